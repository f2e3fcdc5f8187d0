//! Loop form: runs of like links as loops over tables of their constants, the rest of the tree as straight-line code.
//!
//! Straight-line code of a long chain outgrows the instruction cache and takes long to compile. Here every pass of a
//! group (leaves to base, base to leaves) walks the tree once; where it meets a run, one turn is traced on symbols by
//! the same steps of the sweeps, and becomes the body of a loop. What a later pass needs of an earlier one is kept in
//! one row of numbers for each turn. A link may have branches of its own, which are then part of its turn. The operations are
//! those of the straight-line form, so the bits are the same.

mod build;
mod cost;
mod evaluate;
mod link;
mod main_line;
mod mapped;
mod partition;
mod pass_state;
mod rest;
mod runs;
mod share;
mod siblings;
mod side_branches;
mod sines;
mod together;
mod turn_constants;
mod turn_tree;
mod twins;

use std::collections::BTreeSet;

use mbd_runtime::tree::Tree;

use crate::options::{Options, RolledCode};
use crate::output::{Output, OutputProgram};
use crate::plan::{Plan, RowsThatAct};
use crate::symbolic::{Counts, Expr, Graph, Label, Program, ProgramResult};
use crate::trace::{spec_of, symbolic_tree, SymbolicInputs};

pub use cost::cost;
pub use mbd_runtime::sweep::pass::SweepDirection;
#[cfg(feature = "factored")]
pub(crate) use partition::{assemble, nodes, output};
#[cfg(feature = "factored")]
pub(crate) use pass_state::{read, OutputSweeps, PassState};
pub use runs::{find, Run};
pub use siblings::WIDTH;
pub use together::{together, Together, Vectors};

/// Nodes in the shortest run that becomes a loop where the plan allows one.
const LEAST: usize = 6;

/// The same where loops are asked for.
const LEAST_ALWAYS: usize = 3;

/// Where an input of a block comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Input of the function, numbered through its arrays.
    Given(usize),
    /// The same, moving on with every turn.
    GivenOfTurn {
        /// At turn 0.
        first: usize,
        /// From turn to turn.
        stride: usize,
    },
    /// Kept by an earlier block.
    Kept(usize),
    /// Column of the run's table.
    Column(usize),
    /// Number of the turn's row.
    Row(usize),
    /// Carried from turn to turn; the same in all turns where these are branches of one node.
    Carried(usize),
    /// Number of the row of a branch, outside of its loop.
    RowOfBranch {
        /// Which run.
        run: usize,
        /// Which branch.
        turn: usize,
        /// Number of its row.
        row: usize,
    },
}

/// Where an output of a block goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Result of the function, in the order of the straight-line program's outputs.
    Result(usize),
    /// The same, moving on with every turn.
    ResultOfTurn {
        /// At turn 0.
        first: usize,
        /// From turn to turn.
        stride: usize,
    },
    /// Kept for later blocks.
    Kept(usize),
    /// Number of the turn's row.
    Row(usize),
    /// Carried to the next turn.
    Carried(usize),
}

/// First value of something carried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// A constant.
    Const(f64),
    /// Kept by an earlier block, perhaps with the other sign.
    Kept(usize, bool),
    /// Input of the function (gravity), perhaps with the other sign.
    Given(usize, bool),
}

/// How a block repeats.
#[derive(Clone, Debug)]
pub struct Repeat {
    /// Which run.
    pub run: usize,
    /// Order of the turns; `None`: any, the turns do not depend on each other.
    pub way: Option<SweepDirection>,
    /// First values of what is carried, and where the last ones are kept.
    pub carried: Vec<(Start, Option<usize>)>,
}

impl Repeat {
    /// Whether the loop goes from the last turn to the first.
    pub fn is_backward(&self) -> bool {
        self.way == Some(SweepDirection::TipToBase)
    }
}

/// Straight-line code, or the body of a loop.
#[derive(Clone, Debug)]
pub struct Block {
    /// Its program; inputs are numbered through `inputs`.
    pub program: Program,
    /// Where the inputs come from.
    pub inputs: Vec<Place>,
    /// Where the outputs go.
    pub outputs: Vec<Target>,
    /// Set for loops.
    pub repeat: Option<Repeat>,
}

/// One run in the code.
#[derive(Clone, Debug)]
pub struct Loop {
    /// Nodes.
    pub nodes: std::ops::Range<usize>,
    /// Nodes in one turn.
    pub period: usize,
    /// One row of constants for each turn.
    pub table: Vec<Vec<f64>>,
    /// Numbers kept for each turn.
    pub row: usize,
    /// First node of every branch where the turns are like branches of one node, which are computed at the same time.
    pub branches: Vec<usize>,
}

/// An output group in loop form.
#[derive(Clone, Debug)]
pub struct RolledProgram {
    /// Number of results.
    pub results: usize,
    /// Runs.
    pub loops: Vec<Loop>,
    /// Blocks, in order.
    pub blocks: Vec<Block>,
    /// Numbers kept between blocks.
    pub kept: usize,
}

impl RolledProgram {
    /// Operations that are executed.
    pub fn counts(&self) -> Counts {
        self.counts_where(|_| true)
    }

    /// Operations that are executed and whose label meets a condition.
    pub fn counts_where(&self, condition: impl Fn(&Label) -> bool) -> Counts {
        self.blocks.iter().fold(Counts::default(), |sum, block| {
            sum.plus(block.program.counts_where(&condition).times(self.turns(block)))
        })
    }

    /// How many times a block is executed.
    fn turns(&self, block: &Block) -> usize {
        block.repeat.as_ref().map_or(1, |r| self.loops[r.run].table.len())
    }

    /// Numbers of the inputs that are read.
    pub fn used_inputs(&self) -> BTreeSet<usize> {
        let mut used = BTreeSet::new();
        for block in &self.blocks {
            let turns = self.turns(block);
            for place in &block.inputs {
                match *place {
                    Place::Given(k) => used.extend([k]),
                    Place::GivenOfTurn { first, stride } => used.extend((0..turns).map(|turn| first + stride * turn)),
                    _ => {}
                }
            }
            let starts = block.repeat.iter().flat_map(|r| &r.carried);
            used.extend(starts.filter_map(|(start, _)| if let Start::Given(k, _) = start { Some(*k) } else { None }));
        }
        used
    }

    /// Whether all numbers in the code satisfy a condition.
    pub fn all_constants(&self, mut fits: impl FnMut(f64) -> bool) -> bool {
        let tables = self.loops.iter().all(|l| l.table.iter().flatten().all(|x| fits(*x)));
        tables
            && self.blocks.iter().all(|block| {
                let steps = block.program.steps.iter().flat_map(|(_, op, _)| op.operands());
                let mut operands = steps.filter_map(|o| match o {
                    crate::symbolic::Operand::Const(bits) => Some(f64::from_bits(bits)),
                    crate::symbolic::Operand::Node(_) => None,
                });
                let outputs_fit = block.program.outputs.iter().all(|o| match o {
                    ProgramResult::Const(x) => fits(*x),
                    ProgramResult::Node(..) => true,
                });
                outputs_fit && operands.all(&mut fits)
            })
    }
}

/// Nodes that can be loops over the links of chains whose links have branches, run by run, at least `least` in each.
pub fn runs_with_side_branches(plan: &Plan, least: usize) -> Vec<std::ops::Range<usize>> {
    // Loops take in no external wrenches, and a tree of many long paths of these is not made for nothing.
    if plan.nodes.len() <= least || !plan.wrenches.is_empty() {
        return Vec::new();
    }
    with_tree(plan, |tree| {
        let runs = find(tree, &vec![true; plan.nodes.len()], least);
        runs.into_iter().filter(Run::has_side_branches).map(|run| run.nodes).collect()
    })
}

/// Whether a body has like branches, which can be computed together.
pub fn has_like_branches(plan: &Plan) -> bool {
    with_tree(plan, |tree| !siblings::find(tree, true).is_empty())
}

/// Calls `f` with the tree of the rates on symbols.
fn with_tree<T>(plan: &Plan, f: impl FnOnce(&Tree<Expr>) -> T) -> T {
    let (graph, options) = (Graph::default(), Options { outputs: vec![Output::Rates], ..Options::default() });
    let given = SymbolicInputs::new(&graph, plan, spec_of(plan, Output::Rates), &options);
    f(&symbolic_tree(plan, Output::Rates, &given, &options).regrouped())
}

/// The loop form of a group; `None` where there is none, or straight-line code is better.
pub fn rolled(plan: &Plan, group: Output, options: &Options) -> Option<OutputProgram<RolledProgram>> {
    // Rows that act by numbers are not known to loops.
    if matches!(plan.acts, RowsThatAct::Input) {
        return None;
    }
    let least = match options.plan.rolled {
        RolledCode::Never => return None,
        RolledCode::Auto => LEAST,
        RolledCode::Always => LEAST_ALWAYS,
    };
    build::build(plan, group, options, |tree, allowed| find(tree, allowed, least))
}
