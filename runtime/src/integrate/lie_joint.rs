//! The formulas of [`super::chart`] for one joint.

use crate::spatial::{add3, cross, dot3, dot4, quaternion_matrix, scale3, ElementaryTransform, Vec3};
use crate::system::{LieGroup, LieJoint};
use crate::Scalar;

/// Three components from an index on.
fn three<S: Copy>(x: &[S], at: usize) -> Vec3<S> {
    [x[at], x[at + 1], x[at + 2]]
}

fn put<S: Copy>(x: &mut [S], at: usize, value: Vec3<S>) {
    x[at..at + 3].copy_from_slice(&value);
}

fn sub3<S: Scalar>(a: Vec3<S>, b: Vec3<S>) -> Vec3<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Scales a quaternion to unit length and returns the length it had.
pub(super) fn normalise<S: Scalar>(quaternion: &mut [S]) -> S {
    let norm = dot4(quaternion, quaternion).sqrt();
    let scale = S::one() / norm;
    for x in quaternion {
        *x = *x * scale;
    }
    norm
}

/// Quaternion of `cay(φ) R(q)`, of unit length.
fn turned<S: Scalar>(phi: Vec3<S>, q: &[S]) -> [S; 4] {
    let half = scale3(S::constant(0.5), phi);
    let (v, w) = (three(q, 0), q[3]);
    let vector = add3(add3(v, scale3(w, half)), cross(half, v));
    let mut out = [vector[0], vector[1], vector[2], w - dot3(half, v)];
    normalise(&mut out);
    out
}

/// `φ̇` of an angular velocity in outer axes: the inverse differential of Cayley's map.
fn phi_rate<S: Scalar>(phi: Vec3<S>, w: Vec3<S>) -> Vec3<S> {
    let (half, quarter) = (S::constant(0.5), S::constant(0.25));
    add3(sub3(w, scale3(half, cross(phi, w))), scale3(quarter * dot3(phi, w), phi))
}

/// Inverse of [`phi_rate`]: the angular velocity in outer axes.
fn angular<S: Scalar>(phi: Vec3<S>, rate: Vec3<S>) -> Vec3<S> {
    let (half, quarter) = (S::constant(0.5), S::constant(0.25));
    let scale = S::one() / (S::one() + quarter * dot3(phi, phi));
    scale3(scale, add3(rate, scale3(half, cross(phi, rate))))
}

/// Vector of `cay(φ) cay(s)⁻¹`.
fn from<S: Scalar>(phi: Vec3<S>, s: Vec3<S>) -> Vec3<S> {
    let (half, quarter) = (S::constant(0.5), S::constant(0.25));
    let scale = S::one() / (S::one() + quarter * dot3(phi, s));
    scale3(scale, sub3(sub3(phi, s), scale3(half, cross(phi, s))))
}

/// Angular velocity in outer axes of the rate of a unit quaternion.
fn spin<S: Scalar>(q: &[S], qd: &[S]) -> Vec3<S> {
    let (v, vd) = (three(q, 0), three(qd, 0));
    let w = add3(sub3(scale3(q[3], vd), scale3(qd[3], v)), cross(v, vd));
    scale3(S::constant(2.0), w)
}

impl LieJoint {
    /// Place of the rotation's vector in the displacement.
    fn phi(&self) -> Option<usize> {
        match self.kind {
            LieGroup::SO3 => Some(self.v),
            LieGroup::SE3 => Some(self.v + 3),
            LieGroup::SE2 => None,
        }
    }

    /// From body axes to outer ones at coordinates `q`.
    fn rotation<S: Scalar>(&self, q: &[S]) -> ElementaryTransform<S> {
        let o = S::zero();
        ElementaryTransform::Rotate(match self.quaternion() {
            Some(at) => quaternion_matrix([q[at], q[at + 1], q[at + 2], q[at + 3]]),
            None => {
                let (s, c) = q[self.q + 2].sin_cos();
                [[c, -s, o], [s, c, o], [o, o, S::one()]]
            }
        })
    }

    /// Momenta (or their rates) as two vectors: linear, angular. What the kind does not have is zero.
    fn split<S: Scalar>(&self, p: &[S]) -> (Vec3<S>, Vec3<S>) {
        let (o, v) = (S::zero(), self.v);
        match self.kind {
            LieGroup::SO3 => ([o; 3], three(p, v)),
            LieGroup::SE3 => (three(p, v), three(p, v + 3)),
            LieGroup::SE2 => ([p[v], p[v + 1], o], [o, o, p[v + 2]]),
        }
    }

    fn join<S: Scalar>(&self, (linear, angular): (Vec3<S>, Vec3<S>), p: &mut [S]) {
        let v = self.v;
        match self.kind {
            LieGroup::SO3 => put(p, v, angular),
            LieGroup::SE3 => {
                put(p, v, linear);
                put(p, v + 3, angular);
            }
            LieGroup::SE2 => put(p, v, [linear[0], linear[1], angular[2]]),
        }
    }

    /// How far the displacement moves the joint's origin, outer axes.
    pub(super) fn shift<S: Scalar>(&self, x: &[S]) -> Vec3<S> {
        match self.kind {
            LieGroup::SO3 => [S::zero(); 3],
            LieGroup::SE3 => three(x, self.v),
            LieGroup::SE2 => [x[self.v], x[self.v + 1], S::zero()],
        }
    }

    /// Momenta from body axes to outer ones, about the point from which the origin is displaced by `shift`.
    pub(super) fn outward<S: Scalar>(&self, q: &[S], shift: Vec3<S>, p: &mut [S]) {
        if self.momenta {
            let r = self.rotation(q);
            let (linear, angular) = self.split(p);
            let linear = r.vector_back(linear);
            self.join((linear, add3(r.vector_back(angular), cross(shift, linear))), p);
        }
    }

    /// Inverse of [`LieJoint::outward`]: momenta from outer axes to body axes.
    pub(super) fn inward<S: Scalar>(&self, q: &[S], shift: Vec3<S>, p: &mut [S]) {
        if self.momenta {
            let r = self.rotation(q);
            let (linear, angular) = self.split(p);
            self.join((r.vector(linear), r.vector(sub3(angular, cross(shift, linear)))), p);
        }
    }

    /// Momenta in outer axes about a point that is `shift` further.
    pub(super) fn refer<S: Scalar>(&self, shift: Vec3<S>, p: &mut [S]) {
        if self.momenta && self.kind != LieGroup::SO3 {
            let (linear, angular) = self.split(p);
            self.join((linear, sub3(angular, cross(shift, linear))), p);
        }
    }

    /// Quaternion at a displacement `x` from `base`.
    pub(super) fn displace<S: Scalar>(&self, base: &[S], x: &[S], q: &mut [S]) {
        if let (Some(at), Some(phi)) = (self.quaternion(), self.phi()) {
            q[at..at + 4].copy_from_slice(&turned(three(x, phi), &base[at..at + 4]));
        }
    }

    /// Moves the quaternion by a displacement `x`, in place.
    pub(super) fn advance<S: Scalar>(&self, x: &[S], q: &mut [S]) {
        if let (Some(at), Some(phi)) = (self.quaternion(), self.phi()) {
            let turned = turned(three(x, phi), &q[at..at + 4]);
            q[at..at + 4].copy_from_slice(&turned);
        }
    }

    /// Rates of the displacement at the state `(q, p)` it leads to, from `q̇` and, in place, `ṗ`: of the
    /// rotation and the momenta. The rates of positions are known, they stand in `xd`.
    pub(super) fn rates<S: Scalar>(&self, x: &[S], state: (&[S], &[S]), qd: &[S], xd: &mut [S], pd: &mut [S]) {
        let w = match self.quaternion() {
            Some(at) => spin(&state.0[at..at + 4], &qd[at..at + 4]),
            None => [S::zero(), S::zero(), qd[self.q + 2]],
        };
        self.rates_of_spin(x, state, w, xd, pd);
    }

    /// As [`LieJoint::rates`], from the angular velocity in outer axes.
    fn rates_of_spin<S: Scalar>(&self, x: &[S], (q, p): (&[S], &[S]), w: Vec3<S>, xd: &mut [S], pd: &mut [S]) {
        if let Some(phi) = self.phi() {
            put(xd, phi, phi_rate(three(x, phi), w));
        }
        if self.momenta {
            let r = self.rotation(q);
            let ((lin, ang), (lin_d, ang_d)) = (self.split(p), self.split(pd));
            let (lin, ang) = (r.vector_back(lin), r.vector_back(ang));
            let lin_d = add3(r.vector_back(lin_d), cross(w, lin));
            let ang_d = add3(r.vector_back(ang_d), cross(w, ang));
            let moved = add3(cross(self.shift(xd), lin), cross(self.shift(x), lin_d));
            self.join((lin_d, add3(ang_d, moved)), pd);
        }
    }

    /// Appends the displacement `(step, dp)` to `(x, p)`, as far as addition of the components does not do it.
    pub(super) fn compose<S: Scalar>(&self, (step, dp): (&[S], &[S]), x: &mut [S], p: &mut [S]) {
        if self.momenta && self.kind != LieGroup::SO3 {
            // About the point where the first of both begins.
            let (linear, angular) = self.split(p);
            self.join((linear, add3(angular, cross(self.shift(x), self.split(dp).0))), p);
        }
        if let Some(at) = self.phi() {
            let back = scale3(-S::one(), three(x, at));
            put(x, at, from(three(step, at), back));
        }
    }

    /// Takes the displacement `step` off the front of `(x, p)`, of whose momenta those of `step` are taken off already:
    /// what subtraction alone would get wrong.
    pub(super) fn relative<S: Scalar>(&self, step: &[S], x: &mut [S], p: &mut [S]) {
        self.refer(self.shift(step), p);
        if let Some(at) = self.phi() {
            put(x, at, from(three(x, at), three(step, at)));
        }
    }

    /// As [`LieJoint::rates`], from velocities `v` in body axes; the rates of positions are found as well.
    pub(super) fn rates_of_velocity<S: Scalar>(
        &self,
        x: &[S],
        state: (&[S], &[S]),
        v: &[S],
        xd: &mut [S],
        pd: &mut [S],
    ) {
        let r = self.rotation(state.0);
        let (linear, angular) = self.split(v);
        let w = r.vector_back(angular);
        self.join((r.vector_back(linear), w), xd);
        self.rates_of_spin(x, state, w, xd, pd);
    }

    /// Displacement in body axes by which coordinates change from `q` by `dq`, in the limit of small ones.
    pub(crate) fn body<S: Scalar>(&self, q: &[S], dq: &[S], out: &mut [S]) {
        let r = self.rotation(q);
        let angular = match self.quaternion() {
            Some(at) => spin(&q[at..at + 4], &dq[at..at + 4]),
            None => [S::zero(), S::zero(), dq[self.q + 2]],
        };
        // Positions stand first: where `shift` looks for those of a displacement.
        let linear = LieJoint { v: self.q, ..*self }.shift(dq);
        self.join((r.vector(linear), r.vector(angular)), out);
    }

    /// Derivatives of the energy by the displacement, momenta held as they are in outer axes: of the parts of `x`. `p`
    /// are the momenta there; `gx` and `gp` hold `-ṗ` and `ẋ`. Those by the momenta are set to zero.
    ///
    /// With `L = μ − x × π`, force and torque `π̇` and `μ̇ − x × π̇`: `∂H/∂x = ω × π − π̇` and
    /// `∂H/∂φ = ẋ × π + ω × L − μ̇ + x × π̇`, this by a turn from the displaced rotation.
    pub(super) fn gradient<S: Scalar>(&self, x: &[S], p: &[S], gx: &mut [S], gp: &mut [S]) {
        let (place, speed) = (self.shift(x), self.shift(gp));
        let spin = match self.phi() {
            Some(at) => angular(three(x, at), three(gp, at)),
            None => [S::zero(), S::zero(), gp[self.v + 2]],
        };
        let ((linear, about), (force, torque)) = (self.split(p), self.split(gx));
        let about = sub3(about, cross(place, linear));
        let turn = add3(add3(cross(speed, linear), cross(spin, about)), sub3(torque, cross(place, force)));
        self.join((add3(cross(spin, linear), force), turn), gx);
        if let Some(at) = self.phi() {
            let back = scale3(-S::one(), three(x, at));
            put(gx, at, angular(back, turn));
        }
        self.join(([S::zero(); 3], [S::zero(); 3]), gp);
    }

    /// From the axes that velocities have to outer ones.
    pub(super) fn turn_out<S: Scalar>(&self, q: &[S], x: &mut [S]) {
        let r = self.rotation(q);
        let (linear, angular) = self.split(x);
        self.join((r.vector_back(linear), r.vector_back(angular)), x);
    }

    /// Changes a displacement from one that leads to the state `from` to one that leads to the state `to`: its rotation
    /// and its momenta. Its positions are changed already, `before` is what they were.
    pub(super) fn correct<S: Scalar>(
        &self,
        (q0, p0): (&[S], &[S]),
        (q1, p1): (&[S], &[S]),
        before: Vec3<S>,
        (x, p): (&mut [S], &mut [S]),
    ) {
        if let (Some(at), Some(phi)) = (self.quaternion(), self.phi()) {
            let (old, new) = (&q0[at..at + 4], &q1[at..at + 4]);
            let step = scale3(S::one() / dot4(old, new), spin(old, new));
            let back = scale3(-S::one(), three(x, phi));
            put(x, phi, from(step, back));
        }
        let (v, n) = (self.v, self.kind.sizes().1);
        let local = LieJoint { v: 0, ..*self };
        let (mut old, mut new) = ([S::zero(); 6], [S::zero(); 6]);
        old[..n].copy_from_slice(&p0[v..v + n]);
        new[..n].copy_from_slice(&p1[v..v + n]);
        local.outward(q0, before, &mut old);
        local.outward(q1, self.shift(x), &mut new);
        for (p, (new, old)) in p[v..v + n].iter_mut().zip(new.into_iter().zip(old)) {
            *p = *p + (new - old);
        }
    }

    /// The rotation of a displacement `x` in the chart about the middle of a step, `R = cay(ζ − ξ) cay(ξ) R₀` with half
    /// the step's rotation `ξ` in `half`, rewritten in the chart about its start.
    pub(super) fn about_start<S: Scalar>(&self, half: &[S], x: &mut [S]) {
        if let Some(at) = self.phi() {
            let half = three(half, at);
            put(x, at, from(sub3(three(x, at), half), scale3(-S::one(), half)));
        }
    }

    /// Inverse of [`LieJoint::about_start`].
    pub(super) fn about_middle<S: Scalar>(&self, half: &[S], x: &mut [S]) {
        if let Some(at) = self.phi() {
            let half = three(half, at);
            put(x, at, add3(half, from(three(x, at), half)));
        }
    }

    /// The rate `xd` of a rotation, which stands in `start` in the chart about the start and in `middle` in that about
    /// the middle, rewritten from the former to the latter.
    pub(super) fn rate_about_middle<S: Scalar>(&self, half: &[S], start: &[S], middle: &[S], xd: &mut [S]) {
        if let Some(at) = self.phi() {
            let spin = angular(three(start, at), three(xd, at));
            put(xd, at, phi_rate(sub3(three(middle, at), three(half, at)), spin));
        }
    }

    /// Copies the rotation of a displacement.
    pub(super) fn copy_rotation<S: Scalar>(&self, from: &[S], to: &mut [S]) {
        if let Some(at) = self.phi() {
            put(to, at, three(from, at));
        }
    }

    /// Half of the rotation `x`: `cay(half)² = cay(x)`.
    pub(super) fn halve<S: Scalar>(&self, x: &[S], half: &mut [S]) {
        if let Some(at) = self.phi() {
            let whole = three(x, at);
            let root = (S::one() + S::constant(0.25) * dot3(whole, whole)).sqrt();
            put(half, at, scale3(S::one() / (S::one() + root), whole));
        }
    }

    /// Rewrites a past rotation in `x` and the rates when the base has moved by `step`.
    pub(super) fn follow<S: Scalar>(&self, step: &[S], x: &mut [S], xd: &mut [S], pd: &mut [S]) {
        if let Some(at) = self.phi() {
            let (old, moved) = (three(x, at), three(step, at));
            let new = from(old, moved);
            put(xd, at, phi_rate(new, angular(old, three(xd, at))));
            put(x, at, new);
        }
        self.refer(self.shift(step), pd);
    }
}
