//! The rates of past steps, transformed to every new base of the chart.

use crate::integrate::chart::{Chart, Point};
use crate::system::{Real, System};
use crate::Scalar;

/// The last `N` rates, newest first, and where they were taken.
#[derive(Clone, Debug)]
pub(super) struct History<Y: System, const N: usize> {
    rates: [Point<Y>; N],
    /// Displacements from the chart's state; of use for groups only.
    places: [Point<Y>; N],
    /// How long ago, s.
    ages: [Y::Scalar; N],
    /// Slot of the newest; older ones follow it around.
    head: usize,
    len: usize,
}

impl<Y, const N: usize> History<Y, N>
where
    Y: System,
    Y::Scalar: Real,
{
    pub fn new(system: &Y) -> Self {
        let points = || core::array::from_fn(|_| Point::zero(system));
        History { rates: points(), places: points(), ages: [Y::Scalar::zero(); N], head: 0, len: 0 }
    }

    pub fn len(&self) -> usize {
        self.len
    }

    /// Keeps the newest `len`.
    pub fn keep(&mut self, len: usize) {
        self.len = self.len.min(len);
    }

    fn slot(&self, j: usize) -> usize {
        let slot = self.head + j;
        let slot = if slot < N { slot } else { slot - N };
        // The compiler sees that no index is out of bounds.
        slot.min(N - 1)
    }

    /// Rate `j`, 0 the newest.
    pub fn rate(&self, j: usize) -> &Point<Y> {
        &self.rates[self.slot(j)]
    }

    /// The newest rate.
    pub fn newest(&mut self) -> &mut Point<Y> {
        &mut self.rates[self.head]
    }

    /// Age of rate `j`, s.
    pub fn age(&self, j: usize) -> Y::Scalar {
        self.ages[self.slot(j)]
    }

    /// Room for a rate newer than all, at the chart's state or at a displacement that is reached in `ahead` s.
    pub fn push(&mut self, place: Option<(&Point<Y>, Y::Scalar)>) -> &mut Point<Y> {
        self.head = (self.head + N - 1) % N;
        self.len = (self.len + 1).min(N);
        match place {
            None => {
                self.places[self.head].clear();
                self.ages[self.head] = Y::Scalar::zero();
            }
            Some((place, ahead)) => {
                self.places[self.head].copy_from(place);
                self.ages[self.head] = -ahead;
            }
        }
        &mut self.rates[self.head]
    }

    /// The chart's state has moved by `step`, which took `h` s.
    pub fn follow(&mut self, system: &Y, step: &Point<Y>, h: Y::Scalar) {
        for j in 0..self.len {
            let slot = self.slot(j);
            self.ages[slot] = self.ages[slot] + h;
            if !system.lie_joints().is_empty() {
                Chart::follow(system, step, &mut self.places[slot], &mut self.rates[slot]);
            }
        }
    }

    /// `out = w₀ new + Σ wⱼ fⱼ₋₁`: `weights[0]` is that of a rate newer than all.
    #[inline]
    pub fn combine(&self, weights: &[Y::Scalar], new: &Point<Y>, out: &mut Point<Y>) {
        let Some((first, past)) = weights.split_first() else { return };
        self.sums([past], [&mut *out]);
        out.add(*first, new);
    }

    /// `outᵢ = Σ wᵢⱼ fⱼ` for lists of weights of one length: each rate is read once.
    #[inline(always)]
    pub fn sums<const M: usize>(&self, weights: [&[Y::Scalar]; M], mut out: [&mut Point<Y>; M]) {
        let count = weights.iter().map(|w| w.len()).min().unwrap_or(0);
        let fours = count / 4 * 4;
        out.iter_mut().for_each(|out| out.clear());
        for j in (0..fours).step_by(4) {
            // Four terms at once need fewer loads and stores.
            let rates = [0, 1, 2, 3].map(|i| self.rate(j + i).parts());
            for (w, out) in weights.iter().zip(&mut out) {
                let w = &w[j..j + 4];
                for (part, out) in out.parts_mut().into_iter().enumerate() {
                    let [a, b, c, d] = rates.map(|rate| &rate[part][..out.len()]);
                    for i in 0..out.len() {
                        out[i] = out[i] + ((w[0] * a[i] + w[1] * b[i]) + (w[2] * c[i] + w[3] * d[i]));
                    }
                }
            }
        }
        for j in fours..count {
            for (w, out) in weights.iter().zip(&mut out) {
                out.add(w[j], self.rate(j));
            }
        }
    }
}
