//! Instances of what most test programs use. Crates that are optimised no further than level 1, as those of `cargo test` are,
//! take instances of generic functions from the crates below them: this one compiles the sweeps for each kind of number
//! once, in place of five test programs.

use mbd_codegen::plan::Plan;
use mbd_runtime::sweep::Derivatives;
use mbd_runtime::wide::Wide;
use mbd_runtime::{Dual, Interpreter, Scalar};

/// Calls every output of an interpreter of the plan with lists that are too short. Nobody calls it.
pub fn every_instance(plan: &Plan) {
    outputs::<f64>(plan);
    outputs::<f32>(plan);
    outputs::<Dual<f64>>(plan);
    outputs::<Wide>(plan);
}

fn outputs<S: Scalar>(plan: &Plan) {
    let mut i: Interpreter<S> = plan.default_interpreter();
    let (q, v, a, p) = (&[], &[], &[], &[]);
    let mut d = Derivatives::new(i.tree());
    i.rates(q, p, &mut [], &mut [], &mut []);
    i.velocities(q, p, &mut []);
    i.momenta(q, v, &mut []);
    i.energy(q, p);
    i.accelerations(q, v, &mut []);
    i.residuals(q, &mut [], &mut []);
    i.constraint_multipliers(q, v, &mut []);
    i.inverse_dynamics(q, v, a, &mut []);
    i.mass_matrix(q, &mut []);
    i.derivatives(q, p, &mut d);
    i.frames(q, v, &mut []);
}
