//! What an integrator sees of a mechanism.

use crate::Scalar;

/// A scalar that can be compared, for code that watches results (integrators), never for sweeps.
pub trait Real: Scalar + PartialOrd + core::fmt::Debug {
    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool;
    /// As a double.
    fn to_f64(self) -> f64;
}

impl Real for f64 {
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
    fn to_f64(self) -> f64 {
        self
    }
}

impl Real for f32 {
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }
    fn to_f64(self) -> f64 {
        self.into()
    }
}

/// A mechanism in canonical form, `(q, p) → (q̇, ṗ)`.
///
/// `q` has `nq` coordinates (rad, m, unit quaternions x, y, z, w), `p` has `nv ≤ nq` momenta. Joint forces, prescribed
/// motions, wrenches and parameters are fields of the implementing type, set between calls.
pub trait System {
    /// Number type.
    type Scalar: Scalar;
    /// Coordinates: an array in generated code, a vector in the interpreter.
    type Coordinates: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// Velocities, momenta, joint forces.
    type Momenta: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;

    /// The neutral configuration: zeros and unit quaternions.
    fn neutral(&self) -> Self::Coordinates;
    /// Zero momenta.
    fn rest(&self) -> Self::Momenta;
    /// Index into `q` of the first component of every unit quaternion.
    fn quaternions(&self) -> &[usize];
    /// Rates of the state at time `t` (s): `q̇` and `ṗ`.
    fn state_rates(
        &mut self,
        t: Self::Scalar,
        q: &Self::Coordinates,
        p: &Self::Momenta,
        qd: &mut Self::Coordinates,
        pd: &mut Self::Momenta,
    );
    /// `q̇ = N(q) v`: coordinate rates of given velocities.
    fn coordinate_rates(&self, q: &Self::Coordinates, v: &Self::Momenta, qd: &mut Self::Coordinates);
}

/// A [`System`] that gives the derivatives of its rates as well.
///
/// Columns with respect to `q` are derivatives along `q̇ = N(q) e_k`, the direction in which velocity `k` alone moves the
/// coordinates: for angles and slides the partial derivatives, for joints with quaternions and planar joints those with
/// respect to a small displacement in body axes. Joint forces add to `ṗ`: `∂ṗ/∂τ = 1`, `∂v/∂τ = 0`.
pub trait Differentiable: System {
    /// Rows of an `nv × nv` matrix.
    type Square: Clone + AsRef<[Self::Momenta]> + AsMut<[Self::Momenta]>;

    /// A zero matrix.
    fn square(&self) -> Self::Square;
    /// Velocities and momentum rates at time `t` (s), and their derivatives.
    fn rate_derivatives(
        &mut self,
        t: Self::Scalar,
        q: &Self::Coordinates,
        p: &Self::Momenta,
        v: &mut Self::Momenta,
        pd: &mut Self::Momenta,
        derivatives: Blocks<'_, Self::Square>,
    );
}

/// Where the derivatives go, `nv × nv` each.
#[derive(Debug)]
pub struct Blocks<'a, M> {
    /// `∂v/∂q`.
    pub dv_dq: &'a mut M,
    /// `∂v/∂p`, the inverse of the mass matrix.
    pub dv_dp: &'a mut M,
    /// `∂ṗ/∂q`.
    pub dpd_dq: &'a mut M,
    /// `∂ṗ/∂p`.
    pub dpd_dp: &'a mut M,
}
