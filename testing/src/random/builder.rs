//! State of the construction of a random model. The methods of [`Builder`] are in the modules whose parts they make.

use mbd_codegen::model::{Param, Value};

use super::distribution::Distribution;
use super::rng::Rng;

/// State of the construction of a model.
pub struct Builder<'k> {
    /// Random numbers.
    pub rng: Rng,
    /// Probabilities and ranges.
    pub distribution: &'k Distribution,
    /// Parameters so far.
    pub params: Vec<Param>,
}

/// The tree; parents come before their children.
pub struct Skeleton {
    /// Parent of each body.
    pub parent: Vec<Option<usize>>,
    /// Number of bodies between each body and the ground.
    pub depth: Vec<i32>,
}

impl Builder<'_> {
    /// A constant, or a parameter with this default.
    pub fn value(&mut self, x: f64) -> Value {
        if !self.rng.chance(self.distribution.params) {
            return Value::Const(x);
        }
        let k = self.params.len();
        self.params.push(Param { name: format!("n{k}"), default: x });
        Value::Param(k)
    }

    /// As [`Builder::value`], except that zero is always a constant.
    pub fn value_or_zero(&mut self, x: f64) -> Value {
        if x == 0.0 {
            Value::ZERO
        } else {
            self.value(x)
        }
    }
}
