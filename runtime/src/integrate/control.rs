//! The choice of the steps of a run, and its limits.

use crate::error::StepError;

/// Allowed error of a component `y` in one step: `absolute + relative · |y|`. Where that is zero, the component is not
/// controlled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Absolute part, in the unit of the component.
    pub absolute: f64,
    /// Part relative to the size of the component.
    pub relative: f64,
}

/// Allowed errors of a step, by group of components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Coordinates, rad and m.
    pub coordinates: Tolerance,
    /// Rotations by quaternions: tangent vector, rad.
    pub rotations: f64,
    /// Momenta. The size of a momentum counts as at least a thousandth of the largest one since the motion began: where it
    /// comes to rest, nothing but rounding errors is left of it.
    pub momenta: Tolerance,
    /// The errors by which the step is chosen.
    pub control: Control,
}

/// The errors by which the step is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// The errors of coordinates and momenta.
    Full,
    /// The errors of coordinates alone: table 7.3 of the thesis. Momenta follow from the coordinates' history anyway,
    /// and where they have small fast parts this saves steps.
    Coordinates,
}

impl Tolerances {
    /// One tolerance for all components: rad and m for coordinates and rotations, relative to the size for momenta.
    pub const fn new(tolerance: f64) -> Self {
        Tolerances {
            coordinates: Tolerance { absolute: tolerance, relative: 0.0 },
            rotations: tolerance,
            momenta: Tolerance { absolute: 0.0, relative: tolerance },
            control: Control::Full,
        }
    }

    /// Whether they limit the error of something: none is negative or not a number, and one of those by which the step is chosen
    /// is greater than zero.
    pub(super) fn control_errors(&self) -> bool {
        let coordinates = [self.coordinates.absolute, self.coordinates.relative, self.rotations];
        let momenta = [self.momenta.absolute, self.momenta.relative];
        let full = self.control == Control::Full;
        coordinates.iter().chain(&momenta).all(|x| *x >= 0.0)
            && (coordinates.iter().any(|x| *x > 0.0) || full && momenta.iter().any(|x| *x > 0.0))
    }

    /// These tolerances, with steps chosen by the errors of the coordinates alone.
    pub const fn coordinates_only(self) -> Self {
        Tolerances { control: Control::Coordinates, ..self }
    }
}

/// The choice of the step size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// A fixed step, s; the last step before the end may be shorter.
    Fixed(f64),
    /// Chosen by the error, which these tolerances limit.
    Adaptive(Tolerances),
}

/// Limits of the work.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Limits {
    /// Smallest step, s; steps that would not change the time, or are below 1e-15 s, are too small in any case.
    pub min_step: f64,
    /// Largest step, s.
    pub max_step: f64,
    /// First step, s; with zero, it is chosen from the rates.
    pub first_step: f64,
    /// Steps of one call, rejected ones included.
    pub steps: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { min_step: 0.0, max_step: f64::INFINITY, first_step: 0.0, steps: u64::MAX }
    }
}

impl Limits {
    /// Takes one of the steps that are `left` of a call, at time `time` (s).
    ///
    /// # Errors
    /// [`StepError::TooManySteps`] if none is left.
    pub(crate) fn spend(&self, left: &mut u64, time: f64) -> Result<(), StepError> {
        *left = left.checked_sub(1).ok_or(StepError::TooManySteps { time, steps: self.steps })?;
        Ok(())
    }
}
