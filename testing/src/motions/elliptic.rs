//! Elliptic integrals and functions of real modulus, and the quadrature of the angles that have no closed form.

/// Steps of the arithmetic-geometric mean: it converges quadratically, so that eight exhaust the digits.
const STEPS: usize = 8;

/// Means `aₙ` and half differences `cₙ` of the arithmetic-geometric mean for the modulus `k`.
fn means(k: f64) -> [(f64, f64); STEPS + 1] {
    let (mut a, mut b, mut c) = (1.0, (1.0 - k * k).sqrt(), k);
    let mut list = [(a, c); STEPS + 1];
    for entry in &mut list[1..] {
        (a, b, c) = (0.5 * (a + b), (a * b).sqrt(), 0.5 * (a - b));
        *entry = (a, c);
    }
    list
}

/// `sn`, `cn`, `dn` of `u` for the modulus `k`, `0 ≤ k < 1`: M. Abramowitz, I. Stegun, *Handbook of Mathematical
/// Functions*, 16.4.
pub fn jacobi(u: f64, k: f64) -> [f64; 3] {
    let means = means(k);
    let mut phi = means[STEPS].0 * u * f64::from(1 << STEPS);
    for (a, c) in means[1..].iter().rev() {
        phi = 0.5 * (phi + (c / a * phi.sin()).asin());
    }
    let (s, c) = phi.sin_cos();
    [s, c, (1.0 - k * k * s * s).sqrt()]
}

/// Nodes and weights of Gauss-Legendre quadrature with five points on [-1, 1].
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// `∫ f` from 0 to `t`, in panels no longer than `panel`.
pub fn integral(t: f64, panel: f64, f: impl Fn(f64) -> f64) -> f64 {
    let n = (t / panel).ceil().max(1.0);
    let half = 0.5 * t / n;
    let one = |m: f64| GAUSS.iter().map(|(x, w)| w * f(half * (2.0 * m + 1.0 + x))).sum::<f64>();
    half * (0..n as u64).map(|m| one(m as f64)).sum::<f64>()
}
