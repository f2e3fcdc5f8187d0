//! A tree on its way through the passes of an output, one node at a time: the whole tree or one link alone. The order
//! is that of the runtime's lists ([`SweepList`]), and so are the operations.

use mbd_runtime::sweep::pass::{Arguments, Context, Pass, Results, Sweep, SweepList};
use mbd_runtime::sweep::{Accelerations, Sweeps};
use mbd_runtime::tree::{Bond, Constraint, Tree};
use mbd_runtime::workspace::Workspace;
use mbd_runtime::Scalar;

use crate::output::Output;
use crate::symbolic::{Expr, Graph};
use crate::trace::SymbolicInputs;

/// The sweeps of an output on symbols.
#[derive(Clone)]
pub struct OutputSweeps<'g> {
    sweeps: Vec<Sweep<Expr<'g>, Graph>>,
    finish: fn(&mut Context<'_, Expr<'g>, Graph>),
}

impl<'g> OutputSweeps<'g> {
    /// Those of an output; `None` for outputs that are never rolled.
    pub fn of(output: Output) -> Option<Self> {
        match output {
            Output::Rates => Some(SweepList::RATES.into()),
            Output::Velocities => Some(SweepList::VELOCITIES.into()),
            Output::Energy => Some(SweepList::ENERGY.into()),
            Output::Momenta => Some(SweepList::MOMENTA.into()),
            Output::InverseDynamics | Output::Bias => Some(SweepList::INVERSE_DYNAMICS.into()),
            Output::Accelerations | Output::Multipliers => Some(SweepList::ACCELERATIONS.into()),
            Output::ProjectMomenta => Some(SweepList::PROJECT_MOMENTA.into()),
            Output::PositionCorrection => Some(SweepList::POSITION_CORRECTION.into()),
            _ => None,
        }
    }

    /// The passes that a tree needs.
    pub fn all_passes(&self, tree: &Tree<Expr<'g>>) -> Vec<Pass> {
        mbd_runtime::sweep::pass::passes(&self.sweeps, tree)
    }

    /// Whether links of a tree can carry all sweeps that it needs.
    pub fn rolls(&self, tree: &Tree<Expr<'g>>) -> bool {
        self.sweeps.iter().filter(|sweep| (sweep.needed)(tree)).all(|sweep| (sweep.rolls)(tree))
    }
}

impl<'g, const N: usize> From<SweepList<Expr<'g>, Graph, N>> for OutputSweeps<'g> {
    fn from(list: SweepList<Expr<'g>, Graph, N>) -> Self {
        OutputSweeps { sweeps: list.sweeps.into(), finish: list.finish }
    }
}

/// A tree on its way through the passes.
#[derive(Clone)]
pub struct PassState<'g, 'a> {
    output: Output,
    graph: &'g Graph,
    list: OutputSweeps<'g>,
    passes: &'a [Pass],
    /// The mechanism, regrouped.
    pub tree: Tree<Expr<'g>>,
    work: Workspace<Expr<'g>>,
    v: Vec<Expr<'g>>,
    qd: Vec<Expr<'g>>,
    p: Vec<Expr<'g>>,
    rows: Vec<Expr<'g>>,
    pivots: Vec<Expr<'g>>,
    energy: [Expr<'g>; 2],
}

impl<'g, 'a> PassState<'g, 'a> {
    /// Nothing done yet; `None` for outputs that are never rolled.
    pub fn new(output: Output, graph: &'g Graph, tree: Tree<Expr<'g>>, passes: &'a [Pass]) -> Option<Self> {
        let zeros = |n: usize| vec![Expr::zero(); n];
        let (nq, nv, rows) = (tree.dims.nq, tree.dims.nv, tree.dims.rows);
        let (v, qd, p, energy) = (zeros(nv), zeros(nq), zeros(nv), [Expr::zero(); 2]);
        let (list, work) = (OutputSweeps::of(output)?, Workspace::new(&tree));
        Some(PassState {
            output,
            graph,
            list,
            passes,
            work,
            v,
            qd,
            p,
            rows: zeros(rows),
            pivots: zeros(rows),
            energy,
            tree,
        })
    }

    /// Calls `f` with the sweeps of the output and what they work on.
    fn with(
        &mut self,
        given: &SymbolicInputs<'g>,
        f: impl FnOnce(&OutputSweeps<'g>, &mut Context<'_, Expr<'g>, Graph>),
    ) {
        let accelerations = match self.output {
            Output::InverseDynamics => Accelerations::Given(&given.third),
            Output::Accelerations | Output::Multipliers => Accelerations::Chosen,
            _ => Accelerations::Zero,
        };
        let inputs = given.inputs();
        let mut cx = Context {
            sweeps: &Sweeps { tree: &self.tree, trace: self.graph },
            given: &Arguments { q: &given.q, second: &given.second, accelerations, inputs },
            w: &mut self.work,
            results: Results {
                v: &mut self.v,
                qd: &mut self.qd,
                p: &mut self.p,
                rows: &mut self.rows,
                pivots: &mut self.pivots,
                energy: &mut self.energy,
                ..Results::none()
            },
        };
        f(&self.list, &mut cx);
    }

    /// Calls `f` with every sweep of a pass.
    fn each(
        &mut self,
        pass: usize,
        given: &SymbolicInputs<'g>,
        mut f: impl FnMut(&Sweep<Expr<'g>, Graph>, &mut Context<'_, Expr<'g>, Graph>),
    ) {
        let passes = self.passes;
        self.with(given, |list, cx| passes[pass].sweeps.iter().for_each(|&k| f(&list.sweeps[k], cx)));
    }

    /// Before the first node of a pass. Steps of all joints are made ahead of the first one, because screws that are
    /// carried outward need the joints of the whole tree.
    pub fn begin(&mut self, pass: usize, given: &SymbolicInputs<'g>) {
        if pass == 0 {
            self.with(given, |_, cx| cx.articulate());
        }
        self.each(pass, given, |sweep, cx| (sweep.begin)(cx));
    }

    /// One node of a pass.
    pub fn node(&mut self, pass: usize, i: usize, given: &SymbolicInputs<'g>) {
        self.each(pass, given, |sweep, cx| (sweep.node)(cx, i));
    }

    /// After the last node of a pass.
    pub fn end(&mut self, pass: usize, given: &SymbolicInputs<'g>) {
        self.each(pass, given, |sweep, cx| (sweep.end)(cx));
    }

    /// Calls `visit` with what a pass carries through node `i`: from tip to base what its children hand to it, from
    /// base to tip what it hands to its children.
    pub fn carried(&mut self, pass: usize, i: usize, given: &SymbolicInputs<'g>, mut visit: impl FnMut(&mut Expr<'g>)) {
        self.each(pass, given, |sweep, cx| (sweep.carried)(cx, i, &mut visit));
    }

    /// The same with the number of the sweep among those of the output, and that of the value among those of the sweep.
    pub fn carried_by_sweeps(
        &mut self,
        pass: usize,
        i: usize,
        given: &SymbolicInputs<'g>,
        mut visit: impl FnMut([usize; 2], &mut Expr<'g>),
    ) {
        let passes = self.passes;
        self.with(given, |list, cx| {
            for &k in &passes[pass].sweeps {
                let mut number = 0;
                (list.sweeps[k].carried)(cx, i, &mut |e| {
                    visit([k, number], e);
                    number += 1;
                });
            }
        });
    }

    /// Calls `visit` with what a pass carries whatever node it is at: sums over all nodes so far, and multipliers.
    pub fn running(&mut self, pass: usize, given: &SymbolicInputs<'g>, mut visit: impl FnMut(&mut Expr<'g>)) {
        self.each(pass, given, |sweep, cx| (sweep.running)(cx, &mut visit));
    }

    /// The poses that have been reached on the paths of those constraints to the ground that are `wanted`.
    pub fn poses_on_paths(&mut self, wanted: impl Fn(&Constraint<Expr<'g>>) -> bool) -> Vec<&mut Expr<'g>> {
        let grounded = |c: &Constraint<Expr>| matches!(&c.bond, Bond::Cut(cut) if cut.grounded);
        let each = self.tree.constraints.iter().zip(&mut self.work.constraints.reach);
        let ends = each.filter(|(c, _)| grounded(c) && wanted(c)).flat_map(|(_, ends)| ends);
        ends.flat_map(|(rot, pos)| rot.iter_mut().flatten().chain(pos)).collect()
    }

    /// The columns of all unknowns at a node.
    pub fn columns_at(&self, i: usize) -> Vec<Expr<'g>> {
        let n = self.tree.nodes.len();
        let columns = (0..self.tree.unknowns.len()).map(|g| self.work.factor.columns[g * n + i]);
        columns.flat_map(|column| [column.lin, column.ang].concat()).collect()
    }

    /// [`mbd_runtime::sweep::Sweeps::early_rows_act`], after the pass of the factorization.
    pub fn early_rows_act(&self) -> Expr<'g> {
        Sweeps { tree: &self.tree, trace: self.graph }.early_rows_act(&self.work.factor)
    }

    #[cfg(feature = "factored")]
    /// The solutions for the unknowns so far: which of the two linear problems (0: velocities, 1: accelerations), which
    /// unknown, and its value.
    pub fn unknowns(&mut self) -> impl Iterator<Item = (usize, usize, &mut Expr<'g>)> {
        let both = [&mut self.work.velocity, &mut self.work.acceleration].into_iter().enumerate();
        both.flat_map(|(level, solution)| {
            solution.unknown_rate.iter_mut().enumerate().map(move |(unknown, value)| (level, unknown, value))
        })
    }

    /// Results in the order of the generated function, after the last pass.
    pub fn finish(&mut self, given: &SymbolicInputs<'g>) -> Vec<Expr<'g>> {
        self.with(given, |list, cx| (list.finish)(cx));
        match self.output {
            Output::Rates => [self.qd.as_slice(), &self.p].concat(),
            Output::ProjectMomenta => [self.v.as_slice(), &self.p, &self.rows].concat(),
            Output::PositionCorrection => [self.rows.as_slice(), &self.v, &self.pivots].concat(),
            Output::Momenta | Output::InverseDynamics | Output::Bias => self.p.clone(),
            Output::Energy => self.energy.to_vec(),
            Output::Multipliers => self.work.constraints.multipliers.clone(),
            _ => self.v.clone(),
        }
    }
}

/// All values that `each` visits.
pub fn read<'g>(each: impl FnOnce(&mut dyn FnMut(&mut Expr<'g>))) -> Vec<Expr<'g>> {
    let mut all = Vec::new();
    each(&mut |e| all.push(*e));
    all
}
