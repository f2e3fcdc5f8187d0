//! When a method that remembers must be freed of its multipliers.

use crate::system::Real;

/// How near a singular position is, and when the momenta have last been freed of their multipliers for it.
#[derive(Clone, Debug)]
pub(super) struct Nearness<R, S> {
    /// Largest pivot that each row has had.
    largest: R,
    rank: usize,
    /// The least part of its largest pivot that a row had when the momenta were freed; 1 far from singular positions.
    freed: S,
    /// The same when the order of the rows was last looked at.
    ordered: Option<S>,
}

impl<R: AsRef<[S]> + AsMut<[S]>, S: Real> Nearness<R, S> {
    /// Multipliers `σ` of a row with pivot `d` are the part `√d σ` of the momenta. That part is motion as soon as the
    /// row counts as redundant, at whatever pivot that happens; so it is removed at every hundredth of the pivot again.
    const STEP: f64 = 0.01;

    /// Far from singular positions; `zero` has an entry of zero for each row.
    pub fn new(zero: R) -> Self {
        Nearness { largest: zero, rank: 0, freed: S::one(), ordered: None }
    }

    /// The least part that a row has of its largest pivot so far: of the rows that are independent, and of all.
    fn least(&mut self, pivots: &[S]) -> [S; 2] {
        let (zero, mut least) = (S::zero(), [S::one(); 2]);
        for (pivot, largest) in pivots.iter().zip(self.largest.as_mut()) {
            if *pivot > *largest {
                *largest = *pivot;
            }
            let of = usize::from(*pivot == zero);
            if *pivot < least[of] * *largest {
                least[of] = *pivot / *largest;
            }
        }
        if least[0] < least[1] {
            least[1] = least[0];
        }
        least
    }

    /// Whether a row has lost nearly all of its pivot, or has been left out since.
    pub fn near(&mut self, pivots: &[S]) -> bool {
        self.least(pivots)[1] < S::constant(Self::STEP)
    }

    /// Whether the order of the rows must be looked at: at the start, and at every tenth of the part that a row has left
    /// of its pivot, from a hundredth on.
    pub fn asks_for_order(&mut self, pivots: &[S]) -> bool {
        let ([least, _], step) = (self.least(pivots), S::constant(Self::STEP));
        let asks = self.ordered.is_none_or(|ordered| least < step && least < S::constant(0.1) * ordered);
        if asks || least > step {
            self.ordered = Some(if least > step { S::one() } else { least });
        }
        asks
    }

    /// Whether the momenta must be freed at these pivots.
    pub fn asks(&mut self, pivots: &[S]) -> bool {
        let rank = pivots.iter().filter(|pivot| **pivot != S::zero()).count();
        let ([least, _], step) = (self.least(pivots), S::constant(Self::STEP));
        let asks = (rank != self.rank && self.rank > 0) || least < step * self.freed;
        self.rank = rank;
        if asks {
            self.freed = least;
        } else if least > step {
            self.freed = S::one();
        }
        asks
    }
}
