//! Trees for which the build script of `testing/compiled` generates code.

use mbd_codegen::generate::{Arithmetic, Options, Precision};
use mbd_codegen::model::Model;
use mbd_codegen::options::PlanOptions;
use mbd_codegen::{Output, RolledCode};

use crate::branches::{centipede, Numbers};
use crate::random::{random_model, Distribution, Rng};

/// Number of trees.
pub const TREES: u64 = 33;

/// From this index on, the trees are chains with rolled code wherever links repeat.
pub const FIRST_CHAIN: u64 = 28;

/// A chain whose links have legs, in a loop whose body reads and writes so much that all of it is in one array.
const CENTIPEDE: u64 = 32;

/// Every fourth tree is generated in single precision.
pub fn is_single(k: u64) -> bool {
    k % 4 == 3
}

/// Whether lanes and batches of tree `k` are compared with single states. The compiler makes them anew for every set of
/// vector instructions.
pub fn has_lanes(k: u64) -> bool {
    k.is_multiple_of(3) || k >= FIRST_CHAIN
}

/// The outputs of tree `k`: those that lanes have, and of the others every third, in turn. All of them, on many more
/// trees, run as text (`tests/code/bitwise.rs`); here it matters that the compiler reads the text in the same way.
/// Derivatives of large trees are left out, because their code grows with the square of the number of velocities.
fn outputs(k: u64, velocities: usize) -> Vec<Output> {
    let always = [Output::Rates, Output::Momenta, Output::Energy, Output::MassMatrix];
    if k == CENTIPEDE {
        return always.to_vec();
    }
    let in_turn = Output::available(false).filter(|output| !always.contains(output)).enumerate();
    let chosen = in_turn.filter(|(n, output)| {
        let is_large = output.name().ends_with("derivatives") && velocities > 8;
        (*n as u64 + k).is_multiple_of(3) && !is_large
    });
    always.into_iter().chain(chosen.map(|(_, output)| output)).collect()
}

/// Tree `k` and the options of its code.
pub fn tree(k: u64) -> (Model, Options) {
    let seed = 5000 + k;
    let mut rng = Rng::new(seed, 5);
    let efforts = rng.chance(0.8);
    let (distribution, rolled) = match k.checked_sub(FIRST_CHAIN) {
        Some(chain) => (self::chain(chain), RolledCode::Always),
        None => (Distribution::everything(seed, 2 + k as usize % 4), RolledCode::Auto),
    };
    let model = match k {
        CENTIPEDE => centipede(4, 4, 3, Numbers::Different),
        _ => random_model(seed, &distribution),
    };
    let velocities: usize = model.joints.iter().map(|joint| joint.kind.nv()).sum();
    let options = Options {
        arithmetic: Arithmetic::Exact,
        type_name: "Tree".to_string(),
        outputs: outputs(k, velocities),
        precision: if is_single(k) { Precision::F32 } else { Precision::F64 },
        efforts,
        plan: PlanOptions { rolled, ..PlanOptions::default() },
        ..Options::default()
    };
    (model, options)
}

/// Chains of revolute joints, of revolute joints at right angles with springs and dampers, of spherical joints, and of
/// revolute joints again.
fn chain(k: u64) -> Distribution {
    let n = 7 - k as usize;
    let mut kinds = [0.0; 9];
    kinds[if k == 2 { 6 } else { 0 }] = 1.0;
    let plain = Distribution { bodies: (n, n), taper: 1.0, kinds, ..Distribution::default() };
    match k {
        1 => Distribution { skew: 0.0, damping: 1.0, springs: 1.0, armature: 1.0, gravity: [0.0, 0.0, 1.0], ..plain },
        _ => plain,
    }
}
