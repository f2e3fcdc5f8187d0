//! Local coordinates about a state, which the methods integrate.
//!
//! A step is a displacement from the state at its start, with as many components as there are velocities. It is added
//! to the coordinates of ordinary joints. A rotation is displaced by a vector `φ` in the axes of the parent ("outer
//! axes"), `R = cay(φ) R₀` (Cayley map: quaternion `(φ/2, 1)` scaled to unit length), so that it stays a rotation with
//! every method. The momenta of such a joint are taken in outer axes; if its origin moves too, about the point where
//! the step started:
//!
//! `π = R p_lin`, `μ = R p_ang + x × π`, so that `π̇ = R (ṗ_lin + ω × p_lin)`, `μ̇ = R (ṗ_ang + ω × p_ang) + ẋ × π + x
//! × π̇`.
//!
//! The momenta of a body on which nothing acts are then constants, and every method keeps them to round-off. After
//! Bogfjellmo and Marthinsen, *High-order symplectic partitioned Lie group methods*, 2016, section 2, with Cayley's map
//! in place of the exponential: its inverse differential is a polynomial.

use super::combine::{combine, Start};
use super::lie_joint::normalise;
use super::weights::Row;
use super::StepError;
use crate::lists::{copy, part, part_mut};
use crate::system::{LieJoint, Real, System};
use crate::Scalar;

/// A displacement of a state, or its rate: `nv` coordinates, `nv` momenta.
#[derive(Clone, Debug)]
pub struct Point<Y: System> {
    /// Coordinates: rad, m; rotations by the vector `φ` of the module's text.
    pub x: Y::Momenta,
    /// Momenta.
    pub p: Y::Momenta,
}

impl<Y: System> Point<Y> {
    /// The zero displacement.
    pub fn zero(system: &Y) -> Self {
        Point { x: system.zero_momenta(), p: system.zero_momenta() }
    }

    /// Coordinates and momenta.
    pub fn parts(&self) -> [&[Y::Scalar]; 2] {
        [self.x.as_ref(), self.p.as_ref()]
    }

    /// Coordinates and momenta, to be changed.
    pub fn parts_mut(&mut self) -> [&mut [Y::Scalar]; 2] {
        [self.x.as_mut(), self.p.as_mut()]
    }

    /// Sets all components to zero.
    #[inline]
    pub fn clear(&mut self) {
        self.x.as_mut().fill(Y::Scalar::zero());
        self.p.as_mut().fill(Y::Scalar::zero());
    }

    /// Copies the components of another displacement.
    #[inline]
    pub fn copy_from(&mut self, other: &Self) {
        self.x.as_mut().copy_from_slice(other.x.as_ref());
        self.p.as_mut().copy_from_slice(other.p.as_ref());
    }

    /// `self += w k`.
    #[inline]
    pub fn add(&mut self, w: Y::Scalar, k: &Self) {
        let add = |sum: &mut [Y::Scalar], k: &[Y::Scalar]| {
            for (sum, k) in sum.iter_mut().zip(k) {
                *sum = *sum + w * *k;
            }
        };
        add(self.x.as_mut(), k.x.as_ref());
        add(self.p.as_mut(), k.p.as_ref());
    }

    /// `self = h Σ wⱼ k_j` over the pairs `(j, wⱼ)`.
    #[inline]
    pub(super) fn combine(&mut self, h: Y::Scalar, weights: Row, k: &[Self]) {
        combine([self.x.as_mut(), self.p.as_mut()], None, h, weights, k);
    }

    /// `self *= w`.
    #[inline]
    pub fn scale(&mut self, w: Y::Scalar) {
        for part in self.parts_mut() {
            for x in part {
                *x = w * *x;
            }
        }
    }
}

impl<Y: System> Point<Y>
where
    Y::Scalar: Real,
{
    /// Index of the first component that is not finite, momenta after coordinates.
    pub fn not_finite(&self) -> Option<usize> {
        // A product with zero is not a number where the other factor is not finite: one sum for all, and no branch.
        let zero = Y::Scalar::zero();
        let sum = |sum, part: &[Y::Scalar]| part.iter().fold(sum, |sum, x| sum + *x * zero);
        if sum(sum(zero, self.x.as_ref()), self.p.as_ref()).is_finite() {
            return None;
        }
        self.parts().into_iter().flatten().position(|x| !x.is_finite())
    }
}

/// The state that displacements start from, in local coordinates about it.
#[derive(Clone, Debug)]
pub struct Chart<Y: System> {
    /// Coordinates.
    q: Y::Coordinates,
    /// Momenta; those of groups in outer axes.
    p: Y::Momenta,
    /// What rounding removed from the sums of the last steps, where sums are compensated.
    carry: Option<Point<Y>>,
}

/// Iterates over the stretches of the state that are moved by addition, positions of Lie joints included, each with the
/// Lie joint at its end.
struct Stretches<'a> {
    groups: core::slice::Iter<'a, LieJoint>,
    at: (usize, usize),
    end: (usize, usize),
}

impl<'a> Stretches<'a> {
    fn new(groups: &'a [LieJoint], nq: usize, nv: usize) -> Self {
        Stretches { groups: groups.iter(), at: (0, 0), end: (nq, nv) }
    }
}

impl<'a> Iterator for Stretches<'a> {
    /// First index into `q` and into `v`, how many; the group.
    type Item = (usize, usize, usize, Option<&'a LieJoint>);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let (q, v) = self.at;
        if v >= self.end.1 {
            return None;
        }
        let group = self.groups.next();
        let stop = group.map_or(self.end.1, |g| g.v + g.kind.positions());
        self.at = group.map_or(self.end, |g| (g.q + g.kind.sizes().0, g.v + g.kind.sizes().1));
        Some((q, v, stop - v, group))
    }
}

impl<Y> Chart<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    /// A chart about the neutral state. With `compensated`, sums of steps carry on what rounding takes from them.
    #[inline(always)]
    pub fn new(system: &Y, compensated: bool) -> Self {
        let mut chart = Chart { q: system.neutral(), p: system.zero_momenta(), carry: Some(Point::zero(system)) };
        // The compensation is zeroed and then dropped. If it were never made, its bytes would have no value, and the compiler would
        // build parts of an integrator beside the whole and copy them.
        if !compensated {
            chart.carry = None;
        }
        chart
    }

    /// Moves the chart to another state at `time` (s).
    ///
    /// # Errors
    /// [`StepError::Quaternion`] where a quaternion is off the unit sphere by more than 1e-3; it is scaled otherwise.
    pub fn load(&mut self, system: &Y, time: f64, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        self.q.as_mut().copy_from_slice(q.as_ref());
        self.p.as_mut().copy_from_slice(p.as_ref());
        if let Some(carry) = &mut self.carry {
            carry.clear();
        }
        for group in system.lie_joints() {
            if let Some(index) = group.quaternion() {
                let norm = normalise(part_mut(self.q.as_mut(), index, 4)).to_f64();
                if !(norm > 0.999 && norm < 1.001) {
                    return Err(StepError::Quaternion { time, index, norm });
                }
            }
            group.outward(self.q.as_ref(), [Y::Scalar::zero(); 3], self.p.as_mut());
        }
        Ok(())
    }

    /// Gives the state that displacements start from.
    pub fn base(&self, system: &Y, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        q.as_mut().copy_from_slice(self.q.as_ref());
        p.as_mut().copy_from_slice(self.p.as_ref());
        for group in system.lie_joints() {
            group.inward(self.q.as_ref(), [Y::Scalar::zero(); 3], p.as_mut());
        }
    }

    /// Whether nothing is carried over from rounded sums.
    pub(super) fn is_exact(&self) -> bool {
        self.carry.is_none()
    }

    /// The state that displacements start from as the chart stores it: momenta of Lie joints in outer axes.
    pub(super) fn held(&self) -> (&[Y::Scalar], &[Y::Scalar]) {
        (self.q.as_ref(), self.p.as_ref())
    }

    /// Absolute values of the state's components; zero for rotations.
    pub fn size(&self, system: &Y, out: &mut Point<Y>) {
        out.clear();
        let (q, x) = (self.q.as_ref(), out.x.as_mut());
        for (at, v, n, _) in Stretches::new(system.lie_joints(), q.len(), x.len()) {
            for (x, q) in part_mut(x, v, n).iter_mut().zip(part(q, at, n)) {
                *x = q.abs();
            }
        }
        for (size, p) in out.p.as_mut().iter_mut().zip(self.p.as_ref()) {
            *size = p.abs();
        }
    }

    /// State at a displacement. Where sums are compensated, what was carried over is part of it.
    pub fn state(&self, system: &Y, point: &Point<Y>, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        self.stage_state(system, point, q, p);
    }

    /// [`Chart::state`] for the stages of a step, whose loops know the system's joints where this is inlined.
    #[inline(always)]
    pub(super) fn stage_state(&self, system: &Y, point: &Point<Y>, q: &mut Y::Coordinates, p: &mut Y::Momenta) {
        let (base, x) = (self.q.as_ref(), point.x.as_ref());
        let (cx, cp) = self.carry.as_ref().map_or((None, None), |c| (Some(c.x.as_ref()), Some(c.p.as_ref())));
        let q = q.as_mut();
        displaced(self.p.as_ref(), point.p.as_ref(), cp, p.as_mut());
        if system.lie_joints().is_empty() {
            return displaced(base, x, cx, q);
        }
        for (at, v, n, group) in Stretches::new(system.lie_joints(), base.len(), x.len()) {
            displaced(part(base, at, n), part(x, v, n), cx.map(|c| part(c, v, n)), part_mut(q, at, n));
            if let Some(group) = group {
                group.displace(base, x, q);
                group.inward(q, group.shift(x), p.as_mut());
            }
        }
    }

    /// State at the displacement `h Σ wⱼ k_j` in one pass, without the displacement being
    /// stored, for systems all of whose displacements are added.
    #[inline(always)]
    pub(super) fn stage(
        &self,
        h: Y::Scalar,
        (weights, k): (Row, &[Point<Y>]),
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) {
        let carry = self.carry.as_ref().map(Point::parts);
        let start = Start { state: [self.q.as_ref(), self.p.as_ref()], carry };
        combine([q.as_mut(), p.as_mut()], Some(start), h, weights, k);
    }

    /// Rates of the displacement from those of the state `(q, p)` it leads to: `q̇`, and `ṗ` at the place of its
    /// momenta.
    #[inline]
    pub fn rates(
        &self,
        system: &Y,
        point: &Point<Y>,
        (q, p): (&Y::Coordinates, &Y::Momenta),
        qd: &Y::Coordinates,
        out: &mut Point<Y>,
    ) {
        let (xd, qd_) = (out.x.as_mut(), qd.as_ref());
        if system.lie_joints().is_empty() {
            return copy(xd, qd_);
        }
        for (at, v, n, group) in Stretches::new(system.lie_joints(), qd_.len(), xd.len()) {
            copy(part_mut(xd, v, n), part(qd_, at, n));
            if let Some(group) = group {
                group.rates(point.x.as_ref(), (q.as_ref(), p.as_ref()), qd_, xd, out.p.as_mut());
            }
        }
    }

    /// From the rate at a displacement, in canonical form and without forces that do work: the derivatives of the
    /// energy by the displacement, Hamilton's equations turned round. Derivatives by momenta of groups are left out, as
    /// zeros.
    pub fn gradient(&self, system: &Y, point: &Point<Y>, rate: &mut Point<Y>) {
        let (gx, gp) = (rate.x.as_mut(), rate.p.as_mut());
        for (x, p) in gx.iter_mut().zip(gp.iter_mut()) {
            (*x, *p) = (-*p, *x);
        }
        for group in system.lie_joints() {
            let (from, n) = (group.v, group.kind.sizes().1);
            let mut p = [Y::Scalar::zero(); 6];
            let both = part(self.p.as_ref(), from, n).iter().zip(part(point.p.as_ref(), from, n));
            for (p, (base, dp)) in p.iter_mut().zip(both) {
                *p = *base + *dp;
            }
            let group = LieJoint { v: 0, ..*group };
            let x = part(point.x.as_ref(), from, n);
            group.gradient(x, &p, part_mut(gx, from, n), part_mut(gp, from, n));
        }
    }

    /// Moves the state to a displacement from it.
    ///
    /// # Errors
    /// [`StepError::NotFinite`]; the state has not moved then.
    pub fn advance(&mut self, system: &Y, time: f64, point: &Point<Y>) -> Result<(), StepError> {
        if let Some(index) = point.not_finite() {
            return Err(StepError::NotFinite { time, index });
        }
        let (q, x) = (self.q.as_mut(), point.x.as_ref());
        let mut carry = self.carry.as_mut().map(|c| (c.x.as_mut(), c.p.as_mut()));
        for (at, v, n, group) in Stretches::new(system.lie_joints(), q.len(), x.len()) {
            for (k, (q, x)) in part_mut(q, at, n).iter_mut().zip(part(x, v, n)).enumerate() {
                sum(q, *x, carry.as_mut().and_then(|c| c.0.get_mut(v + k)));
            }
            if let Some(group) = group {
                group.advance(x, q);
            }
        }
        let p = self.p.as_mut();
        for (k, (p, dp)) in p.iter_mut().zip(point.p.as_ref()).enumerate() {
            sum(p, *dp, carry.as_mut().and_then(|c| c.1.get_mut(k)));
        }
        for group in system.lie_joints() {
            group.refer(group.shift(x), p);
        }
        Ok(())
    }

    /// Moves coordinates by a displacement in the axes that velocities have, body axes of groups, which is transformed
    /// into outer axes.
    pub fn displace(system: &Y, dx: &mut Y::Momenta, q: &mut Y::Coordinates) {
        let (q, x) = (q.as_mut(), dx.as_mut());
        for group in system.lie_joints() {
            group.turn_out(q, x);
        }
        for (at, v, n, group) in Stretches::new(system.lie_joints(), q.len(), x.len()) {
            for (q, x) in q.iter_mut().skip(at).zip(x.iter().skip(v)).take(n) {
                *q = *q + *x;
            }
            if let Some(group) = group {
                group.advance(x, q);
            }
        }
    }

    /// Transforms forces on the joints, in the axes that momenta of a state have, into rates of the momenta of a
    /// displacement `point` that leads to the coordinates `q`.
    pub fn forces(system: &Y, q: &Y::Coordinates, point: &Point<Y>, forces: &mut Y::Momenta) {
        for group in system.lie_joints() {
            group.outward(q.as_ref(), group.shift(point.x.as_ref()), forces.as_mut());
        }
    }

    /// Inverse of [`Chart::forces`].
    pub fn joint_forces(system: &Y, q: &Y::Coordinates, point: &Point<Y>, rates: &mut Y::Momenta) {
        for group in system.lie_joints() {
            group.inward(q.as_ref(), group.shift(point.x.as_ref()), rates.as_mut());
        }
    }

    /// Changes a displacement that leads to the state `from` into one that leads to the state `to` close to it.
    pub fn correct(
        system: &Y,
        from: (&Y::Coordinates, &Y::Momenta),
        to: (&Y::Coordinates, &Y::Momenta),
        point: &mut Point<Y>,
    ) {
        let (q0, p0, q1, p1) = (from.0.as_ref(), from.1.as_ref(), to.0.as_ref(), to.1.as_ref());
        let (x, p) = (point.x.as_mut(), point.p.as_mut());
        for (at, v, n, group) in Stretches::new(system.lie_joints(), q0.len(), x.len()) {
            let positions = group.map_or(0, |group| group.kind.positions());
            let before = group.map_or([Y::Scalar::zero(); 3], |group| group.shift(x));
            for (x, (q1, q0)) in part_mut(x, v, n).iter_mut().zip(part(q1, at, n).iter().zip(part(q0, at, n))) {
                *x = *x + (*q1 - *q0);
            }
            let n = n - positions;
            for (p, (p1, p0)) in part_mut(p, v, n).iter_mut().zip(part(p1, v, n).iter().zip(part(p0, v, n))) {
                *p = *p + (*p1 - *p0);
            }
            if let Some(group) = group {
                group.correct((q0, p0), (q1, p1), before, (x, p));
            }
        }
    }

    /// Appends a displacement from where `total` leads: `total` becomes both, in the chart of its start.
    pub fn compose(system: &Y, step: &Point<Y>, total: &mut Point<Y>) {
        let (x, p) = (total.x.as_mut(), total.p.as_mut());
        for group in system.lie_joints() {
            group.compose((step.x.as_ref(), step.p.as_ref()), x, p);
        }
        for_positions(system, x, step.x.as_ref(), |x, step| x + step);
        for (sum, dp) in p.iter_mut().zip(step.p.as_ref()) {
            *sum = *sum + *dp;
        }
    }

    /// Inverse of [`Chart::compose`]: takes `step` off the front of `point`, which becomes a displacement from where
    /// `step` leads.
    pub fn relative(system: &Y, step: &Point<Y>, point: &mut Point<Y>) {
        let (x, p) = (point.x.as_mut(), point.p.as_mut());
        for (p, dp) in p.iter_mut().zip(step.p.as_ref()) {
            *p = *p - *dp;
        }
        for group in system.lie_joints() {
            group.relative(step.x.as_ref(), x, p);
        }
        for_positions(system, x, step.x.as_ref(), |x, step| x - step);
    }

    /// What a past point of the motion, `x` from the chart's state, and its rate become when the chart's state is moved
    /// by `step`. Of the displacement only the coordinates are kept up, its momenta are not read.
    pub fn follow(system: &Y, step: &Point<Y>, point: &mut Point<Y>, rate: &mut Point<Y>) {
        let (step, x) = (step.x.as_ref(), point.x.as_mut());
        for group in system.lie_joints() {
            group.follow(step, x, rate.x.as_mut(), rate.p.as_mut());
        }
        for_positions(system, x, step, |x, step| x - step);
    }
}

/// Combines the components of `x` that displacements are added to with those of `step`.
#[inline]
fn for_positions<Y: System>(
    system: &Y,
    x: &mut [Y::Scalar],
    step: &[Y::Scalar],
    with: impl Fn(Y::Scalar, Y::Scalar) -> Y::Scalar,
) {
    let nv = x.len();
    let nq = system.lie_joints().iter().fold(nv, |n, g| n + g.kind.sizes().0 - g.kind.sizes().1);
    for (_, v, n, _) in Stretches::new(system.lie_joints(), nq, nv) {
        for (x, step) in part_mut(x, v, n).iter_mut().zip(part(step, v, n)) {
            *x = with(*x, *step);
        }
    }
}

/// `out = base + (x + carry)`.
#[inline(always)]
fn displaced<S: Scalar>(base: &[S], x: &[S], carry: Option<&[S]>, out: &mut [S]) {
    match carry {
        None => out.iter_mut().zip(base.iter().zip(x)).for_each(|(out, (base, x))| *out = *base + *x),
        Some(carry) => displaced_by_both(base, x, carry, out),
    }
}

/// [`displaced`] where sums are compensated: one copy, so that the code of a small processor stays small.
#[cold]
#[inline(never)]
fn displaced_by_both<S: Scalar>(base: &[S], x: &[S], carry: &[S], out: &mut [S]) {
    let pairs = out.iter_mut().zip(base.iter().zip(x.iter().zip(carry)));
    pairs.for_each(|(out, (base, (x, carry)))| *out = *base + (*x + *carry));
}

/// `total += x`, with what the last sums lost; keeps what this one loses. Kahan, *Further remarks on reducing
/// truncation errors*, 1965.
#[inline]
fn sum<S: Real>(total: &mut S, x: S, carry: Option<&mut S>) {
    match carry {
        None => *total = *total + x,
        Some(carry) => {
            let x = x + *carry;
            let new = *total + x;
            *carry = x - (new - *total);
            *total = new;
        }
    }
}
