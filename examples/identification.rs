//! Masses and inertias of a robot from a motion: joint forces are linear in them, `τ = Y(q, v, v̇) π`.
//!
//! `cargo run --release --features jit --example identification`
//!
//! A UR5 moves along a path that excites all joints. Its positions are known exactly, its joint forces with noise. The
//! combinations of parameters that a motion can tell (base parameters) are estimated by least squares, with the errors
//! that the noise leads one to expect.

use multibody::codegen::identifiable::{identifiable, Identifiable};
use multibody::codegen::model::Model;
use multibody::codegen::plan::Plan;
use multibody::prelude::*;
use nalgebra::{DMatrix, DVector};

/// Noise of the joint forces: standard deviation, N m.
const NOISE: f64 = 0.5;
/// Number of instants at which the robot is measured, and the time between them, s.
const INSTANTS: usize = 2000;
const PERIOD: f64 = 0.01;

/// A normally distributed number, nearly: the sum of twelve uniform ones has its mean and its variance.
fn normal(random: &mut fastrand::Rng) -> f64 {
    (0..12).map(|_| random.f64()).sum::<f64>() - 6.0
}

/// Positions, velocities and accelerations of the path: two frequencies for each joint, none a multiple of another.
fn path(joints: usize, t: f64) -> [Vec<f64>; 3] {
    let mut motion = [vec![0.0; joints], vec![0.0; joints], vec![0.0; joints]];
    for j in 0..joints {
        for (size, rate) in [(0.8, 1.1 + 0.37 * j as f64), (0.3, 2.9 + 0.53 * j as f64)] {
            let (s, c) = (rate * t).sin_cos();
            motion[0][j] += size * s;
            motion[1][j] += size * rate * c;
            motion[2][j] -= size * rate * rate * s;
        }
    }
    motion
}

/// The base parameters of a robot with given parameters.
fn base(found: &Identifiable, parameters: &[f64]) -> DVector<f64> {
    let value = |b: &multibody::codegen::identifiable::BaseParameter| {
        b.others.iter().fold(parameters[b.parameter], |sum, (k, factor)| sum + factor * parameters[*k])
    };
    DVector::from_iterator(found.base.len(), found.base.iter().map(value))
}

/// Identifies the robot; an error that the noise does not explain is a failure.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = Model::load(concat!(env!("CARGO_MANIFEST_DIR"), "/models/ur5.urdf"))?;
    let plan = Plan::new(&model, 0.0);
    let found = identifiable(&plan);
    let mut robot: Interpreter<f64> = plan.default_interpreter();
    let (joints, columns) = (plan.dims.nv, found.names.len());
    let mut random = fastrand::Rng::with_seed(1);
    let mut y = DMatrix::zeros(INSTANTS * joints, found.base.len());
    let mut measured = DVector::zeros(INSTANTS * joints);
    let (mut regressor, mut tau) = (vec![0.0; joints * columns], vec![0.0; joints]);
    for k in 0..INSTANTS {
        let [q, v, a] = path(joints, PERIOD * k as f64);
        robot.inverse_dynamics(&q, &v, &a, &mut tau);
        robot.regressor(&q, &v, &a, &mut regressor);
        for j in 0..joints {
            measured[k * joints + j] = tau[j] + NOISE * normal(&mut random);
            for (column, base) in found.base.iter().enumerate() {
                y[(k * joints + j, column)] = regressor[j * columns + base.parameter];
            }
        }
    }
    let information = y.transpose() * &y;
    let inverse = information.try_inverse().ok_or("the path does not excite all parameters")?;
    let estimate = &inverse * (y.transpose() * &measured);
    let truth = base(&found, &plan.tree(&plan.default_params()).dynamic_parameters());
    println!(
        "{}: {} of {} parameters make {} base parameters",
        model.name,
        columns - found.without_effect.len(),
        columns,
        truth.len()
    );
    println!("{:<42}{:>12}{:>12}{:>12}", "base parameter (led by)", "true", "estimate", "deviation");
    // Errors in units of the deviations that the noise leads one to expect.
    let mut errors = Vec::new();
    for (k, parameter) in found.base.iter().enumerate() {
        let deviation = NOISE * inverse[(k, k)].sqrt();
        let name = &found.names[parameter.parameter];
        println!("{name:<42}{:>12.5}{:>12.5}{deviation:>12.5}", truth[k], estimate[k]);
        errors.push((estimate[k] - truth[k]) / deviation);
    }
    let worst = errors.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    let residual = (&y * &estimate - &measured).norm() / ((INSTANTS * joints - truth.len()) as f64).sqrt();
    println!("largest error: {worst:.2} deviations; residual: {residual:.4} N m, noise {NOISE} N m");
    // Five deviations: less than one in a million for a number; the residual varies by 1 / sqrt(2 · 12000) of itself.
    assert!(worst < 5.0, "{worst}");
    assert!((residual / NOISE - 1.0).abs() < 5.0 / (2.0 * 12000.0_f64).sqrt(), "{residual}");
    Ok(())
}
