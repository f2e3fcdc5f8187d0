//! Derivatives in use: implicit midpoint steps by Newton's method, with generated code and with the interpreter.

use multibody::codegen::read::{self, Base, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::{Differentiable, Interpreter};

multibody::mbd_model! {
    path = "models/double_pendulum.toml",
    name = DoublePendulum,
    outputs = [rates, momenta, energy, derivatives]
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
