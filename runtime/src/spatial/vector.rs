//! Three- and six-dimensional vectors.

use crate::Scalar;

/// Three components x, y, z.
pub type Vec3<S> = [S; 3];

/// `a × b`.
pub fn cross<S: Scalar>(a: Vec3<S>, b: Vec3<S>) -> Vec3<S> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a · b`.
pub fn dot3<S: Scalar>(a: Vec3<S>, b: Vec3<S>) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a + b`.
pub fn add3<S: Scalar>(a: Vec3<S>, b: Vec3<S>) -> Vec3<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `s a`.
pub fn scale3<S: Scalar>(s: S, a: Vec3<S>) -> Vec3<S> {
    [s * a[0], s * a[1], s * a[2]]
}

/// A spatial velocity or acceleration at the frame origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<S> {
    /// Linear part, m/s or m/s².
    pub lin: Vec3<S>,
    /// Angular part, rad/s or rad/s².
    pub ang: Vec3<S>,
}

/// A spatial momentum (N s, N m s) or wrench (N, N m) at the frame origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Force<S> {
    /// Linear part.
    pub lin: Vec3<S>,
    /// Angular part, moment about the frame origin.
    pub ang: Vec3<S>,
}

/// Components and sums, which motions and forces have in common. They are two types, because they transform
/// differently.
macro_rules! six_components {
    ($name:ident) => {
        impl<S: Scalar> $name<S> {
            /// All components zero.
            pub fn zero() -> Self {
                $name { lin: [S::zero(); 3], ang: [S::zero(); 3] }
            }

            /// Component `k`: 0–2 linear, 3–5 angular.
            #[inline(always)]
            pub fn get(&self, k: usize) -> S {
                if k < 3 {
                    self.lin[k]
                } else {
                    self.ang[k - 3]
                }
            }

            /// Component `k`, for changing it: 0–2 linear, 3–5 angular.
            #[inline(always)]
            pub fn get_mut(&mut self, k: usize) -> &mut S {
                if k < 3 {
                    &mut self.lin[k]
                } else {
                    &mut self.ang[k - 3]
                }
            }

            /// Sum.
            pub fn plus(&self, o: &Self) -> Self {
                $name { lin: add3(self.lin, o.lin), ang: add3(self.ang, o.ang) }
            }
        }
    };
}

six_components!(Motion);
six_components!(Force);

impl<S: Scalar> Motion<S> {
    /// `Ω × V`: rate of the components of a motion `V` carried by a frame that moves with `Ω` (D.21).
    pub fn cross_motion(&self, o: &Self) -> Self {
        Motion { lin: add3(cross(self.ang, o.lin), cross(self.lin, o.ang)), ang: cross(self.ang, o.ang) }
    }

    /// `Ω × P = [ω × p_l; v × p_l + ω × p_a]` on momenta and wrenches (3.36).
    pub fn cross_force(&self, p: &Force<S>) -> Force<S> {
        Force { lin: cross(self.ang, p.lin), ang: add3(cross(self.lin, p.lin), cross(self.ang, p.ang)) }
    }
}

impl<S: Scalar> Force<S> {
    /// Difference.
    pub fn minus(&self, o: &Self) -> Self {
        self.plus(&o.times(-S::one()))
    }

    /// Multiple.
    pub fn times(&self, s: S) -> Self {
        Force { lin: scale3(s, self.lin), ang: scale3(s, self.ang) }
    }

    /// `F · Ω`: the power of a wrench, W, or twice the kinetic energy of a momentum, J.
    pub fn dot(&self, v: &Motion<S>) -> S {
        dot3(self.lin, v.lin) + dot3(self.ang, v.ang)
    }
}

/// Sum of the products of up to four components.
pub fn dot4<S: Scalar>(a: &[S], b: &[S]) -> S {
    a.iter().zip(b).fold(S::zero(), |sum, (a, b)| sum + *a * *b)
}
