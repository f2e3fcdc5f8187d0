//! Weights of Adams methods, from the places of the known rates.

use crate::constant::{decimal, Constant};
use crate::Scalar;

/// Most nodes of a polynomial; [`QUADRATURE`] is exact to degree 15.
pub(super) const NODES: usize = 15;

/// Points of [`QUADRATURE`].
const POINTS: usize = 8;

/// Places and weights of Gauss-Legendre quadrature on [0, 1] with 8 points: the left half, the other lies opposite.
/// Roots of the Legendre polynomial, to 36 digits.
const QUADRATURE: [(Constant, Constant); POINTS / 2] = [
    (decimal("0.0198550717512318841582195657152635048"), decimal("0.0506142681451881295762656771549810951")),
    (decimal("0.101666761293186630204223031762084782"), decimal("0.111190517226687235272177997213120442")),
    (decimal("0.237233795041835507091130475405376825"), decimal("0.156853322938943643668981100993300657")),
    (decimal("0.40828267875217509753026192881990801"), decimal("0.181341891689180991482575224638597806")),
];

/// What the rates at some places count in a step. Place 0 is that of the new rate, the others those of the past ones
/// from the newest on; a list of weights has one for each.
///
/// The polynomials are Lagrange's: `1 / Π (zⱼ − zᵢ)` times the integral of a product of factors, by quadrature. No
/// factor changes its sign where it is integrated, so the sums lose no digits, however unequal the steps are.
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
    /// For `k` past rates, 1 to 13, at `places[1..]`, and the end of the step at `end`; time in any unit, from the
    /// start of the step. The change at `m = k + 1` is found if there is one place more; there are no others.
    pub fn new(places: &[S], k: usize, end: S) -> Self {
        let zero = [S::zero(); NODES];
        let mut out = Weights { predictor: zero, corrector: zero, changes: [zero; 3] };
        // By the basis of one node more, where it is wanted, that of the others.
        let (all, mut basis) = (inverses(places), [S::zero(); NODES]);
        for j in 0..=k {
            basis[j] = places[k + 1..].iter().fold(all[j], |all, next| all * (places[j] - *next));
        }
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
            let next = products.all(k + 1, places[0]);
            for j in 0..=k + 1 {
                out.changes[2][j] = next * all[j];
            }
        }
        out
    }
}

/// Weights of order `k`, 1 to 12, for steps of one size, exact but for the last bits: of the rate at the end, then of
/// the past ones from the newest on. `explicit` ones have no weight for the rate at the end.
///
/// Of backward differences: `γ₀ = 1`, `γₘ = e − Σ γₘ₋ᵢ / (i + 1)` with `e` 1 or 0, and weight j is `(−1)ʲ Σ C(m, j) γₘ`
/// over m from j to k − 1 (Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I*, III.1, eqs. 1.4 to
/// 1.9).
pub(super) const fn equal_steps(k: usize, explicit: bool) -> [Constant; NODES] {
    let mut weights = [Constant::ZERO; NODES];
    let mut differences = [Constant::integer(1); NODES];
    let mut m = 0;
    while m < k {
        if m > 0 {
            differences[m] = Constant::integer(explicit as u128);
            let mut i = 1;
            while i <= m {
                let part = differences[m - i].over(Constant::integer(i as u128 + 1));
                differences[m] = differences[m].minus(part);
                i += 1;
            }
        }
        // Minus or plus C(m, j), by Pascal's rule along the row.
        let (mut j, mut binomial) = (0, -1.0);
        while j <= m {
            let at = j + explicit as usize;
            weights[at] = weights[at].minus(differences[m].times(binomial));
            binomial = -binomial * (m - j) as f64 / (j + 1) as f64;
            j += 1;
        }
        m += 1;
    }
    weights
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
    let n = places.len().min(NODES);
    for i in 0..n {
        for j in i + 1..n {
            let apart = places[i] - places[j];
            products[i] = products[i] * apart;
            products[j] = -(products[j] * apart);
        }
    }
    for x in &mut products[..n] {
        *x = S::one() / *x;
    }
    products
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The polynomial through `count` rates `s^m` is `s^m` if `m < count`: places from `first` on.
    fn moments(weights: &[f64], places: &[f64], first: usize, end: f64) {
        for m in 0..(weights.len() - first) as i32 {
            let sum: f64 = weights[first..].iter().zip(&places[first..]).map(|(w, s)| w * s.powi(m)).sum();
            let size: f64 = weights[first..].iter().zip(&places[first..]).map(|(w, s)| (w * s.powi(m)).abs()).sum();
            let exact = end.powi(m + 1) / f64::from(m + 1);
            // Weights are good to some twenty roundings each.
            assert!((sum - exact).abs() <= 20.0 * f64::EPSILON * size, "{m}: {sum} {exact}");
        }
    }

    #[test]
    fn equal_steps_give_the_known_methods() {
        let places: [f64; NODES] = core::array::from_fn(|j| 1.0 - j as f64);
        let (predictor, corrector) =
            (Weights::new(&places[..5], 4, 1.0).predictor, Weights::new(&places[..4], 3, 1.0).corrector);
        // (C.19), (C.20).
        for (w, known) in predictor[1..5].iter().zip([55.0, -59.0, 37.0, -9.0]) {
            assert!((24.0 * w - known).abs() < 1e-13 * known.abs(), "{w} {known}");
        }
        for (w, known) in corrector[..4].iter().zip([9.0, 19.0, -5.0, 1.0]) {
            assert!((24.0 * w - known).abs() < 1e-13 * known.abs(), "{w} {known}");
        }
        let single: [f32; NODES] = places.map(|x| x as f32);
        let single = Weights::new(&single[..13], 12, 1.0).predictor;
        let double = Weights::new(&places[..13], 12, 1.0).predictor;
        for (a, b) in single.into_iter().zip(double) {
            assert!((f64::from(a) - b).abs() <= 20.0 * f64::from(f32::EPSILON) * b.abs(), "{a} {b}");
        }
    }

    #[test]
    fn polynomials_are_integrated_exactly() {
        // Steps that double, shrink, stay.
        let mut places = [1.0, 0.0, -0.3, -1.7, -2.0, -2.1, -2.5, -5.0, -5.5, -6.0, -6.5, -7.5, -7.6, -10.0];
        for end in [1.0, 0.37] {
            for k in 1..=12 {
                let w = Weights::new(&places[..=k + 1], k, end);
                moments(&w.predictor[..=k], &places, 1, end);
                moments(&w.corrector[..=k], &places, 0, end);
                let more = Weights::new(&places[..=k + 1], k + 1, end).corrector;
                let less = if k > 1 { Weights::new(&places[..k], k - 1, end).corrector } else { [0.0; NODES] };
                for j in 0..=k + 1 {
                    let size = 50.0 * f64::EPSILON * (w.corrector[j].abs() + more[j].abs() + less[j].abs());
                    assert!((w.changes[2][j] - (more[j] - w.corrector[j])).abs() <= size, "{k} {j}");
                    if k > 1 {
                        assert!((w.changes[1][j] - (w.corrector[j] - less[j])).abs() <= size, "{k} {j}");
                    }
                }
                if k > 2 {
                    let least = Weights::new(&places[..k - 1], k - 2, end).corrector;
                    for j in 0..k {
                        let size = 50.0 * f64::EPSILON * (least[j].abs() + less[j].abs());
                        assert!((w.changes[0][j] - (less[j] - least[j])).abs() <= size, "{k} {j}");
                    }
                }
            }
            places.iter_mut().skip(1).for_each(|x| *x *= 1.9);
        }
    }

    #[test]
    fn equal_steps_are_a_special_case() {
        let places: [f64; NODES] = core::array::from_fn(|j| 1.0 - j as f64);
        for k in 1..=12 {
            let (explicit, implicit) = (equal_steps(k, true), equal_steps(k, false));
            let w = Weights::new(&places[..=k], k, 1.0);
            let less = Weights::new(&places[..k.max(2)], k.max(2) - 1, 1.0).corrector;
            for j in 0..NODES {
                // As in `moments`; weights of order 12 are sums of numbers up to a hundred times as large.
                let near = |a: f64, b: f64| (a - b).abs() <= 100.0 * f64::EPSILON * b.abs();
                assert!(near(w.predictor[j], explicit[j].hi()), "{k} {j}: {} {}", w.predictor[j], explicit[j].hi());
                if k > 1 {
                    assert!(near(less[j], implicit[j].hi()), "{k} {j}: {} {}", less[j], implicit[j].hi());
                }
            }
        }
        // Known ones: Hairer, Nørsett, Wanner, eqs. 1.5 and 1.9.
        for (j, n) in [55.0, -59.0, 37.0, -9.0].into_iter().enumerate() {
            assert_eq!(equal_steps(4, true)[j + 1].hi(), n / 24.0);
        }
        for (j, n) in [9.0, 19.0, -5.0, 1.0].into_iter().enumerate() {
            assert_eq!(equal_steps(4, false)[j].hi(), n / 24.0);
        }
    }
}
