//! Weights of Adams methods, from the places of the known rates.

use crate::integrate::constant::{decimal, Constant};
use crate::Scalar;

/// Most nodes of a polynomial; [`QUADRATURE`] is exact to degree 15.
pub(super) const NODES: usize = 15;

/// Points of [`QUADRATURE`].
const POINTS: usize = 8;

/// Places and weights of Gauss-Legendre quadrature on [0, 1] with 8 points: the left half, the other lies opposite. Roots of
/// the Legendre polynomial, to 36 digits.
const QUADRATURE: [(Constant, Constant); POINTS / 2] = [
    (decimal("0.0198550717512318841582195657152635048"), decimal("0.0506142681451881295762656771549810951")),
    (decimal("0.101666761293186630204223031762084782"), decimal("0.111190517226687235272177997213120442")),
    (decimal("0.237233795041835507091130475405376825"), decimal("0.156853322938943643668981100993300657")),
    (decimal("0.40828267875217509753026192881990801"), decimal("0.181341891689180991482575224638597806")),
];

/// What the rates at some places count in a step. Place 0 is that of the new rate, the others those of the past ones from
/// the newest on; a list of weights has one for each.
///
/// The polynomials are Lagrange's: `1 / Π (zⱼ − zᵢ)` times the integral of a product of factors, by quadrature. No factor
/// changes its sign where it is integrated, so the sums lose no digits, however unequal the steps are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights<S> {
    /// Of the integral to the end of the step of the polynomial through rates 1 to k. Weight 0 is zero.
    pub predictor: [S; NODES],
    /// The same through rates 0 to k.
    pub corrector: [S; NODES],
    /// By how much that integral changes if one rate more is taken: through rates 0 to m against 0 to m − 1, for m of
    /// k − 1, k, k + 1.
    pub changes: [[S; NODES]; 3],
}

impl<S: Scalar> Weights<S> {
    /// For `k` past rates, 1 to 13, at `places[1..]`, and the end of the step at `end`; time in any unit, from the start of the
    /// step. The change at `m = k + 1` is found if there is a place more.
    pub fn new(places: &[S], k: usize, end: S) -> Self {
        let zero = [S::zero(); NODES];
        let mut out = Weights { predictor: zero, corrector: zero, changes: [zero; 3] };
        let basis = inverses(&places[..=k]);
        let products = Products::new(places, k, end);
        let mut right = [S::one(); POINTS];
        for j in (1..=k).rev() {
            let (mut past, mut all) = (S::zero(), S::zero());
            for g in 0..POINTS {
                let but_one = products.left[j][g] * right[g];
                past = past + but_one;
                all = all + but_one * (products.at[g] - places[0]);
                right[g] = right[g] * (products.at[g] - places[j]);
            }
            out.predictor[j] = past * basis[j] * (places[j] - places[0]);
            out.corrector[j] = all * basis[j];
        }
        out.corrector[0] = products.left[k + 1].into_iter().fold(S::zero(), |sum, x| sum + x) * basis[0];
        let (before, now) = (products.all(k.max(2) - 1, places[0]), products.all(k, places[0]));
        for j in 0..=k {
            out.changes[0][j] = before * basis[j] * (places[j] - places[k]);
            out.changes[1][j] = now * basis[j];
        }
        if places.len() > k + 1 {
            let (next, basis) = (products.all(k + 1, places[0]), inverses(&places[..=k + 1]));
            for j in 0..=k + 1 {
                out.changes[2][j] = next * basis[j];
            }
        }
        out
    }
}

/// Products `Π (s − zᵢ)` from 1 on, at the points of the quadrature, times its weights.
struct Products<S> {
    at: [S; POINTS],
    /// `left[j]`: over all i from 1 to j − 1.
    left: [[S; POINTS]; NODES],
}

impl<S: Scalar> Products<S> {
    fn new(places: &[S], k: usize, end: S) -> Self {
        let mut products = Products { at: [S::zero(); POINTS], left: [[S::zero(); POINTS]; NODES] };
        for (g, (place, weight)) in QUADRATURE.into_iter().enumerate() {
            products.at[g] = end * place.get();
            products.at[POINTS - 1 - g] = end * (S::one() - place.get());
            products.left[1][g] = end * weight.get();
            products.left[1][POINTS - 1 - g] = end * weight.get();
        }
        for j in 1..=k {
            for g in 0..POINTS {
                products.left[j + 1][g] = products.left[j][g] * (products.at[g] - places[j]);
            }
        }
        products
    }

    /// `∫ Π (s − zᵢ)` over i from 0 to m − 1, with `first` for place 0.
    fn all(&self, m: usize, first: S) -> S {
        let mut sum = S::zero();
        for g in 0..POINTS {
            sum = sum + self.left[m][g] * (self.at[g] - first);
        }
        sum
    }
}

/// `1 / Π (zⱼ − zᵢ)` over the other places.
fn inverses<S: Scalar>(places: &[S]) -> [S; NODES] {
    let mut products = [S::one(); NODES];
    for (i, a) in places.iter().enumerate() {
        for (j, b) in places.iter().enumerate().skip(i + 1) {
            products[i] = products[i] * (*a - *b);
            products[j] = products[j] * (*b - *a);
        }
    }
    products.map(|x| S::one() / x)
}
