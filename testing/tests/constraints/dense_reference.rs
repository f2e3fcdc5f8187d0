//! Mechanisms with loops and couplings against dense matrices. The mechanisms are random trees with random constraints
//! of every kind, redundant ones included, which hold in the state of the test.
//!
//! `Φ` of the reference comes from the definitions in ground axes, `M` and `h` from the open tree, multipliers from
//! singular values (`dense/mod.rs`). The rows of interpreter and reference need not be the same, but must span the same
//! space.

use std::collections::BTreeMap;

use mbd_runtime::tree::row_order::early_rows;
use mbd_runtime::{Accelerated, Constrained, Energetic, System};
use mbd_testing::random::Rng;

use crate::dense::case::{system, Case, Errors, SYSTEMS};
use crate::dense::{Dense, Matrix, Vector};

#[test]
fn rates_are_those_of_dense_matrices() {
    let mut velocity = Errors::new("qd", 1e-11);
    let mut rate = Errors::new("pd", 1e-11);
    let (mut redundant, mut early, mut skipped, mut rank) = (0, 0, 0_u64, BTreeMap::new());
    for seed in 0..SYSTEMS {
        let Some(mut c) = Case::new(seed) else {
            skipped += 1;
            continue;
        };
        redundant += usize::from(c.truth.dense.rank < c.truth.dense.phi.nrows());
        early += usize::from(!early_rows(c.i.tree()).is_empty());
        *rank.entry(c.truth.dense.rank).or_insert(0) += 1;
        let (qd, pd) = c.rates(&c.p.clone());
        let exact = c.coordinate_rates(&c.truth.v);
        velocity.add(&c, &qd, &exact, c.truth.unbound.amax().max(exact.amax()));
        // Rates are compared only along directions that the constraints allow: multipliers may differ in the others.
        let free = c.truth.dense.allowed();
        let (ours, exact) = (free.transpose() * pd, free.transpose() * c.truth.momentum_rates());
        let turning = c.truth.phi_rate.transpose() * &c.truth.sigma;
        let scale = c.truth.open_rates.amax().max(turning.amax());
        rate.add(&c, &ours, &exact, scale);
    }
    assert!(SYSTEMS - skipped >= 500 && redundant > 150 && early > 30, "{skipped} {redundant} {early}");
    println!("{skipped} skipped, {redundant} with redundant rows, {early} with early rows, rank: {rank:?}");
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
        // The rows of interpreter and reference must allow the same motions.
        let own = Dense::of(c.truth.dense.m.clone(), phi.clone(), Vector::zeros(n), Vector::zeros(c.p.len()));
        assert_eq!(own.rank, c.truth.dense.rank, "seed {seed}");
        let through = &phi * c.truth.dense.allowed();
        entries.add(&c, &Vector::from_element(1, through.amax()), &Vector::zeros(1), phi.amax());
        // The rows are the derivatives of the residuals, compared by central differences.
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
        let mut a = c.i.zero_momenta();
        c.i.generalized_accelerations(&c.q(), &v, &mut a);
        let scale = c.truth.unbound_motion.amax().max(c.truth.motion.x.amax());
        acceleration.add(&c, &a.into(), &c.truth.motion.x, scale);
        let mut lambda = c.i.zero_rows();
        c.i.multipliers(0.0, &c.q(), &v, &mut lambda);
        let force = c.phi(&c.q()).1.transpose() * Vector::from(lambda);
        let bare = &c.truth.dense.m * &c.truth.unbound_motion;
        let scale = bare.amax().max(c.truth.dense.m.amax() * scale);
        forces.add(&c, &force, &c.truth.motion.force, scale);
    }
    acceleration.done();
    forces.done();
}

#[test]
fn projected_momenta_are_those_of_dense_matrices() {
    let mut velocity = Errors::new("v", 1e-11);
    let mut held = Errors::new("rows held", 1e-12);
    let mut momentum = Errors::new("p", 1e-11);
    let mut pull = Errors::new("forces", 1e-11);
    let mut kinetic = Errors::new("T", 1e-11);
    for seed in 0..SYSTEMS {
        let Some(mut c) = Case::new(seed) else { continue };
        let mut p = c.p.as_slice().to_vec();
        let (mut v, mut sigma) = (c.i.zero_momenta(), c.i.zero_rows());
        c.i.project_momenta(0.0, &c.q(), &mut p, &mut v, &mut sigma);
        let phi = c.phi(&c.q()).1;
        let (v, scale) = (Vector::from(v), c.truth.unbound.amax().max(c.truth.v.amax()));
        velocity.add(&c, &v, &c.truth.v, scale);
        // `Φ v` of the exact velocities is the prescribed motion of the constraints.
        held.add(&c, &(&phi * &v), &(&phi * &c.truth.v), phi.amax() * scale);
        let carried = &c.truth.dense.m * &c.truth.v + &c.truth.dense.driven;
        let scale = c.p.amax().max(c.truth.pull.amax()).max(c.truth.dense.m.amax() * scale);
        momentum.add(&c, &p.into(), &carried, scale);
        let force = c.phi(&c.q()).1.transpose() * Vector::from(sigma);
        pull.add(&c, &force, &c.truth.pull, scale);
        let (ours, _) = c.i.energies(&c.q(), &c.p.as_slice().to_vec());
        let mut open = c.system.state.interpreter(&c.system.open);
        let (exact, _) = open.energy(&c.system.state.q, carried.as_slice());
        let unbound = 0.5 * c.truth.unbound.dot(&(&c.truth.dense.m * &c.truth.unbound));
        kinetic.add(&c, &Vector::from_element(1, ours), &Vector::from_element(1, exact), exact.abs().max(unbound));
    }
    velocity.done();
    held.done();
    momentum.done();
    pull.done();
    kinetic.done();
}

/// Near closed positions, the correction is `δq = −M⁻¹Φᵀ(Φ M⁻¹Φᵀ)⁺φ` with the residuals and rows of the interpreter.
#[test]
fn corrections_are_those_of_dense_matrices() {
    let mut corrections = Errors::new("dq", 1e-10);
    let mut left = Errors::new("residuals left", 3e-6);
    for seed in 0..SYSTEMS {
        let Some(mut c) = Case::new(seed) else { continue };
        let n = c.truth.dense.phi.nrows();
        // Rows are redundant at closed positions only; elsewhere interpreter and reference may omit different rows.
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
        let (mut found, mut dq, mut pivots) = (c.i.zero_rows(), c.i.zero_momenta(), c.i.zero_rows());
        c.i.position_correction(&moved, &mut found, &mut dq, &mut pivots);
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

/// Away from closed positions, residuals of constraints with a decay change by `Φ v = b − decay · φ`.
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
        let (mut v, mut sigma) = (c.i.zero_momenta(), c.i.zero_rows());
        c.i.project_momenta(0.0, &moved, &mut p, &mut v, &mut sigma);
        let mut wanted = Vector::from(residual) * -3.0;
        for (k, _) in c.i.rows().iter().enumerate().filter(|(_, row)| !row.holonomic) {
            wanted[k] = 0.0;
        }
        rates.add(&c, &(phi * Vector::from(v)), &wanted, c.truth.unbound.amax());
    }
    rates.done();
}
