//! How the terms of one sum are shared out to chains of additions.

use crate::symbolic::machine::{PRODUCT, SUM};

/// Chains of one sum at the most.
const CHAINS: usize = 3;

/// Cycles that one more operation has to save.
const WORTH: u32 = 1;

/// A term: when it, or the factors of its last product, can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Arrival {
    /// Cycle.
    pub ready: u32,
    /// Whether a product is to be fused with the addition.
    pub is_product: bool,
}

/// Terms shared out to chains.
pub struct Plan {
    /// When the sum is there.
    pub ready: u32,
    /// Instructions: additions, fused or not, and the products at the head of chains.
    pub instructions: u32,
    /// Those of them that multiply.
    pub products: u32,
    /// Number of chains.
    pub chains: usize,
    /// The chain of each term.
    pub places: Vec<usize>,
}

/// The best plan for terms in order of arrival; nothing for no terms.
pub fn best_plan(terms: &[Arrival]) -> Option<Plan> {
    let plans = (1..=CHAINS.min(terms.len())).map(|k| plan(terms, k));
    plans.min_by_key(|p| p.ready + WORTH * p.instructions)
}

/// Each term goes to the chain that is free first.
fn plan(terms: &[Arrival], chains: usize) -> Plan {
    let mut free: Vec<u32> = Vec::with_capacity(chains);
    let mut places = Vec::with_capacity(terms.len());
    let products = terms.iter().filter(|t| t.is_product).count() as u32;
    let mut instructions = 0;
    for t in terms {
        if free.len() < chains {
            places.push(free.len());
            free.push(t.ready + if t.is_product { PRODUCT } else { 0 });
            instructions += u32::from(t.is_product);
            continue;
        }
        let (k, at) = free.iter().copied().enumerate().min_by_key(|(_, at)| *at).unwrap_or((0, 0));
        free[k] = at.max(t.ready) + if t.is_product { PRODUCT } else { SUM };
        instructions += 1;
        places.push(k);
    }
    while free.len() > 1 {
        free.sort_unstable();
        let joined = free[1] + SUM;
        free.drain(..2);
        free.push(joined);
        instructions += 1;
    }
    Plan { ready: free.first().copied().unwrap_or(0), instructions, products, chains, places }
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
