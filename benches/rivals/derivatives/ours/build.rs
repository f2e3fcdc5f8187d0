//! Generates code for the derivatives of the robots in the list whose file the environment variable `RIVALS_ROBOTS`
//! names. `RIVALS_ONLY` selects some of them.

use std::fmt::Write as _;

use mbd_codegen::search;
use mbd_codegen::options::PlanOptions;
use mbd_codegen::read::{self, Base, ImportOptions};
use mbd_codegen::plan::state_layout::pinocchio;
use mbd_codegen::{generate, Output, Options};

fn main() {
    println!("cargo:rerun-if-env-changed=RIVALS_ROBOTS");
    println!("cargo:rerun-if-env-changed=RIVALS_ONLY");
    println!("cargo:rerun-if-env-changed=RIVALS_CHUNK");
    let list = std::env::var("RIVALS_ROBOTS").expect("RIVALS_ROBOTS names the list of robots");
    let only = std::env::var("RIVALS_ONLY").unwrap_or_default();
    println!("cargo:rerun-if-changed={list}");
    let mut lib = String::new();
    for line in std::fs::read_to_string(&list).expect("the list").lines() {
        let [name, base, path] = line.split(' ').collect::<Vec<_>>()[..] else { panic!("{line}: name base file") };
        if only.is_empty() || only.split(' ').any(|n| n == name) {
            robot(&mut lib, name, base, path);
        }
    }
    write("robots.rs", &lib);
}

fn write(file: &str, text: &str) {
    let out = std::env::var("OUT_DIR").expect("cargo sets it");
    std::fs::write(format!("{out}/{file}"), text).expect("written");
}

fn robot(lib: &mut String, name: &str, base: &str, path: &str) {
    println!("cargo:rerun-if-changed={path}");
    let text = std::fs::read_to_string(path).expect("the model");
    let base = if base == "floating" { Base::Floating } else { Base::Fixed };
    let mut model = read::model(path, &text, &ImportOptions { base, ..ImportOptions::default() }).unwrap_or_else(|findings| panic!("{findings}")).model;
    // Pinocchio's forward dynamics has no dampers.
    for joint in &mut model.joints {
        joint.damping.fill(mbd_codegen::model::Value::Const(0.0));
    }
    let options = Options {
        type_name: "Kernel".to_string(),
        outputs: vec![Output::Derivatives],
        source: name.to_string(),
        chunk: std::env::var("RIVALS_CHUNK").map_or(1000, |c| c.parse().expect("a number")),
        ..Options::default()
    };
    let generated = generate(&model, &options).expect("code");
    write(&format!("{name}.rs"), &generated.source);
    let plan = search::plan(&model, PlanOptions::default());
    let (mut q, mut v) = (vec![0; plan.dims.nq], vec![0; plan.dims.nv]);
    for part in pinocchio(&plan).parts {
        let (here, there, n) = part.form.sizes();
        assert_eq!(here, there, "{name}: both programs have the same coordinates");
        (0..here).for_each(|k| q[part.q.0 + k] = part.q.1 + k);
        (0..n).for_each(|k| v[part.v.0 + k] = part.v.1 + k);
    }
    let operations = generated.counts[0].1.total();
    let (nq, nv) = (q.len(), v.len());
    let block = nv * nv;
    let _ = write!(
        lib,
        "
#[allow(dead_code)]
pub mod {name} {{
    include!(concat!(env!(\"OUT_DIR\"), \"/{name}.rs\"));

    // The joint forces are read where the caller has them.
    const _: () = assert!(core::mem::size_of::<Kernel>() == {nv} * 8);

    /// # Safety
    /// Pointers to {nq}, {nv}, {nv} and 2 × {nv} + 4 × {block} numbers: the fields of `StateDerivatives`.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_derivatives(q: *const f64, p: *const f64, tau: *const f64, out: *mut f64) {{
        (*tau.cast::<Kernel>()).derivatives(&*q.cast(), &*p.cast(), &mut *out.cast());
    }}

    /// Where our coordinates and velocities stand in Pinocchio's state; operations.
    ///
    /// # Safety
    /// Pointers to {nq}, {nv} and 1 numbers.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_about(q: *mut i32, v: *mut i32, operations: *mut i32) {{
        *q.cast() = {q:?} as [i32; {nq}];
        *v.cast() = {v:?} as [i32; {nv}];
        *operations = {operations};
    }}
}}
"
    );
}
