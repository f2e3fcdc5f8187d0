//! Elementary transforms, applied to each spatial quantity.
//!
//! A placement is a list of elementary transforms from the parent frame to the child frame. Velocities are transformed
//! in the order of the list ([`ElementaryTransform::motion`]); momenta, wrenches and inertias in the reverse order,
//! from child to parent ([`ElementaryTransform::force`], [`ElementaryTransform::inertia`]).

use super::{cross, ArticulatedInertia, Force, Mat3, Motion, Vec3, SYM};
use crate::lists::array;
use crate::Scalar;

/// A coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
}

impl Axis {
    /// Indices `(a, b, n)` in cyclic order; `n` is the axis itself.
    #[inline]
    pub fn cyclic(self) -> (usize, usize, usize) {
        match self {
            Axis::X => (1, 2, 0),
            Axis::Y => (2, 0, 1),
            Axis::Z => (0, 1, 2),
        }
    }
}

/// Evaluates an expression with the indices of [`Axis::cyclic`]. It is compiled once for every axis, with indices that
/// are constants then.
macro_rules! for_axis {
    ($axis:expr, |$a:pat_param, $b:pat_param, $n:pat_param| $result:expr) => {
        match $axis {
            Axis::X => {
                let ($a, $b, $n) = (1, 2, 0);
                $result
            }
            Axis::Y => {
                let ($a, $b, $n) = (2, 0, 1);
                $result
            }
            Axis::Z => {
                let ($a, $b, $n) = (0, 1, 2);
                $result
            }
        }
    };
}

/// One elementary transform between a parent frame and a child frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ElementaryTransform<S> {
    /// Rotation about an axis by the angle with cosine `c` and sine `s`.
    Turn {
        /// Axis.
        axis: Axis,
        /// Cosine.
        c: S,
        /// Sine.
        s: S,
    },
    /// Displacement by `r` m along an axis.
    Shift {
        /// Axis.
        axis: Axis,
        /// Displacement.
        r: S,
    },
    /// Rotation by a matrix that takes child components to parent components.
    Rotate(Mat3<S>),
}

#[inline(always)]
fn pair<S: Scalar>(c: S, s: S, x: S, y: S) -> (S, S) {
    (c * x - s * y, s * x + c * y)
}

#[inline(always)]
fn pair_back<S: Scalar>(c: S, s: S, x: S, y: S) -> (S, S) {
    (c * x + s * y, c * y - s * x)
}

#[inline(always)]
fn up3<S: Scalar>(r: &Mat3<S>, x: Vec3<S>) -> Vec3<S> {
    array(|i| r[i][0] * x[0] + r[i][1] * x[1] + r[i][2] * x[2])
}

#[inline(always)]
fn down3<S: Scalar>(r: &Mat3<S>, x: Vec3<S>) -> Vec3<S> {
    array(|i| r[0][i] * x[0] + r[1][i] * x[1] + r[2][i] * x[2])
}

fn full<S: Scalar>(m: &[S; 6]) -> Mat3<S> {
    array(|i| array(|k| m[SYM[i][k]]))
}

/// `R M Rᵀ` for a general matrix.
fn congruence<S: Scalar>(r: &Mat3<S>, m: &Mat3<S>) -> Mat3<S> {
    let rm: Mat3<S> = array(|i| down3(m, r[i]));
    array(|i| array(|k| rm[i][0] * r[k][0] + rm[i][1] * r[k][1] + rm[i][2] * r[k][2]))
}

/// Upper triangle of `R M Rᵀ` for a symmetric matrix: only six entries are formed.
fn congruence_sym<S: Scalar>(r: &Mat3<S>, m: &[S; 6]) -> [S; 6] {
    let m = full(m);
    let rm: Mat3<S> = array(|i| down3(&m, r[i]));
    let at = |i: usize, k: usize| rm[i][0] * r[k][0] + rm[i][1] * r[k][1] + rm[i][2] * r[k][2];
    [at(0, 0), at(0, 1), at(0, 2), at(1, 1), at(1, 2), at(2, 2)]
}

/// Rotation of a symmetric matrix about axis `n`; its 2×2 block is computed from `t = s (xx − yy) + 2 c xy`.
#[inline(always)]
fn turn_sym<S: Scalar>(c: S, s: S, m: &mut [S; 6], a: usize, b: usize, n: usize) {
    let (aa, ab, bb) = (SYM[a][a], SYM[a][b], SYM[b][b]);
    let t = s * (m[aa] - m[bb]) + (c + c) * m[ab];
    let st = s * t;
    let xy = c * t - m[ab];
    m[aa] = m[aa] - st;
    m[bb] = m[bb] + st;
    m[ab] = xy;
    (m[SYM[a][n]], m[SYM[b][n]]) = pair(c, s, m[SYM[a][n]], m[SYM[b][n]]);
}

/// Rotation of a general matrix about axis `n`; its 2×2 block is computed from `t = s (xx − yy) + c (xy + yx)`.
#[inline(always)]
fn turn_general<S: Scalar>(c: S, s: S, h: &mut Mat3<S>, a: usize, b: usize, n: usize) {
    let t = s * (h[a][a] - h[b][b]) + c * (h[a][b] + h[b][a]);
    let (st, ct) = (s * t, c * t);
    let (xy, yx) = (ct - h[b][a], ct - h[a][b]);
    h[a][a] = h[a][a] - st;
    h[b][b] = h[b][b] + st;
    h[a][b] = xy;
    h[b][a] = yx;
    (h[a][n], h[b][n]) = pair(c, s, h[a][n], h[b][n]);
    (h[n][a], h[n][b]) = pair(c, s, h[n][a], h[n][b]);
}

impl<S: Scalar> ElementaryTransform<S> {
    /// Components of a free vector of the parent in the child's axes.
    #[inline(always)]
    pub fn vector(&self, mut x: Vec3<S>) -> Vec3<S> {
        self.carry_vector(&mut x);
        x
    }

    /// [`ElementaryTransform::vector`] in place: numbers that stay what they are are not copied.
    #[inline(always)]
    pub fn carry_vector(&self, x: &mut Vec3<S>) {
        match self {
            ElementaryTransform::Turn { axis, c, s } => {
                for_axis!(axis, |a, b, _| (x[a], x[b]) = pair_back(*c, *s, x[a], x[b]));
            }
            ElementaryTransform::Shift { .. } => {}
            ElementaryTransform::Rotate(r) => *x = down3(r, *x),
        }
    }

    /// Components of a free vector of the child in the parent's axes.
    #[inline(always)]
    pub fn vector_back(&self, mut x: Vec3<S>) -> Vec3<S> {
        match self {
            ElementaryTransform::Turn { axis, c, s } => {
                for_axis!(axis, |a, b, _| (x[a], x[b]) = pair(*c, *s, x[a], x[b]));
            }
            ElementaryTransform::Shift { .. } => {}
            ElementaryTransform::Rotate(r) => x = up3(r, x),
        }
        x
    }

    /// Velocity `X Ω` at the child's origin, in the child's axes, of a motion `Ω` given at the parent frame.
    #[inline(always)]
    pub fn motion(&self, m: &Motion<S>) -> Motion<S> {
        let mut m = *m;
        self.carry_motion(&mut m);
        m
    }

    /// [`ElementaryTransform::motion`] in place.
    #[inline(always)]
    pub fn carry_motion(&self, m: &mut Motion<S>) {
        match self {
            ElementaryTransform::Turn { axis, c, s } => for_axis!(axis, |a, b, _| {
                (m.lin[a], m.lin[b]) = pair_back(*c, *s, m.lin[a], m.lin[b]);
                (m.ang[a], m.ang[b]) = pair_back(*c, *s, m.ang[a], m.ang[b]);
            }),
            ElementaryTransform::Shift { axis, r } => for_axis!(axis, |a, b, _| {
                m.lin[a] = m.lin[a] + *r * m.ang[b];
                m.lin[b] = m.lin[b] - *r * m.ang[a];
            }),
            ElementaryTransform::Rotate(r) => *m = Motion { lin: down3(r, m.lin), ang: down3(r, m.ang) },
        }
    }

    /// Momentum or wrench `Xᵀ P` at the parent frame, of `P` given at the child frame.
    #[inline(always)]
    pub fn force(&self, f: &Force<S>) -> Force<S> {
        let mut f = *f;
        self.carry_force(&mut f);
        f
    }

    /// [`ElementaryTransform::force`] in place.
    #[inline(always)]
    pub fn carry_force(&self, f: &mut Force<S>) {
        match self {
            ElementaryTransform::Turn { axis, c, s } => for_axis!(axis, |a, b, _| {
                (f.lin[a], f.lin[b]) = pair(*c, *s, f.lin[a], f.lin[b]);
                (f.ang[a], f.ang[b]) = pair(*c, *s, f.ang[a], f.ang[b]);
            }),
            ElementaryTransform::Shift { axis, r } => for_axis!(axis, |a, b, _| {
                f.ang[a] = f.ang[a] - *r * f.lin[b];
                f.ang[b] = f.ang[b] + *r * f.lin[a];
            }),
            ElementaryTransform::Rotate(r) => *f = Force { lin: up3(r, f.lin), ang: up3(r, f.ang) },
        }
    }

    /// Inverse of [`ElementaryTransform::force`]: a momentum or wrench given at the parent frame, at the child frame.
    pub fn force_back(&self, f: &Force<S>) -> Force<S> {
        match self {
            ElementaryTransform::Shift { axis, r } => ElementaryTransform::Shift { axis: *axis, r: -*r }.force(f),
            _ => Force { lin: self.vector(f.lin), ang: self.vector(f.ang) },
        }
    }

    /// First moment in the parent frame, kg m, of a mass `m`, kg, whose first moment in the child frame is `s`.
    #[inline(always)]
    pub fn moment(&self, m: S, s: Vec3<S>) -> Vec3<S> {
        match self {
            ElementaryTransform::Shift { axis, r } => for_axis!(axis, |_, _, n| {
                let mut s = s;
                s[n] = s[n] + m * *r;
                s
            }),
            _ => self.vector_back(s),
        }
    }

    /// The transform from the child to the parent.
    pub fn inverse(&self) -> Self {
        match self {
            ElementaryTransform::Turn { axis, c, s } => ElementaryTransform::Turn { axis: *axis, c: *c, s: -*s },
            ElementaryTransform::Shift { axis, r } => ElementaryTransform::Shift { axis: *axis, r: -*r },
            ElementaryTransform::Rotate(r) => ElementaryTransform::Rotate(array(|i| array(|k| r[k][i]))),
        }
    }

    /// Inertia `Xᵀ M X` at the parent frame, of `M` given at the child frame.
    pub fn inertia(&self, m: &ArticulatedInertia<S>) -> ArticulatedInertia<S> {
        let mut m = *m;
        self.carry_inertia(&mut m);
        m
    }

    /// [`ElementaryTransform::inertia`] in place: 21 numbers are not copied.
    pub fn carry_inertia(&self, m: &mut ArticulatedInertia<S>) {
        match self {
            ElementaryTransform::Turn { axis, c, s } => for_axis!(axis, |a, b, n| {
                turn_sym(*c, *s, &mut m.a, a, b, n);
                turn_general(*c, *s, &mut m.h, a, b, n);
                turn_sym(*c, *s, &mut m.j, a, b, n);
            }),
            ElementaryTransform::Shift { axis, r } => for_axis!(axis, |a, b, n| shift_inertia(*r, m, a, b, n)),
            ElementaryTransform::Rotate(r) => {
                m.a = congruence_sym(r, &m.a);
                m.h = congruence(r, &m.h);
                m.j = congruence_sym(r, &m.j);
            }
        }
    }

    /// A symmetric tensor `[xx, xy, xz, yy, yz, zz]` given in the child's axes, in the parent's axes.
    #[inline]
    pub fn turn_symmetric(&self, m: &[S; 6]) -> [S; 6] {
        match self {
            ElementaryTransform::Turn { axis, c, s } => {
                let mut m = *m;
                for_axis!(axis, |a, b, n| turn_sym(*c, *s, &mut m, a, b, n));
                m
            }
            ElementaryTransform::Shift { .. } => *m,
            ElementaryTransform::Rotate(r) => congruence_sym(r, m),
        }
    }

    /// Appends this transform to the pose `(R, r)` of a frame: `R` takes the frame's components to those of the
    /// reference frame, `r` is the frame's origin in the reference frame, m.
    pub fn pose(&self, rot: &mut Mat3<S>, pos: &mut Vec3<S>) {
        match self {
            ElementaryTransform::Turn { axis, c, s } => {
                let (a, b, _) = axis.cyclic();
                for row in rot.iter_mut() {
                    (row[a], row[b]) = pair_back(*c, *s, row[a], row[b]);
                }
            }
            ElementaryTransform::Shift { axis, r } => {
                let (_, _, n) = axis.cyclic();
                for (x, row) in pos.iter_mut().zip(rot.iter()) {
                    *x = *x + *r * row[n];
                }
            }
            ElementaryTransform::Rotate(m) => {
                for row in rot.iter_mut() {
                    *row = down3(m, *row);
                }
            }
        }
    }
}

/// `H'a* = Ha* − r A b*`, `H'b* = Hb* + r A a*`, then `J` from the old and the new `H`. No product is computed twice.
#[inline(always)]
fn shift_inertia<S: Scalar>(r: S, m: &mut ArticulatedInertia<S>, a: usize, b: usize, n: usize) {
    let old = m.h;
    let (h, j) = (&mut m.h, &mut m.j);
    for k in 0..3 {
        h[a][k] = old[a][k] - r * m.a[SYM[b][k]];
        h[b][k] = old[b][k] + r * m.a[SYM[a][k]];
    }
    j[SYM[a][n]] = j[SYM[a][n]] - r * old[n][b];
    j[SYM[b][n]] = j[SYM[b][n]] + r * old[n][a];
    j[SYM[a][a]] = j[SYM[a][a]] - r * (old[a][b] + h[a][b]);
    j[SYM[b][b]] = j[SYM[b][b]] + r * (old[b][a] + h[b][a]);
    j[SYM[a][b]] = j[SYM[a][b]] + r * (old[a][a] - h[b][b]);
}

/// Rotation matrix of a unit quaternion `(x, y, z, w)`, from child components to parent components (A.55).
pub fn quaternion_matrix<S: Scalar>(q: [S; 4]) -> Mat3<S> {
    let [x, y, z, w] = q;
    let (x2, y2, z2) = (x + x, y + y, z + z);
    let (xx, yy, zz) = (x * x2, y * y2, z * z2);
    let (xy, xz, yz) = (x * y2, x * z2, y * z2);
    let (wx, wy, wz) = (w * x2, w * y2, w * z2);
    let one = S::one();
    [[one - (yy + zz), xy - wz, xz + wy], [xy + wz, one - (xx + zz), yz - wx], [xz - wy, yz + wx, one - (xx + yy)]]
}

/// Rate, 1/s, of a unit quaternion whose frame rotates with angular velocity `w`, rad/s, in its own axes (A.58).
pub fn quaternion_rate<S: Scalar>(q: [S; 4], w: Vec3<S>) -> [S; 4] {
    let half = S::constant(0.5);
    let v = cross([q[0], q[1], q[2]], w);
    [
        half * (q[3] * w[0] + v[0]),
        half * (q[3] * w[1] + v[1]),
        half * (q[3] * w[2] + v[2]),
        -(half * (q[0] * w[0] + q[1] * w[1] + q[2] * w[2])),
    ]
}
