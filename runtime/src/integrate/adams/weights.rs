//! Weights of Adams methods, from the places of the known rates.

use crate::constant::{decimal, Constant};
use crate::Scalar;

/// Room for the nodes of a polynomial, at most 14: a multiple of all vectors' lengths. [`QUADRATURE`] is exact to degree
/// 15.
pub(super) const NODES: usize = 16;

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
/// The polynomials are Newton's: integrals of the products of factors `s − zᵢ`, by quadrature, and the products of the
/// places' differences, by Horner's rule. All terms of a sum have one sign, so that the sums lose no digits, however
/// unequal the steps are. Weight 0 of the corrector is one integral by itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights<S> {
    /// Of the integral to the end of the step of the polynomial through rates 0 to k.
    pub corrector: [S; NODES],
    /// Of the divided difference of rates 0 to k: `1 / Π (zⱼ − zᵢ)` over the other places; entries after k mean nothing.
    pub divided: [S; NODES],
    /// `∫ Π (s − zᵢ)` over i from 1 to k: the corrector's integral less that through rates 1 to k is this part of the
    /// divided difference.
    pub past: S,
    places: [S; NODES],
    k: usize,
    /// The integrals `∫ (s − z₀) Π (s − zᵢ)` over i from 1 to m − 1.
    integrals: [S; NODES],
}

impl<S: Scalar> Weights<S> {
    /// For `k` past rates, 1 to 13, at `places[1..]`, and the end of the step at `end`; time in any unit, from the
    /// start of the step. The places after `k` are those that [`Weights::change_above`] may take.
    pub fn new(places: &[S; NODES], k: usize, end: S) -> Self {
        let (zero, one) = (S::zero(), S::one());
        let mut out = Weights {
            corrector: [zero; NODES],
            divided: [one; NODES],
            past: zero,
            places: *places,
            k,
            integrals: [zero; NODES],
        };
        out.past = out.integrate(end);
        // Row m holds `zⱼ − zₘ` for all j at once: loops of a fixed length, which become vector instructions.
        let mut sums = [zero; NODES];
        for m in 0..=k {
            let mut row = [zero; NODES];
            for j in 0..NODES {
                row[j] = places[j] - places[m];
            }
            for j in 0..NODES {
                sums[j] = sums[j] * row[j] + out.integrals[m];
            }
            // The sum of place m begins here, and it is not among the differences of its own.
            (sums[m], row[m]) = (out.integrals[m], one);
            for j in 0..NODES {
                out.divided[j] = out.divided[j] * row[j];
            }
        }
        for j in 0..=k {
            out.divided[j] = one / out.divided[j];
            out.corrector[j] = sums[j] * out.divided[j];
        }
        out.corrector[0] = out.past * out.divided[0];
        out
    }

    /// Of the integral of the polynomial through rates 1 to k. Weight 0 is zero.
    pub fn predictor(&self) -> [S; NODES] {
        let mut out = [S::zero(); NODES];
        for j in 1..=self.k {
            // The polynomial through rate 0, too, is that through the others and a product that vanishes at them.
            out[j] = self.corrector[j] - self.past * self.divided[j];
        }
        out
    }

    /// By which part of the divided difference the corrector's integral changes as rate k is taken, too: through rates
    /// 0 to k against 0 to k − 1.
    pub fn change(&self) -> S {
        self.integrals[self.k]
    }

    /// Integrals to `end`, by quadrature: to `integrals`, and `∫ Π (s − zᵢ)` over i from 1 to k, which is returned.
    fn integrate(&mut self, end: S) -> S {
        let (mut at, mut product) = ([S::zero(); POINTS], [S::zero(); POINTS]);
        for (g, (place, weight)) in QUADRATURE.into_iter().enumerate() {
            (at[g], at[POINTS - 1 - g]) = (end * place.get(), end * (S::one() - place.get()));
            (product[g], product[POINTS - 1 - g]) = (end * weight.get(), end * weight.get());
        }
        let ahead = at.map(|at| at - self.places[0]);
        for m in 1..=self.k + 1 {
            let mut terms = product;
            for g in 0..POINTS {
                terms[g] = terms[g] * ahead[g];
            }
            self.integrals[m] = sum(&terms);
            if m <= self.k {
                for g in 0..POINTS {
                    product[g] = product[g] * (at[g] - self.places[m]);
                }
            }
        }
        sum(&product)
    }

    /// Weights of the change of the corrector's integral through rates 0 to k − 1 against 0 to k − 2. Zero for k = 1.
    pub fn change_below(&self) -> [S; NODES] {
        let mut out = [S::zero(); NODES];
        if let Some(integral) = self.k.checked_sub(1).filter(|m| *m > 0).map(|m| self.integrals[m]) {
            for j in 0..self.k {
                out[j] = integral * self.divided[j] * (self.places[j] - self.places[self.k]);
            }
        }
        out
    }

    /// Weights of the change of the corrector's integral through rates 0 to k + 1 against 0 to k.
    pub fn change_above(&self) -> [S; NODES] {
        let (k, mut out) = (self.k, [S::zero(); NODES]);
        let (integral, last) = (self.integrals[k + 1], self.places[k + 1]);
        let mut own = S::one();
        for j in 0..=k {
            out[j] = integral * self.divided[j] / (self.places[j] - last);
            own = own * (last - self.places[j]);
        }
        out[k + 1] = integral / own;
        out
    }
}

/// Sum of the terms of a quadrature.
fn sum<S: Scalar>(x: &[S; POINTS]) -> S {
    ((x[0] + x[1]) + (x[2] + x[3])) + ((x[4] + x[5]) + (x[6] + x[7]))
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

    /// Weights for the first places of a list.
    fn weights<S: Scalar>(places: &[S], k: usize, end: S) -> Weights<S> {
        let mut all = [S::one(); NODES];
        all[..places.len()].copy_from_slice(places);
        Weights::new(&all, k, end)
    }

    #[test]
    fn equal_steps_give_the_known_methods() {
        let places: [f64; NODES] = core::array::from_fn(|j| 1.0 - j as f64);
        let (predictor, corrector) =
            (weights(&places[..5], 4, 1.0).predictor(), weights(&places[..4], 3, 1.0).corrector);
        // (C.19), (C.20).
        for (w, known) in predictor[1..5].iter().zip([55.0, -59.0, 37.0, -9.0]) {
            assert!((24.0 * w - known).abs() < 1e-13 * known.abs(), "{w} {known}");
        }
        for (w, known) in corrector[..4].iter().zip([9.0, 19.0, -5.0, 1.0]) {
            assert!((24.0 * w - known).abs() < 1e-13 * known.abs(), "{w} {known}");
        }
        let single: [f32; NODES] = places.map(|x| x as f32);
        let single = weights(&single[..13], 12, 1.0).predictor();
        let double = weights(&places[..13], 12, 1.0).predictor();
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
                let w = weights(&places[..=k + 1], k, end);
                moments(&w.predictor()[..=k], &places, 1, end);
                moments(&w.corrector[..=k], &places, 0, end);
                let more = weights(&places[..=k + 1], k + 1, end).corrector;
                let less = if k > 1 { weights(&places[..k], k - 1, end).corrector } else { [0.0; NODES] };
                let above = w.change_above();
                for j in 0..=k + 1 {
                    let size = 50.0 * f64::EPSILON * (w.corrector[j].abs() + more[j].abs() + less[j].abs());
                    assert!((above[j] - (more[j] - w.corrector[j])).abs() <= size, "{k} {j}");
                    if k > 1 && j <= k {
                        assert!((w.change() * w.divided[j] - (w.corrector[j] - less[j])).abs() <= size, "{k} {j}");
                    }
                }
                if k > 2 {
                    let least = weights(&places[..k - 1], k - 2, end).corrector;
                    let below = w.change_below();
                    for j in 0..k {
                        let size = 50.0 * f64::EPSILON * (least[j].abs() + less[j].abs());
                        assert!((below[j] - (less[j] - least[j])).abs() <= size, "{k} {j}");
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
            let w = weights(&places[..=k], k, 1.0);
            let less = weights(&places[..k.max(2)], k.max(2) - 1, 1.0).corrector;
            for j in 0..NODES {
                // As in `moments`; weights of order 12 are sums of numbers up to a hundred times as large.
                let near = |a: f64, b: f64| (a - b).abs() <= 100.0 * f64::EPSILON * b.abs();
                assert!(near(w.predictor()[j], explicit[j].hi()), "{k} {j}: {} {}", w.predictor()[j], explicit[j].hi());
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
