//! Random mechanisms for the tests of the project: generator, states, and a writer of the TOML format.

pub mod random;
pub mod state;
pub mod toml;

use mbd_codegen::model::Value;

/// A number of the model at given parameters.
pub fn value(v: Value, params: &[f64]) -> f64 {
    match v {
        Value::Const(x) => x,
        Value::Param(k) => params[k],
    }
}
