//! The functions of a system that the benchmarks call, under one name for the interpreter and for generated code.

use multibody::codegen::options::PlanOptions;
use multibody::codegen::search;
use std::fmt::Debug;

use super::Scene;
use multibody::runtime::{Accelerated, Conjugate, Energetic, Interpreter, Scalar};

/// A system that gives its energy, accelerations and momenta.
pub trait Dynamics: Energetic + Accelerated + Conjugate {}

impl<Y: Energetic + Accelerated + Conjugate> Dynamics for Y {}

impl Scene {
    /// The interpreter of its model, in any number type.
    pub fn interpreter<S: Scalar + Debug>(&self) -> Interpreter<S> {
        let plan = search::plan(&self.model, PlanOptions::default());
        plan.default_interpreter()
    }

    /// Coordinates and momenta of a scene at its start.
    pub fn start<Y: Dynamics>(&self, system: &mut Y) -> (Y::Coordinates, Y::Momenta) {
        let (mut q, mut v) = (system.neutral(), system.zero_momenta());
        fill(q.as_mut(), &self.q);
        fill(v.as_mut(), &self.v);
        let mut p = system.zero_momenta();
        system.conjugate_momenta(&q, &v, &mut p);
        (q, p)
    }
}

fn fill<S: Scalar>(out: &mut [S], from: &[f64]) {
    for (out, x) in out.iter_mut().zip(from) {
        *out = S::constant(*x);
    }
}
