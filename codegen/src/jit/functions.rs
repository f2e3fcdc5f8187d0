//! The outputs that most programs call, by machine code or by the interpreter.

use super::memory::Number;
use super::Compiled;
use crate::output::Output;

impl<S: Number> Compiled<S> {
    /// Velocities and rates of the state, `(q, p) → (v, q̇, ṗ)`.
    ///
    /// # Panics
    /// As [`Compiled::velocities`].
    pub fn rates(&mut self, q: &[S], p: &[S], v: &mut [S], qd: &mut [S], pd: &mut [S]) {
        if self.run(Output::Rates, [q, p, &[]], [qd, pd]) {
            self.velocities(q, p, v);
        } else {
            self.interpreting().rates(q, p, v, qd, pd);
        }
    }

    /// Velocities from momenta, `(q, p) → v`.
    ///
    /// # Panics
    /// If a slice has another length than the mechanism has coordinates or velocities.
    pub fn velocities(&mut self, q: &[S], p: &[S], v: &mut [S]) {
        if !self.run(Output::Velocities, [q, p, &[]], [v]) {
            self.interpreting().velocities(q, p, v);
        }
    }

    /// Bias forces, `(q, v) → h` with `M v̇ + h = τ`.
    ///
    /// # Panics
    /// As [`Compiled::velocities`].
    pub fn bias(&mut self, q: &[S], v: &[S], h: &mut [S]) {
        if !self.run(Output::Bias, [q, v, &[]], [h]) {
            self.interpreting().bias(q, v, h);
        }
    }

    /// Kinetic and potential energy, `(q, p) → (kinetic, potential)`, J.
    ///
    /// # Panics
    /// As [`Compiled::velocities`].
    pub fn energy(&mut self, q: &[S], p: &[S]) -> (S, S) {
        let mut energy = [S::zero(); 2];
        match self.run(Output::Energy, [q, p, &[]], [&mut energy]) {
            true => (energy[0], energy[1]),
            false => self.interpreting().energy(q, p),
        }
    }

    /// Momenta from velocities, `(q, v) → p`.
    ///
    /// # Panics
    /// As [`Compiled::velocities`].
    pub fn momenta(&mut self, q: &[S], v: &[S], p: &mut [S]) {
        if !self.run(Output::Momenta, [q, v, &[]], [p]) {
            self.interpreting().momenta(q, v, p);
        }
    }

    /// Accelerations, `(q, v) → v̇`.
    ///
    /// # Panics
    /// As [`Compiled::velocities`].
    pub fn accelerations(&mut self, q: &[S], v: &[S], a: &mut [S]) {
        if !self.run(Output::Accelerations, [q, v, &[]], [a]) {
            self.interpreting().accelerations(q, v, a);
        }
    }

    /// Joint forces, `(q, v, v̇) → τ = M v̇ + h`.
    ///
    /// # Panics
    /// As [`Compiled::velocities`].
    pub fn inverse_dynamics(&mut self, q: &[S], v: &[S], a: &[S], tau: &mut [S]) {
        if !self.run(Output::InverseDynamics, [q, v, a], [tau]) {
            self.interpreting().inverse_dynamics(q, v, a, tau);
        }
    }

    /// Mass matrix, `q → M`, `nv × nv`, row by row.
    ///
    /// # Panics
    /// As [`Compiled::velocities`].
    pub fn mass_matrix(&mut self, q: &[S], m: &mut [S]) {
        if !self.run(Output::MassMatrix, [q, &[], &[]], [m]) {
            self.interpreting().mass_matrix(q, m);
        }
    }
}
