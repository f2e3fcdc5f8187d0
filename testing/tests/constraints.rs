//! Mechanisms with loops and couplings against dense matrices: random trees with random constraints of every kind, closed in
//! the state that is looked at, redundant ones included.
//!
//! `Φ` of the reference comes from the definitions in ground axes, `M` and `h` from the open tree, multipliers from singular
//! values (`dense/mod.rs`). Rows of the two sides need not be the same, only what they span.

use std::collections::BTreeMap;

use mbd_codegen::plan::{Forms, Plan, PlanOptions};
use mbd_runtime::{Accelerated, Constrained, Energetic, Interpreter, System};
use mbd_testing::closed::{random_loops, LoopKnobs, LoopSystem};
use mbd_testing::random::{Knobs, Rng};

mod dense;

use dense::minimal::{choices, full, least, others, pivot};
use dense::{minimal, thesis, Dense, Matrix, Truth, Vector};

const SYSTEMS: u64 = 500;

/// A system in a state, its motion by the reference, and what is tested.
struct Case {
    seed: u64,
    system: LoopSystem,
    i: Interpreter<f64>,
    p: Vector,
    truth: Truth,
    /// The smallest part of a row that rows before it leave and that still counts.
    pivot: f64,
}

fn system(seed: u64) -> LoopSystem {
    match seed % 5 {
        0 => random_loops(seed, &LoopKnobs::plain()),
        // Whole joints in a plane: two or three rows of each count.
        1 => {
            let kinds = [3.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.5, 0.0, 0.5, 0.0];
            let tree = Knobs {
                bodies: (3, 8),
                branching: 0.3,
                kinds: [4.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                ..Knobs::default()
            };
            random_loops(seed, &LoopKnobs { planar: true, kinds, tree, ..LoopKnobs::plain() })
        }
        _ => random_loops(seed, &LoopKnobs::everything(seed, [4, 6, 10][seed as usize / 5 % 3])),
    }
}

fn plan_of(system: &LoopSystem, seed: u64) -> Plan {
    // Most as they stand; some as the search lays them out.
    let forms = if seed % 7 == 0 { Forms::ALL[seed as usize / 7 % 3] } else { Forms::Single };
    let searched = forms != Forms::Single;
    let options = PlanOptions { forms, accelerations: searched, mass_matrix: false, ..PlanOptions::default() };
    Plan::new(&system.model, options)
}

impl Case {
    /// Nothing where drives and loops contradict one another, or the rank is about to change.
    fn new(seed: u64) -> Option<Case> {
        Case::of(seed, system(seed))
    }

    fn of(seed: u64, system: LoopSystem) -> Option<Case> {
        let mut rng = Rng::new(seed, 9);
        let p = Vector::from_fn(system.open.dims.nv, |_, _| rng.around(1.0));
        let truth = Truth::new(&system, &p);
        if !truth.regular() || !truth.dense.condition().is_finite() {
            return None;
        }
        let i = system.state.interpreter(&plan_of(&system, seed));
        let mut case = Case { seed, system, i, p, truth, pivot: 1.0 };
        case.pivot = case.least_pivot();
        Some(case)
    }

    fn q(&self) -> Vec<f64> {
        self.system.state.q.clone()
    }

    /// Coordinates moved along velocities, quaternions of unit length.
    fn moved(&self, v: &Vector) -> Vec<f64> {
        let mut q: Vec<f64> = self.q().iter().zip(self.coordinate_rates(v).iter()).map(|(q, qd)| q + qd).collect();
        for at in self.i.quaternions() {
            let norm = q[at..at + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
            q[at..at + 4].iter_mut().for_each(|x| *x /= norm);
        }
        q
    }

    fn least_pivot(&mut self) -> f64 {
        let phi = self.phi(&self.q()).1;
        let (mut residual, mut dq, mut pivots) = (self.i.zero_rows(), self.i.rest(), self.i.zero_rows());
        self.i.correction(&self.q(), &mut residual, &mut dq, &mut pivots);
        let a = &phi * self.truth.dense.m.clone().cholesky().expect("M is positive definite").solve(&phi.transpose());
        let kept = pivots.iter().enumerate().filter(|(_, pivot)| **pivot > 0.0);
        kept.map(|(k, pivot)| pivot / a[(k, k)]).fold(1.0, f64::min)
    }

    /// Entries of `Φ` as the interpreter has them.
    fn phi(&mut self, q: &[f64]) -> (Vec<f64>, Matrix) {
        let (mut residual, mut entries) = (self.i.zero_rows(), self.i.zero_entries());
        self.i.closure(&q.to_vec(), &mut residual, &mut entries);
        let mut phi = Matrix::zeros(residual.len(), self.p.len());
        for (k, row) in self.i.rows().iter().enumerate() {
            for at in row.first..row.first + row.len {
                phi[(k, self.i.entry_columns()[at])] += entries[at];
            }
        }
        (residual, phi)
    }

    fn rates(&mut self, p: &Vector) -> (Vector, Vector) {
        let (mut qd, mut pd) = (self.i.neutral(), self.i.rest());
        self.i.state_rates(0.0, &self.q(), &p.as_slice().to_vec(), &mut qd, &mut pd);
        (qd.into(), pd.into())
    }

    fn coordinate_rates(&self, v: &Vector) -> Vector {
        let mut qd = self.i.neutral();
        self.i.coordinate_rates(&self.q(), &v.as_slice().to_vec(), &mut qd);
        qd.into()
    }
}

/// Errors of one comparison, all systems.
struct Errors {
    what: &'static str,
    tolerance: f64,
    all: Vec<(f64, u64, f64, f64)>,
}

impl Errors {
    fn new(what: &'static str, tolerance: f64) -> Errors {
        Errors { what, tolerance, all: Vec::new() }
    }

    fn add(&mut self, c: &Case, ours: &Vector, reference: &Vector, scale: f64) {
        assert_eq!(ours.len(), reference.len());
        let finite = ours.iter().all(|x| x.is_finite());
        let error = if finite { (ours - reference).amax() / scale.max(1e-3) } else { f64::INFINITY };
        self.all.push((error, c.seed, c.truth.dense.condition(), c.pivot));
    }

    /// Relative to the scale and the square of the condition: multipliers are solved for with `Φ M⁻¹Φᵀ`.
    fn done(mut self) {
        self.all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let n = self.all.len();
        let at = |part: f64| self.all[((n as f64 * part) as usize).min(n - 1)];
        println!("{}: {n} systems, median {:.1e}, 99 % {:.1e}", self.what, at(0.5).0, at(0.99).0);
        for (error, seed, condition, pivot) in self.all.iter().rev().take(12) {
            println!("    seed {seed}: {error:.1e}, condition {condition:.0e}, pivot {pivot:.0e}");
        }
        let bad: Vec<_> = self.all.iter().filter(|(e, ..)| *e > self.tolerance).collect();
        assert!(bad.is_empty(), "{}: {} of {n} beyond {:e}: {bad:?}", self.what, bad.len(), self.tolerance);
    }
}

/// Some columns of an orthonormal basis of what a matrix' rows do not reach.
fn unreached(c: &Case) -> Matrix {
    c.truth.dense.allowed()
}

#[test]
fn rates_are_those_of_dense_matrices() {
    let mut velocity = Errors::new("qd", 1e-11);
    let mut rate = Errors::new("pd", 1e-11);
    let (mut redundant, mut skipped, mut rank) = (0, 0, BTreeMap::new());
    for seed in 0..SYSTEMS {
        let Some(mut c) = Case::new(seed) else {
            skipped += 1;
            continue;
        };
        redundant += usize::from(c.truth.dense.rank < c.truth.dense.phi.nrows());
        *rank.entry(c.truth.dense.rank).or_insert(0) += 1;
        let (qd, pd) = c.rates(&c.p.clone());
        let exact = c.coordinate_rates(&c.truth.v);
        velocity.add(&c, &qd, &exact, c.truth.unbound.amax().max(exact.amax()));
        // But for what multipliers may add.
        let free = unreached(&c);
        let (ours, exact) = (free.transpose() * pd, free.transpose() * c.truth.momentum_rates());
        let turning = c.truth.phi_rate.transpose() * &c.truth.sigma;
        let scale = c.truth.open_rates.amax().max(turning.amax());
        rate.add(&c, &ours, &exact, scale);
    }
    println!("{skipped} skipped, {redundant} with redundant rows, rank: {rank:?}");
    velocity.done();
    rate.done();
}

#[test]
fn rows_are_those_of_the_definitions() {
    let mut entries = Errors::new("rows", 1e-12);
    let mut residuals = Errors::new("residuals", 1e-13);
    let mut slopes = Errors::new("residuals along a motion", 1e-8);
    for seed in 0..SYSTEMS {
        let Some(mut c) = Case::new(seed) else { continue };
        let q = c.q();
        let (residual, phi) = c.phi(&q);
        let n = residual.len();
        residuals.add(&c, &residual.into(), &Vector::zeros(n), 1.0);
        // Everything that one side allows the other allows.
        let own = Dense::of(c.truth.dense.m.clone(), phi.clone(), Vector::zeros(n), Vector::zeros(c.p.len()));
        assert_eq!(own.rank, c.truth.dense.rank, "seed {seed}");
        let through = &phi * c.truth.dense.allowed();
        entries.add(&c, &Vector::from_element(1, through.amax()), &Vector::zeros(1), phi.amax());
        // Residuals change as the rows say: near by, where they are not zero.
        let mut rng = Rng::new(seed, 10);
        let v = Vector::from_fn(c.p.len(), |_, _| rng.around(1.0));
        let h = 1e-4;
        let mut value = |steps: f64| {
            let moved = c.moved(&(&v * (steps * h)));
            Vector::from(c.phi(&moved).0)
        };
        let slope = ((value(1.0) - value(-1.0)) * 8.0 - (value(2.0) - value(-2.0))) / (12.0 * h);
        let mut expected = &phi * &v;
        for (k, row) in c.i.rows().iter().enumerate().filter(|(_, row)| !row.holonomic) {
            assert_eq!(slope[k], 0.0, "seed {seed}: {row:?}");
            expected[k] = 0.0;
        }
        slopes.add(&c, &slope, &expected, expected.amax().max(1.0));
    }
    entries.done();
    residuals.done();
    slopes.done();
}

#[test]
fn accelerations_and_multipliers_are_those_of_dense_matrices() {
    let mut acceleration = Errors::new("a", 1e-11);
    let mut forces = Errors::new("forces", 1e-11);
    for seed in 0..SYSTEMS {
        let Some(mut c) = Case::new(seed) else { continue };
        let v = c.truth.v.as_slice().to_vec();
        let mut a = c.i.rest();
        c.i.state_accelerations(&c.q(), &v, &mut a);
        let scale = c.truth.unbound_motion.amax().max(c.truth.motion.x.amax());
        acceleration.add(&c, &a.into(), &c.truth.motion.x, scale);
        let mut lambda = c.i.zero_rows();
        c.i.multipliers(0.0, &c.q(), &v, &mut lambda);
        let force = c.phi(&c.q()).1.transpose() * Vector::from(lambda);
        let bare = &c.truth.dense.m * &c.truth.unbound_motion;
        forces.add(&c, &force, &c.truth.motion.force, bare.amax().max(c.truth.motion.force.amax()));
    }
    acceleration.done();
    forces.done();
}

#[test]
fn settled_states_are_those_of_dense_matrices() {
    let mut velocity = Errors::new("v", 1e-11);
    let mut momentum = Errors::new("p", 1e-11);
    let mut pull = Errors::new("forces", 1e-11);
    let mut kinetic = Errors::new("T", 1e-11);
    for seed in 0..SYSTEMS {
        let Some(mut c) = Case::new(seed) else { continue };
        let mut p = c.p.as_slice().to_vec();
        let (mut v, mut sigma) = (c.i.rest(), c.i.zero_rows());
        c.i.settle(0.0, &c.q(), &mut p, &mut v, &mut sigma);
        velocity.add(&c, &v.into(), &c.truth.v, c.truth.unbound.amax().max(c.truth.v.amax()));
        let carried = &c.truth.dense.m * &c.truth.v + &c.truth.dense.driven;
        let scale = c.p.amax().max(c.truth.pull.amax());
        momentum.add(&c, &p.into(), &carried, scale);
        let force = c.phi(&c.q()).1.transpose() * Vector::from(sigma);
        pull.add(&c, &force, &c.truth.pull, scale);
        let (ours, _) = c.i.state_energy(&c.q(), &c.p.as_slice().to_vec());
        let mut open = c.system.state.interpreter(&c.system.open);
        let (exact, _) = open.energy(&c.system.state.q, carried.as_slice());
        let unbound = 0.5 * c.truth.unbound.dot(&(&c.truth.dense.m * &c.truth.unbound));
        kinetic.add(&c, &Vector::from_element(1, ours), &Vector::from_element(1, exact), exact.abs().max(unbound));
    }
    velocity.done();
    momentum.done();
    pull.done();
    kinetic.done();
}

/// Near closed positions: `δq = −M⁻¹Φᵀ(Φ M⁻¹Φᵀ)⁺φ` with residuals and rows as the interpreter has them there.
#[test]
fn corrections_are_those_of_dense_matrices() {
    let mut corrections = Errors::new("dq", 1e-10);
    let mut left = Errors::new("residuals left", 1e-6);
    for seed in 0..SYSTEMS {
        let Some(mut c) = Case::new(seed) else { continue };
        let n = c.truth.dense.phi.nrows();
        // Redundant rows are so on closed positions only; elsewhere nothing tells the two sides which to leave out.
        if c.truth.dense.rank < n || c.truth.dense.condition() > 100.0 {
            continue;
        }
        let mut rng = Rng::new(seed, 11);
        let v = Vector::from_fn(c.p.len(), |_, _| rng.around(1e-4));
        let moved = c.moved(&v);
        let (residual, phi) = c.phi(&moved);
        let residual = Vector::from(residual);
        let mut m = vec![0.0; c.p.len() * c.p.len()];
        c.system.state.interpreter(&c.system.open).mass_matrix(&moved, &mut m);
        let m = Matrix::from_row_slice(c.p.len(), c.p.len(), &m);
        let there = Dense::of(m, phi, Vector::zeros(n), Vector::zeros(c.p.len()));
        let exact = there.solve(&Vector::zeros(c.p.len()), &-&residual).x;
        let (mut found, mut dq, mut pivots) = (c.i.zero_rows(), c.i.rest(), c.i.zero_rows());
        c.i.correction(&moved, &mut found, &mut dq, &mut pivots);
        assert!(pivots.iter().all(|p| *p > 0.0), "seed {seed}: {pivots:?}");
        let scale = exact.amax();
        assert_eq!(found, residual.as_slice());
        corrections.add(&c, &Vector::from(dq.clone()), &exact, scale);
        let mut back = c.i.neutral();
        c.i.coordinate_rates(&moved, &dq, &mut back);
        let closed: Vec<f64> = moved.iter().zip(&back).map(|(q, dq)| q + dq).collect();
        let rest = Vector::from(c.phi(&closed).0);
        left.add(&c, &rest, &Vector::zeros(n), 1.0);
    }
    corrections.done();
    left.done();
}

/// Off closed positions the rates of those that decay do: `Φ v = b − decay · φ`.
#[test]
fn errors_of_positions_decay() {
    let mut rates = Errors::new("decay", 1e-11);
    for seed in 0..SYSTEMS / 2 {
        let mut system = system(seed);
        for c in &mut system.model.constraints {
            c.decay = mbd_codegen::model::Value::Const(3.0);
        }
        system.state.drive[1].fill(0.0);
        let Some(mut c) = Case::of(seed, system) else { continue };
        if c.truth.dense.rank < c.truth.dense.phi.nrows() {
            continue;
        }
        let mut rng = Rng::new(seed, 12);
        let v = Vector::from_fn(c.p.len(), |_, _| rng.around(1e-2));
        let moved = c.moved(&v);
        let (residual, phi) = c.phi(&moved);
        let mut p = c.p.as_slice().to_vec();
        let (mut v, mut sigma) = (c.i.rest(), c.i.zero_rows());
        c.i.settle(0.0, &moved, &mut p, &mut v, &mut sigma);
        let mut wanted = Vector::from(residual) * -3.0;
        for (k, _) in c.i.rows().iter().enumerate().filter(|(_, row)| !row.holonomic) {
            wanted[k] = 0.0;
        }
        rates.add(&c, &(phi * Vector::from(v)), &wanted, c.truth.unbound.amax());
    }
    rates.done();
}

/// Any choice of independent velocities: `ṗ_ind` out of `ṗ⁺` at `p⁺_dep = 0` is `d/dt (Bᵀ M v)`.
#[test]
fn minimal_coordinates_are_a_gauge() {
    let mut velocity = Errors::new("qd", 1e-11);
    let mut rate = Errors::new("pd of independents", 1e-10);
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
            let (qd, pd) = c.rates(&p);
            let exact = c.coordinate_rates(&c.truth.v);
            velocity.add(&c, &qd, &exact, c.truth.unbound.amax().max(exact.amax()));
            let b = minimal::tangents(&phi, &dependents);
            let ours = b.transpose() * pd;
            let exact = minimal::rates(&c.system, &c.truth, &dependents);
            let turning = c.truth.phi_rate.transpose() * &c.truth.sigma;
            let scale = c.truth.open_rates.amax().max(turning.amax()).max(exact.amax());
            rate.add(&c, &ours, &exact, scale * b.amax());
        }
    }
    println!("{choices_met} choices");
    assert!(choices_met > 500);
    velocity.done();
    rate.done();
}

/// The recursion of section 5.3.3 and the gauge, on the chains that it is for.
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
