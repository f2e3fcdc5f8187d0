//! States in the order and representation of other programs ("there"), and their conversion to this project's ("here").
//!
//! Velocities, momenta and joint forces are permuted. Coordinates are also converted where the other program represents
//! a rotation differently. Both layouts describe the same frames, so that nothing else changes.

use alloc::vec::Vec;

use crate::spatial::{quaternion_matrix, ElementaryTransform};
use crate::system::Real;

/// How another program stores the coordinates of one joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// As in this project.
    Same {
        /// Number of coordinates and of velocities.
        n: usize,
    },
    /// An angle as cosine and sine (Pinocchio, unbounded revolute joints).
    CosSin,
    /// x, y, cosine, sine (Pinocchio, planar joints).
    PlanarCosSin,
    /// Unit quaternion x, y, z, w, as here.
    Quaternion,
    /// Unit quaternion w, x, y, z (MuJoCo).
    QuaternionWxyz,
    /// Position, quaternion x, y, z, w, velocities in body axes, as here (Pinocchio).
    Floating,
    /// Position, quaternion w, x, y, z, linear velocity in the parent's axes, angular velocity in body axes (MuJoCo).
    FloatingWorld,
}

impl Form {
    /// Number of coordinates here, number of coordinates there, number of velocities.
    pub fn sizes(self) -> (usize, usize, usize) {
        match self {
            Form::Same { n } => (n, n, n),
            Form::CosSin => (1, 2, 1),
            Form::PlanarCosSin => (3, 4, 3),
            Form::Quaternion | Form::QuaternionWxyz => (4, 4, 3),
            Form::Floating | Form::FloatingWorld => (7, 7, 6),
        }
    }
}

/// The place of one joint in both layouts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Representation there.
    pub form: Form,
    /// Index of the first coordinate, here and there.
    pub q: (usize, usize),
    /// Index of the first velocity, here and there.
    pub v: (usize, usize),
}

/// A correspondence of states in two layouts.
///
/// The slices that are converted must have the lengths of their layouts. Entries that no joint refers to are not
/// changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Joints.
    pub parts: Vec<Part>,
}

fn copy<S: Copy>(from: &[S], at: usize, to: &mut [S], place: usize, n: usize) {
    if let (Some(from), Some(to)) = (from.get(at..at + n), to.get_mut(place..place + n)) {
        to.copy_from_slice(from);
    }
}

impl Layout {
    /// Number of coordinates and velocities there.
    pub fn sizes(&self) -> (usize, usize) {
        let sizes = self.parts.iter().map(|p| p.form.sizes());
        sizes.fold((0, 0), |(q, v), (_, nq, nv)| (q + nq, v + nv))
    }

    /// Converts coordinates from there to here. An angle that is stored as cosine and sine is returned in (−π, π] rad.
    pub fn q_from(&self, there: &[f64], here: &mut [f64]) {
        for part in &self.parts {
            let (at, to) = (part.q.1, part.q.0);
            let (n, _, _) = part.form.sizes();
            match part.form {
                Form::Same { .. } | Form::Quaternion | Form::Floating => copy(there, at, here, to, n),
                Form::CosSin => here[to] = libm::atan2(there[at + 1], there[at]),
                Form::PlanarCosSin => {
                    copy(there, at, here, to, 2);
                    here[to + 2] = libm::atan2(there[at + 3], there[at + 2]);
                }
                Form::QuaternionWxyz => {
                    copy(there, at + 1, here, to, 3);
                    here[to + 3] = there[at];
                }
                Form::FloatingWorld => {
                    copy(there, at, here, to, 3);
                    copy(there, at + 4, here, to + 3, 3);
                    here[to + 6] = there[at + 3];
                }
            }
        }
    }

    /// Converts coordinates from here to there.
    pub fn q_to(&self, here: &[f64], there: &mut [f64]) {
        for part in &self.parts {
            let (at, to) = part.q;
            let (n, _, _) = part.form.sizes();
            match part.form {
                Form::Same { .. } | Form::Quaternion | Form::Floating => copy(here, at, there, to, n),
                Form::CosSin => (there[to + 1], there[to]) = crate::trig::sincos_f64(here[at]),
                Form::PlanarCosSin => {
                    copy(here, at, there, to, 2);
                    (there[to + 3], there[to + 2]) = crate::trig::sincos_f64(here[at + 2]);
                }
                Form::QuaternionWxyz => {
                    copy(here, at, there, to + 1, 3);
                    there[to] = here[at + 3];
                }
                Form::FloatingWorld => {
                    copy(here, at, there, to, 3);
                    copy(here, at + 3, there, to + 4, 3);
                    there[to + 3] = here[at + 6];
                }
            }
        }
    }

    /// Converts coordinate rates from here to there; `q` are the coordinates here.
    pub fn qd_to(&self, q: &[f64], here: &[f64], there: &mut [f64]) {
        self.q_to(here, there);
        for part in &self.parts {
            let (at, to) = part.q;
            let shift = match part.form {
                Form::CosSin => 0,
                Form::PlanarCosSin => 2,
                _ => continue,
            };
            let (s, c) = crate::trig::sincos_f64(q[at + shift]);
            let rate = here[at + shift];
            there[to + shift] = -s * rate;
            there[to + shift + 1] = c * rate;
        }
    }

    /// Converts velocities, momenta or joint forces from there to here; `q` are the coordinates here.
    pub fn v_from(&self, q: &[f64], there: &[f64], here: &mut [f64]) {
        for part in &self.parts {
            let (_, _, n) = part.form.sizes();
            copy(there, part.v.1, here, part.v.0, n);
            if part.form == Form::FloatingWorld {
                turn(q, part, &mut here[part.v.0..], ElementaryTransform::vector);
            }
        }
    }

    /// Converts velocities, momenta or joint forces from here to there; `q` are the coordinates here.
    pub fn v_to(&self, q: &[f64], here: &[f64], there: &mut [f64]) {
        for part in &self.parts {
            let (_, _, n) = part.form.sizes();
            copy(here, part.v.0, there, part.v.1, n);
            if part.form == Form::FloatingWorld {
                turn(q, part, &mut there[part.v.1..], ElementaryTransform::vector_back);
            }
        }
    }
}

/// Transforms the first three numbers between the body axes and the parent's axes of a floating joint.
fn turn<S: Real>(q: &[S], part: &Part, x: &mut [S], by: impl Fn(&ElementaryTransform<S>, [S; 3]) -> [S; 3]) {
    let at = part.q.0 + 3;
    let step = ElementaryTransform::Rotate(quaternion_matrix([q[at], q[at + 1], q[at + 2], q[at + 3]]));
    let turned = by(&step, [x[0], x[1], x[2]]);
    x[..3].copy_from_slice(&turned);
}
