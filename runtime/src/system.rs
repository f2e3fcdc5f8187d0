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
