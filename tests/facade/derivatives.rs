//! Derivatives in use: implicit midpoint steps by Newton's method, with generated code and with the interpreter.

use multibody::codegen::read::{self, Base, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::{Differentiable, Interpreter, MomentumDerivatives, StateDerivatives};

multibody::mbd_model! {
    path = "models/double_pendulum.toml",
    name = DoublePendulum,
    outputs = [rates, momenta, energy, derivatives, momentum_derivatives, mass_matrix]
}

/// Makes one step `z₁ = z₀ + h f((z₀ + z₁)/2)` of a system whose coordinates are angles. Returns the largest residual
/// of every iteration.
fn midpoint<M: Differentiable<Scalar = f64>>(
    m: &mut M,
    h: f64,
    q: &mut M::Coordinates,
    p: &mut M::Momenta,
) -> Vec<f64> {
    let n = p.as_ref().len();
    let (q0, p0) = (q.clone(), p.clone());
    let mut d = m.zero_derivatives();
    let mut residuals = Vec::new();
    for _ in 0..6 {
        let (mut q_mid, mut p_mid) = (q.clone(), p.clone());
        for k in 0..n {
            q_mid.as_mut()[k] = 0.5 * (q0.as_ref()[k] + q.as_ref()[k]);
            p_mid.as_mut()[k] = 0.5 * (p0.as_ref()[k] + p.as_ref()[k]);
        }
        m.rate_derivatives(0.0, &q_mid, &p_mid, &mut d);
        let mut step: Vec<f64> = (0..n).map(|k| q.as_ref()[k] - q0.as_ref()[k] - h * d.v.as_ref()[k]).collect();
        step.extend((0..n).map(|k| p.as_ref()[k] - p0.as_ref()[k] - h * d.pd.as_ref()[k]));
        residuals.push(step.iter().fold(0.0_f64, |m, x| m.max(x.abs())));
        let entry = |a: usize, b: usize| {
            let block = d.blocks()[a / n][b / n];
            f64::from(u8::from(a == b)) - 0.5 * h * block.as_ref()[a % n].as_ref()[b % n]
        };
        solve((0..2 * n).map(|a| (0..2 * n).map(|b| entry(a, b)).collect()).collect(), &mut step);
        for k in 0..n {
            q.as_mut()[k] -= step[k];
            p.as_mut()[k] -= step[n + k];
        }
    }
    residuals
}

/// Gaussian elimination without pivoting, for a matrix near the unit matrix.
fn solve(mut a: Vec<Vec<f64>>, x: &mut [f64]) {
    let n = x.len();
    for k in 0..n {
        let pivot = a[k].clone();
        for i in (0..n).filter(|&i| i != k) {
            let f = a[i][k] / pivot[k];
            a[i].iter_mut().zip(&pivot).for_each(|(x, p)| *x -= f * p);
            x[i] -= f * x[k];
        }
    }
    (0..n).for_each(|k| x[k] /= a[k][k]);
}

/// With exact derivatives, every iteration squares the residual, down to rounding.
fn assert_newton(residuals: &[f64]) {
    println!("{residuals:?}");
    assert!(residuals[4] < 1e-14, "{residuals:?}");
    for pair in residuals.windows(2).filter(|pair| pair[0] < 1e-2 && pair[0] > 1e-7) {
        assert!(pair[1] < 5.0 * pair[0] * pair[0] + 1e-14, "{residuals:?}");
    }
}

#[test]
fn newton_converges_quadratically_in_implicit_steps() {
    let mut model = DoublePendulum::new();
    let (mut q, v, mut p) = ([1.0, -0.5], [0.3, 2.0], [0.0; 2]);
    model.momenta(&q, &v, &mut p);
    let before: f64 = model.energy(&q, &p).iter().sum();
    let (mut q_there, mut p_there) = (q.to_vec(), p.to_vec());
    for _ in 0..200 {
        assert_newton(&midpoint(&mut model, 0.02, &mut q, &mut p));
    }
    let after: f64 = model.energy(&q, &p).iter().sum();
    // The implicit midpoint rule is symplectic and of second order: the error of the energy stays of the order h².
    assert!((after - before).abs() < 1e-2 * before.abs().max(1.0), "{before} {after}");

    let text = std::fs::read_to_string("models/double_pendulum.toml").expect("the model");
    let read =
        read::model("double_pendulum.toml", &text, &ImportOptions { base: Base::Fixed, ..ImportOptions::default() })
            .unwrap_or_else(|findings| panic!("{findings}"));
    let plan = search::plan(&read.model, Default::default());
    let mut interpreter = Interpreter::new(plan.tree::<f64>(&[]), plan.gravity(&[]));
    for _ in 0..200 {
        assert_newton(&midpoint(&mut interpreter, 0.02, &mut q_there, &mut p_there));
    }
    let off = q.iter().chain(&p).zip(q_there.iter().chain(&p_there)).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(off < 1e-9, "generated and interpreted differ by {off:e}");
}

/// The fields have the names of what is written to them: canonical symmetry, mass matrix and its inverse, and what the
/// trait and other functions give.
#[test]
fn results_are_the_fields_of_a_named_struct() {
    let mut model = DoublePendulum::new();
    let (q, v) = ([1.0, -0.5], [0.3, 2.0]);
    let mut at_velocities = MomentumDerivatives::zero();
    model.momentum_derivatives(&q, &v, &mut at_velocities);
    let (mut p, mut mass) = ([0.0; 2], [[0.0; 2]; 2]);
    model.momenta(&q, &v, &mut p);
    model.mass_matrix(&q, &mut mass);
    assert!(at_velocities.p.iter().zip(&p).all(|(a, b)| (a - b).abs() < 1e-14), "{at_velocities:?}");
    assert!(at_velocities.dp_dv.iter().flatten().zip(mass.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-14));

    let mut d = StateDerivatives::zero();
    model.derivatives(&q, &p, &mut d);
    assert!(d.v.iter().zip(&v).all(|(a, b)| (a - b).abs() < 1e-13), "{d:?}");
    let StateDerivatives { dv_dq, dv_dp, dpd_dq, dpd_dp, .. } = &d;
    for (i, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let product: f64 = (0..2).map(|j| dv_dp[i][j] * at_velocities.dp_dv[j][k]).sum();
        assert!((product - f64::from(u8::from(i == k))).abs() < 1e-13, "{d:?}");
        // `∂v/∂q = −M⁻¹ ∂p/∂q` at given velocities.
        let product: f64 = (0..2).map(|j| dv_dp[i][j] * at_velocities.dp_dq[j][k]).sum();
        assert!((product + dv_dq[i][k]).abs() < 1e-12, "{d:?}");
        // Without dampers.
        assert!((dpd_dp[i][k] + dv_dq[k][i]).abs() < 1e-12 && (dpd_dq[i][k] - dpd_dq[k][i]).abs() < 1e-12, "{d:?}");
    }
    let (mut traits, mut rates) = (model.zero_derivatives(), [[0.0; 2]; 2]);
    model.rate_derivatives(0.0, &q, &p, &mut traits);
    assert_eq!(traits, d);
    let [qd, pd] = &mut rates;
    model.rates(&q, &p, qd, pd);
    assert!(d.pd.iter().zip(&*pd).all(|(a, b)| (a - b).abs() < 1e-12), "{d:?} {pd:?}");
}

#[test]
fn lanes_write_the_same_struct_with_arrays_of_lanes() {
    let model = DoublePendulum::new();
    let (q, p) = ([[1.0, 0.2, -0.4], [-0.5, 0.7, 2.0]], [[0.1, -0.2, 0.3], [0.4, 0.5, -0.6]]);
    let (mut d, mut m) = (StateDerivatives::zero(), MomentumDerivatives::zero());
    model.lanes::<3>().derivatives(&q, &p, &mut d);
    model.lanes::<3>().momentum_derivatives(&q, &p, &mut m);
    for lane in 0..3 {
        let one = |x: &[[f64; 3]; 2]| x.map(|row| row[lane]);
        let all = |x: &[[[f64; 3]; 2]; 2]| x.map(|row| row.map(|entry| entry[lane]));
        let (mut alone, mut at_velocities) = (StateDerivatives::zero(), MomentumDerivatives::zero());
        model.derivatives(&one(&q), &one(&p), &mut alone);
        model.momentum_derivatives(&one(&q), &one(&p), &mut at_velocities);
        assert_eq!((one(&d.v), one(&d.pd)), (alone.v, alone.pd));
        assert_eq!(d.blocks().map(|row| row.map(all)), alone.blocks().map(|row| row.map(|block| *block)));
        assert_eq!((one(&m.p), one(&m.pd)), (at_velocities.p, at_velocities.pd));
        let MomentumDerivatives { dp_dq, dp_dv, dpd_dq, dpd_dv, .. } = at_velocities;
        assert_eq!([&m.dp_dq, &m.dp_dv, &m.dpd_dq, &m.dpd_dv].map(all), [dp_dq, dp_dv, dpd_dq, dpd_dv]);
    }
}
