//! The traits through which an integrator uses a mechanism.

mod derivatives;

pub use derivatives::{MomentumDerivatives, StateDerivatives, Zero};

use crate::Scalar;

/// A scalar that can be compared, for code that examines results (integrators). Sweeps use [`Scalar`] only.
pub trait Real: Scalar + PartialOrd + core::fmt::Debug {
    /// Whether it is neither infinite nor NaN.
    fn is_finite(self) -> bool;
    /// The nearest double.
    fn to_f64(self) -> f64;
    /// Distance of the next number after one.
    fn epsilon() -> f64;
    /// A count, such as the number of a row: exact up to 2²⁴ in any type.
    fn from_index(index: usize) -> Self {
        Self::constant(index as f64)
    }
    /// Its derivative, rounded to a double; `None` for number types that carry none. Iterations that stop where a value is
    /// found ask, because a derivative takes one more step.
    fn derivative(self) -> Option<f64> {
        None
    }
    /// The count that a number is: the inverse of [`Real::from_index`].
    fn index(self) -> usize {
        self.to_f64() as usize
    }
    /// Absolute value.
    fn abs(self) -> Self {
        if self < Self::zero() {
            -self
        } else {
            self
        }
    }
}

impl Real for f64 {
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
    fn to_f64(self) -> f64 {
        self
    }
    fn epsilon() -> f64 {
        f64::EPSILON
    }
}

impl Real for f32 {
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }
    fn to_f64(self) -> f64 {
        self.into()
    }
    fn epsilon() -> f64 {
        f32::EPSILON.into()
    }
    // Direct conversions, because small processors have doubles in software only.
    fn from_index(index: usize) -> Self {
        index as f32
    }
    fn index(self) -> usize {
        self as usize
    }
}

/// A mechanism in canonical form, `(q, p) → (q̇, ṗ)`.
///
/// `q` has `nq` coordinates (rad, m, unit quaternions x, y, z, w), `p` has `nv ≤ nq` momenta. Joint forces, prescribed
/// motions, wrenches and parameters are fields of the implementing type, set between calls.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a mechanism with rates of its state",
    label = "the trait `System` is not implemented",
    note = "a generated type has it with `rates` among its outputs: `outputs = [rates, ..]` in `mbd_model!`, `--outputs rates` on the command line"
)]
pub trait System {
    /// Number type.
    type Scalar: Scalar + core::fmt::Debug;
    /// Coordinates: an array in generated code, a vector in the interpreter.
    type Coordinates: Clone + core::fmt::Debug + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// Velocities, momenta, joint forces.
    type Momenta: Clone + core::fmt::Debug + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;

    /// The neutral configuration: zeros and unit quaternions.
    fn neutral(&self) -> Self::Coordinates;
    /// Zero momenta.
    fn zero_momenta(&self) -> Self::Momenta;
    /// Joints whose configurations form a Lie group other than a vector space, in the order of the state: displacements
    /// are not just added to their coordinates.
    fn lie_joints(&self) -> &[LieJoint];
    /// Index into `q` of the first component of every unit quaternion.
    fn quaternions(&self) -> impl Iterator<Item = usize> {
        self.lie_joints().iter().filter_map(LieJoint::quaternion)
    }
    /// Rates of the state at time `t` (s): `q̇` and `ṗ`.
    fn rates_at(
        &mut self,
        t: Self::Scalar,
        q: &Self::Coordinates,
        p: &Self::Momenta,
        qd: &mut Self::Coordinates,
        pd: &mut Self::Momenta,
    );
    /// [`System::rates_at`] where coordinate rates are the velocities, which are then written to `v`. Returns whether it
    /// has computed them: generated code does where it has no Lie joints, so that integrators need not copy them.
    #[inline]
    fn rates_by_velocities(
        &mut self,
        _t: Self::Scalar,
        _q: &Self::Coordinates,
        _p: &Self::Momenta,
        _v: &mut Self::Momenta,
        _pd: &mut Self::Momenta,
    ) -> bool {
        false
    }
    /// Rates of several states at once, side by side: `q[k][l]` is coordinate `k` of the state in lane `l`, which is at
    /// time `t[l]`, s. `q` and `qd` have `nq` rows, `p` and `pd` `nv`. Returns whether it has computed them: generated
    /// code does, in vector registers and with the bits of [`System::rates_at`]; others evaluate one state after the
    /// other.
    #[inline]
    fn rates_in_lanes<const LANES: usize>(
        &mut self,
        _t: &[Self::Scalar; LANES],
        _q: &[[Self::Scalar; LANES]],
        _p: &[[Self::Scalar; LANES]],
        _qd: &mut [[Self::Scalar; LANES]],
        _pd: &mut [[Self::Scalar; LANES]],
    ) -> bool {
        false
    }
    /// Rounding error of the rates of momenta that were computed last, N (N m), beyond that of their size: where forces come
    /// from a division by a difference that is nearly zero. No step is made shorter for what it adds to an error.
    fn rounding(&self) -> f64 {
        0.0
    }
    /// Name of a part, for messages; `None` where it is not known.
    fn part_name(&self, _part: Part) -> Option<&str> {
        None
    }
    /// `q̇ = N(q) v`: coordinate rates of given velocities.
    fn coordinate_rates(&self, q: &Self::Coordinates, v: &Self::Momenta, qd: &mut Self::Coordinates);
}

/// What `impl System` of a wrapper takes over from the system in its field `$inner`: states, their names, kinematics.
macro_rules! system_within {
    ($inner:ident: $system:ty) => {
        type Scalar = <$system as System>::Scalar;
        type Coordinates = <$system as System>::Coordinates;
        type Momenta = <$system as System>::Momenta;

        fn neutral(&self) -> Self::Coordinates {
            self.$inner.neutral()
        }

        fn zero_momenta(&self) -> Self::Momenta {
            self.$inner.zero_momenta()
        }

        fn part_name(&self, part: crate::system::Part) -> Option<&str> {
            self.$inner.part_name(part)
        }

        fn coordinate_rates(&self, q: &Self::Coordinates, v: &Self::Momenta, qd: &mut Self::Coordinates) {
            self.$inner.coordinate_rates(q, v, qd);
        }
    };
}
pub(crate) use system_within;

/// A part of a mechanism that may have a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// A velocity, by its index into `v` and `p`.
    Velocity(usize),
    /// A constraint, by its index as in [`Row::constraint`].
    Constraint(usize),
}

/// A joint whose state lies on a Lie group: its group, and its place in the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LieJoint {
    /// The group.
    pub kind: LieGroup,
    /// Index of its first coordinate.
    pub q: usize,
    /// Index of its first velocity and momentum.
    pub v: usize,
    /// Whether the second half of the state holds momenta, whose components change with the rotation of the body. In
    /// acceleration form it holds velocities.
    pub momenta: bool,
}

/// The Lie group of a joint's configurations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LieGroup {
    /// Rotations: a unit quaternion; angular velocity in body axes.
    SO3,
    /// Poses: a position in outer axes and a unit quaternion; linear and angular velocity in body axes.
    SE3,
    /// Planar poses: two positions in outer axes and an angle; linear velocity in body axes.
    SE2,
}

impl LieGroup {
    /// Numbers of coordinates and of velocities.
    pub const fn sizes(self) -> (usize, usize) {
        match self {
            LieGroup::SO3 => (4, 3),
            LieGroup::SE3 => (7, 6),
            LieGroup::SE2 => (3, 3),
        }
    }

    /// Number of coordinates, from the first on, that are positions or angles, to which displacements are added.
    pub const fn positions(self) -> usize {
        match self {
            LieGroup::SO3 => 0,
            LieGroup::SE3 | LieGroup::SE2 => 3,
        }
    }
}

impl LieJoint {
    /// A joint in canonical form.
    pub const fn new(kind: LieGroup, q: usize, v: usize) -> Self {
        LieJoint { kind, q, v, momenta: true }
    }

    /// Indices into `v` of its rotations.
    pub const fn rotations(&self) -> core::ops::Range<usize> {
        self.v + self.kind.positions()..self.v + self.kind.sizes().1
    }

    /// Index into `q` of the first component of its quaternion.
    pub const fn quaternion(&self) -> Option<usize> {
        match self.kind {
            LieGroup::SO3 => Some(self.q),
            LieGroup::SE3 => Some(self.q + 3),
            LieGroup::SE2 => None,
        }
    }
}

/// A [`System`] whose energy is known.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not give its energy",
    label = "the trait `Energetic` is not implemented",
    note = "a generated type has it with `energy` among its outputs: `outputs = [rates, energy, ..]`"
)]
pub trait Energetic: System {
    /// Kinetic and potential energy, J.
    fn energies(&mut self, q: &Self::Coordinates, p: &Self::Momenta) -> (Self::Scalar, Self::Scalar);
}

/// A mechanism that gives the momenta of given velocities.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not give the momenta of velocities",
    label = "the trait `Conjugate` is not implemented",
    note = "a generated type has it with `momenta` among its outputs: `outputs = [rates, momenta, ..]`"
)]
pub trait Conjugate: System {
    /// `(q, v) → p`: the momenta of given velocities.
    fn conjugate_momenta(&mut self, q: &Self::Coordinates, v: &Self::Momenta, p: &mut Self::Momenta);
}

/// A mechanism that gives accelerations at given velocities.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not give its accelerations",
    label = "the trait `Accelerated` is not implemented",
    note = "a generated type has it with `accelerations` among its outputs: `outputs = [rates, accelerations, ..]`"
)]
pub trait Accelerated: System {
    /// `(q, v) → v̇`: the rates of the components of `v`.
    fn generalized_accelerations(&mut self, q: &Self::Coordinates, v: &Self::Momenta, a: &mut Self::Momenta);
}

/// A [`System`] that gives the derivatives of its rates as well.
///
/// Columns with respect to `q` are derivatives along `q̇ = N(q) e_k`, the direction in which velocity `k` alone moves
/// the coordinates: for angles and displacements the partial derivatives, for joints with quaternions and planar joints
/// those with respect to a small displacement in body axes. Joint forces add to `ṗ`: `∂ṗ/∂τ = 1`, `∂v/∂τ = 0`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not give the derivatives of its rates",
    label = "the trait `Differentiable` is not implemented",
    note = "a generated type has it with `derivatives` among its outputs: `outputs = [rates, derivatives, ..]`; explicit methods and those by fixed-point iteration do without"
)]
pub trait Differentiable: System {
    /// Rows of an `nv × nv` matrix.
    type Square: Clone + core::fmt::Debug + AsRef<[Self::Momenta]> + AsMut<[Self::Momenta]>;

    /// A zero matrix.
    fn square(&self) -> Self::Square;
    /// Whether the rates change with time at a fixed state. Rosenbrock methods then evaluate them twice more in each
    /// step.
    fn depends_on_time(&self) -> bool {
        false
    }
    /// Zeros in the shape of the derivatives: room for [`Differentiable::rate_derivatives`].
    fn zero_derivatives(&self) -> StateDerivatives<Self::Momenta, Self::Square> {
        let (zero, square) = (|| self.zero_momenta(), || self.square());
        StateDerivatives { v: zero(), pd: zero(), dv_dq: square(), dv_dp: square(), dpd_dq: square(), dpd_dp: square() }
    }
    /// Velocities and momentum rates at time `t` (s), and their derivatives.
    fn rate_derivatives(
        &mut self,
        t: Self::Scalar,
        q: &Self::Coordinates,
        p: &Self::Momenta,
        out: &mut StateDerivatives<Self::Momenta, Self::Square>,
    );
}

/// One scalar constraint of a [`Constrained`] system: a row of `Φ v = b`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Index of the loop or coupling it belongs to, in the order of the description.
    pub constraint: usize,
    /// Whether the row is the derivative of a condition on positions, which has a residual. Other rows (a knife edge)
    /// constrain velocities only.
    pub holonomic: bool,
    /// Its first entry among all entries of `Φ`.
    pub first: usize,
    /// Number of its entries.
    pub len: usize,
}

/// A [`System`] with constraints between its joints: closed loops, couplings, rolling.
///
/// The momenta are the augmented momenta `p⁺ = M v + Φᵀσ` (5.7). The motion does not depend on `σ`. A one-step method
/// may therefore start each step with `σ = 0` ([`Constrained::project_momenta`]), and the rates may leave out terms
/// that change `σ` alone: `σ` is the integral of `λ`, except for joints that close a loop to the ground.
///
/// The velocities of every evaluation satisfy the constraints to round-off; redundant rows are recognised and left out.
/// `Φ` is `rows × nv`, one column for each velocity, and the force of the constraints on the joints is `−Φᵀλ`. It is
/// given by the entries that can be other than zero, row by row.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not give its constraints",
    label = "the trait `Constrained` is not implemented",
    note = "a generated type of a mechanism with loops or couplings has it with the outputs `outputs = [rates, constraint_residuals, project_momenta, position_correction, multipliers]`"
)]
pub trait Constrained: System {
    /// One number for each row.
    type Rows: Clone + core::fmt::Debug + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// One number for each entry of `Φ`.
    type Entries: Clone + core::fmt::Debug + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;

    /// Zero for every row.
    fn zero_rows(&self) -> Self::Rows;
    /// Zero for every entry.
    fn zero_entries(&self) -> Self::Entries;
    /// The rows.
    fn rows(&self) -> &[Row];
    /// Whether any of the rows acts now. Where none does, momenta and positions are as [`Constrained::project_momenta`] and
    /// [`Constrained::position_correction`] leave them.
    fn rows_act(&self) -> bool {
        !self.rows().is_empty()
    }
    /// Velocity index of every entry of `Φ`.
    fn entry_columns(&self) -> &[usize];
    /// Residuals `φ(q)` of the positions (m, rad; zero for rows that are not holonomic) and the entries of `Φ(q)`.
    fn constraint_residuals(&mut self, q: &Self::Coordinates, residual: &mut Self::Rows, jacobian: &mut Self::Entries);
    /// Projects the momenta of a state: computes its velocities `v` and multipliers `σ`, and sets `p := p⁺ − Φᵀσ = M
    /// v`. This is the projection onto `Φ v = b` that is orthogonal in the metric of the mass matrix.
    fn project_momenta(
        &mut self,
        t: Self::Scalar,
        q: &Self::Coordinates,
        p: &mut Self::Momenta,
        v: &mut Self::Momenta,
        sigma: &mut Self::Rows,
    );
    /// One step of Newton's method towards closed positions, with the displacement that is least in the metric of the
    /// mass matrix: residuals `φ(q)`, displacement `δq = −M⁻¹Φᵀ(Φ M⁻¹Φᵀ)⁻¹φ` (`nv` numbers, body axes where velocities
    /// have them), and the pivots of `Φ M⁻¹Φᵀ`, zero for rows that were left out as redundant.
    fn position_correction(
        &mut self,
        q: &Self::Coordinates,
        residual: &mut Self::Rows,
        dq: &mut Self::Momenta,
        pivots: &mut Self::Rows,
    );
    /// Multipliers `λ` at given velocities: forces and moments of the constraints, `Φᵀλ = τ − M v̇ − h`.
    fn multipliers(&mut self, t: Self::Scalar, q: &Self::Coordinates, v: &Self::Momenta, lambda: &mut Self::Rows);
    /// Chooses the order in which rows are eliminated anew, by their pivots at `q`, and returns whether it has changed.
    /// [`crate::constrained::Projection`] calls it at the end of a step where a row has lost most of its pivot. The
    /// interpreter and machine code made at run time can do that; code generated ahead of time keeps its order, and
    /// returns `false`.
    fn reorder_rows(&mut self, _q: &Self::Coordinates) -> bool {
        false
    }
    /// Whether a row is eliminated before other freedoms of its loop, as those of legs are. Its pivot then tells whether the leg can
    /// follow the row by itself, and not whether the mechanism can. Code generated ahead of time does not tell, and returns
    /// `false`.
    fn row_is_early(&self, _row: usize) -> bool {
        false
    }
}
