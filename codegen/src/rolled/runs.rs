//! Runs of like links: where a branch repeats itself.
//!
//! Links are alike if their joints are of one kind and their placements, inertias and passive elements have zeros and
//! ones in the same places; a run may repeat two to four different links in turn. Where a branch is not strictly
//! regular, links are also taken for alike after identity steps and zeros have been let in, if that costs little.
//! A link may have branches of its own, which are then part of its turn (`side_branches.rs`).

use std::ops::Range;

use mbd_runtime::spatial::ElementaryTransform;
use mbd_runtime::tree::{Bond, Constraint, Elimination, Node, Source, Tree, Unknown};

use super::mapped::map_node;
use super::side_branches;
use crate::symbolic::Expr;

/// Links that repeat: `count` times `period` nodes.
#[derive(Clone, Debug)]
pub struct Run {
    /// Nodes, inner first; each hangs on the one before it, unless turns have branches of their own.
    pub nodes: Range<usize>,
    /// Nodes in one turn of the loop.
    pub period: usize,
    /// The node of a turn on which the next turn hangs, counted from the first node of the turn.
    pub(super) exit: usize,
    /// One node of the period each: constants common to all turns, and the others as columns of the table.
    pub(super) template: Vec<Node<Slot>>,
    /// Constraints between the nodes of a turn, or between these and the ground, with constants as in the nodes.
    pub(super) constraints: Vec<Constraint<Slot>>,
    /// One row for each turn of the loop, columns as the template numbers them.
    pub table: Vec<Vec<f64>>,
    /// Set where the turns are branches of one node or of the ground instead of links of a chain.
    pub branches: Option<Branches>,
}

/// Turns that are like branches of one node, or mechanisms on the ground that no constraint binds to one another.
/// [`Run::nodes`] and [`Run::period`] are those of the first of them.
#[derive(Clone, Debug)]
pub struct Branches {
    /// The node that all of them hang on; `None` for the ground.
    pub parent: Option<usize>,
    /// First node of each, in ascending order.
    pub roots: Vec<usize>,
    /// By how much the first coordinate, velocity and row move on from branch to branch.
    pub stride: Extent,
    /// Those of the first branch begin here.
    pub(super) first: Extent,
    /// How many one branch has.
    pub size: Extent,
    /// Unknowns of a branch, by its own velocities and rows.
    pub(super) unknowns: Vec<Unknown>,
    /// Those of them that are solved where the branches hang: at the ground or at their parent.
    pub(super) solve_last: Vec<usize>,
    /// Whether the momentum of the branches is accumulated at their parent.
    pub(super) accumulates: bool,
}

/// A number of coordinates, of velocities and of rows of constraints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extent {
    /// Coordinates.
    pub q: usize,
    /// Velocities.
    pub v: usize,
    /// Rows.
    pub rows: usize,
}

/// A constant of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Slot {
    /// The same in all links.
    Const(f64),
    /// Column of the table.
    Column(usize),
}

impl Extent {
    /// By how much it is more than another one; `None` where it is less.
    pub fn checked_sub(self, other: Extent) -> Option<Extent> {
        let q = self.q.checked_sub(other.q)?;
        Some(Extent { q, v: self.v.checked_sub(other.v)?, rows: self.rows.checked_sub(other.rows)? })
    }
}

impl Run {
    /// Turns of the loop.
    pub fn count(&self) -> usize {
        self.table.len()
    }

    /// First node of a turn.
    pub fn first(&self, turn: usize) -> usize {
        self.nodes.start + turn * self.period
    }

    /// The node of the last turn on which hangs what follows.
    pub fn last(&self) -> usize {
        self.nodes.end - self.period + self.exit
    }

    /// The node of a turn on which its node `k` hangs, counted from the first node; `None` for what comes before the turn.
    pub fn parent_in_turn(&self, k: usize) -> Option<usize> {
        self.template[k].parent?.checked_sub(self.nodes.start)
    }

    /// Whether links of a chain have branches: not every node of a turn hangs on the one before it, or the next turn does
    /// not hang on the last.
    pub fn has_side_branches(&self) -> bool {
        let chained = (1..self.period).all(|k| self.parent_in_turn(k) == Some(k - 1));
        self.branches.is_none() && !(chained && self.exit + 1 == self.period)
    }
}

/// The longest period that is looked for.
const LONGEST_PERIOD: usize = 4;

/// Runs of at least `least` nodes among those that are allowed, inner nodes first.
pub fn find(tree: &Tree<Expr>, allowed: &[bool], least: usize) -> Vec<Run> {
    if !tree.wrenches.is_empty() {
        return Vec::new();
    }
    let mut links: Vec<Option<Node<f64>>> =
        (0..tree.nodes.len()).map(|i| constant_link(tree, i).filter(|_| allowed[i])).collect();
    let mut children = vec![0; tree.nodes.len()];
    let parents: Vec<Option<usize>> = tree.nodes.iter().map(|node| node.parent).collect();
    parents.iter().copied().flatten().for_each(|parent| children[parent] += 1);
    let mut runs = side_branches::find(&links, &parents, least);
    for run in &runs {
        links[run.nodes.clone()].fill(None);
    }
    let mut at = 0;
    while at < tree.nodes.len() {
        let path = path_from(&links, &children, at);
        in_path(&links, path.clone(), least, &mut runs);
        at = path.end.max(at + 1);
    }
    runs.sort_by_key(|run| run.nodes.start);
    runs
}

/// Consecutive nodes from `start` on that may be in one run: each the only child of the one before it.
fn path_from(links: &[Option<Node<f64>>], children: &[usize], start: usize) -> Range<usize> {
    // What the innermost link hands inward needs a place, so it hangs on a node; the outermost takes in from one child.
    let fits =
        |i: usize| links.get(i).is_some_and(|l| l.as_ref().is_some_and(|l| l.parent.is_some())) && children[i] <= 1;
    if !fits(start) {
        return start..start;
    }
    let mut end = start + 1;
    while fits(end) && links[end].as_ref().is_some_and(|l| l.parent == Some(end - 1)) {
        end += 1;
    }
    start..end
}

/// Node `i` with numbers for constants, if it can be in a loop.
fn constant_link(tree: &Tree<Expr>, i: usize) -> Option<Node<f64>> {
    let node = &tree.nodes[i];
    let Elimination { before_joint, open, .. } = node.elimination.clone();
    let rows_only = open.iter().all(|&g| matches!(tree.unknowns[g], Unknown::Row(_)));
    let plain_parent = |p: usize| {
        let parent = &tree.nodes[p].elimination;
        !parent.accumulates_momentum && !parent.non_rotating
    };
    let plain = rows_only
        && node.elimination == Elimination { before_joint, open, ..Elimination::default() }
        && node.parent.is_none_or(plain_parent)
        && !tree.constraints.iter().any(|c| ends_at(&c.bond, i))
        && matches!(node.source, Source::State { .. });
    let mut constant = true;
    let link = map_node(node, &mut |x| match x {
        Expr::Const(x) => x,
        Expr::Node { .. } => {
            constant = false;
            0.0
        }
    });
    (plain && constant).then_some(link)
}

/// Whether a constraint acts on node `i` itself.
fn ends_at(bond: &Bond<Expr>, i: usize) -> bool {
    match bond {
        Bond::Cut(cut) => [cut.a.node, cut.b.node].contains(&Some(i)),
        Bond::Coupling { terms, .. } => terms.iter().any(|(node, _)| *node == i),
    }
}

/// Runs in a path: strictly alike where that covers most of it, otherwise as alike as possible.
fn in_path(links: &[Option<Node<f64>>], path: Range<usize>, least: usize, runs: &mut Vec<Run>) {
    let link = |i: usize| links[i].as_ref();
    let strict = cover(path.clone(), least, |a, b| matches!((link(a), link(b)), (Some(a), Some(b)) if alike(a, b)));
    let covered: usize = strict.iter().map(|(nodes, _)| nodes.len()).sum();
    let mut chosen = strict;
    if covered + covered / 4 < path.len() {
        let loose = cover(path, least, |a, b| matches!((link(a), link(b)), (Some(a), Some(b)) if compatible(a, b)));
        if loose.iter().map(|(nodes, _)| nodes.len()).sum::<usize>() > covered {
            chosen = loose;
        }
    }
    for (nodes, period) in chosen {
        let all: Option<Vec<Node<f64>>> = nodes.clone().map(|i| links[i].clone()).collect();
        if let Some(run) = all.and_then(|all| tabulate(&all, nodes, (period, period - 1))) {
            runs.push(run);
        }
    }
}

/// Greedy cover by runs with their periods: the longest from each start, with the shortest period that gives it.
fn cover(path: Range<usize>, least: usize, same: impl Fn(usize, usize) -> bool) -> Vec<(Range<usize>, usize)> {
    let mut runs = Vec::new();
    let mut at = path.start;
    while at < path.end {
        let mut best = (0, 1);
        for period in 1..=LONGEST_PERIOD {
            let mut end = at + period;
            while end < path.end && same(end - period, end) && same(at + (end - at) % period, end) {
                end += 1;
            }
            let turns = (end.min(path.end) - at) / period;
            let length = turns * period;
            if turns >= 2 && length >= least && length > best.0 + best.0 / 8 {
                best = (length, period);
            }
        }
        let (length, period) = best;
        if length == 0 {
            at += 1;
            continue;
        }
        runs.push((at..at + length, period));
        at += length;
    }
    runs
}

/// 0, 1, −1 or anything else.
fn class(x: f64) -> Option<i8> {
    [0, 1, -1].into_iter().find(|&c| f64::from(c) == x)
}

pub(super) fn constants(node: &Node<f64>) -> Vec<f64> {
    let mut out = Vec::new();
    map_node(node, &mut |x| out.push(x));
    out
}

pub(super) fn same_step(a: &ElementaryTransform<f64>, b: &ElementaryTransform<f64>) -> bool {
    match (a, b) {
        (ElementaryTransform::Turn { axis: a, .. }, ElementaryTransform::Turn { axis: b, .. }) => a == b,
        (ElementaryTransform::Shift { axis: a, .. }, ElementaryTransform::Shift { axis: b, .. }) => a == b,
        (ElementaryTransform::Rotate(_), ElementaryTransform::Rotate(_)) => true,
        _ => false,
    }
}

pub(super) fn same_joint(a: &Node<f64>, b: &Node<f64>) -> bool {
    std::mem::discriminant(&a.kind) == std::mem::discriminant(&b.kind)
        && a.quarter == b.quarter
        && a.elimination == b.elimination
}

/// The same structure and zeros and ones in the same places.
pub(super) fn alike(a: &Node<f64>, b: &Node<f64>) -> bool {
    same_joint(a, b)
        && a.place.len() == b.place.len()
        && a.place.iter().zip(&b.place).all(|(a, b)| same_step(a, b))
        && constants(a).iter().zip(constants(b)).all(|(a, b)| class(*a) == class(b))
}

/// The same joint, and one placement is the other with shifts left out.
pub(super) fn compatible(a: &Node<f64>, b: &Node<f64>) -> bool {
    same_joint(a, b) && merged(&a.place, &b.place).is_some()
}

/// The longer placement, if the other is the same but for shifts left out. A shift by zero is exact; a turn by zero
/// rounds.
fn merged(a: &[ElementaryTransform<f64>], b: &[ElementaryTransform<f64>]) -> Option<Vec<ElementaryTransform<f64>>> {
    let (long, short) = if a.len() >= b.len() { (a, b) } else { (b, a) };
    let mut rest = short.iter().peekable();
    for step in long {
        if rest.peek().is_some_and(|s| same_step(s, step)) {
            rest.next();
        } else if !matches!(step, ElementaryTransform::Shift { .. }) {
            return None;
        }
    }
    rest.next().is_none().then(|| long.to_vec())
}

/// A placement written with the steps of a longer one, identity steps let in.
fn padded(
    place: &[ElementaryTransform<f64>],
    steps: &[ElementaryTransform<f64>],
) -> Option<Vec<ElementaryTransform<f64>>> {
    let mut rest = place.iter().copied().peekable();
    let mut out = Vec::new();
    for step in steps {
        match rest.peek() {
            Some(s) if same_step(s, step) => out.extend(rest.next()),
            _ => match *step {
                ElementaryTransform::Shift { axis, .. } => out.push(ElementaryTransform::Shift { axis, r: 0.0 }),
                ElementaryTransform::Turn { .. } | ElementaryTransform::Rotate(_) => return None,
            },
        }
    }
    rest.next().is_none().then_some(out)
}

/// Constants of a run, given the nodes in a turn and which of them the next turn hangs on: what is the same in all turns stays a
/// constant, the rest goes into the table.
pub(super) fn tabulate(links: &[Node<f64>], nodes: Range<usize>, (period, exit): (usize, usize)) -> Option<Run> {
    let turns = links.len() / period;
    let mut table = vec![Vec::new(); turns];
    let mut template = Vec::new();
    for k in 0..period {
        let group = || links.iter().skip(k).step_by(period);
        let steps = group().try_fold(links[k].place.clone(), |all, link| merged(&all, &link.place))?;
        let like = group()
            .map(|link| Some(Node { place: padded(&link.place, &steps)?, ..link.clone() }))
            .collect::<Option<Vec<_>>>()?;
        template.push(columns_of(&like, &mut table));
    }
    Some(Run { nodes, period, exit, template, constraints: Vec::new(), table, branches: None })
}

/// One node of the template from its likes in all turns, each of which has the same steps: constants that differ get
/// a column of the table.
pub(super) fn columns_of(like: &[Node<f64>], table: &mut [Vec<f64>]) -> Node<Slot> {
    let mut slots = slots_of(&like.iter().map(constants).collect::<Vec<_>>(), table).into_iter();
    map_node(&like[0], &mut |_| slots.next().unwrap_or(Slot::Const(0.0)))
}

/// Constants of the turns, one list for each: those that differ get a column of the table.
pub(super) fn slots_of(turns: &[Vec<f64>], table: &mut [Vec<f64>]) -> Vec<Slot> {
    let slot = |c: usize| {
        let same = turns.iter().all(|turn| turn[c].to_bits() == turns[0][c].to_bits());
        if same {
            return Slot::Const(turns[0][c]);
        }
        let column = table[0].len();
        for (row, from) in table.iter_mut().zip(turns) {
            row.push(from[c]);
        }
        Slot::Column(column)
    };
    (0..turns[0].len()).map(slot).collect()
}
