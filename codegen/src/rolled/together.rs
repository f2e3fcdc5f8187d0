//! Like branches of one node, or of the ground, computed at the same time, one in each lane of a vector register, for one state.

use super::{build, siblings, RolledProgram, WIDTH};
use crate::options::{Arithmetic, LikeBranches, Options};
use crate::output::{Output, OutputProgram};
use crate::plan::Plan;
use crate::symbolic::{passes, Expr, Graph, Op, Program};
use crate::trace::rewrite;

/// The program of an output that computes like branches together, and the same statements branch by branch.
#[derive(Clone, Debug)]
pub struct Together {
    /// With loops over the branches.
    pub program: RolledProgram,
    /// Without loops: the same operations on the same numbers.
    pub apart: Program,
}

/// Like branches together in an output; `None` where there are none.
pub fn together(plan: &Plan, group: Output, options: &Options) -> Option<OutputProgram<Together>> {
    if options.plan.branches == LikeBranches::Apart {
        return None;
    }
    let fast = options.arithmetic == Arithmetic::Fast;
    let built = build::build(plan, group, options, |tree, _| siblings::find(tree, fast))?;
    // Tables are read one lane after the other.
    let mut operations = built.program.blocks.iter().flat_map(|block| &block.program.steps).map(|(_, op, _)| op);
    if operations.any(Op::looks_up) {
        return None;
    }
    let count = built.inputs.iter().map(crate::output::InputArray::len).sum::<usize>();
    Some(built.map(|program| {
        let graph = Graph::default();
        let inputs: Vec<Expr> = (0..count).map(|k| graph.input(k)).collect();
        let results = program.evaluate(&inputs, |a, b, c| graph.fma(a, b, c));
        let apart = passes::order(Program::new(&graph, &results), rewrite(options));
        Together { program, apart }
    }))
}

/// Largest share of the instructions of straight-line code with which branches are computed together. A loop over
/// branches also moves numbers into vectors and out of them.
const WORTH: f64 = 0.8;

/// Fewest instructions of straight-line code, below which sums and inputs take most of the time.
const LEAST: usize = 300;

/// Numbers of double precision in a vector register of any target, and in one of AVX2.
const REGISTERS: [usize; 2] = [2, 4];

/// Where like branches are computed together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vectors {
    /// On every target that has vector instructions.
    Any,
    /// With vectors of 32 bytes only, because pairs of branches fill half of the lanes.
    Wide,
}

impl Together {
    /// Whether it is to replace straight-line code for one state, on a target that has vectors of `width` numbers and
    /// writes the code of as many of them as there are branches.
    pub fn pays_in(&self, width: usize, straight: &Program, options: &Options) -> bool {
        let blocks = self.program.blocks.iter().map(|block| {
            let turns = |repeat: &super::Repeat| self.program.loops[repeat.run].table.len().div_ceil(width);
            block.repeat.as_ref().map_or(1, turns) * block.program.instructions()
        });
        let (together, apart) = (blocks.sum::<usize>(), straight.instructions());
        let fewer = apart >= LEAST && together as f64 <= WORTH * apart as f64;
        options.plan.branches == LikeBranches::Together || fewer
    }

    /// Where it is to replace straight-line code for one state, if anywhere.
    pub fn pays(&self, straight: &Program, options: &Options) -> Option<Vectors> {
        let together = |lanes: usize| {
            let blocks = self.program.blocks.iter().map(|block| {
                let parts = if block.repeat.is_some() { WIDTH.div_ceil(lanes) } else { 1 };
                parts * block.program.instructions()
            });
            blocks.sum::<usize>() as f64
        };
        if options.plan.branches == LikeBranches::Together {
            return Some(Vectors::Any);
        }
        // Bodies of loops are not written in parts; scopes in scopes beyond this are too deep for compilers.
        let longest = self.program.blocks.iter().map(|block| block.program.steps.len()).max().unwrap_or(0);
        let apart = straight.instructions();
        let fits = longest <= 2 * options.chunk.max(1000) && apart >= LEAST;
        let [any, wide] = REGISTERS.map(|lanes| fits && together(lanes) <= WORTH * apart as f64);
        match (any, wide) {
            (true, _) => Some(Vectors::Any),
            (false, true) => Some(Vectors::Wide),
            (false, false) => None,
        }
    }
}
