//! Linearisation about an upright cart and pole, and the linear-quadratic regulator that balances it, in `(q, v)`.
//!
//! `cargo run --release --example lqr`
//!
//! The generated code gives `p`, `ṗ` and their derivatives at given `(q, v)` (output `momentum_derivatives`). With
//! `p = M(q) v` the linear system about an equilibrium at rest is `M δv̇ = (∂ṗ/∂q) δq + (∂ṗ/∂v) δv + δτ`. (About a motion,
//! `−d/dt(∂p/∂q)` belongs to `∂ṗ/∂q`, and `−Ṁ − ∂p/∂q` to `∂ṗ/∂v`.)

use multibody::prelude::*;
use nalgebra::{SMatrix, Vector4};

multibody::mbd_model! {
    toml = r#"
        name = "cart_pole"
        [[body]]
        name = "cart"
        mass = 1.0
        inertia = [0.01, 0.01, 0.01]
        [[body]]
        name = "pole"
        mass = 0.2
        com = [0, 0, 0.5]
        inertia = [0.0167, 0.0167, 0.0001]
        [[joint]]
        name = "rail"
        type = "prismatic"
        child = "cart"
        axis = [1, 0, 0]
        [[joint]]
        name = "hinge"
        type = "revolute"
        parent = "cart"
        child = "pole"
        axis = [0, 1, 0]
    "#,
    name = CartPole,
    outputs = [rates, momenta, velocities, momentum_derivatives],
}

type Matrix4 = SMatrix<f64, 4, 4>;
type Gain = SMatrix<f64, 1, 4>;

/// `A` and `B` of `ẋ = A x + B u` about the upright rest, `x = (δq, δv)`, `u` the force on the cart, N.
fn linearised(cart: &CartPole) -> (Matrix4, Vector4<f64>) {
    let (q, v) = ([0.0; 2], [0.0; 2]);
    let mut at = MomentumDerivatives::zero();
    cart.momentum_derivatives(&q, &v, &mut at);
    let matrix = |m: [[f64; 2]; 2]| SMatrix::<f64, 2, 2>::from_fn(|i, j| m[i][j]);
    let inverse = matrix(at.dp_dv).try_inverse().expect("a mass matrix is positive definite");
    let mut a = Matrix4::zeros();
    a.fixed_view_mut::<2, 2>(0, 2).fill_with_identity();
    a.fixed_view_mut::<2, 2>(2, 0).copy_from(&(inverse * matrix(at.dpd_dq)));
    a.fixed_view_mut::<2, 2>(2, 2).copy_from(&(inverse * matrix(at.dpd_dv)));
    (a, Vector4::new(0.0, 0.0, inverse[(0, 0)], inverse[(1, 0)]))
}

/// The gain `K` of `u = −K x` that makes `∫ xᵀQx + r u²` least: the Riccati equation by the matrix sign function
/// (J. D. Roberts, 1980).
fn regulator(a: &Matrix4, b: &Vector4<f64>, cost: &Matrix4, r: f64) -> Gain {
    let mut hamiltonian = SMatrix::<f64, 8, 8>::zeros();
    hamiltonian.fixed_view_mut::<4, 4>(0, 0).copy_from(a);
    hamiltonian.fixed_view_mut::<4, 4>(0, 4).copy_from(&(-b * b.transpose() / r));
    hamiltonian.fixed_view_mut::<4, 4>(4, 0).copy_from(&-cost);
    hamiltonian.fixed_view_mut::<4, 4>(4, 4).copy_from(&-a.transpose());
    let mut sign = hamiltonian;
    for _ in 0..60 {
        let inverse = sign.try_inverse().expect("no eigenvalue of a stabilisable system is imaginary");
        sign = (sign + inverse) / 2.0;
    }
    // [W12; W22 + 1] P = −[W11 + 1; W21], by least squares.
    let one = Matrix4::identity();
    let part = |i: usize, j: usize| sign.fixed_view::<4, 4>(4 * i, 4 * j).into_owned();
    let mut left = SMatrix::<f64, 8, 4>::zeros();
    left.fixed_view_mut::<4, 4>(0, 0).copy_from(&part(0, 1));
    left.fixed_view_mut::<4, 4>(4, 0).copy_from(&(part(1, 1) + one));
    let mut right = SMatrix::<f64, 8, 4>::zeros();
    right.fixed_view_mut::<4, 4>(0, 0).copy_from(&-(part(0, 0) + one));
    right.fixed_view_mut::<4, 4>(4, 0).copy_from(&-part(1, 0));
    let normal = left.transpose() * left;
    let riccati = normal.try_inverse().expect("the sign function has full rank") * left.transpose() * right;
    b.transpose() * riccati / r
}

/// Balances the pole from a lean of 0.2 rad.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut cart = CartPole::new();
    let (a, b) = linearised(&cart);
    let gain = regulator(&a, &b, &Matrix4::from_diagonal(&Vector4::new(1.0, 1.0, 0.1, 0.1)), 0.01);
    println!("A = {a:.3}B = {b:.3}K = {gain:.2}");
    let slowest = (a - b * gain).complex_eigenvalues().iter().map(|z| z.re).fold(f64::NEG_INFINITY, f64::max);
    println!("slowest eigenvalue of the closed loop: {slowest:.2} 1/s");
    assert!(slowest < 0.0);

    let (mut q, mut p) = ([0.0, 0.2], cart.zero_momenta());
    let mut rk4 = Rk4::new(&cart);
    for k in 0..8000 {
        let mut v = [0.0; 2];
        cart.velocities(&q, &p, &mut v);
        cart.tau[CartPole::V_RAIL] = -(gain * Vector4::new(q[0], q[1], v[0], v[1]))[0];
        rk4.step(&mut cart, f64::from(k) * 1e-3, 1e-3, &mut q, &mut p)?;
        if k % 2000 == 1999 {
            println!("{} s: cart at {:+.4} m, pole leans {:+.5} rad", (k + 1) / 1000, q[0], q[1]);
        }
    }
    assert!(q.iter().all(|x| x.abs() < 1e-2), "the regulator brings cart and pole back: {q:?}");
    Ok(())
}
