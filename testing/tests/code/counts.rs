//! Operation counts of random mechanisms: limits, and elements that a mechanism does not have, which must cost nothing.

use mbd_codegen::generate::{generate, trace};
use mbd_codegen::model::{Gravity, JointKind, Model, Rotation, Value, Wrench, WrenchAxes};
use mbd_codegen::options::{EliminationStrategy, PlanOptions};
use mbd_codegen::plan::Plan;
use mbd_codegen::search;
use mbd_codegen::symbolic::Counts;
use mbd_codegen::{Arithmetic, Options, Output};
use mbd_runtime::sweep::Quantity;
use mbd_testing::random::{random_model, Distribution};

const NONE: Gravity = Gravity::Constant([Value::ZERO; 3]);

/// The program with joints eliminated one by one. What these tests state of loads and outputs holds for every
/// elimination.
fn program(model: &Model, output: Output, efforts: bool) -> mbd_codegen::symbolic::Program {
    let plan = PlanOptions { elimination: EliminationStrategy::Single, ..PlanOptions::default() };
    let options = Options { efforts, arithmetic: Arithmetic::Exact, plan, ..Options::default() };
    trace(&search::plan(model, plan), output, &options).expect("no frames are named").program
}

fn counts(model: &Model, output: Output) -> Counts {
    program(model, output, false).counts()
}

/// Operations of the rates with the elimination that has the fewest.
fn fewest(model: &Model) -> usize {
    let plan = PlanOptions {
        elimination: EliminationStrategy::Fewest,
        accelerations: false,
        mass_matrix: false,
        ..PlanOptions::default()
    };
    let options = Options { efforts: false, arithmetic: Arithmetic::Fast, plan, ..Options::default() };
    trace(&search::plan(model, plan), Output::Rates, &options).expect("no frames are named").program.counts().total()
}

/// A chain of `n` revolute joints, general in every number.
fn general_chain(seed: u64, n: usize) -> Model {
    let distribution = Distribution { bodies: (n, n), gravity: [0.0, 1.0, 0.0], ..Distribution::default() };
    let mut model = random_model(seed, &distribution);
    // The generator makes one placement in six an identity; in a general chain nothing may be aligned.
    for (k, joint) in model.joints.iter_mut().enumerate() {
        if joint.placement.rotation == Rotation::NONE {
            joint.placement.rotation = Rotation::Rpy([0.3, 0.7, 1.1 + k as f64].map(Value::Const));
        }
    }
    model
}

/// The same chain in a plane: all axes are vertical, and placements are rotations about them.
fn planar_chain(seed: u64, n: usize) -> Model {
    let mut model = general_chain(seed, n);
    for joint in &mut model.joints {
        joint.kind = JointKind::Revolute { axis: [0.0, 0.0, 1.0] };
        joint.placement.rotation = Rotation::Rpy([Value::ZERO, Value::ZERO, Value::Const(0.4)]);
        joint.placement.xyz[2] = Value::ZERO;
    }
    model
}

/// One more body of a planar chain always costs the same, and only a fraction of its cost in space.
#[test]
fn planar_chains_are_cheap() {
    let count = |n: usize| fewest(&planar_chain(0, n));
    let (ten, twelve) = (count(10), count(12));
    // These are the counts when the test was written. The limits keep the counts from growing.
    assert!(ten <= 561 && twelve - ten <= 2 * 66, "{ten} operations for 10 bodies, {twelve} for 12");
    assert_eq!(count(14) - twelve, twelve - ten);
}

/// Without gravity and wrenches, no operation of the rates belongs to loads.
#[test]
fn absent_loads_cost_nothing() {
    for seed in 0..100 {
        let distribution = Distribution { wrenches: 0.0, ..Distribution::everything(seed, 6) };
        let mut model = random_model(seed, &distribution);
        model.gravity = NONE;
        let loads = program(&model, Output::Rates, true).counts_where(|(_, what)| *what == Quantity::Load);
        assert_eq!(loads, Counts::default(), "seed {seed}");
        let without = counts(&model, Output::Rates).total();
        model.gravity = Gravity::Input;
        assert!(counts(&model, Output::Rates).total() >= without, "seed {seed}");
    }
}

/// Velocities, momenta and the mass matrix do not depend on wrenches and gravity; the energy does not depend on
/// wrenches.
#[test]
fn loads_stay_out_of_what_does_not_depend_on_them() {
    for seed in 0..100 {
        let mut model = random_model(seed, &Distribution { wrenches: 0.0, ..Distribution::everything(seed, 6) });
        let all = |model: &Model, outputs: &[Output]| outputs.iter().map(|o| counts(model, *o)).collect::<Vec<_>>();
        let kinematic = [
            Output::Velocities,
            Output::Momenta,
            Output::MassMatrix,
            Output::Frames,
            Output::Jacobians,
            Output::BiasAccelerations,
        ];
        let before = (all(&model, &kinematic), counts(&model, Output::Energy));
        model.wrenches.push(Wrench { name: "w".to_string(), body: 0, axes: WrenchAxes::World });
        assert_eq!(before, (all(&model, &kinematic), counts(&model, Output::Energy)), "seed {seed}: a wrench");
        model.gravity = Gravity::Input;
        assert_eq!(before.0, all(&model, &kinematic), "seed {seed}: gravity");
    }
}

/// Each joint force costs at most one addition.
#[test]
fn efforts_cost_one_addition_each() {
    for seed in 0..100 {
        let model = random_model(seed, &Distribution::everything(seed, 6));
        let nv = Plan::new(&model, 0.0).dims.nv;
        let [with, without] = [true, false].map(|efforts| program(&model, Output::Rates, efforts).counts());
        assert!(with.additions <= without.additions + nv, "seed {seed}");
        assert_eq!((with.multiplications, with.divisions), (without.multiplications, without.divisions), "seed {seed}");
    }
}

/// An output that is not requested costs nothing, and outputs do not change each other.
#[test]
fn outputs_are_independent() {
    for seed in 0..10 {
        let model = random_model(seed, &Distribution::everything(seed, 5));
        let generated = |outputs: Vec<Output>| {
            generate(&model, &Options { outputs, arithmetic: Arithmetic::Exact, ..Options::default() })
                .unwrap_or_else(|e| panic!("seed {seed}: {e}"))
        };
        let all = generated(Output::available(false).collect());
        for (k, output) in Output::available(false).enumerate() {
            let one = generated(vec![output]);
            assert_eq!(one.counts, [all.counts[k]], "seed {seed}: {output:?}");
            for other in Output::available(false).filter(|o| *o != output) {
                assert!(
                    !one.source.contains(&format!("pub fn {}(", other.name())),
                    "seed {seed}: {output:?}, {other:?}"
                );
            }
        }
    }
}

/// A frame that is not requested is not computed.
#[test]
fn frames_are_chosen_one_by_one() {
    let model = random_model(3, &Distribution { bodies: (6, 6), ..Distribution::default() });
    let count = |frames: Vec<String>| {
        let options = Options { frames, arithmetic: Arithmetic::Exact, ..Options::default() };
        let plan = search::plan(&model, options.plan);
        trace(&plan, Output::Frames, &options).expect("the frames exist").program.counts().total()
    };
    let names: Vec<String> = model.joints.iter().map(|j| model.bodies[j.child].name.clone()).collect();
    let each: Vec<usize> = names.iter().map(|n| count(vec![n.clone()])).collect();
    assert!(each.windows(2).all(|w| w[0] < w[1]), "{each:?}: a frame farther from the ground must cost more");
    assert!(count(names) > each[5]);
}

/// A chain with aligned axes costs less than a general one, with symmetric links less still, and a planar chain the
/// least.
#[test]
fn structure_pays() {
    for seed in 0..20 {
        let total = |model: &Model| counts(model, Output::Rates).total();
        let general = general_chain(seed, 8);
        let mut aligned = general.clone();
        for joint in &mut aligned.joints {
            let turn = Rotation::Rpy([Value::Const(std::f64::consts::FRAC_PI_2), Value::ZERO, Value::ZERO]);
            joint.kind = JointKind::Revolute { axis: [0.0, 0.0, 1.0] };
            joint.placement.rotation = turn;
        }
        let mut symmetric = aligned.clone();
        for body in &mut symmetric.bodies {
            body.com = [Value::ZERO, Value::ZERO, body.com[2]];
            body.inertia[3..].fill(Value::ZERO);
            body.inertia_axes = Rotation::NONE;
        }
        let counts = [&general, &aligned, &symmetric, &planar_chain(seed, 8)].map(total);
        println!(
            "seed {seed}: general {}, aligned {}, symmetric {}, planar {}",
            counts[0], counts[1], counts[2], counts[3]
        );
        assert!(counts.windows(2).all(|w| w[0] > w[1]), "seed {seed}: {counts:?}");
    }
}

/// Chains on both sides of a spherical joint are searched apart, although the part of the mechanism that consists of one, its
/// ancestors and what is beyond it is the whole arm for both.
#[test]
fn chains_on_both_sides_of_a_spherical_joint_are_searched() {
    let mut model = general_chain(3, 6);
    model.joints[3].kind = JointKind::Spherical;
    let chosen = search::best(Plan::new(&model, 0.0), PlanOptions::default());
    let forms = |branch: [usize; 2]| {
        let own = chosen.candidates.iter().filter(move |c| c.branch == branch);
        own.map(|c| c.form.clone()).collect::<Vec<_>>()
    };
    // Three joints can be eliminated together, or two.
    let together =
        |forms: &[String], n: usize| forms.iter().any(|form| form.starts_with(&format!("last {n} together")));
    let (inner, outer) = (forms([0, 2]), forms([4, 5]));
    assert!(together(&inner, 3), "{inner:?}");
    assert!(together(&outer, 2) && !together(&outer, 3), "{outer:?}");
}
