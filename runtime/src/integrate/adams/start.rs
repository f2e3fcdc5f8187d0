//! One-step method of any even order: the start of the fixed-step ones.

use crate::integrate::chart::Point;
use crate::integrate::field::Field;
use crate::system::{Real, System};

/// Columns at most: order 12.
const COLUMNS: usize = 6;

/// Extrapolation of the midpoint rule with 2, 4, 6 … substeps (Gragg, SIAM J. Numer. Anal. 2, 1965; Hairer, Nørsett,
/// Wanner, *Solving Ordinary Differential Equations I*, II.9): its error has even powers of the substep alone, so every
/// further number of substeps gives two orders more.
#[derive(Clone, Debug)]
pub(super) struct Extrapolation<Y: System> {
    columns: [Point<Y>; COLUMNS],
    /// The two last points of the midpoint rule.
    points: [Point<Y>; 2],
    rate: Point<Y>,
}

impl<Y> Extrapolation<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    pub fn new(system: &Y) -> Self {
        let point = || Point::zero(system);
        Extrapolation { columns: core::array::from_fn(|_| point()), points: [point(), point()], rate: point() }
    }

    /// One step of order `order` or one more, at most 12: `⌈order / 2⌉²` evaluations of the rates. `start` is the rate
    /// at its start.
    pub fn step(
        &mut self,
        (field, system): (&mut Field<Y>, &mut Y),
        (t, h): (Y::Scalar, Y::Scalar),
        order: usize,
        start: &Point<Y>,
        out: &mut Point<Y>,
    ) {
        let last = order.div_ceil(2).clamp(1, COLUMNS) - 1;
        for row in 0..=last {
            self.midpoint(field, system, (t, h), 2 * (row + 1), start);
            self.extrapolate(row);
        }
        out.copy_from(&self.columns[last]);
    }

    /// The midpoint rule with `n` substeps; its end goes to the second point.
    fn midpoint(
        &mut self,
        field: &mut Field<Y>,
        system: &mut Y,
        (t, h): (Y::Scalar, Y::Scalar),
        n: usize,
        start: &Point<Y>,
    ) {
        let part = h / Y::Scalar::from_index(n);
        let [before, now] = &mut self.points;
        before.clear();
        now.clear();
        now.add(part, start);
        for m in 1..n {
            field.rates(system, t + part * Y::Scalar::from_index(m), now, &mut self.rate);
            before.add(part + part, &self.rate);
            core::mem::swap(before, now);
        }
    }

    /// Aitken and Neville: row `row` of the table takes the place of the one before.
    fn extrapolate(&mut self, row: usize) {
        let [_, new] = &mut self.points;
        for (k, old) in self.columns.iter_mut().enumerate().take(row) {
            // 1 / (n² / m² − 1), of integers: exact but for the division, in any precision.
            let (n2, m2) = ((row + 1) * (row + 1), (row - k) * (row - k));
            let factor = Y::Scalar::from_index(m2) / Y::Scalar::from_index(n2 - m2);
            for (new, old) in new.parts_mut().into_iter().zip(old.parts_mut()) {
                for (new, old) in new.iter_mut().zip(old) {
                    let change = factor * (*new - *old);
                    *old = *new;
                    *new = *new + change;
                }
            }
        }
        self.columns[row].copy_from(new);
    }
}
