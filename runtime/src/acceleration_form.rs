//! The equations of motion in velocities instead of momenta.

use alloc::vec::Vec;

use crate::system::{system_within, Accelerated, Conjugate, Energetic, LieJoint, System};

/// A mechanism in acceleration form, `(q, v) → (N(q) v, v̇)`: a [`System`] with velocities in place of momenta, which
/// every integrator can run. A comparison with the [`System`] itself shows the effect of momenta as state variables.
///
/// Velocities of joints with quaternions and of planar joints are in body axes, and their rates are integrated
/// component by component. Momenta that are conserved exactly in canonical form are therefore not conserved exactly
/// here.
#[derive(Clone, Debug)]
pub struct AccelerationForm<Y> {
    /// The mechanism, with its inputs.
    pub system: Y,
    lie_joints: Vec<LieJoint>,
}

impl<Y: System> AccelerationForm<Y> {
    /// The acceleration form of a mechanism.
    pub fn new(system: Y) -> Self {
        let lie_joints = system.lie_joints().iter().map(|g| LieJoint { momenta: false, ..*g }).collect();
        AccelerationForm { system, lie_joints }
    }
}

impl<Y: Accelerated> System for AccelerationForm<Y> {
    system_within!(system: Y);

    fn lie_joints(&self) -> &[LieJoint] {
        &self.lie_joints
    }

    /// `p` are velocities, `pd` accelerations.
    fn rates_at(
        &mut self,
        _t: Y::Scalar,
        q: &Y::Coordinates,
        v: &Y::Momenta,
        qd: &mut Y::Coordinates,
        a: &mut Y::Momenta,
    ) {
        self.system.coordinate_rates(q, v, qd);
        self.system.generalized_accelerations(q, v, a);
    }
}

impl<Y: Accelerated + Conjugate + Energetic> Energetic for AccelerationForm<Y> {
    /// Kinetic and potential energy, J, found from the momenta of the velocities.
    fn energies(&mut self, q: &Y::Coordinates, v: &Y::Momenta) -> (Y::Scalar, Y::Scalar) {
        let mut p = self.system.zero_momenta();
        self.system.conjugate_momenta(q, v, &mut p);
        self.system.energies(q, &p)
    }
}
