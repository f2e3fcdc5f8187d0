//! Generates the code of the robots in the list whose file the environment variable `RIVALS_ROBOTS` names.

use mbd_codegen::search;
use mbd_codegen::options::{EliminationStrategy, PlanOptions};
use mbd_codegen::read::{self, Base, ImportOptions};
use mbd_codegen::plan::state_layout::pinocchio;
use mbd_codegen::{generate, Output, Options};
use std::fmt::Write as _;

fn main() {
    println!("cargo:rerun-if-env-changed=RIVALS_ROBOTS");
    let list = std::env::var("RIVALS_ROBOTS").expect("RIVALS_ROBOTS names the list of robots");
    println!("cargo:rerun-if-changed={list}");
    let mut lib = String::new();
    for line in std::fs::read_to_string(&list).expect("the list").lines() {
        let [name, base, path] = line.split(' ').collect::<Vec<_>>()[..] else { panic!("{line}: name base file") };
        robot(&mut lib, name, base, path);
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
        outputs: vec![Output::Rates, Output::Accelerations],
        source: name.to_string(),
        ..Options::default()
    };
    let generated = generate(&model, &options).expect("code");
    write(&format!("{name}.rs"), &generated.source);
    // This plan is for the order of coordinates only, which is the same for every elimination.
    let plan = search::plan(&model, PlanOptions { elimination: EliminationStrategy::Single, ..PlanOptions::default() });
    let (mut q, mut v) = (vec![0; plan.dims.nq], vec![0; plan.dims.nv]);
    for part in pinocchio(&plan).parts {
        let (here, there, n) = part.form.sizes();
        assert_eq!(here, there, "{name}: both programs have the same coordinates");
        (0..here).for_each(|k| q[part.q.0 + k] = part.q.1 + k);
        (0..n).for_each(|k| v[part.v.0 + k] = part.v.1 + k);
    }
    let ops = |output: Output| generated.counts.iter().find(|c| c.0 == output).expect("generated").1.total();
    let (rates, accelerations) = (ops(Output::Rates), ops(Output::Accelerations));
    let (nq, nv) = (q.len(), v.len());
    let _ = write!(
        lib,
        "
#[allow(dead_code)]
pub mod {name} {{
    include!(concat!(env!(\"OUT_DIR\"), \"/{name}.rs\"));

    // The joint forces are read where the caller has them, as the rivals read theirs.
    const _: () = assert!(core::mem::size_of::<Kernel>() == {nv} * 8);

    /// # Safety
    /// Pointers to {nq}, {nv}, {nv} and {nq} + {nv} numbers.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_rates(q: *const f64, p: *const f64, tau: *const f64, out: *mut f64) {{
        (*tau.cast::<Kernel>()).rates(&*q.cast(), &*p.cast(), &mut *out.cast(), &mut *out.add({nq}).cast());
    }}

    /// # Safety
    /// Pointers to {nq}, {nv}, {nv} and {nv} numbers.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_accelerations(q: *const f64, v: *const f64, tau: *const f64, out: *mut f64) {{
        (*tau.cast::<Kernel>()).accelerations(&*q.cast(), &*v.cast(), &mut *out.cast());
    }}

    const _: () = assert!(core::mem::size_of::<KernelLanes<8>>() == {nv} * 64);

    /// # Safety
    /// Pointers to 8 times {nq}, {nv}, {nv} and {nq} + {nv} numbers, the lanes of each side by side.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_rates_lanes(q: *const f64, p: *const f64, tau: *const f64, out: *mut f64) {{
        (*tau.cast::<KernelLanes<8>>()).rates(&*q.cast(), &*p.cast(), &mut *out.cast(), &mut *out.add(8 * {nq}).cast());
    }}

    /// # Safety
    /// Pointers to 8 times {nq}, {nv}, {nv} and {nv} numbers, the lanes of each side by side.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_accelerations_lanes(q: *const f64, v: *const f64, tau: *const f64, out: *mut f64) {{
        (*tau.cast::<KernelLanes<8>>()).accelerations(&*q.cast(), &*v.cast(), &mut *out.cast());
    }}

    /// # Safety
    /// Pointers to [`crate::STATES`] times {nq}, {nv}, {nv} and {nq} + {nv} numbers, the states of each side by side.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_rates_batch(q: *const f64, p: *const f64, tau: *const f64, out: *mut f64) {{
        use crate::{{columns, columns_mut}};
        let _ = Kernel::new().rates_batch(columns(q), columns(p), columns(tau), columns_mut(out), columns_mut(out.add(crate::STATES * {nq})));
    }}

    /// Where our coordinates and velocities stand in Pinocchio's state; operations of rates and accelerations.
    ///
    /// # Safety
    /// Pointers to {nq}, {nv} and 2 numbers.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_about(q: *mut i32, v: *mut i32, operations: *mut i32) {{
        *q.cast() = {q:?} as [i32; {nq}];
        *v.cast() = {v:?} as [i32; {nv}];
        *operations.cast() = [{rates}, {accelerations}];
    }}
}}
"
    );
}
