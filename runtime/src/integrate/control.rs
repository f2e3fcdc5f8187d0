//! How the steps of a run are chosen, and what bounds them.

/// Allowed error of a component `y` in one step: `absolute + relative · |y|`. Where that is zero nothing is controlled.
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
    /// Momenta. The size of a momentum counts as at least a thousandth of the largest one.
    pub momenta: Tolerance,
    /// Which errors the step is chosen by.
    pub control: Control,
}

/// Which errors the step is chosen by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// The errors of coordinates and momenta.
    Full,
    /// The errors of coordinates alone: table 7.3 of the thesis. Momenta follow from the coordinates' history anyway, and where
    /// they have small fast parts this saves steps.
    Coordinates,
}

impl Tolerances {
    /// One number for all: rad and m for coordinates and rotations, relative to the size for momenta.
    pub const fn new(tolerance: f64) -> Self {
        Tolerances {
            coordinates: Tolerance { absolute: tolerance, relative: 0.0 },
            rotations: tolerance,
            momenta: Tolerance { absolute: 0.0, relative: tolerance },
            control: Control::Full,
        }
    }

    /// These tolerances, with steps chosen by the errors of the coordinates alone.
    pub const fn coordinates_only(self) -> Self {
        Tolerances { control: Control::Coordinates, ..self }
    }
}

/// How the size of steps is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Always this many seconds, but for the last one before the end.
    Fixed(f64),
    /// Chosen by the error, which these tolerances limit.
    Adaptive(Tolerances),
}

/// Bounds of the work.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Limits {
    /// Smallest step, s; zero: where the time would no longer change.
    pub min_step: f64,
    /// Largest step, s.
    pub max_step: f64,
    /// First step, s; zero: chosen from the rates.
    pub first_step: f64,
    /// Steps of one call, rejected ones included.
    pub steps: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { min_step: 0.0, max_step: f64::INFINITY, first_step: 0.0, steps: u64::MAX }
    }
}
