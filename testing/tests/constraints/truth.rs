//! Consistency of the reference for constraints: definitions of positions against those of velocities, and momenta
//! against accelerations. `dense_reference.rs` compares the sweeps with the reference.

use mbd_runtime::System;
use mbd_testing::closed::{random_loops, LoopKnobs, LoopSystem};
use mbd_testing::random::Rng;

use crate::dense::minimal::{choices, full, others, pivot, rates};
use crate::dense::{rows, thesis, Truth, Vector};

const SYSTEMS: u64 = 300;

fn system(seed: u64) -> LoopSystem {
    match seed % 4 {
        0 => random_loops(seed, &LoopKnobs::plain()),
        _ => random_loops(seed, &LoopKnobs::everything(seed, [4, 7, 10][seed as usize % 3])),
    }
}

/// Residuals are zero in the state, and the rows are their rates.
#[test]
fn residuals_and_rates_agree() {
    let (mut gap, mut worst, mut kinds) = (0.0_f64, 0.0_f64, std::collections::BTreeMap::new());
    for seed in 0..SYSTEMS {
        let s = system(seed);
        let rows = rows(&s);
        let mut i = s.state.interpreter(&s.open);
        for residual in rows.residuals(&mut i, &s.state.q).concat() {
            gap = gap.max(residual.abs());
            assert!(residual.abs() < 1e-13, "seed {seed}: {residual:e}\n{:#?}", s.model.constraints);
        }
        let (mut moving, q) = rows.moving(&s.state.v);
        let along = rows.residuals(&mut moving, &q);
        let rates = rows.rates(&mut i, &s.state.q, &s.state.v);
        for (c, (along, rates)) in s.model.constraints.iter().zip(along.iter().zip(&rates)) {
            let name = format!("{:?}", c.kind);
            let name = name.trim_start_matches("Loop { kind: ").split([' ', ',']).next().unwrap_or("").to_string();
            *kinds.entry(name).or_insert(0) += 1;
            assert!(along.len() <= rates.len());
            let size = rates.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
            for (a, b) in along.iter().zip(rates) {
                worst = worst.max((a.du - b).abs() / size);
                assert!((a.du - b).abs() < 1e-12 * size, "seed {seed}: {} against {b}\n{c:#?}", a.du);
            }
        }
    }
    println!("residuals {gap:.1e}, rates {worst:.1e}, {kinds:?}");
    assert!(kinds.len() == 22 && kinds.values().all(|n| *n > 10), "{kinds:?}");
}

/// Along `q̇` and `ṗ⁺`, the velocities that follow from `(q, p⁺)` change by the accelerations. The test uses central
/// differences.
#[test]
fn velocities_along_the_motion_have_the_accelerations() {
    let (mut worst, mut met, mut redundant) = (0.0_f64, 0, 0);
    for seed in 0..SYSTEMS / 3 {
        let s = system(seed);
        if s.open.dims.drive_q > 0 {
            continue;
        }
        let mut rng = Rng::new(seed, 7);
        let p = Vector::from_fn(s.open.dims.nv, |_, _| rng.around(1.0));
        let truth = Truth::new(&s, &p);
        // The differences have about six digits, which ill-conditioned systems would lose.
        if !truth.regular() || truth.dense.condition() > 20.0 || truth.unbound.norm() > 100.0 {
            continue;
        }
        met += 1;
        redundant += usize::from(truth.dense.rank < truth.dense.phi.nrows());
        let rates = truth.momentum_rates();
        let mut qd = vec![0.0; s.state.q.len()];
        s.state.interpreter(&s.open).coordinate_rates(&s.state.q, &truth.v.as_slice().to_vec(), &mut qd);
        let h = 1e-4;
        let at = |h: f64| {
            let mut moved = s.clone();
            moved.state.q.iter_mut().zip(&qd).for_each(|(q, qd)| *q += h * qd);
            Truth::new(&moved, &(&p + &rates * h)).v
        };
        let slope = ((at(h) - at(-h)) * 8.0 - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        let size = truth.motion.x.norm().max(truth.unbound_motion.norm()).max(1.0);
        let error = (slope - &truth.motion.x).norm() / size;
        assert!(error < 1e-5, "seed {seed}: {error:e}");
        worst = worst.max(error);
    }
    println!("{met} systems, {redundant} with redundant rows: {worst:.1e}");
    assert!(met > 30 && redundant > 5);
}

/// The recursion of the thesis for minimal coordinates gives `d/dt (Bᵀ M v)` for every choice of dependent joints.
#[test]
fn the_thesis_s_recursion_is_right() {
    let (mut worst, mut worst_v, mut met) = (0.0_f64, 0.0_f64, 0);
    for seed in 0..60 {
        let s = thesis::chain(seed);
        let nv = s.open.dims.nv;
        let links = thesis::Chain::new(&s, &s.state.q);
        let mut rng = Rng::new(seed, 8);
        let momenta = Vector::from_fn(nv, |_, _| rng.around(1.0));
        let rank = Truth::new(&s, &momenta).dense.rank;
        for count in 1..=rank.min(links.links()) {
            for joints in choices(links.links(), count) {
                let dependents = links.velocities(&joints);
                if dependents.len() != rank {
                    continue;
                }
                let independents = others(nv, &dependents);
                let p = full(&momenta.select_rows(&independents), nv, &dependents);
                let truth = Truth::new(&s, &p);
                // A badly conditioned choice loses digits, so it is left out.
                if pivot(&truth.dense, &dependents) < 0.1 || !truth.regular() || truth.v.amax() > 100.0 {
                    continue;
                }
                let (v, found) = thesis::motion(&s, &p, &joints);
                let exact = rates(&s, &truth, &dependents);
                let scale = truth.open_rates.amax().max(exact.amax());
                let errors = [(&v - &truth.v).amax() / truth.unbound.amax(), (&found - &exact).amax() / scale];
                assert!(errors[0] < 1e-12, "seed {seed}, {joints:?}: {errors:?}");
                assert!(errors[1] < 1e-10, "seed {seed}, {joints:?}: {errors:?}\n{found}{exact}");
                (worst_v, worst) = (worst_v.max(errors[0]), worst.max(errors[1]));
                met += 1;
            }
        }
    }
    println!("{met} choices: velocities {worst_v:.1e}, rates {worst:.1e}");
    assert!(met > 100);
}
