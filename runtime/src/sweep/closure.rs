//! Rows of the constraints between two frames: directions, residuals, and how both change with time.
//!
//! The frames are `A` and `B`; components are those of `B`, moments are about its origin. `turn` takes components in
//! `A` to components in `B`, `d` goes from the origin of `A` to that of `B`. A row is a wrench `E` on `B` with `Eᵀ
//! Ω_rel = b`; where what is left free is a joint that moves with `B`, it is constant.

use super::touch::Touch;
use crate::lists::array;
use crate::spatial::{add3, cross, dot3, scale3, Force, Mat3, Motion, Vec3};
use crate::tree::Closure;
use crate::workspace::Relative;
use crate::{Dual, Scalar};

/// A unit force (components 0–2) or moment (3–5).
fn unit<S: Scalar>(k: usize) -> Force<S> {
    let mut f = Force::zero();
    *f.get_mut(k) = S::one();
    f
}

/// A force along `n` at the point `r`.
fn at_point<S: Scalar>(n: Vec3<S>, r: Vec3<S>) -> Force<S> {
    Force { lin: n, ang: cross(r, n) }
}

/// Two directions that form a right-handed triple of unit vectors with `n` in front: those of a constant triple in `A`
/// after the shortest rotation that takes its third direction to `n`. That rotation is a smooth function of every `n`
/// but the opposite direction, which is one that motions along the axes or planes of a frame do not meet.
fn tangents<S: Scalar>(at: &Relative<S>, n: Vec3<S>) -> [Vec3<S>; 2] {
    let direction = |x: [f64; 3]| at.turned(x.map(|x| S::constant(x / 7.0)));
    let pole = direction([2.0, -3.0, 6.0]);
    let sum = add3(pole, n);
    // Next to the opposite direction itself, the triple is left as it is.
    let factor = (S::one() + dot3(pole, n)).reciprocal_above(S::constant(1e-12));
    [[6.0, -2.0, -3.0], [3.0, 6.0, 2.0]].map(|x| {
        let x = direction(x);
        add3(x, scale3(-(factor * dot3(x, n)), sum))
    })
}

impl<S: Scalar> Relative<S> {
    /// Axis `k` of `A`.
    pub(super) fn axis(&self, k: usize) -> Vec3<S> {
        [self.turn[0][k], self.turn[1][k], self.turn[2][k]]
    }

    /// `d` without its part along z of `A`.
    pub(super) fn across(&self) -> Vec3<S> {
        let z = self.axis(2);
        add3(self.d, scale3(-dot3(z, self.d), z))
    }

    /// Motion of `A` at the origin of `B`, in its components.
    pub(super) fn motion(&self, a: &Motion<S>) -> Motion<S> {
        let ang = self.turned(a.ang);
        Motion { lin: add3(self.turned(a.lin), cross(ang, self.d)), ang }
    }

    /// A vector with components in `A`.
    pub(super) fn turned(&self, x: Vec3<S>) -> Vec3<S> {
        array(|i| dot3(self.turn[i], x))
    }

    /// A wrench on `B` as one at `A`, in its components.
    pub(super) fn force(&self, f: &Force<S>) -> Force<S> {
        let back = |x: Vec3<S>| array(|k| dot3(self.axis(k), x));
        Force { lin: back(f.lin), ang: back(add3(f.ang, cross(self.d, f.lin))) }
    }

    /// The same with its derivative, where `B` moves with `rel` relative to `A`, both in components of `B`.
    pub(super) fn moving(&self, rel: &Motion<S>) -> Relative<Dual<S>> {
        let mut out =
            Relative { turn: self.turn.map(|row| row.map(|x| Dual::new(x, S::zero()))), d: [Dual::zero(); 3] };
        for k in 0..3 {
            let rate = cross(self.axis(k), rel.ang);
            (0..3).for_each(|i| out.turn[i][k].du = rate[i]);
        }
        let rate = add3(rel.lin, cross(self.d, rel.ang));
        out.d = array(|i| Dual::new(self.d[i], rate[i]));
        out
    }
}

impl<S: Copy> Closure<S> {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        match self {
            Closure::Fixed => 6,
            Closure::Revolute | Closure::Prismatic | Closure::Helical { .. } => 5,
            Closure::Cylindrical | Closure::Universal => 4,
            Closure::Planar
            | Closure::Spherical
            | Closure::RollingDisc { .. }
            | Closure::RollingBall { .. }
            | Closure::RollingEllipsoid { .. }
            | Closure::RollingBalls { .. }
            | Closure::RollingCapsules { .. }
            | Closure::RollingBallOnBox { .. }
            | Closure::RollingBallOnCylinder { .. } => 3,
            #[cfg(feature = "height_fields")]
            Closure::RollingBallOnField { .. } => 3,
            #[cfg(feature = "hulls")]
            Closure::RollingBallOnHull { .. } | Closure::RollingCapsuleOnCylinder { .. } => 3,
            Closure::PointOnLine => 2,
            Closure::Distance { .. }
            | Closure::PointOnPlane
            | Closure::PointOnCylinder { .. }
            | Closure::KnifeEdge
            | Closure::Pfaffian { .. } => 1,
        }
    }

    /// Whether row `k` is the derivative of a condition on positions.
    pub fn holonomic(&self, k: usize) -> bool {
        match self {
            Closure::KnifeEdge | Closure::Pfaffian { .. } => false,
            _ => k == 0 || !self.rolls(),
        }
    }

    /// Whether two surfaces roll on each other without slip: the first row is their distance, the others their slip.
    pub fn rolls(&self) -> bool {
        #[cfg(feature = "height_fields")]
        if let Closure::RollingBallOnField { .. } = self {
            return true;
        }
        #[cfg(feature = "hulls")]
        if let Closure::RollingBallOnHull { .. } | Closure::RollingCapsuleOnCylinder { .. } = self {
            return true;
        }
        use Closure::{
            RollingBall, RollingBallOnBox, RollingBallOnCylinder, RollingBalls, RollingCapsules, RollingDisc,
            RollingEllipsoid,
        };
        matches!(
            self,
            RollingDisc { .. }
                | RollingBall { .. }
                | RollingEllipsoid { .. }
                | RollingBalls { .. }
                | RollingCapsules { .. }
                | RollingBallOnBox { .. }
                | RollingBallOnCylinder { .. }
        )
    }

    /// Whether the residual of row `k` is an angle (rad); those of the other rows are lengths (m).
    pub fn is_rotation(&self, k: usize) -> bool {
        match self {
            Closure::Revolute | Closure::Universal | Closure::Fixed => k >= 3,
            Closure::Prismatic | Closure::Cylindrical => k >= 2,
            // The last row compares a length with the pitch times an angle.
            Closure::Helical { .. } => k == 2 || k == 3,
            Closure::Planar => k >= 1,
            _ => false,
        }
    }

    /// Whether the motions that the constraint allows form a group, as those of a joint do.
    pub fn is_joint(&self) -> bool {
        use Closure::{Cylindrical, Fixed, Helical, Planar, Prismatic, Revolute, Spherical};
        matches!(self, Revolute | Prismatic | Cylindrical | Helical { .. } | Planar | Spherical | Fixed)
    }
}

impl<S: Scalar> Closure<S> {
    /// Whether the rows are constant.
    pub(super) fn constant(&self) -> bool {
        !self.rolls()
            && !matches!(
                self,
                Closure::Universal
                    | Closure::Distance { .. }
                    | Closure::PointOnLine
                    | Closure::PointOnPlane
                    | Closure::PointOnCylinder { .. }
            )
    }

    /// Whether all rows turn with the first body, and change in no other way.
    pub(super) fn turns_with_first(&self) -> bool {
        matches!(self, Closure::PointOnLine | Closure::PointOnPlane | Closure::RollingBall { .. })
    }

    /// Whether the rows are the derivatives of their residuals at all poses, closed or not.
    pub(super) fn exact(&self) -> bool {
        use Closure::{Distance, PointOnCylinder, PointOnLine, PointOnPlane};
        matches!(self, Distance { .. } | PointOnLine | PointOnPlane | PointOnCylinder { .. })
    }

    /// Rows that are constants, by components.
    fn components(&self) -> &'static [usize] {
        match self {
            Closure::Revolute => &[0, 1, 2, 3, 4],
            Closure::Prismatic => &[0, 1, 3, 4, 5],
            Closure::Cylindrical | Closure::Helical { .. } => &[0, 1, 3, 4],
            Closure::Planar => &[2, 3, 4],
            Closure::Spherical | Closure::Universal => &[0, 1, 2],
            Closure::Fixed => &[0, 1, 2, 3, 4, 5],
            _ => &[],
        }
    }

    /// `E_c`, one for each row.
    pub(super) fn directions(&self, at: &Relative<S>) -> [Force<S>; 6] {
        let mut rows = [Force::zero(); 6];
        for (row, &k) in rows.iter_mut().zip(self.components()) {
            *row = unit(k);
        }
        let force = |n: Vec3<S>| Force { lin: n, ang: [S::zero(); 3] };
        match self {
            Closure::Helical { pitch } => {
                rows[4] = unit(2);
                rows[4].ang[2] = -*pitch;
            }
            Closure::Universal => {
                let x = at.axis(0);
                rows[3].ang = [x[2], S::zero(), -x[0]];
            }
            Closure::Distance { length } => rows[0] = force(scale3(S::one() / *length, at.d)),
            Closure::PointOnLine => (rows[0], rows[1]) = (force(at.axis(0)), force(at.axis(1))),
            Closure::PointOnPlane => rows[0] = force(at.axis(2)),
            Closure::PointOnCylinder { radius } => {
                rows[0] = force(scale3(S::one() / *radius, at.across()));
            }
            Closure::RollingBall { radius } => {
                let [x, y] = [0, 1].map(|k| at.axis(k));
                rows[0] = force(at.axis(2));
                rows[1] = Force { lin: x, ang: scale3(-*radius, y) };
                rows[2] = Force { lin: y, ang: scale3(*radius, x) };
            }
            Closure::RollingDisc { .. } | Closure::RollingEllipsoid { .. } => {
                let contact = self.contact(at);
                for (row, k) in rows.iter_mut().zip([2, 0, 1]) {
                    *row = at_point(at.axis(k), contact);
                }
            }
            Closure::KnifeEdge => rows[0] = unit(2),
            Closure::Pfaffian { row: [fx, fy, fz, mx, my, mz] } => {
                rows[0] = Force { lin: [*fx, *fy, *fz], ang: [*mx, *my, *mz] };
            }
            _ => {}
        }
        if let Some(touch) = self.touch(at) {
            let tangents = tangents(at, touch.normal);
            for (row, t) in rows.iter_mut().zip([touch.normal, tangents[0], tangents[1]]) {
                *row = at_point(t, touch.at);
            }
        }
        rows
    }

    /// The same for a contact without slip, along the axes of `B`.
    pub(super) fn directions_in_own_axes(&self, at: &Relative<S>) -> [Force<S>; 6] {
        let contact = self.contact(at);
        let mut rows = [Force::zero(); 6];
        for (k, row) in rows.iter_mut().enumerate().take(3) {
            *row = at_point(unit::<S>(k).lin, contact);
        }
        rows
    }

    /// Contact point of the rolling body and the plane, from the origin of `B`, m.
    fn contact(&self, at: &Relative<S>) -> Vec3<S> {
        let n = at.axis(2);
        match self {
            Closure::RollingBall { radius } => scale3(-*radius, n),
            Closure::RollingDisc { radius } => {
                let s = (n[0] * n[0] + n[1] * n[1]).sqrt();
                let down = -(*radius / s);
                [down * n[0], down * n[1], S::zero()]
            }
            // Where the normal of the ellipsoid is `-n`: its radius along `n` is the length of the semi-axes times `n`.
            Closure::RollingEllipsoid { semi_axes } => {
                let scaled: Vec3<S> = array(|k| semi_axes[k] * n[k]);
                let down = -(S::one() / dot3(scaled, scaled).sqrt());
                array(|k| down * (semi_axes[k] * scaled[k]))
            }
            _ => [S::zero(); 3],
        }
    }

    /// Contact of two bodies neither of which is a plane; `None` for other kinds.
    fn touch(&self, at: &Relative<S>) -> Option<Touch<S>> {
        match self {
            Closure::RollingBalls { radii } => Some(Touch::balls(at, radii)),
            Closure::RollingCapsules { lengths, radii } => Some(Touch::capsules(at, lengths, radii)),
            Closure::RollingBallOnBox { size, rounding, radius } => {
                Some(Touch::ball_on_box(at, size, &[*rounding, *radius]))
            }
            #[cfg(feature = "hulls")]
            Closure::RollingBallOnHull { hull, rounding, radius } => {
                Some(Touch::ball_on_hull(at, hull, &[*rounding, *radius]))
            }
            #[cfg(feature = "hulls")]
            Closure::RollingCapsuleOnCylinder { lengths, radii } => {
                Some(Touch::capsule_on_cylinder(at, lengths, radii))
            }
            Closure::RollingBallOnCylinder { length, radii } => Some(Touch::ball_on_cylinder(at, *length, radii)),
            #[cfg(feature = "height_fields")]
            Closure::RollingBallOnField { field, ball } => Some(Touch::ball_on_field(at, field, *ball)),
            _ => None,
        }
    }

    /// Residuals of the positions; their rates are `EᵀΩ_rel`, at least where they are zero.
    pub(super) fn residuals(&self, at: &Relative<S>) -> [S; 6] {
        let half = S::constant(0.5);
        let [x, z, d] = [at.axis(0), at.axis(2), at.d];
        // Twice the tangent of half the angle; a sine would be zero for frames that are rotated by 180° too.
        let tangent = |cosine: S| S::constant(2.0) / (S::one() + cosine);
        let (tilt, spin) = (tangent(z[2]), tangent(x[0]));
        let small = [d[0], d[1], d[2], tilt * z[1], -(tilt * z[0]), -(spin * x[1])];
        let mut out = [S::zero(); 6];
        for (out, &k) in out.iter_mut().zip(self.components()) {
            *out = small[k];
        }
        // Where `d` need not be zero, a tilt changes its components too; the rows do not contain this change.
        if let Closure::Prismatic | Closure::Cylindrical | Closure::Helical { .. } = self {
            (out[0], out[1]) = (d[0] - d[2] * z[0], d[1] - d[2] * z[1]);
        }
        match self {
            Closure::Planar => out[0] = dot3(z, d),
            Closure::Helical { pitch } => {
                let (s, c) = (d[2] / *pitch).sin_cos();
                let turned = tangent(c * x[0] - s * x[1]);
                out[4] = *pitch * (turned * (s * x[0] + c * x[1]));
            }
            Closure::Universal => out[3] = x[1],
            Closure::Distance { length } => out[0] = half * (dot3(d, d) / *length - *length),
            Closure::PointOnLine => (out[0], out[1]) = (dot3(x, d), dot3(at.axis(1), d)),
            Closure::PointOnPlane => out[0] = dot3(z, d),
            Closure::PointOnCylinder { radius } => {
                let across = at.across();
                out[0] = half * (dot3(across, across) / *radius - *radius);
            }
            Closure::RollingDisc { .. } | Closure::RollingBall { .. } | Closure::RollingEllipsoid { .. } => {
                out[0] = dot3(z, add3(d, self.contact(at)));
            }
            _ => {}
        }
        if let Some(touch) = self.touch(at) {
            out[0] = touch.gap;
        }
        out
    }

    /// Where two surfaces that roll touch, in ground axes, m, and the directions of the forces of the three rows on the
    /// second body: the normal and two across it. `a` and `b` are rotations to ground axes and origins, m, of the two
    /// frames. `None` for constraints of other kinds.
    pub fn touching(&self, a: (&Mat3<S>, Vec3<S>), b: (&Mat3<S>, Vec3<S>)) -> Option<(Vec3<S>, [Vec3<S>; 3])> {
        if !self.rolls() {
            return None;
        }
        let column = |m: &Mat3<S>, k: usize| [m[0][k], m[1][k], m[2][k]];
        let axes: [Vec3<S>; 3] = array(|i| column(b.0, i));
        let way = add3(b.1, scale3(-S::one(), a.1));
        let turn = array(|i| array(|k| dot3(axes[i], column(a.0, k))));
        let at = Relative { turn, d: array(|i| dot3(axes[i], way)) };
        let arm = self.touch(&at).map_or_else(|| self.contact(&at), |touch| touch.at);
        let ground = |x: Vec3<S>| array(|i| dot3(b.0[i], x));
        let rows = self.directions(&at);
        Some((add3(b.1, ground(arm)), [0, 1, 2].map(|k: usize| ground(rows[k].lin))))
    }

    /// Rates of the components of `E_c`, where `B` moves with `rel` relative to `A`; zero where they are constant.
    pub(super) fn direction_rates(&self, at: &Relative<S>, rel: &Motion<S>) -> [Force<S>; 6] {
        if self.constant() {
            return [Force::zero(); 6];
        }
        if self.turns_with_first() {
            let turned = |e: Force<S>| Force { lin: cross(e.lin, rel.ang), ang: cross(e.ang, rel.ang) };
            return self.directions(at).map(turned);
        }
        let rate = |f: Force<Dual<S>>| Force { lin: f.lin.map(|x| x.du), ang: f.ang.map(|x| x.du) };
        self.map(&|x| Dual::new(x, S::zero())).directions(&at.moving(rel)).map(rate)
    }

    /// Derivatives of [`Closure::direction_rates`] at the motion `rel`, where `B` moves with `way` relative to `A` and
    /// `rel` itself changes by `bend`.
    pub(super) fn bent_rates(
        &self,
        at: &Relative<S>,
        rel: &Motion<S>,
        way: &Motion<S>,
        bend: &Motion<S>,
    ) -> [Force<S>; 6] {
        if self.constant() {
            return [Force::zero(); 6];
        }
        let both = |x: Vec3<S>, dx: Vec3<S>| array(|k| Dual::new(x[k], dx[k]));
        let rel = Motion { lin: both(rel.lin, bend.lin), ang: both(rel.ang, bend.ang) };
        let rate = |f: Force<Dual<S>>| Force { lin: f.lin.map(|x| x.du), ang: f.ang.map(|x| x.du) };
        self.map(&|x| Dual::new(x, S::zero())).direction_rates(&at.moving(way), &rel).map(rate)
    }

    /// Rates of the residuals, where `B` moves with `rel` relative to `A`.
    pub(super) fn residual_rates(&self, at: &Relative<S>, rel: &Motion<S>) -> [S; 6] {
        self.map(&|x| Dual::new(x, S::zero())).residuals(&at.moving(rel)).map(|x| x.du)
    }
}
