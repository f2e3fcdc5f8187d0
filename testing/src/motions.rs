//! Motions whose exact course is known: a model, a start, and the coordinates at any time.
//!
//! The solutions are those of the textbooks, in closed form or by elliptic functions and one quadrature, and use
//! nothing of the runtime; see each motion for its source.

mod elliptic;

use elliptic::{integral, jacobi};
use mbd_codegen::model::Model;
use mbd_codegen::{read, search};
use mbd_runtime::{Interpreter, System};

const G: f64 = 9.81;

/// A motion with an exact solution.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Name in tables.
    pub name: &'static str,
    /// The model, a TOML file.
    pub text: &'static str,
    /// Coordinates at a time, s.
    pub at: fn(f64) -> Vec<f64>,
    /// Velocities at the start.
    pub v: fn() -> Vec<f64>,
    /// Whether the model has constraints, which a post-step must hold.
    pub constrained: bool,
}

/// All motions.
pub const MOTIONS: [Motion; 6] = [
    Motion { name: "pendulum", text: PENDULUM, at: pendulum, v: || vec![0.0], constrained: false },
    Motion { name: "free top", text: FREE_TOP, at: free_top, v: || free_rates(0.0).to_vec(), constrained: false },
    Motion {
        name: "conical pendulum",
        text: CONICAL,
        at: conical,
        v: || vec![0.0, round() * OPENING.sin(), 0.0],
        constrained: false,
    },
    Motion { name: "heavy top", text: HEAVY_TOP, at: heavy_top, v: || vec![0.0, 0.0, SPIN], constrained: false },
    Motion { name: "spinning oscillator", text: OSCILLATOR, at: oscillator, v: spinning, constrained: false },
    Motion { name: "rolling disc", text: DISC, at: disc, v: rolling, constrained: true },
];

impl Motion {
    /// The model.
    ///
    /// # Panics
    /// If the text is wrong.
    pub fn model(&self) -> Model {
        read::model("motion.toml", self.text, &Default::default()).unwrap_or_else(|findings| panic!("{findings}")).model
    }

    /// The interpreter, coordinates and momenta at the start.
    pub fn start(&self) -> (Interpreter<f64>, Vec<f64>, Vec<f64>) {
        let mut system: Interpreter<f64> = search::plan(&self.model(), Default::default()).interpreter(&[]);
        let (q, mut p) = ((self.at)(0.0), system.zero_momenta());
        system.momenta(&q, &(self.v)(), &mut p);
        (system, q, p)
    }

    /// Largest error of a coordinate at time `t` s: rad, m; of rotations the angle between both.
    pub fn error(&self, system: &Interpreter<f64>, t: f64, q: &[f64]) -> f64 {
        let mut exact = (self.at)(t);
        let mut worst = 0.0_f64;
        for at in system.quaternions() {
            // Twice the vector part of the quaternion between both; its sign does not matter.
            let (a, b) = (&q[at..at + 4], &exact[at..at + 4]);
            let back = [-b[0], -b[1], -b[2], b[3]];
            let between = product([a[0], a[1], a[2], a[3]], back);
            worst = between[..3].iter().fold(worst, |worst, x| worst.max(2.0 * x.abs()));
            exact[at..at + 4].copy_from_slice(&q[at..at + 4]);
        }
        q.iter().zip(&exact).fold(worst, |worst, (a, b)| worst.max((a - b).abs()))
    }
}

/// Product of quaternions, scalar last.
fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[3] * b[0] + b[3] * a[0] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] + b[3] * a[1] + a[2] * b[0] - a[0] * b[2],
        a[3] * b[2] + b[3] * a[2] + a[0] * b[1] - a[1] * b[0],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

/// Quaternion of rotations one after the other, each by an angle about an axis that the ones before it have turned.
fn turns<const N: usize>(list: [(usize, f64); N]) -> [f64; 4] {
    list.into_iter().fold([0.0, 0.0, 0.0, 1.0], |all, (axis, angle)| {
        let mut one = [0.0; 4];
        (one[axis], one[3]) = (0.5 * angle).sin_cos();
        product(all, one)
    })
}

/// A compound pendulum that is let go at 2 rad.
const PENDULUM: &str = r#"
gravity = [0, 0, -9.81]
[[body]]
name = "bob"
mass = 1.5
com = [0, 0, -0.8]
inertia = [0.1, 0.1, 0.02]
[[joint]]
name = "pivot"
type = "revolute"
child = "bob"
axis = [0, 1, 0]
"#;

/// `sin(θ/2) = k cd(ω t)` with `k` that at rest. E. T. Whittaker, *Analytical Dynamics*, 44.
fn pendulum(t: f64) -> Vec<f64> {
    let rate = (1.5 * G * 0.8 / (0.1 + 1.5 * 0.8 * 0.8)).sqrt();
    let k = 1.0_f64.sin();
    let [_, cn, dn] = jacobi(rate * t, k);
    vec![2.0 * (k * cn / dn).asin()]
}

/// A body with three different moments of inertia, held at its centre of mass.
const FREE_TOP: &str = r#"
gravity = [0, 0, 0]
[[body]]
name = "body"
mass = 0.5
inertia = [0.02, 0.03, 0.04]
[[joint]]
name = "centre"
type = "spherical"
child = "body"
"#;
const MOMENTS: [f64; 3] = [0.02, 0.03, 0.04];
/// Angular momentum, N m s, which is along z, and its angle to the axis of the largest moment at the start.
const MOMENTUM: f64 = 0.16;
const TILT: f64 = 0.6;

/// Angular velocities in body axes: L. D. Landau, E. M. Lifshitz, *Mechanics*, §37, eq. 37.10. `M² > 2 E I₂`.
fn free_rates(t: f64) -> [f64; 3] {
    let [a, b, c] = MOMENTS;
    let (s, co) = TILT.sin_cos();
    let (x, z) = (MOMENTUM * s, MOMENTUM * co);
    let (energy, square) = (x * x / a + z * z / c, MOMENTUM * MOMENTUM);
    let (low, high) = (energy * c - square, square - energy * a);
    let k = ((b - a) * low / ((c - b) * high)).sqrt();
    let [sn, cn, dn] = jacobi(t * ((c - b) * high / (a * b * c)).sqrt(), k);
    [(low / (a * (c - a))).sqrt() * cn, (low / (b * (c - b))).sqrt() * sn, (high / (c * (c - a))).sqrt() * dn]
}

/// Euler's angles about the angular momentum, eq. 37.14 and 37.16; the precession by quadrature.
fn free_top(t: f64) -> Vec<f64> {
    let momenta = |t: f64| {
        let w = free_rates(t);
        [0, 1, 2].map(|k| MOMENTS[k] * w[k])
    };
    let precession = integral(t, 0.02, |t| {
        let (l, w) = (momenta(t), free_rates(t));
        MOMENTUM * (l[0] * w[0] + l[1] * w[1]) / (l[0] * l[0] + l[1] * l[1])
    });
    let [x, y, z] = momenta(t);
    turns([(2, precession), (0, x.hypot(y).atan2(z)), (2, x.atan2(y))]).to_vec()
}

/// A bob on a rod that goes round on a circle and does not turn about the rod.
const CONICAL: &str = r#"
gravity = [0, 0, -9.81]
[[body]]
name = "bob"
mass = 1
com = [0, 0, -1]
inertia = [0.01, 0.01, 0.01]
[[joint]]
name = "pivot"
type = "spherical"
child = "bob"
"#;
/// Angle of its rod from the vertical, rad.
const OPENING: f64 = 0.5;

/// Rate at which it goes round: the torque of gravity turns the angular momentum, which is that of the rod alone,
/// `J Ω² cos θ = m g l`.
fn round() -> f64 {
    (G / (1.01 * OPENING.cos())).sqrt()
}

fn conical(t: f64) -> Vec<f64> {
    turns([(2, round() * t), (0, OPENING), (2, -round() * OPENING.cos() * t)]).to_vec()
}

/// A symmetric top on its tip that is let go with a spin about its axis, and no other motion, at an angle of 0.5 rad.
const HEAVY_TOP: &str = r#"
gravity = [0, 0, -9.81]
[[body]]
name = "top"
mass = 0.5
com = [0, 0, 0.1]
inertia = [0.001, 0.001, 0.0008]
[[joint]]
name = "tip"
type = "spherical"
child = "top"
start = [0.24740395925452294, 0, 0, 0.96891242171064478]
"#;
const SPIN: f64 = 40.0;

/// Lagrange's top: H. Goldstein, *Classical Mechanics*, 5.7. The cosine `u` of the angle goes to and fro between two
/// roots of a cubic, as an elliptic function; the other angles follow by quadrature.
fn heavy_top(t: f64) -> Vec<f64> {
    let (across, along, torque) = (0.001 + 0.5 * 0.1 * 0.1, 0.0008, 0.5 * G * 0.1);
    let start = 0.5_f64.cos();
    // `u̇² = (α − β u)(1 − u²) − (b − a u)²`; at the start no motion but the spin: b = a u, α = β u.
    let (a, beta) = (along * SPIN / across, 2.0 * torque / across);
    let (b, alpha) = (a * start, beta * start);
    // The cubic divided by `u − start`: β u² + middle u + last.
    let middle = beta * start - (alpha + a * a);
    let last = 2.0 * a * b - beta + middle * start;
    let root = (middle * middle - 4.0 * beta * last).sqrt();
    let high = (root - middle) / (2.0 * beta);
    let low = last / (beta * high);
    let (k, rate) = (((start - low) / (high - low)).sqrt(), 0.5 * (beta * (high - low)).sqrt());
    let cosine = |t: f64| {
        let [_, cn, dn] = jacobi(rate * t, k);
        let cd = cn / dn;
        low + (start - low) * cd * cd
    };
    let precession = |u: f64| (b - a * u) / (1.0 - u * u);
    let azimuth = integral(t, 0.01, |t| precession(cosine(t)));
    let spin = SPIN * t - integral(t, 0.01, |t| precession(cosine(t)) * cosine(t));
    turns([(2, azimuth), (0, cosine(t).acos()), (2, spin)]).to_vec()
}

/// A point mass on a slide that turns freely, held by a spring to the axis: in the plane, a harmonic oscillator.
const OSCILLATOR: &str = r#"
gravity = [0, 0, 0]
[[body]]
name = "arm"
[[body]]
name = "mass"
mass = 2
[[joint]]
name = "turn"
type = "revolute"
child = "arm"
axis = [0, 0, 1]
[[joint]]
name = "slide"
type = "prismatic"
parent = "arm"
child = "mass"
axis = [1, 0, 0]
stiffness = 18
"#;
/// Its ellipse: half axes, m, and frequency, rad/s.
const ELLIPSE: [f64; 3] = [1.0, 0.4, 3.0];

fn oscillator(t: f64) -> Vec<f64> {
    let [a, b, rate] = ELLIPSE;
    let (s, c) = (rate * t).sin_cos();
    let (x, y) = (a * c, b * s);
    // The angle is close to `ω t`; what it differs by needs no count of the turns.
    let ahead = (y * c - x * s).atan2(x * c + y * s);
    vec![rate * t + ahead, x.hypot(y)]
}

fn spinning() -> Vec<f64> {
    let [a, b, rate] = ELLIPSE;
    vec![b * rate / a, 0.0]
}

/// A disc that rolls on a circle, leaning inward.
const DISC: &str = r#"
gravity = [0, 0, -9.81]
[[body]]
name = "disc"
mass = 2
inertia = [0.02, 0.04, 0.02]
[[joint]]
name = "free"
type = "floating"
child = "disc"
[[loop]]
name = "contact"
type = "rolling_disc"
between = ["ground", "disc"]
normal = [0, 0, 1]
axis = [0, 1, 0]
radius = 0.2
"#;
const RADIUS: f64 = 0.2;
/// Its lean from the vertical, rad, and the rate at which it goes round, rad/s.
const LEAN: f64 = 0.2;
const ROUND: f64 = 1.2;

/// Angular velocity about the axis of the disc: the torque of gravity and of the contact's force turns the angular
/// momentum, `Ω s (A Ω c − C n) = m r (r Ω n s + g c)` with the sine and cosine of the angle between the axis and the
/// vertical. E. J. Routh, *Advanced Rigid Dynamics*, 244.
fn rotation() -> f64 {
    let (across, along, mass) = (0.02, 0.04, 2.0);
    let (c, s) = LEAN.sin_cos();
    c * (across * ROUND * ROUND * s - mass * RADIUS * G) / (ROUND * s * (along + mass * RADIUS * RADIUS))
}

fn disc(t: f64) -> Vec<f64> {
    let (path, (s, c)) = (RADIUS * rotation() / ROUND, (ROUND * t).sin_cos());
    let turn = turns([(2, ROUND * t), (0, LEAN), (1, (rotation() - ROUND * LEAN.sin()) * t)]);
    [&[path * s, path * (1.0 - c), RADIUS * LEAN.cos()][..], &turn].concat()
}

fn rolling() -> Vec<f64> {
    vec![RADIUS * rotation(), 0.0, 0.0, 0.0, rotation(), ROUND * LEAN.cos()]
}
