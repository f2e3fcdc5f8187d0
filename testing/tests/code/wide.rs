//! Measurement of rounding errors: double-double numbers as a scalar, and errors of many states.
//!
//! Sines and cosines are those that programs on doubles compute, rounded to 53 bits. They are the same for every
//! elimination, and another test keeps their own errors within an ulp; the roundings after them are measured here.

use mbd_codegen::model::Model;
use mbd_codegen::read::{self, Base, ImportOptions};
pub use mbd_codegen::search::Wide;
use mbd_runtime::Scalar;

/// Models of the project, each with the connection of its base to the ground.
pub const MODELS: [(&str, Base); 11] = [
    ("double_pendulum.toml", Base::Fixed),
    ("spherical_pendulum.toml", Base::Fixed),
    ("satellite.toml", Base::Fixed),
    ("chain6.toml", Base::Fixed),
    ("chain10_planar.toml", Base::Fixed),
    ("ur5.urdf", Base::Fixed),
    ("panda_arm.urdf", Base::Fixed),
    ("panda.urdf", Base::Fixed),
    ("iiwa14.urdf", Base::Fixed),
    ("solo12.urdf", Base::Floating),
    ("g1.urdf", Base::Floating),
];

/// One of [`MODELS`].
pub fn model(file: &str, base: Base) -> Model {
    let path = format!("{}/../models/{file}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("the model");
    read::model(file, &text, &ImportOptions { base, ..ImportOptions::default() })
        .unwrap_or_else(|findings| panic!("{findings}"))
        .model
}

/// Errors of one array of results in many states.
///
/// The error of a state is the largest error in the array, relative to the largest entry of the array. If this entry is
/// smaller than a tenth of its median over all states, the error is relative to that tenth instead. Otherwise the worst
/// of all states would be the one in which the array is nearest to zero, and its error would be that of a single
/// rounding.
#[derive(Clone, Default)]
pub struct Errors {
    off: Vec<f64>,
    size: Vec<f64>,
}

impl Errors {
    /// Adds a state.
    pub fn add(&mut self, results: &[f64], reference: &[Wide]) {
        let size = reference.iter().fold(0.0_f64, |m, x| m.max(x.0.hi().abs()));
        let difference = |(r, w): (&f64, &Wide)| (*w - Wide::constant(*r)).0.hi().abs();
        let off = results.iter().zip(reference).map(difference).fold(0.0_f64, f64::max);
        assert!(results.iter().all(|x| x.is_finite()));
        self.size.push(size);
        self.off.push(off);
    }

    /// The median of the largest entries.
    pub fn typical(&self) -> f64 {
        let mut sizes = self.size.clone();
        sizes.sort_by(f64::total_cmp);
        sizes[sizes.len() / 2]
    }

    /// The errors of all states, smallest first.
    pub fn sorted(&self) -> Vec<f64> {
        let least = (0.1 * self.typical()).max(f64::MIN_POSITIVE);
        let mut errors: Vec<f64> = self.off.iter().zip(&self.size).map(|(off, size)| off / size.max(least)).collect();
        errors.sort_by(f64::total_cmp);
        errors
    }
}

/// Number of states from which on their worst error is not a matter of chance.
pub const MANY: u64 = 10_000;

/// Errors of many states in two numbers, each at least two roundings.
///
/// For fewer than [`MANY`] states, `worst` is the error that 99 of 100 states stay below. The largest error of few
/// states is that of one state, which another order of the same operations makes three times as large or as small by
/// chance.
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The worst error, or the error that 99 of 100 states stay below.
    pub worst: f64,
}

impl Spread {
    /// The spread of some errors.
    pub fn new(errors: &Errors) -> Spread {
        let e = errors.sorted();
        let last = if e.len() < MANY as usize { (e.len() - 1) * 99 / 100 } else { e.len() - 1 };
        let above = |k: usize| e[k].max(f64::EPSILON);
        Spread { median: above(e.len() / 2), worst: above(last) }
    }

    /// The larger median and the larger worst error of two spreads.
    pub fn larger(self, other: Spread) -> Spread {
        Spread { median: self.median.max(other.median), worst: self.worst.max(other.worst) }
    }

    /// This spread in multiples of another.
    pub fn times(self, other: Spread) -> Spread {
        Spread { median: self.median / other.median, worst: self.worst / other.worst }
    }

    /// Whether multiples are within the limits: 2 for medians, 3 for the worst.
    pub fn within_limits(self) -> bool {
        self.median <= 2.0 && self.worst <= 3.0
    }
}
