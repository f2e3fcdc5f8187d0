//! Penalties in place of multipliers: a row is violated by `σ/α`, which is less the larger the weight `α`.

use mbd_runtime::{Conjugate, Constrained, Energetic, Interpreter, System};
use mbd_testing::closed::{random_loops, LoopKnobs};
use mbd_testing::eliminations::random_plan;
use mbd_testing::largest_difference;

#[test]
fn rows_give_way_as_their_weight_says() {
    let mut looked = 0;
    for seed in 0..40 {
        let system = random_loops(seed, &LoopKnobs::plain());
        let plan = random_plan(&system.model, seed);
        let params = plan.default_params();
        let tree = plan.tree(&params);
        if tree.constraints.is_empty() || tree.dims.drive_v > 0 {
            continue;
        }
        looked += 1;
        let gravity = plan.gravity(&params);
        let mut held = Interpreter::new(tree.clone(), gravity);
        let q = held.neutral();
        let p: Vec<f64> = (0..tree.dims.nv).map(|k| (1.7 * k as f64 + 0.3).sin()).collect();
        let mut exact = held.zero_momenta();
        held.project_momenta(0.0, &q, &mut p.clone(), &mut exact, &mut held.zero_rows());

        let mut worst = [0.0_f64; 2];
        for (weight, worst) in [1e4, 1e6].into_iter().zip(&mut worst) {
            let mut soft = Interpreter::new(tree.penalised(weight, 0.0), gravity);
            let (mut v, mut sigma, mut freed) = (soft.zero_momenta(), soft.zero_rows(), p.clone());
            soft.project_momenta(0.0, &q, &mut freed, &mut v, &mut sigma);
            // The definition σ = α Φ v, row by row.
            let (mut gap, mut phi) = (soft.zero_rows(), soft.zero_entries());
            soft.constraint_residuals(&q, &mut gap, &mut phi);
            let scale =
                v.iter().fold(1e-3_f64, |m, x| m.max(x.abs())) * phi.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
            for (row, sigma) in soft.rows().iter().zip(&sigma) {
                let at = row.first..row.first + row.len;
                let rate: f64 = at.map(|k| phi[k] * v[soft.entry_columns()[k]]).sum();
                assert!((rate - sigma / weight).abs() < 1e-9 * scale, "seed {seed}: {rate} {sigma}");
            }
            // Projected momenta and the kinetic energy are those of the velocities.
            let mut again = soft.zero_momenta();
            soft.conjugate_momenta(&q, &v, &mut again);
            let size = p.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
            assert!(again.iter().zip(&freed).all(|(a, b)| (a - b).abs() < 1e-8 * size), "seed {seed}");
            let kinetic = 0.5 * v.iter().zip(&again).map(|(v, p)| v * p).sum::<f64>();
            assert!((soft.energies(&q, &p).0 - kinetic).abs() < 1e-8 * kinetic.abs().max(1e-3), "seed {seed}");
            *worst = largest_difference(&v, &exact);
        }
        assert!(worst[1] < 0.1 * worst[0] || worst[1] < 1e-9, "seed {seed}: {worst:?}");
    }
    assert!(looked >= 10, "{looked}");
}
