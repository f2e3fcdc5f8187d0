//! Spatial algebra in six dimensions: `[linear; angular]`, in body axes, taken at the frame origin.
//!
//! A transform stays factored into elementary transforms (a rotation about one axis, a displacement along one axis, or
//! a full rotation). They are applied one by one, which keeps the zeros of the operands; a product with a 6×6 matrix
//! would lose them.

mod inertia;
mod vector;
mod xform;

pub use inertia::{ArticulatedInertia, RigidInertia, SYM};
pub use vector::{add3, cross, dot3, dot4, scale3, Force, Motion, Vec3};
pub use xform::{quaternion_matrix, quaternion_rate, Axis, ElementaryTransform};

/// A 3×3 matrix, row by row.
pub type Mat3<S> = [[S; 3]; 3];
