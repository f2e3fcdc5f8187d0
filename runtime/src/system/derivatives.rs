//! Derivatives of a mechanism's quantities, by name.

/// Numbers, and arrays of them in any shape, that can be zero.
pub trait Zero {
    /// Zero, in every entry of an array.
    const ZERO: Self;
}

impl Zero for f64 {
    const ZERO: Self = 0.0;
}

impl Zero for f32 {
    const ZERO: Self = 0.0;
}

impl<T: Zero, const N: usize> Zero for [T; N] {
    const ZERO: Self = [T::ZERO; N];
}

/// Velocities `v` and momentum rates `ṗ` of a state, and their derivatives with respect to coordinates and momenta.
///
/// The output `derivatives` of generated code writes one: `V` is `[f64; NV]` and `M` is `[[f64; NV]; NV]`, by rows. With
/// lanes, every number is an array of the lanes. Fields of arrays lie in memory in their order, without gaps.
///
/// ```
/// use mbd_runtime::StateDerivatives;
/// let room: StateDerivatives<[f64; 2], [[f64; 2]; 2]> = StateDerivatives::zero();
/// assert_eq!((room.v, room.dpd_dq), ([0.0; 2], [[0.0; 2]; 2]));
/// ```
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct StateDerivatives<V, M> {
    /// Velocities, `nv` numbers.
    pub v: V,
    /// Momentum rates, `nv` numbers.
    pub pd: V,
    /// `∂v/∂q`, `nv × nv`; columns as [`Differentiable`](super::Differentiable) says.
    pub dv_dq: M,
    /// `∂v/∂p`, `nv × nv`: the inverse of the mass matrix.
    pub dv_dp: M,
    /// `∂ṗ/∂q`, `nv × nv`.
    pub dpd_dq: M,
    /// `∂ṗ/∂p`, `nv × nv`.
    pub dpd_dp: M,
}

impl<V, M> StateDerivatives<V, M> {
    /// The four blocks: rows `v`, `ṗ`; columns `q`, `p`.
    pub fn blocks(&self) -> [[&M; 2]; 2] {
        [[&self.dv_dq, &self.dv_dp], [&self.dpd_dq, &self.dpd_dp]]
    }

    /// The four blocks, for changing them.
    pub fn blocks_mut(&mut self) -> [[&mut M; 2]; 2] {
        [[&mut self.dv_dq, &mut self.dv_dp], [&mut self.dpd_dq, &mut self.dpd_dp]]
    }
}

impl<V: Zero, M: Zero> StateDerivatives<V, M> {
    /// Zeros: room for the results of generated code.
    pub const fn zero() -> Self {
        StateDerivatives { v: V::ZERO, pd: V::ZERO, dv_dq: M::ZERO, dv_dp: M::ZERO, dpd_dq: M::ZERO, dpd_dp: M::ZERO }
    }
}

/// Momenta `p = M v` and their rates `ṗ` at given velocities and `v̇ = 0`, and the derivatives of both with respect to
/// coordinates and velocities.
///
/// The output `momentum_derivatives` of generated code writes one: `V` is `[f64; NV]` and `M` is `[[f64; NV]; NV]`, by
/// rows. With lanes, every number is an array of the lanes. Fields of arrays lie in memory in their order, without gaps.
/// The sweeps and the interpreter have both in a `Vec`, matrices row by row.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct MomentumDerivatives<V, M> {
    /// Momenta, `nv` numbers.
    pub p: V,
    /// Momentum rates, accelerations not entering, `nv` numbers.
    pub pd: V,
    /// `∂p/∂q`, `nv × nv`; columns as [`Differentiable`](super::Differentiable) says.
    pub dp_dq: M,
    /// `∂p/∂v`, `nv × nv`: the mass matrix.
    pub dp_dv: M,
    /// `∂ṗ/∂q`, `nv × nv`.
    pub dpd_dq: M,
    /// `∂ṗ/∂v`, `nv × nv`.
    pub dpd_dv: M,
}

impl<V: Zero, M: Zero> MomentumDerivatives<V, M> {
    /// Zeros: room for the results of generated code.
    pub const fn zero() -> Self {
        MomentumDerivatives {
            p: V::ZERO,
            pd: V::ZERO,
            dp_dq: M::ZERO,
            dp_dv: M::ZERO,
            dpd_dq: M::ZERO,
            dpd_dv: M::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rooms_are_zero_in_every_shape() {
        let of_one: StateDerivatives<[f32; 2], [[f32; 2]; 2]> = StateDerivatives::zero();
        assert_eq!(of_one.blocks(), [[&[[0.0; 2]; 2]; 2]; 2]);
        assert_eq!([of_one.v, of_one.pd], [[0.0; 2]; 2]);
        let of_lanes: MomentumDerivatives<[[f64; 4]; 3], [[[f64; 4]; 3]; 3]> = MomentumDerivatives::zero();
        assert_eq!([of_lanes.p, of_lanes.pd], [[[0.0; 4]; 3]; 2]);
        let MomentumDerivatives { dp_dq, dp_dv, dpd_dq, dpd_dv, .. } = of_lanes;
        assert_eq!([dp_dq, dp_dv, dpd_dq, dpd_dv], [[[[0.0; 4]; 3]; 3]; 4]);
    }
}
