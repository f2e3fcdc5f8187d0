//! Trees that the build script generates code for; it and the test that runs the code both read this file.

use mbd_codegen::generate::{Arithmetic, Options, Precision};
use mbd_codegen::model::Model;
use mbd_codegen::Group;

use crate::random::{random_model, Knobs, Rng};

/// Number of trees: as many as compile in well under a minute.
pub const TREES: u64 = 40;

/// Every fourth tree is generated in single precision.
pub fn is_single(k: u64) -> bool {
    k % 4 == 3
}

/// Tree `k` and how code is made for it.
pub fn tree(k: u64) -> (Model, Options) {
    let seed = 5000 + k;
    let mut rng = Rng::new(seed, 5);
    let options = Options {
        arithmetic: Arithmetic::Exact,
        type_name: "Tree".to_string(),
        outputs: Group::ALL.to_vec(),
        precision: if is_single(k) { Precision::F32 } else { Precision::F64 },
        efforts: rng.chance(0.8),
        ..Options::default()
    };
    (random_model(seed, &Knobs::everything(seed, 2 + k as usize % 4)), options)
}
