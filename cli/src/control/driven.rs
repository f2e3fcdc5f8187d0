//! A mechanism with the efforts and wrenches of its control.

use std::ops::{Deref, DerefMut};
use std::rc::Rc;

use multibody::codegen::jit::Compiled;
use multibody::runtime::contact::{ColumnsOf, Contact, Reach, Reducible, Way};
use multibody::runtime::interp::ImplicitSprings;
use multibody::runtime::system::{LieJoint, Part, Row};
use multibody::runtime::{Conjugate, Constrained, Differentiable, Energetic, StateDerivatives, System};

use super::Controller;

/// A mechanism whose inputs are set by a controller, if it has one, before its rates are computed.
#[derive(Clone)]
pub struct Driven {
    inner: Compiled,
    control: Option<Rc<Controller>>,
    v: Vec<f64>,
}

impl Driven {
    /// A mechanism and its controller.
    pub fn new(inner: Compiled, control: Option<Rc<Controller>>) -> Driven {
        let v = inner.zero_momenta();
        Driven { inner, control, v }
    }

    /// Sets the inputs for a state.
    fn set(&mut self, t: f64, q: &[f64], p: &[f64]) {
        if let Some(control) = &self.control {
            if control.feels() {
                self.inner.velocities(q, p, &mut self.v);
            }
            control.set(&mut self.inner, t, q, &self.v);
        }
    }

    /// The controller.
    pub fn control(&self) -> Option<Rc<Controller>> {
        self.control.clone()
    }

    /// Joint forces in a state.
    pub fn efforts(&mut self, t: f64, q: &[f64], p: &[f64]) -> Vec<f64> {
        self.set(t, q, p);
        self.inner.inputs().tau.clone()
    }

    /// Power of efforts and wrenches at a state, W. The efforts stay in the inputs.
    pub fn power(&mut self, t: f64, q: &[f64], p: &[f64]) -> f64 {
        let Some(control) = self.control.clone() else { return 0.0 };
        let Driven { inner, v, .. } = self;
        inner.velocities(q, p, v);
        control.set(inner, t, q, v);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut power = dot(&inner.inputs().tau, v);
        if control.pushes() {
            // A wrench adds its generalised force to ṗ.
            let (mut with, mut without, mut qd) = (v.clone(), v.clone(), q.to_vec());
            let mut unused = v.clone();
            inner.rates(q, p, &mut unused, &mut qd, &mut with);
            inner.inputs().wrenches.fill([0.0; 6]);
            inner.rates(q, p, &mut unused, &mut qd, &mut without);
            power += dot(&with, v) - dot(&without, v);
        }
        power
    }
}

impl Deref for Driven {
    type Target = Compiled;
    fn deref(&self) -> &Compiled {
        &self.inner
    }
}

impl DerefMut for Driven {
    fn deref_mut(&mut self) -> &mut Compiled {
        &mut self.inner
    }
}

impl Energetic for Driven {
    fn energies(&mut self, q: &Vec<f64>, p: &Vec<f64>) -> (f64, f64) {
        self.inner.energies(q, p)
    }
}

impl Conjugate for Driven {
    fn conjugate_momenta(&mut self, q: &Vec<f64>, v: &Vec<f64>, p: &mut Vec<f64>) {
        self.inner.conjugate_momenta(q, v, p);
    }
}

impl System for Driven {
    type Scalar = f64;
    type Coordinates = Vec<f64>;
    type Momenta = Vec<f64>;

    fn neutral(&self) -> Vec<f64> {
        self.inner.neutral()
    }
    fn zero_momenta(&self) -> Vec<f64> {
        self.inner.zero_momenta()
    }
    fn lie_joints(&self) -> &[LieJoint] {
        self.inner.lie_joints()
    }
    fn rates_at(&mut self, t: f64, q: &Vec<f64>, p: &Vec<f64>, qd: &mut Vec<f64>, pd: &mut Vec<f64>) {
        self.set(t, q, p);
        self.inner.rates_at(t, q, p, qd, pd);
    }
    fn part_name(&self, part: Part) -> Option<&str> {
        self.inner.part_name(part)
    }
    fn coordinate_rates(&self, q: &Vec<f64>, v: &Vec<f64>, qd: &mut Vec<f64>) {
        self.inner.coordinate_rates(q, v, qd);
    }
}

impl Constrained for Driven {
    type Rows = Vec<f64>;
    type Entries = Vec<f64>;

    fn zero_rows(&self) -> Vec<f64> {
        self.inner.zero_rows()
    }
    fn zero_entries(&self) -> Vec<f64> {
        self.inner.zero_entries()
    }
    fn rows(&self) -> &[Row] {
        self.inner.rows()
    }
    fn entry_columns(&self) -> &[usize] {
        self.inner.entry_columns()
    }
    fn constraint_residuals(&mut self, q: &Vec<f64>, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) {
        self.inner.constraint_residuals(q, residual, jacobian);
    }
    fn project_momenta(&mut self, t: f64, q: &Vec<f64>, p: &mut Vec<f64>, v: &mut Vec<f64>, sigma: &mut Vec<f64>) {
        self.inner.project_momenta(t, q, p, v, sigma);
    }
    fn position_correction(&mut self, q: &Vec<f64>, residual: &mut Vec<f64>, dq: &mut Vec<f64>, pivots: &mut Vec<f64>) {
        self.inner.position_correction(q, residual, dq, pivots);
    }
    fn multipliers(&mut self, t: f64, q: &Vec<f64>, v: &Vec<f64>, lambda: &mut Vec<f64>) {
        if let Some(control) = &self.control {
            control.set(&mut self.inner, t, q, v);
        }
        self.inner.multipliers(t, q, v, lambda);
    }
    fn row_is_early(&self, row: usize) -> bool {
        self.inner.row_is_early(row)
    }
    fn reorder_rows(&mut self, q: &Vec<f64>) -> bool {
        self.inner.reorder_rows(q)
    }
}

impl Differentiable for Driven {
    type Square = Vec<Vec<f64>>;

    fn square(&self) -> Vec<Vec<f64>> {
        self.inner.square()
    }
    fn rate_derivatives(
        &mut self,
        t: f64,
        q: &Vec<f64>,
        p: &Vec<f64>,
        out: &mut StateDerivatives<Vec<f64>, Vec<Vec<f64>>>,
    ) {
        self.set(t, q, p);
        self.inner.rate_derivatives(t, q, p, out);
        if let Some(control) = &self.control {
            control.add_derivatives(out);
        }
    }
    fn depends_on_time(&self) -> bool {
        self.inner.depends_on_time() || self.control.as_ref().is_some_and(|control| control.depends_on_time())
    }
}

impl Reducible for Driven {
    fn acting(&self, acts: &[bool]) -> Self {
        Driven { inner: self.inner.acting(acts), ..self.clone() }
    }
    fn swap_inputs(&mut self, other: &mut Self) {
        Reducible::swap_inputs(&mut self.inner, &mut other.inner);
    }
    fn way(&self) -> Way {
        self.inner.way()
    }
    fn reaches(&self, contacts: &[Contact<f64>]) -> Vec<Reach<f64>> {
        self.inner.reaches(contacts)
    }
    fn trees(&self) -> Vec<usize> {
        self.inner.trees()
    }
    fn moves_at_rest(&self) -> bool {
        self.inner.moves_at_rest()
    }
    fn gaps(
        &mut self,
        q: &Vec<f64>,
        v: &Vec<f64>,
        gaps: &mut Vec<f64>,
        velocities: &mut Vec<f64>,
        entries: &mut Vec<f64>,
    ) {
        self.inner.gaps(q, v, gaps, velocities, entries);
    }
    fn sees_parts(&self) -> bool {
        self.inner.sees_parts()
    }
    fn gaps_of(
        &mut self,
        wanted: &[bool],
        state: (&Vec<f64>, &Vec<f64>),
        gaps: &mut Vec<f64>,
        velocities: &mut Vec<f64>,
        entries: &mut Vec<f64>,
    ) {
        self.inner.gaps_of(wanted, state, gaps, velocities, entries);
    }
    fn with_implicit_springs(&self, step: f64) -> Option<ImplicitSprings<Self, Vec<f64>>> {
        let found = self.inner.with_implicit_springs(step)?;
        Some(found.map(|inner| Driven { inner, ..self.clone() }))
    }
    fn project_several(&mut self, t: f64, q: &Vec<f64>, of: &mut ColumnsOf<f64>) -> bool {
        self.inner.project_several(t, q, of)
    }
}
