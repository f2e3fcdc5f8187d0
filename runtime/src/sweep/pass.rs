//! What a sweep is: a function of one node, the direction in which the nodes are visited, and what the visit of a node
//! leaves for its neighbours. `outputs.rs` lists the sweeps of every output.
//!
//! A tree runs the sweeps of a list one after the other. Rolled code visits each node of a chain once for several
//! sweeps together, in a [`Pass`]; [`passes`] says which sweeps share one. Both run the same functions in the same
//! order, so they give the same bits.

use alloc::vec::Vec;

use super::{Accelerations, Inputs, Sweeps, Trace};
use crate::spatial::{ArticulatedInertia, Force, Motion};
use crate::tree::Tree;
use crate::workspace::Workspace;
use crate::Scalar;

/// The direction in which a sweep visits the nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepDirection {
    /// Children before their parents.
    TipToBase,
    /// Parents before their children.
    BaseToTip,
}

/// What the sweeps of an output read beside the tree.
#[derive(Clone, Copy, Debug)]
pub struct Arguments<'a, S> {
    /// Coordinates.
    pub q: &'a [S],
    /// Momenta `p` or velocities `v`, whichever the output takes, one for each velocity.
    pub second: &'a [S],
    /// Accelerations of the velocities that `Sweep::NEWTON` starts from.
    pub accelerations: Accelerations<'a, S>,
    /// Everything else that is given with a call.
    pub inputs: Inputs<'a, S>,
}

impl<'a, S: Scalar> Arguments<'a, S> {
    /// Those of an output that takes no accelerations.
    pub fn new(q: &'a [S], second: &'a [S], u: &Inputs<'a, S>) -> Self {
        Arguments { q, second, accelerations: Accelerations::Zero, inputs: *u }
    }
}

/// Where the sweeps of an output put its results. Each output fills its own of them and leaves the others empty.
#[derive(Debug)]
pub struct Results<'a, S> {
    /// Velocities, accelerations or corrections of the coordinates, one for each velocity.
    pub v: &'a mut [S],
    /// Rates of the coordinates.
    pub qd: &'a mut [S],
    /// Momenta, their rates or joint forces, one for each velocity.
    pub p: &'a mut [S],
    /// Residuals or multipliers, one for each row of the constraints.
    pub rows: &'a mut [S],
    /// Pivots, one for each row of the constraints.
    pub pivots: &'a mut [S],
    /// Wrenches `[force; moment]`, one for each joint.
    pub wrenches: &'a mut [[S; 6]],
    /// Kinetic and potential energy, J; while the sweeps run, twice the kinetic energy of the nodes so far.
    pub energy: &'a mut [S],
}

impl<S> Results<'_, S> {
    /// Room for no result.
    pub fn none() -> Self {
        Results {
            v: &mut [],
            qd: &mut [],
            p: &mut [],
            rows: &mut [],
            pivots: &mut [],
            wrenches: &mut [],
            energy: &mut [],
        }
    }
}

/// All that a sweep reads and writes.
#[derive(Debug)]
pub struct Context<'a, S, T> {
    /// The tree and its listener.
    pub sweeps: &'a Sweeps<'a, S, T>,
    /// What is given.
    pub given: &'a Arguments<'a, S>,
    /// What the sweeps leave for one another.
    pub w: &'a mut Workspace<S>,
    /// What is asked for.
    pub results: Results<'a, S>,
}

/// Is called with every number that a pass carries from a node to the next.
pub type Visit<'v, S> = &'v mut dyn FnMut(&mut S);

/// One sweep over the nodes of a tree.
pub struct Sweep<S, T> {
    /// Order of the nodes.
    pub direction: SweepDirection,
    /// Whether it reads what a sweep of the other direction before it in the list computes. If not, it can share the
    /// first pass in its own direction.
    pub waits: bool,
    /// Whether a tree has use for it.
    pub needed: fn(&Tree<S>) -> bool,
    /// Whether a link of a chain of this tree can carry it.
    pub rolls: fn(&Tree<S>) -> bool,
    /// Runs before the first node.
    pub begin: fn(&mut Context<'_, S, T>),
    /// Runs at every node.
    pub node: fn(&mut Context<'_, S, T>, usize),
    /// Runs [`Sweep::node`] at all nodes of the tree, in order.
    pub(super) tree: fn(&mut Context<'_, S, T>),
    /// Runs after the last node: what is eliminated or summed up at the ground.
    pub end: fn(&mut Context<'_, S, T>),
    /// Visits what the sweep hands through a node: from tip to base the sum of what its children hand to it, from base
    /// to tip what it hands to its children.
    pub carried: fn(&mut Context<'_, S, T>, usize, Visit<'_, S>),
    /// Visits what the sweep updates at every node: sums over all nodes so far, and multipliers.
    pub running: fn(&mut Context<'_, S, T>, Visit<'_, S>),
}

impl<S, T> Clone for Sweep<S, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S, T> Copy for Sweep<S, T> {}

impl<S, T> Sweep<S, T> {
    /// A sweep that does nothing, for the fields that others leave as they are.
    pub(super) const fn idle(direction: SweepDirection) -> Self {
        Sweep {
            direction,
            waits: true,
            needed: |_| true,
            rolls: |_| true,
            begin: |_| {},
            node: |_, _| {},
            tree: |_| {},
            end: |_| {},
            carried: |_, _, _| {},
            running: |_, _| {},
        }
    }
}

/// A sweep that visits the nodes in a direction and does something at each, once as a function of a node and once with
/// the loop over the tree, where the compiler can merge the two. What a `let` makes ahead of it is the same at all nodes.
macro_rules! each_node {
    ($direction:ident, |$cx:ident, $i:ident| let $part:ident = $of_tree:expr; $at_node:expr) => {
        Sweep {
            node: |$cx, $i| {
                let $part = $of_tree;
                $at_node
            },
            tree: |context| {
                let $cx = &mut context.reborrowed();
                let $part = $of_tree;
                each_node!(@ $direction, $cx).for_each(|$i| $at_node);
            },
            ..Sweep::idle($crate::sweep::pass::SweepDirection::$direction)
        }
    };
    ($direction:ident, |$cx:ident, $i:ident| $at_node:expr) => {
        each_node!($direction, |$cx, $i| let _nothing = (); $at_node)
    };
    (@ TipToBase, $cx:ident) => {
        (0..$cx.sweeps.tree.nodes.len()).rev()
    };
    (@ BaseToTip, $cx:ident) => {
        (0..$cx.sweeps.tree.nodes.len())
    };
}
pub(super) use each_node;

/// An output as a list of sweeps, in order.
pub struct SweepList<S, T, const N: usize> {
    /// The sweeps, run after the joints' steps are known (`Sweeps::articulate`).
    pub sweeps: [Sweep<S, T>; N],
    /// Runs after the last sweep and completes the results.
    pub finish: fn(&mut Context<'_, S, T>),
}

impl<S: Scalar, T: Trace> Context<'_, S, T> {
    /// The same for a shorter time: in a loop over the nodes a copy whose parts the compiler can keep in registers.
    #[inline(always)]
    pub(super) fn reborrowed(&mut self) -> Context<'_, S, T> {
        let Results { v, qd, p, rows, pivots, wrenches, energy } = &mut self.results;
        let results = Results { v, qd, p, rows, pivots, wrenches, energy };
        Context { sweeps: self.sweeps, given: self.given, w: self.w, results }
    }

    /// Runs a whole output over the tree.
    #[inline(always)]
    pub(super) fn run<const N: usize>(&mut self, list: SweepList<S, T, N>) {
        self.articulate();
        self.run_after_steps(list);
    }

    /// [`Context::run`] after [`Context::articulate`].
    #[inline(always)]
    pub(super) fn run_after_steps<const N: usize>(&mut self, list: SweepList<S, T, N>) {
        self.sweep(list.sweeps);
        (list.finish)(self);
    }

    /// [`Context::run_after_steps`] for an output that takes a plain tree one pass inward and one
    /// outward (as [`passes`] says): all sweeps of a pass visit a node together, while its numbers are at hand.
    #[inline(always)]
    pub(super) fn run_together<const N: usize>(&mut self, list: SweepList<S, T, N>) {
        self.pass(&list.sweeps, SweepDirection::TipToBase);
        self.pass(&list.sweeps, SweepDirection::BaseToTip);
        (list.finish)(self);
    }

    /// All sweeps of one direction together, as far as a tree needs them.
    #[inline(always)]
    fn pass<const N: usize>(&mut self, sweeps: &[Sweep<S, T>; N], direction: SweepDirection) {
        let tree = self.sweeps.tree;
        macro_rules! each {
            (|$sweep:ident| $run:expr) => {
                each!(@ $sweep, $run, 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15)
            };
            (@ $sweep:ident, $run:expr, $($k:literal)*) => {
                const { assert!(N <= [$($k),*].len(), "more sweeps than are unrolled") };
                $(if $k < N && sweeps[$k].direction == direction && (sweeps[$k].needed)(tree) {
                    let $sweep = &sweeps[$k];
                    $run;
                })*
            };
        }
        each!(|sweep| (sweep.begin)(self));
        {
            let cx = &mut self.reborrowed();
            match direction {
                SweepDirection::TipToBase => {
                    for i in (0..tree.nodes.len()).rev() {
                        each!(|sweep| (sweep.node)(cx, i));
                    }
                }
                SweepDirection::BaseToTip => {
                    for i in 0..tree.nodes.len() {
                        each!(|sweep| (sweep.node)(cx, i));
                    }
                }
            }
        }
        each!(|sweep| (sweep.end)(self));
    }

    /// Steps of all joints from the coordinates: what every list of sweeps starts from.
    pub fn articulate(&mut self) {
        self.sweeps.articulate(self.given.q, self.given.inputs.drive_q, &mut self.w.poses);
    }

    /// Runs sweeps over the tree, one after the other. The loop is unrolled by hand, so that the compiler knows the
    /// functions of a constant list and can merge them into the caller.
    #[inline(always)]
    pub(super) fn sweep<const N: usize>(&mut self, sweeps: [Sweep<S, T>; N]) {
        macro_rules! unrolled {
            ($($k:literal)*) => {
                const { assert!(N <= [$($k),*].len(), "more sweeps than are unrolled") };
                $(if $k < N {
                    self.visit(sweeps[$k]);
                })*
            };
        }
        unrolled!(0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15);
    }

    /// Runs one sweep over the tree.
    #[inline(always)]
    fn visit(&mut self, sweep: Sweep<S, T>) {
        if (sweep.needed)(self.sweeps.tree) {
            (sweep.begin)(self);
            (sweep.tree)(self);
            (sweep.end)(self);
        }
    }
}

/// Sweeps that visit each node together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pass {
    /// Order of the nodes.
    pub direction: SweepDirection,
    /// Numbers of the sweeps in their list, in the order in which each node runs them.
    pub sweeps: Vec<usize>,
}

/// The sweeps of a list that a tree needs, in as few passes as their directions allow: a sweep that waits shares the
/// last pass or opens one, the others share the first pass in their direction.
pub fn passes<S, T>(list: &[Sweep<S, T>], tree: &Tree<S>) -> Vec<Pass> {
    let of = |waits: bool| {
        let all = list.iter().enumerate().filter(move |(_, sweep)| sweep.waits == waits && (sweep.needed)(tree));
        all.map(|(k, sweep)| (k, sweep.direction))
    };
    let mut passes: Vec<Pass> = Vec::new();
    for (k, direction) in of(true) {
        match passes.last_mut().filter(|pass| pass.direction == direction) {
            Some(pass) => pass.sweeps.push(k),
            None => passes.push(Pass { direction, sweeps: alloc::vec![k] }),
        }
    }
    for (k, direction) in of(false) {
        match passes.iter_mut().find(|pass| pass.direction == direction) {
            Some(pass) => pass.sweeps.push(k),
            None => passes.push(Pass { direction, sweeps: alloc::vec![k] }),
        }
    }
    passes.iter_mut().for_each(|pass| pass.sweeps.sort_unstable());
    passes
}

/// Visits the entries of an inertia.
pub(super) fn visit_inertia<S>(m: &mut ArticulatedInertia<S>, visit: Visit<'_, S>) {
    m.a.iter_mut().chain(m.h.iter_mut().flatten()).chain(&mut m.j).for_each(visit);
}

/// Visits the components of a motion.
pub(super) fn visit_motion<S>(m: &mut Motion<S>, visit: Visit<'_, S>) {
    m.lin.iter_mut().chain(&mut m.ang).for_each(visit);
}

/// Visits the components of a force.
pub(super) fn visit_force<S>(f: &mut Force<S>, visit: Visit<'_, S>) {
    f.lin.iter_mut().chain(&mut f.ang).for_each(visit);
}

/// Visits the values of the constraints' rows among those of all unknowns.
pub(super) fn visit_rows<S>(tree: &Tree<S>, values: &mut [S], visit: Visit<'_, S>) {
    values.iter_mut().enumerate().filter(|(g, _)| tree.is_slot(*g)).for_each(|(_, x)| visit(x));
}
