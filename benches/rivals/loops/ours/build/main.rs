//! Generates the code of every mechanism, and writes its description for Pinocchio to `NAME.loop` in the folder that
//! the environment variable `RIVALS_MODELS` names. `RIVALS_ONLY` selects some of the mechanisms.

mod mechanisms;
mod rods;
mod theirs;

use std::fmt::Write as _;

use mbd_codegen::search;
use mbd_codegen::options::PlanOptions;
use mbd_codegen::model::Model;
use mbd_codegen::plan::Plan;
use mbd_codegen::{generate, Output, Options};
use mbd_runtime::tree::Source;

fn main() {
    for name in ["RIVALS_MODELS", "RIVALS_ONLY"] {
        println!("cargo:rerun-if-env-changed={name}");
    }
    let folder = std::env::var("RIVALS_MODELS").expect("RIVALS_MODELS names a folder");
    let only = std::env::var("RIVALS_ONLY").unwrap_or_default();
    let mut lib = String::new();
    for mechanism in mechanisms::all() {
        let name = mechanism.name;
        if !only.is_empty() && !only.split(' ').any(|n| n == name) {
            continue;
        }
        let their = mechanism.theirs.as_ref().unwrap_or(&mechanism.ours);
        std::fs::write(format!("{folder}/{name}.loop"), theirs::text(name, their)).expect("written");
        door(&mut lib, name, &mechanism.ours, their, mechanism.far);
    }
    write("mechanisms.rs", &lib);
}

fn write(file: &str, text: &str) {
    let out = std::env::var("OUT_DIR").expect("cargo sets it");
    std::fs::write(format!("{out}/{file}"), text).expect("written");
}

/// For each of our coordinates and velocities, its index in Pinocchio's state; and the start in our order.
fn order(ours: &Model, plan: &Plan, theirs: &Model) -> (Vec<usize>, Vec<usize>, Vec<f64>) {
    let (mut q, mut v) = (vec![0; plan.dims.nq], vec![0; plan.dims.nv]);
    let mut start = vec![0.0; plan.dims.nq];
    for slot in &plan.slots {
        let Some(Source::State { q: at, v: vat }) = slot.at else { continue };
        let joint = &ours.joints[slot.joint];
        let before = theirs.joints.iter().take_while(|j| j.name != joint.name);
        let (theirs_q, theirs_v) = before.fold((0, 0), |(q, v), j| (q + j.kind.nq(), v + j.kind.nv()));
        (0..joint.kind.nq()).for_each(|k| q[at + k] = theirs_q + k);
        (0..joint.kind.nv()).for_each(|k| v[vat + k] = theirs_v + k);
        if let Some(given) = ours.starts.iter().find(|s| s.joint == slot.joint) {
            start[at..at + given.q.len()].copy_from_slice(&given.q);
        }
    }
    (q, v, start)
}

fn door(lib: &mut String, name: &str, model: &Model, theirs: &Model, far: f64) {
    use Output::{Accelerations, ConstraintResiduals, Momenta, Multipliers, PositionCorrection, ProjectMomenta, Rates};
    let options = Options {
        type_name: "Kernel".to_string(),
        outputs: vec![Rates, Momenta, Accelerations, ConstraintResiduals, ProjectMomenta, PositionCorrection, Multipliers],
        source: name.to_string(),
        ..Options::default()
    };
    let generated = generate(model, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
    write(&format!("{name}.rs"), &generated.source);
    let plan = search::plan(model, PlanOptions::default());
    let (q, v, start) = order(model, &plan, theirs);
    let count = |output: Output| generated.counts.iter().find(|c| c.0 == output).map_or(0, |c| c.1.total());
    let (rates, accelerations) = (count(Rates), count(Accelerations));
    let (nq, nv, rows) = (q.len(), v.len(), plan.dims.rows);
    let _ = write!(
        lib,
        "
#[allow(dead_code, clippy::all)]
pub mod {name} {{
    include!(concat!(env!(\"OUT_DIR\"), \"/{name}.rs\"));

    // The joint forces are read where the caller has them.
    const _: () = assert!(core::mem::size_of::<Kernel>() == {nv} * 8);

    /// # Safety
    /// Pointers to {nq}, {nv}, {nv} and {nv} numbers.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_accelerations(q: *const f64, v: *const f64, tau: *const f64, a: *mut f64) {{
        (*tau.cast::<Kernel>()).accelerations(&*q.cast(), &*v.cast(), &mut *a.cast());
    }}

    /// # Safety
    /// Pointers to {nq}, {nv}, {nv}, {nq} and {nv} numbers.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_rates(q: *const f64, p: *const f64, tau: *const f64, qd: *mut f64, pd: *mut f64) {{
        (*tau.cast::<Kernel>()).rates(&*q.cast(), &*p.cast(), &mut *qd.cast(), &mut *pd.cast());
    }}

    /// # Safety
    /// Pointers to {nq}, {nv} and {nv} numbers.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_momenta(q: *const f64, v: *const f64, p: *mut f64) {{
        Kernel::new().momenta(&*q.cast(), &*v.cast(), &mut *p.cast());
    }}

    /// The residual of the positions.
    ///
    /// # Safety
    /// Pointers to {nq} and {nv} numbers.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_state(seed: u64, q: *mut f64, v: *mut f64) -> f64 {{
        let start: [f64; {nq}] = {start:?};
        super::state(&mut Kernel::new(), &start, {far:?}, seed, &mut *q.cast(), &mut *v.cast())
    }}

    /// Numbers of coordinates, velocities and rows; operations of the rates and of the accelerations; where our
    /// coordinates and velocities stand in Pinocchio's state.
    ///
    /// # Safety
    /// A pointer to 5 + {nq} + {nv} numbers.
    #[no_mangle]
    pub unsafe extern \"C\" fn {name}_about(out: *mut i32) {{
        *out.cast() = [{nq}, {nv}, {rows}, {rates}, {accelerations}];
        *out.add(5).cast() = {q:?} as [i32; {nq}];
        *out.add(5 + {nq}).cast() = {v:?} as [i32; {nv}];
    }}
}}
"
    );
}
