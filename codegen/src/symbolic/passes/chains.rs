//! Distribution of the terms of one sum over chains of additions that run in parallel.

use crate::symbolic::machine::{PRODUCT, SUM};

/// Largest number of chains for one sum.
const CHAINS: usize = 3;

/// Cycles that an additional operation must save.
const WORTH: u32 = 1;

/// A term of a sum, and the time at which it, or the factors of its last product, are available.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Arrival {
    /// Time, in cycles.
    pub ready: u32,
    /// Whether the term is a product that is fused with the addition.
    pub is_product: bool,
}

/// An assignment of terms to chains.
pub struct Plan {
    /// Time at which the sum is available, in cycles.
    pub ready: u32,
    /// Number of instructions: additions, fused or not, and the products that start a chain.
    pub instructions: u32,
    /// Number of these instructions that multiply.
    pub products: u32,
    /// Number of chains.
    pub chains: usize,
}

/// The best plan for terms in the order in which they become available; `None` if there are no terms.
pub fn best_plan(terms: &[Arrival]) -> Option<Plan> {
    let plans = (1..=CHAINS.min(terms.len())).map(|chains| plan(terms, chains, &mut |_| ()));
    plans.min_by_key(|p| p.ready + WORTH * p.instructions)
}

/// The plan in which each term goes to the chain that is free first; `place` is told the chain of each term.
fn plan(terms: &[Arrival], chains: usize, place: &mut impl FnMut(usize)) -> Plan {
    // An array and plain loops: a search plans very many sums, in macros without optimisation.
    let mut free = [0; CHAINS];
    let (mut products, mut instructions) = (0, 0);
    for (n, t) in terms.iter().enumerate() {
        products += u32::from(t.is_product);
        if n < chains {
            place(n);
            free[n] = t.ready + if t.is_product { PRODUCT } else { 0 };
            instructions += u32::from(t.is_product);
            continue;
        }
        let mut k = 0;
        for other in 1..chains {
            if free[other] < free[k] {
                k = other;
            }
        }
        free[k] = free[k].max(t.ready) + if t.is_product { PRODUCT } else { SUM };
        instructions += 1;
        place(k);
    }
    // The two chains that are free first are joined, until there is one.
    let free = &mut free[..chains];
    free.sort_unstable();
    for joined in 1..chains {
        let rest = &mut free[joined..];
        rest[0] += SUM;
        rest.sort_unstable();
        instructions += 1;
    }
    Plan { ready: free.last().copied().unwrap_or(0), instructions, products, chains }
}

impl Plan {
    /// The chain of each term of the sum that the plan was made for.
    pub fn places(&self, terms: &[Arrival]) -> Vec<usize> {
        let mut places = Vec::with_capacity(terms.len());
        plan(terms, self.chains, &mut |chain| places.push(chain));
        places
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ready: u32) -> Arrival {
        Arrival { ready, is_product: false }
    }

    #[test]
    fn late_terms_are_added_last() {
        let plan = best_plan(&[at(0), at(0), at(100)]).expect("terms");
        assert_eq!((plan.ready, plan.instructions), (100 + SUM, 2));
    }

    #[test]
    fn long_sums_are_split() {
        let plan = best_plan(&[at(0); 16]).expect("terms");
        assert!(plan.chains > 1 && plan.ready < 15 * SUM, "{} chains, {} cycles", plan.chains, plan.ready);
        assert_eq!(plan.instructions, 15);
    }

    #[test]
    fn products_cost_one_instruction_each() {
        let product = Arrival { ready: 0, is_product: true };
        let plan = best_plan(&[product; 2]).expect("terms");
        assert_eq!((plan.ready, plan.instructions, plan.products), (2 * PRODUCT, 2, 2));
        assert!(best_plan(&[]).is_none());
    }
}
