//! Mechanisms with loops in minimal coordinates and in several descriptions: every choice of independent velocities,
//! the recursion of the thesis, parameters in place of constants, eliminations, single precision.

use std::collections::BTreeMap;

use mbd_codegen::model::{ConstraintKind, JointKind, JointMotion, Model};
use mbd_codegen::options::{EliminationStrategy, PlanOptions};
use mbd_codegen::plan::Plan;
use mbd_codegen::search;
use mbd_runtime::constrained::CoordinatePartition;
use mbd_runtime::{Accelerated, Constrained, Interpreter, System};
use mbd_testing::closed::{random_loops, LoopKnobs, LoopSystem};
use mbd_testing::eliminations::random_plan_snapped;
use mbd_testing::random::Distribution;
use mbd_testing::state::State;
use mbd_testing::{largest, relative_error, substituted};

use crate::dense::case::{system, Case, Errors, SYSTEMS};
use crate::dense::minimal::{choices, full, least, others, pivot};
use crate::dense::{minimal, thesis, Matrix, Truth, Vector};

/// For any choice of independent velocities, `ṗ_ind` of the state with `p⁺_dep = 0` is `d/dt (Bᵀ M v)`. It is computed
/// from `ṗ⁺` of the rates, and by [`CoordinatePartition`].
#[test]
fn minimal_coordinates_are_a_gauge() {
    let mut velocity = Errors::new("qd", 1e-11);
    let mut rate = Errors::new("pd of independents", 1e-10);
    let mut adapted = Errors::new("pd of CoordinatePartition", 1e-10);
    let mut choices_met = 0;
    for seed in 0..SYSTEMS / 2 {
        let Some(mut c) = Case::new(seed) else { continue };
        let nv = c.p.len();
        if nv > 8 || c.truth.dense.condition() > 100.0 {
            continue;
        }
        let phi = c.phi(&c.q()).1;
        for dependents in choices(nv, c.truth.dense.rank) {
            if pivot(&c.truth.dense, &dependents) < 0.05 {
                continue;
            }
            choices_met += 1;
            let p = full(&c.p.select_rows(&others(nv, &dependents)), nv, &dependents);
            c.truth = Truth::new(&c.system, &p);
            if !c.truth.regular() {
                continue;
            }
            let (qd, pd) = c.rates(&p);
            let exact = c.coordinate_rates(&c.truth.v);
            velocity.add(&c, &qd, &exact, c.truth.unbound.amax().max(exact.amax()));
            let b = minimal::tangents(&phi, &dependents);
            let ours = b.transpose() * pd;
            let exact = minimal::rates(&c.system, &c.truth, &dependents);
            let turning = c.truth.phi_rate.transpose() * &c.truth.sigma;
            let scale = c.truth.open_rates.amax().max(turning.amax()).max(exact.amax());
            rate.add(&c, &ours, &exact, scale * b.amax());
            let (mut q, mut gauge) = (c.q(), p.as_slice().to_vec());
            let mut minimal = CoordinatePartition::new(c.i.clone(), &mut q, &mut gauge.clone()).expect("closed");
            minimal.choose_among(&dependents, &mut q, &mut gauge).expect("a valid choice");
            let (mut qd, mut pd) = (c.i.neutral(), c.i.zero_momenta());
            minimal.rates_at(0.0, &q, &p.as_slice().to_vec(), &mut qd, &mut pd);
            assert!(dependents.iter().all(|k| pd[*k] == 0.0), "seed {seed}, {dependents:?}: {pd:?}");
            let ours = Vector::from(pd).select_rows(&others(nv, &dependents));
            adapted.add(&c, &ours, &exact, scale * b.amax());
        }
    }
    println!("{choices_met} choices");
    assert!(choices_met > 500, "{choices_met}");
    velocity.done();
    rate.done();
    adapted.done();
}

/// Section 5.3.3 of the thesis has a recursion for minimal coordinates of serial chains. It gives the same motion as
/// the rates with `p⁺_dep = 0`.
#[test]
fn the_gauge_agrees_with_the_thesis_s_recursion() {
    let mut velocity = Errors::new("v", 1e-11);
    let mut rate = Errors::new("pd of independents", 1e-9);
    for seed in 0..60 {
        let Some(mut c) = Case::of(seed, thesis::chain(seed)) else { continue };
        let nv = c.p.len();
        let links = thesis::Chain::new(&c.system, &c.system.state.q);
        for count in 1..=c.truth.dense.rank.min(links.links()) {
            for joints in choices(links.links(), count) {
                let dependents = links.velocities(&joints);
                if dependents.len() != c.truth.dense.rank || pivot(&c.truth.dense, &dependents) < 0.1 {
                    continue;
                }
                let p = full(&c.p.select_rows(&others(nv, &dependents)), nv, &dependents);
                let (v, exact) = thesis::motion(&c.system, &p, &joints);
                c.truth = Truth::new(&c.system, &p);
                let (qd, pd) = c.rates(&p);
                velocity.add(&c, &qd, &c.coordinate_rates(&v), c.truth.unbound.amax());
                let phi = c.phi(&c.q()).1;
                // ṗ_ind = ṗ⁺_ind − Φ_indᵀ y, Φ_dᵀ y = ṗ⁺_dep.
                let y = least(
                    &phi.select_columns(&dependents).transpose(),
                    &Matrix::from_columns(&[pd.select_rows(&dependents)]),
                );
                let independents = others(nv, &dependents);
                let ours = pd.select_rows(&independents) - phi.select_columns(&independents).transpose() * y.column(0);
                let scale = c.truth.open_rates.amax().max(exact.amax());
                rate.add(&c, &ours, &exact, scale);
            }
        }
    }
    velocity.done();
    rate.done();
}

/// Velocities, projected momenta, rates, accelerations and `Φᵀλ` of a plan in a state. None of them depends on the
/// order of rows.
fn results(plan: &Plan, s: &State, p: &[f64]) -> [Vec<f64>; 5] {
    let mut i = s.interpreter(plan);
    let q = s.q.clone();
    let (mut projected, mut v, mut sigma) = (p.to_vec(), i.zero_momenta(), i.zero_rows());
    i.project_momenta(0.0, &q, &mut projected, &mut v, &mut sigma);
    let (mut qd, mut pd, mut a) = (i.neutral(), i.zero_momenta(), i.zero_momenta());
    i.rates_at(0.0, &q, &projected, &mut qd, &mut pd);
    i.generalized_accelerations(&q, &v, &mut a);
    let (mut lambda, mut residual, mut entries) = (i.zero_rows(), i.zero_rows(), i.zero_entries());
    i.multipliers(0.0, &q, &v, &mut lambda);
    i.constraint_residuals(&q, &mut residual, &mut entries);
    let mut force = i.zero_momenta();
    for (k, row) in i.rows().iter().enumerate() {
        for at in row.first..row.first + row.len {
            force[i.entry_columns()[at]] += lambda[k] * entries[at];
        }
    }
    [v, projected, pd, a, force]
}

/// Largest difference relative to the largest entry of both (at least 1).
fn difference(a: &[Vec<f64>; 5], b: &[Vec<f64>; 5]) -> f64 {
    a.iter().zip(b).map(|(a, b)| relative_error(a, b, largest(a, 1.0))).fold(0.0, f64::max)
}

/// Systems whose rows are far from dependent. Their results then differ by less than 1e-10; with four percent of a row
/// left, they differ by twice as much in one of the systems.
fn apart(seed: u64, system: LoopSystem) -> Option<Case> {
    Case::of(seed, system).filter(|c| c.pivot > 5e-2)
}

#[test]
fn parameters_of_constraints_are_as_good_as_constants() {
    let (mut worst, mut met) = (0.0_f64, 0);
    for seed in 0..200 {
        let distribution = LoopKnobs::everything(seed, 6);
        let distribution = LoopKnobs { tree: Distribution { params: 0.4, ..distribution.tree }, ..distribution };
        let Some(c) = apart(seed, random_loops(seed, &distribution)) else { continue };
        met += 1;
        let s = &c.system.state;
        let ours = results(&random_plan_snapped(&c.system.model, 0.0, seed), s, c.p.as_slice());
        let plain = random_plan_snapped(&substituted(&c.system.model, &s.params), 0.0, seed + SYSTEMS);
        let s = State { params: Vec::new(), ..s.clone() };
        let d = difference(&ours, &results(&plain, &s, c.p.as_slice()));
        assert!(d < 1e-10, "seed {seed}: {d:e}");
        worst = worst.max(d);
    }
    println!("{met} systems: {worst:.1e}");
    assert!(met > 100);
}

#[test]
fn eliminations_do_not_matter() {
    let (mut worst, mut met) = (0.0_f64, 0);
    for seed in 0..80 {
        let Some(c) = apart(seed, system(seed)) else { continue };
        met += 1;
        let of = |elimination| {
            let plan = search::plan(&c.system.model, PlanOptions { elimination, ..PlanOptions::default() });
            results(&plan, &c.system.state, c.p.as_slice())
        };
        let [first, others @ ..] = EliminationStrategy::ALL.map(of);
        for other in &others {
            let d = difference(&first, other);
            assert!(d < 1e-10, "seed {seed}: {d:e}");
            worst = worst.max(d);
        }
    }
    println!("{met} systems: {worst:.1e}");
    assert!(met > 30);
}

/// Velocities of well-conditioned systems in single precision.
#[test]
fn single_precision_holds_constraints() {
    let (mut worst, mut met) = (0.0_f64, 0);
    for seed in 0..SYSTEMS {
        let Some(c) = apart(seed, system(seed)) else { continue };
        // Without constraints, velocities depend on the inertias only. Large ones mean that the inertias lose digits.
        if c.truth.unbound.amax() > 20.0 || c.truth.dense.condition() > 5.0 {
            continue;
        }
        met += 1;
        let plan = crate::dense::case::plan_of(&c.system, seed);
        let mut i: Interpreter<f32> = c.system.state.interpreter_of(&plan, |x, _| x as f32);
        let single = |list: &[f64]| list.iter().map(|x| *x as f32).collect::<Vec<f32>>();
        let (mut p, mut v, mut sigma) = (single(c.p.as_slice()), i.zero_momenta(), i.zero_rows());
        i.project_momenta(0.0, &single(&c.system.state.q), &mut p, &mut v, &mut sigma);
        let v = Vector::from_iterator(v.len(), v.iter().map(|x| f64::from(*x)));
        let error = (v - &c.truth.v).amax() / c.truth.unbound.amax().max(1.0);
        assert!(error < 1e-4, "seed {seed}: {error:e}");
        worst = worst.max(error);
    }
    println!("{met} systems: {worst:.1e}");
    assert!(met > 100);
}

/// Joints on the path from a body to the ground.
fn way(model: &Model, body: Option<usize>) -> Vec<usize> {
    let joint = |body| model.joints.iter().position(|j| Some(j.child) == body);
    std::iter::successors(joint(body), |&j| joint(model.joints[j].parent)).collect()
}

/// Joints that a constraint binds.
fn cycle(model: &Model, kind: &ConstraintKind) -> Vec<usize> {
    match kind {
        ConstraintKind::Loop { first, second, .. } => {
            let (a, b) = (way(model, first.body), way(model, second.body));
            let only = |x: &[usize], y: &[usize]| x.iter().copied().filter(|j| !y.contains(j)).collect::<Vec<_>>();
            [only(&a, &b), only(&b, &a)].concat()
        }
        ConstraintKind::Coupling { terms, .. } => terms.iter().map(|t| t.0).collect(),
    }
}

/// Loops of every sort occur among the systems.
#[test]
fn the_systems_have_everything() {
    let mut met: BTreeMap<&str, u64> = BTreeMap::new();
    for seed in 0..SYSTEMS {
        let model = system(seed).model;
        let mut note = |what: &'static str, here: bool| *met.entry(what).or_default() += u64::from(here);
        let cycles: Vec<Vec<usize>> = model.constraints.iter().map(|c| cycle(&model, &c.kind)).collect();
        let bodies = |c: &ConstraintKind| match c {
            ConstraintKind::Loop { first, second, .. } => [first.body, second.body],
            ConstraintKind::Coupling { .. } => [None; 2],
        };
        let any = |f: &dyn Fn(usize) -> bool| cycles.iter().flatten().any(|&j| f(j));
        let kind = |f: fn(&JointKind) -> bool| any(&|j| f(&model.joints[j].kind));
        note("between bodies", model.constraints.iter().any(|c| bodies(&c.kind).iter().all(Option::is_some)));
        note("to the ground", model.constraints.iter().any(|c| bodies(&c.kind).iter().any(Option::is_none)));
        note("coupling", model.constraints.iter().any(|c| matches!(c.kind, ConstraintKind::Coupling { .. })));
        let pairs = || (0..cycles.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let shared = |(a, b): (usize, usize)| cycles[a].iter().any(|j| cycles[b].contains(j));
        note("shared joints", pairs().any(shared));
        note("independent loops", pairs().any(|pair| !shared(pair)));
        note("twice", pairs().any(|(a, b)| model.constraints[a].kind == model.constraints[b].kind));
        note("long", cycles.iter().any(|c| c.len() > 5));
        note("spherical", kind(|k| *k == JointKind::Spherical));
        note("floating", kind(|k| *k == JointKind::Floating));
        note("planar", kind(|k| matches!(k, JointKind::Planar { .. })));
        note("drive", any(&|j| model.joints[j].motion == JointMotion::Prescribed));
        note("mimic", any(&|j| matches!(model.joints[j].motion, JointMotion::Mimic { .. })));
        let led = |j: usize| {
            let follows = |m: &JointMotion| matches!(m, JointMotion::Mimic { leader, .. } if *leader == j);
            model.joints.iter().any(|joint| follows(&joint.motion))
        };
        note("leader", any(&led));
    }
    println!("{met:?}");
    assert!(met.values().all(|n| *n > 20), "{met:?}");
}
