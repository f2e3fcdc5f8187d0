//! An extended Kalman filter: the motion of a double pendulum from noisy angles, on exact derivatives.
//!
//! `cargo run --release --example kalman`
//!
//! The state is `(q, p)`. Unknown torques push the joints; angles are measured a hundred times a second. The filter knows
//! the deviations of both, and says how far its estimate may be off: the test is whether it is.

// The program that tests all examples has it from `mpc` too.
#[allow(clippy::duplicate_mod)]
// What costs weigh is not used: a filter has no costs.
#[allow(dead_code)]
#[path = "mpc/steps.rs"]
mod steps;

use multibody::runtime::{Differentiable, Real};
use nalgebra::{SMatrix, SVector};
use steps::{Dynamics, Steps};

multibody::mbd_model! {
    path = "models/double_pendulum.toml",
    name = Pendulum,
    outputs = [rates, derivatives],
}

type Matrix4 = SMatrix<f64, 4, 4>;
type Vector4 = SVector<f64, 4>;

/// Time between two measurements, s, and their number.
const PERIOD: f64 = 0.01;
const COUNT: usize = 3000;
/// Deviations of the measured angles, rad, and of the torques, N m, which are constant between two measurements.
const ANGLE: f64 = 5e-3;
const TORQUE: f64 = 0.3;

fn normal(random: &mut fastrand::Rng) -> f64 {
    (0..12).map(|_| random.f64()).sum::<f64>() - 6.0
}

/// Follows the pendulum; a filter that is off by more or less than it says is a failure.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let drive = |pendulum: &mut Pendulum, u: &[f64; 2]| pendulum.tau = *u;
    let mut dynamics = Steps { system: Pendulum::new(), drive, joints: [0, 1], length: PERIOD };
    let mut random = fastrand::Rng::with_seed(7);
    let mut truth = [0.6, -0.4, 0.0, 0.0];
    // The filter does not know where the motion starts.
    let (mut x, mut covariance) = ([0.0; 4], Matrix4::identity());
    let observed = SMatrix::<f64, 2, 4>::identity();
    let measurement = SMatrix::<f64, 2, 2>::identity() * ANGLE * ANGLE;
    let (mut innovations, mut errors, mut counted) = (0.0, 0.0, 0);
    let mut worst = [0.0_f64; 2];
    for k in 0..COUNT {
        truth = dynamics.step(&truth, &[TORQUE * normal(&mut random), TORQUE * normal(&mut random)]);
        let seen = [0, 1].map(|i| truth[i] + ANGLE * normal(&mut random));
        // What the model expects.
        let (mut a, mut b) = ([[0.0; 4]; 4], [[0.0; 2]; 4]);
        dynamics.linearise(&x, &[0.0; 2], &mut a, &mut b);
        x = dynamics.step(&x, &[0.0; 2]);
        let (a, b) = (Matrix4::from_fn(|i, j| a[i][j]), SMatrix::<f64, 4, 2>::from_fn(|i, j| b[i][j]));
        covariance = a * covariance * a.transpose() + b * b.transpose() * TORQUE * TORQUE;
        // What the measurement says of it.
        let innovation = SVector::<f64, 2>::from_fn(|i, _| seen[i] - x[i]);
        let spread = observed * covariance * observed.transpose() + measurement;
        let inverse = spread.try_inverse().ok_or("the spread of a measurement has full rank")?;
        let gain = covariance * observed.transpose() * inverse;
        let correction = gain * innovation;
        x = core::array::from_fn(|i| x[i] + correction[i]);
        // Joseph's form keeps it symmetric and positive.
        let rest = Matrix4::identity() - gain * observed;
        covariance = rest * covariance * rest.transpose() + gain * measurement * gain.transpose();
        // The first second is for finding the motion.
        if k >= 100 {
            let error = Vector4::from_fn(|i, _| truth[i] - x[i]);
            let information = covariance.try_inverse().ok_or("the covariance has full rank")?;
            innovations += (innovation.transpose() * inverse * innovation)[0];
            errors += (error.transpose() * information * error)[0];
            counted += 1;
            worst =
                [worst[0].max(error[0].abs()).max(error[1].abs()), worst[1].max(error[2].abs()).max(error[3].abs())];
        }
    }
    let n = f64::from(counted);
    let (innovations, errors) = (innovations / n, errors / n);
    println!("{COUNT} measurements of two angles with {ANGLE} rad of noise, torques of {TORQUE} N m");
    println!("errors of the estimate: at most {:.4} rad and {:.4} kg m2/s", worst[0], worst[1]);
    println!("squared innovations over their expected spread: {innovations:.3} (2 for a consistent filter)");
    println!("squared errors over their expected spread: {errors:.3} (4 for a consistent filter)");
    // Means of n chi-square numbers of 2 degrees of freedom: deviation sqrt(2 · 2 / n); five of them.
    assert!((innovations - 2.0).abs() < 5.0 * (4.0 / n).sqrt(), "{innovations}");
    // Successive errors depend on each other for a few tenths of a second, so that they count for fewer: a tenth.
    assert!((errors - 4.0).abs() < 5.0 * (8.0 / (0.1 * n)).sqrt(), "{errors}");
    Ok(())
}
