//! Rewriting of whole programs, for [`Rewrite`]: the values are the same up to rounding.

pub(super) mod chains;
pub mod constants;
pub mod factor;
#[cfg(test)]
mod random;
mod rebuild;
pub mod schedule;
pub mod share;
pub mod shorten;
pub mod sums;
pub(super) mod terms;

use std::cell::Cell;

use super::Program;
use schedule::Limits;

/// Largest number of rounds of rewriting; two or three have been enough for all models so far.
const ROUNDS: usize = 4;

/// Number of values that a schedule keeps alive: of the 32 registers of AVX-512, or of 16 registers with some values in
/// memory, which costs little.
const LIMITS: Limits = Limits { registers: 24, search: 64 };

/// Long programs keep the order of the sweeps if the work of their busiest pipe takes this many times as long as their
/// critical path. There is then always an operation that is ready, and values that are used soon after they are
/// computed stay in registers. (The derivatives of a general chain, of the Panda and of Solo12 take less time in this
/// order, those of the last two a fifth less with fused operations; those of the iiwa, with fewer instructions, take
/// more.)
const WIDE: f64 = 2.0;

/// Number of instructions from which a program counts as long.
const LONG: usize = 1400;

/// How a program is rewritten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rewrite {
    /// Not at all.
    None,
    /// For the shortest time; operations may be made twice to save time.
    Shortest,
    /// For the fewest operations.
    Fewest,
}

/// The program as it is to be emitted.
pub fn run(program: Program, rewrite: Rewrite) -> Program {
    order(operations(program, rewrite), rewrite)
}

/// The operations of the program as it is to be emitted, not yet in their order.
pub fn operations(program: Program, rewrite: Rewrite) -> Program {
    if rewrite == Rewrite::None {
        return program;
    }
    let (collected, plain) = with_fewer(program);
    match plain {
        // Long programs take too long to finish twice, and an operation is nothing to them.
        Some(plain) if plain.steps.len() < LONG => fewest(finished(collected, rewrite), finished(plain, rewrite)),
        Some(plain) => finished(fewest(collected, plain), rewrite),
        None => finished(collected, rewrite),
    }
}

/// The program in the order in which it is to be emitted; its operations stay.
pub fn order(program: Program, rewrite: Rewrite) -> Program {
    if rewrite == Rewrite::None {
        return program;
    }
    let wide = program.throughput() >= WIDE * f64::from(program.critical_path());
    match wide && program.instructions() >= LONG {
        true => program,
        false => schedule::schedule(&program, LIMITS),
    }
}

/// A program with fewer operations, regrouped.
fn finished(program: Program, rewrite: Rewrite) -> Program {
    match rewrite {
        Rewrite::None => program,
        Rewrite::Shortest => shorten::regroup_short(&constants::gather(&program)),
        Rewrite::Fewest => fewest(sums::regroup(&constants::gather(&program)), sums::regroup(&program)),
    }
}

/// The program with fewer operations; among equals the first.
fn fewest(a: Program, b: Program) -> Program {
    match a.counts().total() <= b.counts().total() {
        true => a,
        false => b,
    }
}

/// Reduces the number of operations: takes out common factors and common pairs in turn, until neither saves any. With equal
/// terms collected and, if there are any, without: then a pair may be gone that other sums would have shared.
fn with_fewer(program: Program) -> (Program, Option<Program>) {
    let collects = Cell::new(false);
    let collected = rounds(program.clone(), Some(&collects));
    (collected, collects.get().then(|| rounds(program, None)))
}

fn rounds(mut program: Program, collects: Option<&Cell<bool>>) -> Program {
    for _ in 0..ROUNDS {
        let next = share::share(&factor::factor(&program, collects));
        if next.counts().total() >= program.counts().total() {
            break;
        }
        program = next;
    }
    program
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fewer(program: Program) -> Program {
        match with_fewer(program) {
            (collected, Some(plain)) => fewest(collected, plain),
            (collected, None) => collected,
        }
    }

    #[test]
    fn values_stay() {
        for rewrite in [Rewrite::Shortest, Rewrite::Fewest] {
            random::keeps_values(|p| run(p.clone(), rewrite));
        }
        random::keeps_values(|p| fewer(p.clone()));
    }

    #[test]
    fn counts_do_not_grow() {
        for rewrite in [Rewrite::Shortest, Rewrite::Fewest] {
            random::counts_never_grow(|p| run(p.clone(), rewrite));
        }
        random::counts_never_grow(|p| fewer(p.clone()));
    }

    #[test]
    fn the_same_program_gives_the_same_program() {
        for seed in 0..20 {
            let program = random::integer_program(seed, 100);
            let [a, b] = [0; 2].map(|_| run(program.clone(), Rewrite::Shortest));
            assert_eq!((a.steps, a.outputs), (b.steps, b.outputs));
        }
    }

    #[test]
    fn exact_programs_are_left_alone() {
        let program = random::integer_program(1, 100);
        let exact = run(program.clone(), Rewrite::None);
        assert_eq!((exact.steps, exact.outputs), (program.steps, program.outputs));
    }
}
