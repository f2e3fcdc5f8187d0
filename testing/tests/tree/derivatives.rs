//! Derivatives of the rates against dual numbers, on random trees with all kinds of elements.
//!
//! The reference runs the sweeps for the rates, which use another factorisation and other formulas, on `q + ε N(q) e_k`
//! and `p + ε e_k`.

use mbd_codegen::model::{Model, Value};
use mbd_codegen::options::{PlanOptions, DEFAULT_SNAP};
use mbd_codegen::plan::Plan;
use mbd_codegen::read::{self, Base, ImportOptions};
use mbd_codegen::search;
use mbd_runtime::sweep::{Derivatives, Sweeps};
use mbd_runtime::tree::Kind;
use mbd_runtime::workspace::Workspace;
use mbd_runtime::{Dual, Interpreter, MomentumDerivatives, System};
use mbd_testing::eliminations::random_plan;
use mbd_testing::random::{random_model, Distribution};
use mbd_testing::state::{parameter, random_state, State};
use mbd_testing::toml::to_toml;

type D = Dual<f64>;

const TREES: u64 = 300;

/// Tolerance relative to the largest entry of the block. The mass matrices of these trees lose five digits at worst
/// (light tips on heavy bases), and a derivative of `ṗ` multiplies by the inverse twice.
const TOLERANCE: f64 = 1e-9;
/// Tolerance that 99 % of the trees keep.
const USUAL: f64 = 1e-11;

struct Case {
    seed: u64,
    plan: Plan,
    s: State,
    i: Interpreter<f64>,
    p: Vec<f64>,
    d: Derivatives<f64>,
}

impl Case {
    /// A tree with random eliminations.
    fn new(seed: u64) -> Case {
        let model = Case::model(seed);
        Case::of(random_plan(&model, seed), seed)
    }

    fn model(seed: u64) -> Model {
        random_model(seed, &Distribution::everything(seed, [3, 5, 8, 14][seed as usize % 4]))
    }

    fn of(plan: Plan, seed: u64) -> Case {
        let s = random_state(&plan, seed);
        let mut i = s.interpreter(&plan);
        let mut p = vec![0.0; plan.dims.nv];
        i.momenta(&s.q, &s.v, &mut p);
        let mut d = Derivatives::new(i.tree());
        i.derivatives(&s.q, &p, &mut d);
        Case { seed, plan, s, i, p, d }
    }

    /// Derivatives of `v` and `ṗ` along a change of state.
    fn along(&self, dq: &[f64], dp: &[f64]) -> [Vec<f64>; 2] {
        let mut i: Interpreter<D> = self.s.interpreter_of(&self.plan, |x, _| Dual::new(x, 0.0));
        rates_of(&mut i, &dual(&self.s.q, dq), &dual(&self.p, dp))
    }

    fn worst(&self, what: &str, ours: &[f64], reference: &[f64]) -> f64 {
        assert_eq!(ours.len(), reference.len());
        let size = reference.iter().fold(1e-3_f64, |m, x| m.max(x.abs()));
        let mut worst = 0.0_f64;
        for (a, b) in ours.iter().zip(reference) {
            let error = (a - b).abs() / size;
            let text = || to_toml(&self.plan.model);
            assert!(error < TOLERANCE, "seed {}: {what}: {error:e}\n{ours:?}\n{reference:?}\n{}", self.seed, text());
            worst = worst.max(error);
        }
        worst
    }
}

fn dual(x: &[f64], dx: &[f64]) -> Vec<D> {
    x.iter().zip(dx).map(|(x, dx)| Dual::new(*x, *dx)).collect()
}

fn rates_of(i: &mut Interpreter<D>, q: &[D], p: &[D]) -> [Vec<f64>; 2] {
    let zero = Dual::new(0.0, 0.0);
    let (mut v, mut qd, mut pd) = (vec![zero; p.len()], vec![zero; q.len()], vec![zero; p.len()]);
    i.rates(q, p, &mut v, &mut qd, &mut pd);
    [v, pd].map(|list| list.iter().map(|x| x.du).collect())
}

fn unit(n: usize, k: usize) -> Vec<f64> {
    (0..n).map(|j| f64::from(u8::from(j == k))).collect()
}

/// Column `k` of a block.
fn column(block: &[f64], nv: usize, k: usize) -> Vec<f64> {
    block.chunks(nv).map(|row| row[k]).collect()
}

#[test]
fn derivatives_are_those_of_dual_numbers() {
    let mut errors = Vec::new();
    for seed in 0..TREES {
        let c = Case::new(seed);
        let nv = c.plan.dims.nv;
        let mut blocks = [const { Vec::new() }; 4];
        let mut ours = [const { Vec::new() }; 4];
        for k in 0..nv {
            let mut dq = vec![0.0; c.plan.dims.nq];
            c.i.coordinate_rates(&c.s.q, &unit(nv, k), &mut dq);
            let [vq, pq] = c.along(&dq, &vec![0.0; nv]);
            let [vp, pp] = c.along(&vec![0.0; c.plan.dims.nq], &unit(nv, k));
            for (to, from) in blocks.iter_mut().zip([vq, vp, pq, pp]) {
                to.extend(from);
            }
            for (to, from) in ours.iter_mut().zip([&c.d.dv_dq, &c.d.dv_dp, &c.d.dpd_dq, &c.d.dpd_dp]) {
                to.extend(column(from, nv, k));
            }
        }
        let names = ["dv/dq", "dv/dp", "dpd/dq", "dpd/dp"];
        let each = names.iter().zip(&ours).zip(&blocks).map(|((name, a), b)| c.worst(name, a, b));
        errors.push((each.fold(0.0, f64::max), seed));
        c.worst("v", &c.d.v, &c.s.v);
        let (mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; c.plan.dims.nq], vec![0.0; nv]);
        c.s.interpreter(&c.plan).rates(&c.s.q, &c.p, &mut v, &mut qd, &mut pd);
        c.worst("pd", &c.d.pd, &pd);
    }
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [median, most, worst] = [errors[errors.len() / 2], errors[errors.len() * 99 / 100], errors[errors.len() - 1]];
    println!("median {:.1e}, 99 % {:.1e}, worst {:.1e} (seed {})", median.0, most.0, worst.0, worst.1);
    assert!(most.0 < USUAL, "{:e}", most.0);
}

#[test]
fn derivatives_at_given_velocities_are_those_of_dual_numbers() {
    let mut worst = 0.0_f64;
    for seed in 0..TREES {
        let mut c = Case::new(seed);
        let (nq, nv) = (c.plan.dims.nq, c.plan.dims.nv);
        let mut room = Derivatives::new(c.i.tree());
        let mut ours = MomentumDerivatives::new(c.i.tree());
        c.i.momentum_derivatives(&c.s.q, &c.s.v, &mut room, &mut ours);
        // The reference goes body by body and uses no composite inertia.
        let i: Interpreter<D> = c.s.interpreter_of(&c.plan, |x, _| Dual::new(x, 0.0));
        let sweeps = Sweeps { tree: i.tree(), trace: &() };
        let mut w = Workspace::new(i.tree());
        let zero = Dual::new(0.0, 0.0);
        let mut along = |dq: &[f64], dv: &[f64]| {
            let (mut p, mut pd) = (vec![zero; nv], vec![zero; nv]);
            let (q, v) = (dual(&c.s.q, dq), dual(&c.s.v, dv));
            sweeps.momenta_and_rates(&q, &v, &i.inputs(), &mut w, &mut p, &mut pd);
            [p, pd]
        };
        let du = |list: &[D]| list.iter().map(|x| x.du).collect::<Vec<f64>>();
        let re = |list: &[D]| list.iter().map(|x| x.re).collect::<Vec<f64>>();
        let [p, pd] = along(&vec![0.0; nq], &vec![0.0; nv]);
        worst = worst.max(c.worst("p", &ours.p, &re(&p))).max(c.worst("pd", &ours.pd, &re(&pd)));
        let mut blocks = [const { Vec::new() }; 4];
        let mut got = [const { Vec::new() }; 4];
        for k in 0..nv {
            let mut dq = vec![0.0; nq];
            c.i.coordinate_rates(&c.s.q, &unit(nv, k), &mut dq);
            let [pq, pdq] = along(&dq, &vec![0.0; nv]);
            let [pv, pdv] = along(&vec![0.0; nq], &unit(nv, k));
            for (to, from) in blocks.iter_mut().zip([pq, pv, pdq, pdv]) {
                to.extend(du(&from));
            }
            for (to, from) in got.iter_mut().zip([&ours.dp_dq, &ours.dp_dv, &ours.dpd_dq, &ours.dpd_dv]) {
                to.extend(column(from, nv, k));
            }
        }
        for (name, (a, b)) in ["dp/dq", "dp/dv", "dpd/dq", "dpd/dv"].iter().zip(got.iter().zip(&blocks)) {
            worst = worst.max(c.worst(name, a, b));
        }
    }
    println!("worst {worst:.1e}");
    // These derivatives divide by nothing, so the condition of the mass matrix does not matter.
    assert!(worst < 1e-12, "{worst:e}");
}

#[test]
fn conservative_trees_with_coordinate_rates_are_canonical() {
    let mut trees = 0;
    for seed in 0..TREES {
        let mut model = random_model(seed, &Distribution::everything(seed, 6));
        model.wrenches.clear();
        model.joints.iter_mut().for_each(|j| j.damping.fill(Value::ZERO));
        let plan = random_plan(&model, seed);
        if plan.tree::<f64>(&plan.default_params()).nodes.iter().any(|n| n.kind.nv() > 1) {
            continue;
        }
        trees += 1;
        let s = random_state(&plan, seed);
        let mut i = s.interpreter(&plan);
        let (nv, mut p) = (plan.dims.nv, vec![0.0; plan.dims.nv]);
        i.momenta(&s.q, &s.v, &mut p);
        let mut d = Derivatives::new(i.tree());
        i.derivatives(&s.q, &p, &mut d);
        for a in 0..nv {
            for b in 0..nv {
                assert_eq!(d.dpd_dp[a * nv + b], -d.dv_dq[b * nv + a], "seed {seed}");
                assert_eq!(d.dpd_dq[a * nv + b], d.dpd_dq[b * nv + a], "seed {seed}");
                assert_eq!(d.dv_dp[a * nv + b], d.dv_dp[b * nv + a], "seed {seed}");
            }
        }
    }
    println!("{trees} trees");
    assert!(trees > 30);
}

#[test]
fn parameters_are_those_of_dual_numbers() {
    let mut compared = 0;
    for seed in 0..TREES {
        let c = Case::new(seed);
        let (nq, nv) = (c.plan.dims.nq, c.plan.dims.nv);
        for k in 0..c.plan.params().len() {
            let (ours, mut reference) = parameter(&c.plan, &c.s, &c.i, &c.s.q, &c.d, k);
            let [v, pd] = rates_of(&mut reference, &dual(&c.s.q, &vec![0.0; nq]), &dual(&c.p, &vec![0.0; nv]));
            c.worst("v by a parameter", &ours.dv, &v);
            c.worst("pd by a parameter", &ours.dpd, &pd);
            compared += 1;
        }
    }
    println!("{compared} parameters");
    assert!(compared > 100);
}

/// The elimination of freedoms affects only the computation of the rates, not the values of the derivatives. The sweeps
/// for derivatives depend on non-rotating frames and on nothing else of an elimination.
#[test]
fn eliminations_do_not_matter() {
    let mut met = [0; 6];
    let mut worst = 0.0_f64;
    for seed in 0..TREES / 2 {
        let model = Case::model(seed);
        let [c, others @ ..] =
            [Plan::new(&model, DEFAULT_SNAP), random_plan(&model, seed), random_plan(&model, seed + TREES)]
                .map(|plan| Case::of(plan, seed));
        for other in &others {
            let ours = [&c.d.v, &c.d.pd, &c.d.dv_dq, &c.d.dv_dp, &c.d.dpd_dq, &c.d.dpd_dp];
            let theirs = [&other.d.v, &other.d.pd, &other.d.dv_dq, &other.d.dv_dp, &other.d.dpd_dq, &other.d.dpd_dp];
            for (a, b) in ours.into_iter().zip(theirs) {
                worst = worst.max(c.worst("another elimination", a, b));
            }
        }
        for node in [&c].into_iter().chain(&others).flat_map(|c| &c.i.tree().nodes) {
            let features = [
                node.elimination.deferred,
                node.elimination.before_joint,
                node.elimination.non_rotating,
                node.elimination.accumulates_momentum,
                !node.elimination.ends.is_empty(),
                !node.elimination.screws.is_empty(),
            ];
            met.iter_mut().zip(features).for_each(|(met, here)| *met += usize::from(here));
        }
    }
    // The eliminations of robots with parallel joints have non-rotating frames.
    for file in ["ur5.urdf", "chain10_planar.toml"] {
        let text =
            std::fs::read_to_string(format!("{}/../models/{file}", env!("CARGO_MANIFEST_DIR"))).expect("the model");
        let model = read::model(file, &text, &ImportOptions { base: Base::Fixed, ..ImportOptions::default() })
            .unwrap_or_else(|findings| panic!("{findings}"))
            .model;
        let fastest = search::plan(&model, PlanOptions::default());
        for seed in 0..20 {
            let plans = [fastest.clone(), Plan::new(&model, DEFAULT_SNAP)];
            let [a, b] = plans.map(|plan| Case::of(plan, seed));
            let [ours, theirs] = [&a, &b].map(|c| [&c.d.pd, &c.d.dv_dq, &c.d.dv_dp, &c.d.dpd_dq]);
            for (ours, theirs) in ours.into_iter().zip(theirs) {
                worst = worst.max(a.worst(file, ours, theirs));
            }
            met[2] += a.i.tree().nodes.iter().filter(|node| node.elimination.non_rotating).count();
        }
    }
    println!("worst {worst:.1e}, met {met:?}");
    assert!(met.iter().all(|n| *n > 20), "{met:?}");
}

/// Every kind of joint, wrench, drive and mimic occurs among the trees.
#[test]
fn the_trees_have_everything() {
    let mut met = [0; 10];
    for seed in 0..TREES {
        let c = Case::new(seed);
        for node in &c.i.tree().nodes {
            met[match node.kind {
                Kind::Revolute => 0,
                Kind::Prismatic => 1,
                Kind::Helical { .. } => 2,
                Kind::Planar => 3,
                Kind::Spherical => 4,
                Kind::Floating => 5,
            }] += 1;
            met[6] += usize::from(node.elimination.unknown.is_some() && !node.elimination.deferred);
            met[7] += usize::from(matches!(node.source, mbd_runtime::tree::Source::Drive { .. }));
        }
        for wrench in &c.i.tree().wrenches {
            met[8 + usize::from(wrench.axes == mbd_runtime::tree::WrenchAxes::Ground)] += 1;
        }
    }
    println!("{met:?}");
    assert!(met.iter().all(|n| *n > 20), "{met:?}");
}
