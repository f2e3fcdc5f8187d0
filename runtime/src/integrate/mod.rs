//! Integrators of [`System`]s. No allocation in a step.

pub(crate) mod constant;
mod rk4;
pub mod tableau;

pub use constant::{decimal, ratio, Constant};
pub use rk4::Rk4;

use crate::spatial::dot4;
use crate::system::{Real, System};
use crate::Scalar;

/// A step that must not be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepError {
    /// A coordinate or momentum is infinite or not a number after the step.
    NotFinite {
        /// Time at the start of the step, s.
        time: f64,
        /// Index into `q`, then on into `p`.
        index: usize,
    },
    /// A quaternion has left the unit sphere by far more than a step of a sound size can move it.
    Quaternion {
        /// Time at the start of the step, s.
        time: f64,
        /// Index of its first component.
        index: usize,
        /// Its norm.
        norm: f64,
    },
}

impl core::fmt::Display for StepError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            StepError::NotFinite { time, index } => {
                write!(f, "state component {index} is not finite after the step from t = {time} s: reduce the step")
            }
            StepError::Quaternion { time, index, norm } => {
                write!(f, "quaternion at q[{index}] has norm {norm} after the step from t = {time} s: reduce the step")
            }
        }
    }
}

impl core::error::Error for StepError {}

/// Scales every quaternion back to the unit sphere and checks that all numbers are finite.
fn settle<Y>(system: &Y, time: Y::Scalar, q: &mut Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError>
where
    Y: System,
    Y::Scalar: Real,
{
    let q = q.as_mut();
    if let Some(index) = q.iter().chain(p.as_ref()).position(|x| !x.is_finite()) {
        return Err(StepError::NotFinite { time: time.to_f64(), index });
    }
    for &index in system.quaternions() {
        let Some(quaternion) = q.get_mut(index..index + 4) else { continue };
        let norm = dot4(quaternion, quaternion).sqrt();
        let half = Y::Scalar::constant(0.5);
        if !(norm > half && norm < Y::Scalar::constant(2.0)) {
            return Err(StepError::Quaternion { time: time.to_f64(), index, norm: norm.to_f64() });
        }
        let scale = Y::Scalar::one() / norm;
        for x in quaternion {
            *x = *x * scale;
        }
    }
    Ok(())
}
