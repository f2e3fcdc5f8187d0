//! Like branches of one node that are computed together, against the interpreter.
//!
//! In exact arithmetic the operations are those of the sweeps, and what branches hand to their parent is added in the
//! order of the interpreter: results are the same bit for bit. In fast arithmetic the errors are small, and code that
//! computes one branch after the other (for several states) has the bits of code that computes all at once.

use std::fmt::Write;

use mbd_codegen::generate::trace;
use mbd_codegen::model::Model;
use mbd_codegen::options::{EliminationStrategy, LikeBranches, PlanOptions};
use mbd_codegen::plan::Plan;
use mbd_codegen::read::{self, Base, ImportOptions};
use mbd_codegen::rolled::{together, Vectors};
use mbd_codegen::{search, Arithmetic, Options, Output};
use mbd_testing::assert_same_bits;
use mbd_testing::random::Rng;
use mbd_testing::state::random_state;

use crate::wide;

/// How the numbers of the branches of a body differ.
#[derive(Clone, Copy, Debug)]
enum Numbers {
    Same,
    /// The second is the mirror image of the first, and so on.
    Mirrored,
    Different,
    /// Some of one branch's are zero.
    ZerosInOne,
}

const NUMBERS: [Numbers; 4] = [Numbers::Same, Numbers::Mirrored, Numbers::Different, Numbers::ZerosInOne];

const KINDS: [&str; 4] = ["revolute", "prismatic", "spherical", "universal"];

/// One body with its joint.
fn body(text: &mut String, name: &str, parent: &str, kind: &str, rng: &mut Rng, scale: [f64; 3]) {
    let mut vector = |size: f64| scale.map(|s| s * (size + rng.around(0.5 * size)));
    let (xyz, com) = (vector(0.3), vector(0.1));
    let mass = 1.0 + 0.5 * scale[1].abs();
    let axis = match kind {
        "revolute" | "prismatic" => "axis = [0, 1, 0]\n".to_string(),
        _ => String::new(),
    };
    let _ = writeln!(
        text,
        "[[body]]\nname = \"{name}\"\nmass = {mass}\ncom = {com:?}\ninertia = [0.02, 0.03, 0.04]\n\n[[joint]]\nname = \
         \"j_{name}\"\ntype = \"{kind}\"\nparent = \"{parent}\"\nchild = \"{name}\"\nxyz = {xyz:?}\n{axis}"
    );
}

/// A floating body with two to six like branches, a branch that is like none, and branches on branches.
fn tree(seed: u64, numbers: Numbers) -> Model {
    let mut rng = Rng::new(seed, 3);
    let mut text =
        "name = \"tree\"\ngravity = [0, 0, -9.81]\n\n[[body]]\nname = \"trunk\"\nmass = 5.0\ncom = [0.1, 0, \
                    0.02]\ninertia = [0.2, 0.3, 0.4]\n\n[[joint]]\nname = \"base\"\ntype = \"floating\"\nchild = \
                    \"trunk\"\n\n"
            .to_string();
    let (branches, length) = (2 + rng.below(5), 1 + rng.below(4));
    let kinds: Vec<&str> = (0..length).map(|_| if rng.chance(0.7) { "revolute" } else { rng.pick(&KINDS) }).collect();
    let fingers = rng.chance(0.3);
    for branch in 0..branches {
        let mut own = match numbers {
            Numbers::Different => Rng::new(seed, 20 + branch as u64),
            _ => Rng::new(seed, 20),
        };
        let scale = match numbers {
            Numbers::Mirrored if branch % 2 == 1 => [1.0, -1.0, 1.0],
            Numbers::ZerosInOne if branch == 1 => [1.0, 0.0, 1.0],
            Numbers::Same | Numbers::Mirrored | Numbers::Different | Numbers::ZerosInOne => [1.0; 3],
        };
        let mut parent = "trunk".to_string();
        for (k, kind) in kinds.iter().enumerate() {
            let name = format!("b{branch}_{k}");
            body(&mut text, &name, &parent, kind, &mut own, scale);
            parent = name;
        }
        for finger in 0..if fingers { 2 } else { 0 } {
            body(&mut text, &format!("f{branch}_{finger}"), &parent, "revolute", &mut own, scale);
        }
        if branch == 1 {
            body(&mut text, "odd", "trunk", "prismatic", &mut rng, [1.0; 3]);
        }
    }
    let options = ImportOptions::default();
    read::model("tree.toml", &text, &options).unwrap_or_else(|findings| panic!("{findings}\n{text}")).model
}

fn options(arithmetic: Arithmetic, elimination: EliminationStrategy) -> Options {
    let branches = LikeBranches::Together;
    let plan = PlanOptions { elimination, branches, ..PlanOptions::default() };
    Options { arithmetic, plan, ..Options::default() }
}

/// Compares all outputs that compute like branches together with the interpreter. Returns the number of branches in the
/// sets of the rates.
fn compare(what: &str, model: &Model, plan: &Plan, options: &Options) -> usize {
    let s = random_state(plan, 7);
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let mut i = s.interpreter(plan);
    let (mut p, mut v, mut qd, mut pd, mut a) =
        (vec![0.0; nv], vec![0.0; nv], vec![0.0; nq], vec![0.0; nv], vec![0.0; nv]);
    i.momenta(&s.q, &s.v, &mut p);
    i.accelerations(&s.q, &s.v, &mut a);
    let mut branches = 0;
    for output in Output::available(false) {
        let Some(both) = together(plan, output, options) else { continue };
        let expected = match output {
            Output::Rates => {
                i.rates(&s.q, &p, &mut v, &mut qd, &mut pd);
                branches = both.program.program.loops.iter().map(|l| l.branches.len()).sum();
                [qd.as_slice(), &pd].concat()
            }
            Output::Velocities => s.v.clone(),
            Output::Momenta => p.clone(),
            Output::Accelerations => a.clone(),
            Output::InverseDynamics => {
                i.inverse_dynamics(&s.q, &s.v, &a, &mut v);
                v.clone()
            }
            Output::Bias => {
                i.bias(&s.q, &s.v, &mut v);
                v.clone()
            }
            other => panic!("{what}: {other:?} adds up over all nodes in order"),
        };
        let expected = if output == Output::Velocities {
            i.velocities(&s.q, &p, &mut v);
            v.clone()
        } else {
            expected
        };
        let given = s.inputs_of(&both.inputs, &p, &a);
        for fused in [|a: f64, b: f64, c: f64| a * b + c, |a: f64, b: f64, c: f64| a.mul_add(b, c)] {
            let results = both.program.program.evaluate(&given, fused);
            let apart = both.program.apart.evaluate(&given, fused);
            assert_same_bits(what, &format!("{output:?}, apart"), model, &apart, &results);
            if options.arithmetic == Arithmetic::Exact {
                assert_same_bits(what, output.name(), model, &results, &expected);
            }
            // Some hundred roundings, and their growth by the condition of the inertia.
            let size = expected.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
            let off = results.iter().zip(&expected).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(off <= 1e-11 * size, "{what}: {output:?} is {off:e} off, size {size:e}");
        }
        let straight = trace(plan, output, options).expect("a program").program.counts().total();
        let apart = both.program.apart.counts().total();
        if options.arithmetic == Arithmetic::Exact {
            assert_eq!(apart, straight, "{what}: {output:?} has other operations");
        }
    }
    branches
}

/// Compares on one tree for each seed. Returns the number of branches.
fn compare_trees(seeds: std::ops::Range<u64>) -> usize {
    let mut branches = 0;
    for seed in seeds {
        let numbers = NUMBERS[seed as usize % 4];
        let model = tree(seed, numbers);
        let elimination = match seed % 5 {
            0 if model.joints.len() < 8 => EliminationStrategy::Fastest,
            1 if model.joints.len() < 8 => EliminationStrategy::Fewest,
            _ => EliminationStrategy::Single,
        };
        let plan = search::plan(&model, options(Arithmetic::Exact, elimination).plan);
        for arithmetic in [Arithmetic::Exact, Arithmetic::Fast] {
            let what = format!("seed {seed}, {numbers:?}, {arithmetic:?}");
            branches += compare(&what, &model, &plan, &options(arithmetic, elimination));
        }
    }
    branches
}

#[test]
fn random_trees() {
    // The odd branch between them leaves some sets without equal distances.
    let branches = compare_trees(0..15);
    assert!(branches > 40, "only {branches} branches are computed together");
}

#[test]
#[ignore = "takes a minute: cargo test -p mbd-testing --test code together -- --ignored"]
fn more_random_trees() {
    let branches = compare_trees(15..75);
    assert!(branches > 200, "only {branches} branches are computed together");
}

#[test]
fn legs_of_solo12() {
    let model = wide::model("solo12.urdf", Base::Floating);
    let plan = search::plan(&model, Options::default().searches());
    for arithmetic in [Arithmetic::Exact, Arithmetic::Fast] {
        let options = options(arithmetic, EliminationStrategy::Fastest);
        assert_eq!(compare("solo12", &model, &plan, &options), 4);
        let (both, straight) = (together(&plan, Output::Rates, &options), trace(&plan, Output::Rates, &options));
        let (both, straight) = (both.expect("legs").program, straight.expect("a program").program);
        let chosen = Options { plan: PlanOptions::default(), ..options };
        assert_eq!(both.pays(&straight, &chosen), Some(Vectors::Any), "the default computes the legs together");
    }
}

/// Also the legs and the arms of a humanoid.
#[test]
#[ignore = "takes half a minute: cargo test -p mbd-testing --test code together -- --ignored"]
fn limbs_of_g1() {
    let model = wide::model("g1.urdf", Base::Floating);
    let plan = search::plan(&model, Options::default().searches());
    for arithmetic in [Arithmetic::Exact, Arithmetic::Fast] {
        assert_eq!(compare("g1", &model, &plan, &options(arithmetic, EliminationStrategy::Fastest)), 4);
    }
}
