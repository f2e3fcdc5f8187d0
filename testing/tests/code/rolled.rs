//! Rolled code of long chains against the interpreter.
//!
//! In exact arithmetic, rolled code has the operations of the sweeps, so results are the same bit for bit on every
//! tree.

use mbd_codegen::generate::trace;
use mbd_codegen::model::{Constraint, ConstraintKind, Joint, LoopKind, Model, Mount, Placement, Rotation, Value};
use mbd_codegen::options::{EliminationStrategy, PlanOptions};
use mbd_codegen::rolled::rolled;
use mbd_codegen::search;
use mbd_codegen::{Arithmetic, Options, Output, RolledCode};
use mbd_runtime::Constrained;
use mbd_testing::branches::{centipede, NUMBERS};
use mbd_testing::chains::{general, planar};
use mbd_testing::random::{random_model, Distribution, Rng};
use mbd_testing::state::random_state;
use mbd_testing::toml::to_toml;
use mbd_testing::{assert_same_bits, relative_error};

/// Compares every output that has rolled code with the interpreter. Returns the largest number of rolled nodes of an
/// output.
fn compare(model: &Model, seed: u64, options: &Options) -> usize {
    let plan = search::plan(model, options.plan);
    let mut s = random_state(&plan, seed);
    if !options.efforts {
        s.tau.fill(0.0);
    }
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let mut i = s.interpreter(&plan);
    let (mut p, mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nv], vec![0.0; nq], vec![0.0; nv]);
    i.momenta(&s.q, &s.v, &mut p);
    let mut a = vec![0.0; nv];
    i.accelerations(&s.q, &s.v, &mut a);
    let mut nodes = 0;
    let (mut rows, mut pivots) = (i.zero_rows(), i.zero_rows());
    for &output in Output::ALL {
        let Some(program) = rolled(&plan, output, options) else { continue };
        nodes = nodes.max(program.program.loops.iter().map(|l| l.nodes.len()).sum());
        let inputs = s.inputs_of(&program.inputs, &p, &a);
        let results = program.program.evaluate(&inputs, |a, b, c| a * b + c);
        let inside = program.program.with_sines_in_loops();
        assert_eq!(inside.counts(), program.program.counts(), "{output:?}");
        let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<u64>>();
        let moved = inside.evaluate(&inputs, |a, b, c| a * b + c);
        assert_eq!(bits(&moved), bits(&results), "{output:?} with sines in the loops");
        let expected = match output {
            Output::Rates => {
                i.rates(&s.q, &p, &mut v, &mut qd, &mut pd);
                [qd.as_slice(), &pd].concat()
            }
            Output::Velocities => {
                i.velocities(&s.q, &p, &mut v);
                v.clone()
            }
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
            Output::Multipliers => {
                i.multipliers(0.0, &s.q, &s.v, &mut rows);
                rows.clone()
            }
            Output::ProjectMomenta => {
                let mut freed = p.clone();
                i.project_momenta(0.0, &s.q, &mut freed, &mut v, &mut rows);
                [v.as_slice(), &freed, &rows].concat()
            }
            Output::PositionCorrection => {
                i.position_correction(&s.q, &mut rows, &mut v, &mut pivots);
                [rows.as_slice(), &v, &pivots].concat()
            }
            _ => {
                let (kinetic, potential) = i.energy(&s.q, &p);
                vec![kinetic, potential]
            }
        };
        assert_eq!(results.len(), expected.len());
        if options.arithmetic == Arithmetic::Fast {
            // The tolerance, relative to the largest of the results, allows for a few hundred roundings and for their
            // growth by the condition of the inertia, which is below 1e3 in chains this short.
            let off = relative_error(&results, &expected, 1.0);
            assert!(off <= 1e-11, "seed {seed}: {output:?} is {off:e} off\n{}", to_toml(model));
            continue;
        }
        assert_same_bits(&format!("seed {seed}"), output.name(), model, &results, &expected);
        let straight = trace(&plan, output, options).map(|g| g.program.counts().total()).unwrap_or_default();
        let more = program.program.counts().total();
        assert!(
            more >= straight,
            "seed {seed}: {output:?}: rolled code has {more} operations, straight-line code {straight}"
        );
    }
    nodes
}

fn forced(seed: u64) -> Options {
    let mut rng = Rng::new(seed, 9);
    // Mostly `Single`: blocks of joints that are eliminated together at the tips stay straight-line code and leave few
    // nodes of short chains to rolled code, and the search for them takes most of the time.
    let elimination = match rng.below(6) {
        0 => EliminationStrategy::Fewest,
        1 => EliminationStrategy::Fastest,
        _ => EliminationStrategy::Single,
    };
    Options {
        arithmetic: Arithmetic::Exact,
        efforts: rng.chance(0.7),
        plan: PlanOptions { elimination, rolled: RolledCode::Always, ..PlanOptions::default() },
        ..Options::default()
    }
}

#[test]
fn chains_of_revolute_joints() {
    for seed in 0..16 {
        let n = 5 + seed as usize * 3 % 25;
        let distribution = Distribution { bodies: (n, n), taper: 1.0, ..Distribution::default() };
        let nodes = compare(&random_model(seed, &distribution), seed, &forced(seed));
        assert!(nodes + 13 >= n, "seed {seed}: {nodes} of {n} nodes are rolled");
    }
}

/// Chains in space and in a plane whose tips are connected to the ground. Rolled code then carries the columns of the
/// constraint's rows from link to link.
#[test]
fn closed_chains() {
    let kinds = [
        LoopKind::Spherical,
        LoopKind::Revolute { axis: [0.2, 0.0, 1.0] },
        LoopKind::Planar { normal: [0.0, 0.0, 1.0] },
        LoopKind::Fixed,
        LoopKind::Helical { axis: [1.0, 0.0, 0.0], pitch: Value::Const(0.3) },
    ];
    for seed in 0..20 {
        let n = 8 + seed as usize % 7;
        let mut model = if seed % 2 == 0 { general(seed, n) } else { planar(seed, n) };
        let at = |x: f64| Placement { xyz: [x, 0.3 - x, 0.1].map(Value::Const), rotation: Rotation::NONE };
        let (ground, tip) = (
            Mount { body: None, placement: at(0.4) },
            Mount { body: Some(model.joints[n - 1].child), placement: at(0.2) },
        );
        let [first, second] = if seed % 3 == 0 { [ground, tip] } else { [tip, ground] };
        let kind = ConstraintKind::Loop { kind: kinds[seed as usize % 5], first, second };
        let decay = if seed % 4 == 0 { Value::Const(5.0) } else { Value::ZERO };
        model.constraints.push(Constraint::new("loop", kind, decay));
        let mut options = forced(seed);
        // Nodes with non-rotating frames stay straight-line code.
        if options.plan.elimination == EliminationStrategy::Fewest {
            options.plan.elimination = EliminationStrategy::Single;
        }
        let nodes = compare(&model, seed, &options);
        if seed % 4 == 0 {
            // With a decay, the rows need the pose of the tip and exert forces on the joints; this stays straight-line
            // code.
            continue;
        }
        let plan = search::plan(&model, options.plan);
        for output in [
            Output::Rates,
            Output::Energy,
            Output::Accelerations,
            Output::Multipliers,
            Output::ProjectMomenta,
            Output::PositionCorrection,
        ] {
            let is_rolled = rolled(&plan, output, &options).is_some();
            assert!(is_rolled, "seed {seed}: {output:?} has no rolled code, {:?}", options.plan);
        }
        assert!(nodes + 2 >= n, "seed {seed}: {nodes} of {n} nodes are rolled");
        options.arithmetic = Arithmetic::Fast;
        compare(&model, seed, &options);
    }
}

/// Chains whose links have legs: a turn of the loop is one link with its legs, or two.
#[test]
fn centipedes() {
    for seed in 0..24 {
        let (links, legs) = (6 + seed as usize % 4, 1 + seed as usize % 3);
        let mut model = centipede(seed, links, legs, NUMBERS[seed as usize % 4]);
        if seed % 3 == 0 {
            // Columns of the rows at the tail pass through the links, but not through the legs.
            let at = |x: f64| Placement { xyz: [x, 0.3 - x, 0.1].map(Value::Const), rotation: Rotation::NONE };
            let tail = model.joints[model.joints.len() - 1].child;
            let [first, second] = [(Some(tail), 0.2), (None, 0.4)].map(|(body, x)| Mount { body, placement: at(x) });
            let kind = ConstraintKind::Loop { kind: LoopKind::Spherical, first, second };
            model.constraints.push(Constraint::new("loop", kind, Value::ZERO));
        }
        let mut options = forced(seed);
        // Only joints that are eliminated one by one are in loops.
        options.plan.elimination = EliminationStrategy::Single;
        let nodes = compare(&model, seed, &options);
        // The first link hangs on another kind of joint, and where every other link is alike, one stays apart at the end.
        let least = (links - 2) * (model.joints.len() / links);
        assert!(nodes >= least, "seed {seed}: {nodes} of {} nodes are rolled", model.joints.len());
        options.arithmetic = Arithmetic::Fast;
        compare(&model, seed, &options);
    }
}

/// What hangs on a leg or twice on the last link ends the run of links before it.
#[test]
fn centipedes_with_other_ends() {
    let options = forced(0);
    for seed in 0..8 {
        let mut model = centipede(seed, 5, 2, NUMBERS[seed as usize % 4]);
        let joints = model.joints.len();
        let last = model.joints[joints - 1].clone();
        // After the tail, or before it, so that joints stay depth first.
        let (parent, at) = match seed % 2 {
            0 => (last.parent, joints),
            _ => (Some(model.joints[joints - 2].child), joints - 1),
        };
        let mut body = model.bodies[last.child].clone();
        body.name = "end".to_string();
        model.bodies.push(body);
        model.joints.insert(at, Joint { name: "j_end".to_string(), child: model.bodies.len() - 1, parent, ..last });
        compare(&model, seed, &options);
    }
}

#[test]
fn rewritten_chains() {
    for seed in 0..6 {
        let n = 16 + 2 * seed as usize;
        let distribution = Distribution { bodies: (n, n), taper: 1.0, ..Distribution::default() };
        // In a plane, programs are so short that rolled code must be asked for.
        let (model, rolled) = match seed % 2 {
            0 => (random_model(seed, &distribution), RolledCode::Auto),
            _ => (planar(seed, n), RolledCode::Always),
        };
        let plan = PlanOptions { rolled, ..PlanOptions::default() };
        let options = Options { arithmetic: Arithmetic::Fast, plan, ..Options::default() };
        let nodes = compare(&model, seed, &options);
        assert!(nodes + 4 >= n, "seed {seed}: {nodes} of {n} nodes are rolled");
    }
}

#[test]
fn trees_of_everything() {
    let mut nodes = 0;
    for seed in 0..75 {
        let all = Distribution { wrenches: 0.0, ..Distribution::everything(seed, 6 + seed as usize % 20) };
        // Nodes with parameters, mimic joints or drives stay straight-line code.
        let plain = Distribution { params: 0.0, mimic: 0.0, prescribed: 0.0, branching: 0.1, ..all.clone() };
        let distribution = if seed % 3 == 0 { all } else { plain };
        nodes += compare(&random_model(seed, &distribution), seed, &forced(seed));
    }
    assert!(nodes > 35, "only {nodes} nodes were rolled");
}

#[test]
fn chains_of_one_kind() {
    let mut nodes = 0;
    for seed in 0..64 {
        let mut kinds = [0.0; 9];
        kinds[seed as usize % 8] = 1.0;
        let n = 4 + seed as usize % 9;
        let distribution = Distribution {
            wrenches: 0.0,
            mimic: 0.0,
            prescribed: 0.0,
            bodies: (n, n),
            branching: 0.1,
            kinds,
            ..Distribution::everything(seed, n)
        };
        nodes += compare(&random_model(seed, &distribution), seed, &forced(seed));
    }
    assert!(nodes > 100, "only {nodes} nodes were rolled");
}
