//! Weights of Adams methods, from the places of the known rates.

use crate::integrate::constant::{decimal, Constant};
use crate::Scalar;

/// Most nodes a polynomial may have: [`QUADRATURE`] is exact to degree 15.
pub(super) const NODES: usize = 15;

/// Places and weights of Gauss-Legendre quadrature on [0, 1] with 8 points, to 36 digits; computed with 60 digits from the
/// roots of the Legendre polynomial. The other four lie opposite.
const QUADRATURE: [(Constant, Constant); 4] = [
    (decimal("0.0198550717512318841582195657152635048"), decimal("0.0506142681451881295762656771549810951")),
    (decimal("0.101666761293186630204223031762084782"), decimal("0.111190517226687235272177997213120442")),
    (decimal("0.237233795041835507091130475405376825"), decimal("0.156853322938943643668981100993300657")),
    (decimal("0.40828267875217509753026192881990801"), decimal("0.181341891689180991482575224638597806")),
];

/// Calls `f` with every point of the quadrature on [0, `upper`] and its weight.
fn quadrature<S: Scalar>(upper: S, mut f: impl FnMut(S, S)) {
    for (place, weight) in QUADRATURE {
        let (place, weight) = (place.get::<S>(), upper * weight.get::<S>());
        f(upper * place, weight);
        f(upper * (S::one() - place), weight);
    }
}

/// `∫₀ᵘ Lⱼ(s) ds`, where `Lⱼ` is the polynomial of least degree that is one at node `j` and zero at the others: what the
/// rate at node `j` counts in the integral of the polynomial through all rates.
///
/// With no node inside of (0, u) no integrand changes its sign, so the sums lose no digits.
pub(super) fn integrals<S: Scalar>(nodes: &[S], upper: S, out: &mut [S]) {
    out.fill(S::zero());
    quadrature(upper, |s, weight| {
        // Products of the factors to the left of each node, then those to the right.
        let mut product = weight;
        let mut left = [S::zero(); NODES];
        for (left, node) in left.iter_mut().zip(nodes) {
            *left = product;
            product = product * (s - *node);
        }
        let mut right = S::one();
        for ((out, left), node) in out.iter_mut().zip(&left[..nodes.len()]).zip(nodes).rev() {
            *out = *out + *left * right;
            right = right * (s - *node);
        }
    });
    for (j, out) in out.iter_mut().enumerate() {
        *out = *out * inverse(nodes, j);
    }
}

/// `1 / Π (sⱼ − sᵢ)`: what the rate at node `j` counts in the divided difference over all.
pub(super) fn inverse<S: Scalar>(nodes: &[S], j: usize) -> S {
    let mut product = S::one();
    for (i, node) in nodes.iter().enumerate() {
        if i != j {
            product = product * (nodes[j] - *node);
        }
    }
    S::one() / product
}

/// `∫₀¹ Π (s − sᵢ) ds`.
pub(super) fn product<S: Scalar>(nodes: &[S]) -> S {
    let mut sum = S::zero();
    quadrature(S::one(), |s, weight| {
        sum = sum + nodes.iter().fold(weight, |product, node| product * (s - *node));
    });
    sum
}
