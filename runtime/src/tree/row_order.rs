//! The order in which the rows of the constraints are eliminated.
//!
//! Rows that are nearly dependent on one another lose digits when they are eliminated one after the other: of a row `a +
//! δ u` after `a`, only `δ²` is left, and a row `u` after both of them is redundant but for rounding errors of the size
//! `ε/δ²`. Where `u` comes first, `a + δ u` is redundant, and nothing is lost. The order in which a description lists
//! its constraints must not matter; rows are therefore ordered by their pivots, as a factorization with diagonal pivoting
//! would. The sweeps have no branches: the order belongs to the tree. It is chosen when a plan is made, and anew where
//! rows become nearly dependent during a motion ([`crate::Constrained::reorder_rows`]).
//!
//! Legs bind a platform, or a trunk to the ground, by rows that their own joints can follow. Such rows are *early*: they are
//! solved as soon as the leg has been eliminated, before the freedoms of the platform or trunk (see [`early_rows`]). What a
//! leg cannot follow by itself waits for the ground.

mod products;

use alloc::collections::BTreeSet;
use alloc::vec;
use alloc::vec::Vec;

pub use products::RowProducts;

use super::{Bond, Elimination, Tree, Unknown};

/// A row of which less than this part is left waits for rows that are solved further inboard.
const SMALL: f64 = 1e-3;
/// A row of which less is left is redundant, and waits for nothing.
const NOTHING: f64 = 1e-12;
/// An early row of which less than this part can be followed by the joints that are eliminated before it waits for the ground.
const EARLY: f64 = 1e-2;

/// The least part of a row that is left at any of the positions.
fn left(at: &[RowProducts], r: usize) -> f64 {
    at.iter().fold(1.0, |least, products| products.left(r).min(least))
}

/// What says in which order rows are eliminated: a tree, or the plan of one.
pub trait RowLists {
    /// Number of nodes, parents first.
    fn nodes(&self) -> usize;
    /// Parent of a node.
    fn parent(&self, node: usize) -> Option<usize>;
    /// Elimination of a node.
    fn elimination(&self, node: usize) -> &Elimination;
    /// The same, to be changed.
    fn elimination_mut(&mut self, node: usize) -> &mut Elimination;
    /// Unknowns that are solved at the ground.
    fn ground(&self) -> &[usize];
    /// The same, to be changed.
    fn ground_mut(&mut self) -> &mut Vec<usize>;
    /// The row of an unknown.
    fn row(&self, unknown: usize) -> Option<usize>;
    /// Whether an unknown is a row of a loop that a node is part of.
    fn binds(&self, unknown: usize, node: usize) -> bool;
    /// Whether rows may wait for those of an inner node. Code of loops over links has the places of its columns.
    fn may_wait(&self) -> bool {
        true
    }
}

/// With fewer rows no order is better than another.
pub const FEWEST: usize = 3;

/// Orders the rows anew, the largest relative pivot first, where the order that they have loses digits at a position.
/// Returns whether anything has changed.
pub fn reorder_rows(lists: &mut dyn RowLists, at: &RowProducts) -> bool {
    loses_digits(lists, at.clone()) && order_rows(lists, vec![at.clone()], 1.0)
}

impl<S> Tree<S> {
    /// Whether there are rows enough for their order to matter.
    pub fn rows_can_be_ordered(&self) -> bool {
        self.dims.rows >= FEWEST && self.constraints.iter().all(|c| c.passes.is_empty())
    }

    /// Chooses the order of its rows anew, where the one that it has loses digits at a position. Returns whether it has
    /// changed.
    pub fn reorder_rows(&mut self, at: &RowProducts) -> bool {
        if !self.rows_can_be_ordered() {
            return false;
        }
        let own = reorder_rows(self, at);
        let other = self.accelerations.as_deref_mut().is_some_and(|other| other.reorder_rows(at));
        own || other
    }
}

impl<S> RowLists for Tree<S> {
    fn nodes(&self) -> usize {
        self.nodes.len()
    }
    fn parent(&self, node: usize) -> Option<usize> {
        self.nodes[node].parent
    }
    fn elimination(&self, node: usize) -> &Elimination {
        &self.nodes[node].elimination
    }
    fn elimination_mut(&mut self, node: usize) -> &mut Elimination {
        &mut self.nodes[node].elimination
    }
    fn ground(&self) -> &[usize] {
        &self.solve_at_ground
    }
    fn ground_mut(&mut self) -> &mut Vec<usize> {
        &mut self.solve_at_ground
    }
    fn row(&self, unknown: usize) -> Option<usize> {
        row_of(self.unknowns[unknown])
    }
    fn binds(&self, unknown: usize, node: usize) -> bool {
        self.constraints.iter().filter(|c| c.slots.contains(&unknown)).any(|c| match &c.bond {
            Bond::Cut(cut) => cut.path_a.contains(&node) || cut.path_b.contains(&node),
            Bond::Coupling { .. } => false,
        })
    }
}

/// The row that an unknown is the multiplier of.
pub fn row_of(unknown: Unknown) -> Option<usize> {
    match unknown {
        Unknown::Row(r) => Some(r),
        Unknown::Velocity(_) => None,
    }
}

/// Rows that are solved at a node before freedoms of their loop, those of the node itself or further inboard: `(node, unknown)`.
/// The other freedoms of the loop have been eliminated then: those of a branch beyond the node, or of one that starts at the
/// ground.
pub fn early_rows(lists: &dyn RowLists) -> Vec<(usize, usize)> {
    let mut early = Vec::new();
    for i in 0..lists.nodes() {
        let Elimination { solve_before, solve_after, .. } = lists.elimination(i);
        let inner = || ancestors(lists, i).into_iter();
        let before = solve_before.iter().filter(|&&g| inner().chain([i]).any(|k| lists.binds(g, k)));
        let after = solve_after.iter().filter(|&&g| inner().any(|k| lists.binds(g, k)));
        early.extend(before.chain(after).map(|&g| (i, g)));
    }
    early
}

/// Whether a row is one of the [`early_rows`].
pub fn is_early(lists: &dyn RowLists, row: usize) -> bool {
    early_rows(lists).iter().any(|(_, g)| lists.row(*g) == Some(row))
}

/// Has all early rows wait for the ground.
pub fn solve_late(lists: &mut dyn RowLists) {
    for (i, g) in early_rows(lists) {
        for after in [false, true] {
            list(lists.elimination_mut(i), after).retain(|&h| h != g);
        }
        wait(lists, i, g, true);
    }
}

/// Nodes whose freedoms are eliminated after early rows of their loops.
fn late_nodes(lists: &dyn RowLists) -> BTreeSet<usize> {
    let mut late = BTreeSet::new();
    for (i, g) in early_rows(lists) {
        let own = lists.elimination(i).solve_before.contains(&g).then_some(i);
        late.extend(ancestors(lists, i).into_iter().chain(own).filter(|&k| lists.binds(g, k)));
    }
    late
}

/// Orders the rows that are solved at the same node by the parts of them that are left at all of the positions, and
/// moves rows that are nearly dependent to an inner node. A row is taken in the order that it has if its relative pivot is
/// at least the part `large` of the largest one. Returns whether anything has changed.
pub fn order_rows(lists: &mut dyn RowLists, mut at: Vec<RowProducts>, large: f64) -> bool {
    let mut changed = false;
    let early: Vec<usize> = early_rows(lists).into_iter().map(|(_, g)| g).collect();
    for i in (0..lists.nodes()).rev() {
        for after in [false, true] {
            let old = list(lists.elimination_mut(i), after).clone();
            let inward = lists.may_wait() && inner(lists, i).is_some();
            let waits = Waits { early: if lists.may_wait() { &early } else { &[] }, inward };
            let (new, waiting) = ordered(lists, &old, &mut at, large, waits);
            changed |= new != old;
            *list(lists.elimination_mut(i), after) = new;
            for g in waiting {
                wait(lists, i, g, early.contains(&g));
            }
            if !after && rows_are_left(lists, i) {
                at.iter_mut().for_each(|products| products.eliminate_node(i));
            }
        }
    }
    let old = lists.ground().to_vec();
    let new = ordered(lists, &old, &mut at, large, Waits { early: &[], inward: false }).0;
    changed |= new != old;
    *lists.ground_mut() = new;
    changed
}

/// Whether the order loses digits at one position: a row that is nearly dependent on those before it is eliminated, and
/// others come after it, or an early row can hardly be followed by the joints before it.
fn loses_digits(lists: &dyn RowLists, at: RowProducts) -> bool {
    let all = (0..lists.nodes()).flat_map(|i| solved(lists, i)).chain(lists.ground().iter().copied());
    let mut rest = all.filter(|&g| lists.row(g).is_some()).count();
    let mut loses = false;
    each_row(lists, at, &mut |at, _, r, early| {
        rest -= 1;
        loses |= match early {
            true => at.followed(r) < SMALL,
            false => (NOTHING..SMALL).contains(&at.left(r)) && rest > 0,
        };
    });
    loses
}

/// Early rows, as unknowns, that are zero at one of the positions, or of which the joints before them can follow next to nothing.
pub fn not_followed(lists: &dyn RowLists, at: &[RowProducts]) -> BTreeSet<usize> {
    let mut rows = BTreeSet::new();
    for at in at {
        each_row(lists, at.clone(), &mut |at, g, r, early| {
            if early && (at.is_zero(r) || at.followed(r) < EARLY) {
                rows.insert(g);
            }
        });
    }
    rows
}

/// Eliminates all rows in their order. Before each calls `visit` with what is left of the products, the unknown, its row,
/// and whether it is early.
fn each_row(lists: &dyn RowLists, mut at: RowProducts, visit: &mut dyn FnMut(&RowProducts, usize, usize, bool)) {
    let early = early_rows(lists);
    let mut eliminate = |at: &mut RowProducts, i: Option<usize>, list: &[usize]| {
        for &g in list {
            if let Some(r) = lists.row(g) {
                visit(at, g, r, i.is_some_and(|i| early.contains(&(i, g))));
                at.eliminate(r);
            }
        }
    };
    for i in (0..lists.nodes()).rev() {
        let Elimination { solve_before, solve_after, .. } = lists.elimination(i);
        eliminate(&mut at, Some(i), solve_before);
        if rows_are_left(lists, i) {
            at.eliminate_node(i);
        }
        eliminate(&mut at, Some(i), solve_after);
    }
    eliminate(&mut at, None, lists.ground());
}

/// Unknowns that are solved at node `i`.
fn solved<'a>(lists: &'a dyn RowLists, i: usize) -> impl Iterator<Item = usize> + 'a {
    let Elimination { solve_before, solve_after, .. } = lists.elimination(i);
    solve_before.iter().chain(solve_after).copied()
}

/// Unknowns that are solved at a node, before or after its own freedoms.
fn list(elimination: &mut Elimination, after: bool) -> &mut Vec<usize> {
    if after {
        &mut elimination.solve_after
    } else {
        &mut elimination.solve_before
    }
}

/// Which rows may wait.
#[derive(Clone, Copy)]
struct Waits<'a> {
    /// Early rows.
    early: &'a [usize],
    /// Whether rows exist further inboard for which others may wait.
    inward: bool,
}

/// The unknowns of a list with its rows in a new order, and the rows that are to wait for inner ones. Eliminates the rows
/// that stay. Unknowns that are no rows keep their places.
fn ordered(
    lists: &dyn RowLists,
    list: &[usize],
    at: &mut [RowProducts],
    large: f64,
    waits: Waits,
) -> (Vec<usize>, Vec<usize>) {
    let row = |g: usize| lists.row(g);
    let mut rest: Vec<usize> = list.iter().copied().filter(|&g| row(g).is_some()).collect();
    let (mut taken, mut waiting) = (Vec::new(), Vec::new());
    while !rest.is_empty() {
        let parts: Vec<f64> = rest.iter().map(|&g| row(g).map_or(1.0, |r| left(at, r))).collect();
        let most = parts.iter().fold(0.0_f64, |most, part| part.max(most));
        let first = parts.iter().position(|part| *part >= large * most).unwrap_or(0);
        let g = rest.remove(first);
        let followed = |r| at.iter().all(|products| products.followed(r) >= EARLY);
        let waits = match waits.early.contains(&g) {
            true => !row(g).is_some_and(followed),
            false => waits.inward && (NOTHING..SMALL).contains(&parts[first]),
        };
        if waits {
            waiting.push(g);
            continue;
        }
        if let Some(r) = row(g) {
            at.iter_mut().for_each(|products| products.eliminate(r));
        }
        taken.push(g);
    }
    let mut taken = taken.into_iter();
    let kept = list.iter().copied().filter(|g| !waiting.contains(g));
    let list = kept.filter_map(|g| if row(g).is_some() { taken.next() } else { Some(g) }).collect();
    (list, waiting)
}

/// The ancestors of node `i`, from its parent inward.
fn ancestors(lists: &dyn RowLists, i: usize) -> Vec<usize> {
    core::iter::successors(lists.parent(i), |&k| lists.parent(k)).collect()
}

/// The nearest ancestor of node `i` at which rows are solved, `Some(None)` for the ground.
fn inner(lists: &dyn RowLists, i: usize) -> Option<Option<usize>> {
    let rows = |g: usize| lists.row(g).is_some();
    let nearest = ancestors(lists, i).into_iter().find(|&k| solved(lists, k).any(rows));
    let ground = || lists.ground().iter().any(|&g| rows(g)).then_some(None);
    nearest.map(Some).or_else(ground)
}

/// Whether rows are solved at node `i` after its freedoms, or further inboard. Where none are, nothing depends on its velocities any
/// more.
fn rows_are_left(lists: &dyn RowLists, i: usize) -> bool {
    let own = &lists.elimination(i).solve_after;
    own.iter().any(|&g| lists.row(g).is_some()) || inner(lists, i).is_some()
}

/// Has row `g`, which was to be solved at node `i`, wait for the rows that are solved next further inboard, or, if it is
/// early, for the ground, where its loop ends.
fn wait(lists: &mut dyn RowLists, i: usize, g: usize, early: bool) {
    let Some(target) = (if early { Some(None) } else { inner(lists, i) }) else { return };
    lists.elimination_mut(i).open.push(g);
    for k in ancestors(lists, i).into_iter().take_while(|&k| Some(k) != target) {
        lists.elimination_mut(k).open.push(g);
    }
    match target {
        Some(k) => lists.elimination_mut(k).solve_after.push(g),
        None => lists.ground_mut().push(g),
    }
}
