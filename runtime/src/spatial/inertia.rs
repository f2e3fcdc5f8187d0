//! Rigid and articulated inertia.

use super::{add3, cross, Force, Mat3, Motion, Vec3};
use crate::lists::array;
use crate::Scalar;

/// Place of entry `(i, j)` of a symmetric matrix stored as `[xx, xy, xz, yy, yz, zz]`.
pub const SYM: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// Inertia of a rigid body at a frame: mass (kg), first moment `m c` (kg m), inertia about the frame origin (kg m²) as
/// `[xx, xy, xz, yy, yz, zz]`. The equations of motion are linear in these ten numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidInertia<S> {
    /// Mass, kg.
    pub mass: S,
    /// First moment `m c`, kg m.
    pub moment: Vec3<S>,
    /// Inertia about the frame origin, kg m², as `[xx, xy, xz, yy, yz, zz]`.
    pub inertia: [S; 6],
}

/// A symmetric 6×6 inertia `[[A, Hᵀ], [H, J]]` at a frame; `H` maps linear velocity to angular momentum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArticulatedInertia<S> {
    /// Linear block, kg, as `[xx, xy, xz, yy, yz, zz]`.
    pub a: [S; 6],
    /// Coupling block `h[angular][linear]`, kg m.
    pub h: Mat3<S>,
    /// Angular block, kg m², as `[xx, xy, xz, yy, yz, zz]`.
    pub j: [S; 6],
}

impl<S: Scalar> RigidInertia<S> {
    /// The inertia of no body: all numbers zero.
    pub fn zero() -> Self {
        let o = S::zero();
        RigidInertia { mass: o, moment: [o; 3], inertia: [o; 6] }
    }

    /// From the ten standard parameters: `[m, m c_x, m c_y, m c_z, J_xx, J_xy, J_yy, J_xz, J_yz, J_zz]`, the inertia
    /// about the frame origin.
    pub fn from_parameters(&[m, x, y, z, xx, xy, yy, xz, yz, zz]: &[S; 10]) -> Self {
        RigidInertia { mass: m, moment: [x, y, z], inertia: [xx, xy, xz, yy, yz, zz] }
    }

    /// The ten standard parameters, in the order of [`RigidInertia::from_parameters`].
    pub fn parameters(&self) -> [S; 10] {
        let ([x, y, z], [xx, xy, xz, yy, yz, zz]) = (self.moment, self.inertia);
        [self.mass, x, y, z, xx, xy, yy, xz, yz, zz]
    }

    /// Sum of the inertias of two bodies at the same frame.
    pub fn plus(&self, o: &Self) -> Self {
        RigidInertia {
            mass: self.mass + o.mass,
            moment: add3(self.moment, o.moment),
            inertia: array(|k| self.inertia[k] + o.inertia[k]),
        }
    }

    /// Momentum `M Ω` at the frame, N s and N m s.
    pub fn momentum(&self, w: &Motion<S>) -> Force<S> {
        let (m, s, i) = (self.mass, self.moment, &self.inertia);
        let spin: Vec3<S> = array(|k| i[SYM[k][0]] * w.ang[0] + i[SYM[k][1]] * w.ang[1] + i[SYM[k][2]] * w.ang[2]);
        let drag = cross(w.ang, s);
        Force { lin: array(|k| m * w.lin[k] + drag[k]), ang: add3(cross(s, w.lin), spin) }
    }

    /// As a general 6×6 inertia.
    pub fn articulated(&self) -> ArticulatedInertia<S> {
        let (o, m, [x, y, z]) = (S::zero(), self.mass, self.moment);
        ArticulatedInertia { a: [m, o, o, m, o, m], h: [[o, -z, y], [z, o, -x], [-y, x, o]], j: self.inertia }
    }

    /// The ten numbers of a 6×6 inertia that is known to be that of a rigid body.
    pub fn from_articulated(m: &ArticulatedInertia<S>) -> Self {
        RigidInertia { mass: m.a[0], moment: [m.h[2][1], m.h[0][2], m.h[1][0]], inertia: m.j }
    }
}

impl<S: Scalar> ArticulatedInertia<S> {
    /// All entries zero.
    pub fn zero() -> Self {
        let o = S::zero();
        ArticulatedInertia { a: [o; 6], h: [[o; 3]; 3], j: [o; 6] }
    }

    /// Sum of two inertias at the same frame.
    #[inline]
    pub fn plus(&self, o: &Self) -> Self {
        ArticulatedInertia {
            a: array(|k| self.a[k] + o.a[k]),
            h: array(|i| array(|k| self.h[i][k] + o.h[i][k])),
            j: array(|k| self.j[k] + o.j[k]),
        }
    }

    /// Entry `(i, k)` of the 6×6 matrix.
    #[inline(always)]
    pub fn get(&self, i: usize, k: usize) -> S {
        match (i < 3, k < 3) {
            (true, true) => self.a[SYM[i][k]],
            (false, false) => self.j[SYM[i - 3][k - 3]],
            (false, true) => self.h[i - 3][k],
            (true, false) => self.h[k - 3][i],
        }
    }

    /// Entry `(i, k)`, which is also entry `(k, i)`, for changing it.
    #[inline(always)]
    pub fn get_mut(&mut self, i: usize, k: usize) -> &mut S {
        match (i < 3, k < 3) {
            (true, true) => &mut self.a[SYM[i][k]],
            (false, false) => &mut self.j[SYM[i - 3][k - 3]],
            (false, true) => &mut self.h[i - 3][k],
            (true, false) => &mut self.h[k - 3][i],
        }
    }

    /// Column `k`.
    #[inline(always)]
    pub fn column(&self, k: usize) -> Force<S> {
        Force { lin: array(|i| self.get(i, k)), ang: array(|i| self.get(i + 3, k)) }
    }

    /// `M Ω`.
    pub fn times(&self, v: &Motion<S>) -> Force<S> {
        let row = |i: usize| (1..6).fold(self.get(i, 0) * v.get(0), |sum, k| sum + self.get(i, k) * v.get(k));
        Force { lin: array(row), ang: array(|i| row(i + 3)) }
    }
}
