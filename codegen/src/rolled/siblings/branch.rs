//! A branch by itself, with numbers of its own for nodes, coordinates, unknowns and rows.

use std::ops::Range;

use mbd_runtime::tree::{Bond, Constraint, Elimination, Node, Source, Tree, Unknown};

use super::super::mapped::{map_constraint, map_node};
use super::super::runs::{same_joint, Extent};
use super::steps::{padded, Steps};
use crate::symbolic::Expr;

/// A branch by itself: nodes, coordinates, unknowns, rows and entries of `Φ` are numbered from its first ones.
#[derive(Clone)]
pub struct Branch {
    pub root: usize,
    pub nodes: Vec<Node<f64>>,
    pub constraints: Vec<Constraint<f64>>,
    pub unknowns: Vec<Unknown>,
    /// Unknowns that are solved where the branch hangs: at the ground, or at its parent.
    pub solve_last: Vec<usize>,
    pub first: Extent,
    pub size: Extent,
}

/// The nodes that a constraint acts on; `None` for the ground.
pub fn nodes_of<S>(bond: &Bond<S>) -> Vec<Option<usize>> {
    match bond {
        Bond::Cut(cut) => vec![cut.a.node, cut.b.node],
        Bond::Coupling { terms, .. } => terms.iter().map(|(node, _)| Some(*node)).collect(),
    }
}

/// Nodes that may be a branch.
struct Candidate<'a, 'g> {
    tree: &'a Tree<Expr<'g>>,
    /// What the branch hangs on; `None` for the ground.
    parent: Option<usize>,
    nodes: Range<usize>,
}

impl<'a, 'g> Candidate<'a, 'g> {
    /// Whether all that hangs on its nodes is in it, and nothing of it hangs elsewhere than on them and its parent.
    fn stands_alone(&self) -> bool {
        let inside = |i: usize| self.nodes.contains(&i);
        (0..self.tree.nodes.len()).all(|i| match self.tree.nodes[i].parent {
            Some(p) if inside(p) => inside(i),
            other => !inside(i) || other == self.parent,
        })
    }

    /// The ranges of its coordinates and velocities; `None` where other nodes have some of them, or motions are prescribed.
    fn coordinates(&self) -> Option<(Range<usize>, Range<usize>)> {
        let span = |node: &Node<Expr>| match node.source {
            Source::State { q, v } => Some([q, v, q + node.kind.nq(), v + node.kind.nv()]),
            Source::Drive { .. } => None,
        };
        let spans: Vec<[usize; 4]> = self.tree.nodes[self.nodes.clone()].iter().map(span).collect::<Option<_>>()?;
        let least = |k: usize| spans.iter().map(|s| s[k]).min().unwrap_or(0);
        let most = |k: usize| spans.iter().map(|s| s[k]).max().unwrap_or(0);
        let (q, v) = (least(0)..most(2), least(1)..most(3));
        let mut others = (0..self.tree.nodes.len()).filter(|i| !self.nodes.contains(i)).map(|i| &self.tree.nodes[i]);
        let shared = others
            .any(|node| matches!(node.source, Source::State { v: at, .. } if v.contains(&at) && node.kind.nv() > 0));
        (!shared).then_some((q, v))
    }

    /// The constraints that bind its nodes to one another and to the ground, and in `fast` arithmetic to its parent; `None` where
    /// others do or their rows do not follow one another.
    fn constraints(&self, fast: bool) -> Option<Vec<&'a Constraint<Expr<'g>>>> {
        let inside = |i: usize| self.nodes.contains(&i);
        let binds = |c: &&Constraint<Expr>| nodes_of(&c.bond).into_iter().flatten().any(inside);
        let own: Vec<_> = self.tree.constraints.iter().filter(binds).collect();
        let outside = |end: Option<usize>| end.is_none() || (fast && end == self.parent);
        let within = |end: Option<usize>| end.is_some_and(inside) || outside(end);
        let whole = own.iter().all(|c| nodes_of(&c.bond).into_iter().all(within));
        let steady = own.windows(2).all(|pair| rows_of(pair[0]).end == pair[1].first);
        (whole && steady).then_some(own)
    }

    /// Those of its unknowns that are solved where it hangs; `None` where it cannot be evaluated without its parent because of
    /// such unknowns, or others stay open in it.
    fn solved_last(&self, unknowns: &[usize], fast: bool) -> Option<Vec<usize>> {
        let tree = self.tree;
        let own = |list: &[usize]| -> Vec<usize> { list.iter().copied().filter(|g| unknowns.contains(g)).collect() };
        let Some(parent) = self.parent else { return Some(own(&tree.solve_at_ground)) };
        let last = own(&tree.nodes[parent].elimination.solve_before);
        let roots = tree.nodes[self.nodes.clone()].iter().filter(|node| node.parent == self.parent);
        let row = |g: &usize| last.contains(g) && matches!(tree.unknowns[*g], Unknown::Row(_));
        let closed = roots.flat_map(|node| &node.elimination.open).all(row);
        let fits = closed && (fast || last.is_empty()) && own(&tree.solve_at_ground).is_empty();
        fits.then_some(last)
    }
}

/// The rows of a constraint.
fn rows_of(constraint: &Constraint<Expr>) -> Range<usize> {
    constraint.first..constraint.first + constraint.slots.len()
}

impl Branch {
    /// The branch of some nodes, if it can be evaluated by itself.
    pub fn new(tree: &Tree<Expr>, parent: Option<usize>, range: Range<usize>, fast: bool) -> Option<Branch> {
        let candidate = Candidate { tree, parent, nodes: range.clone() };
        if !candidate.stands_alone() {
            return None;
        }
        let (q, v) = candidate.coordinates()?;
        let constraints = candidate.constraints(fast)?;
        let rows = constraints.first().map_or(0, |c| c.first)..constraints.last().map_or(0, |c| rows_of(c).end);
        let unknown = |unknown: &Unknown| match *unknown {
            Unknown::Velocity(at) => v.contains(&at).then(|| Unknown::Velocity(at - v.start)),
            Unknown::Row(row) => rows.contains(&row).then(|| Unknown::Row(row - rows.start)),
        };
        let (global, unknowns): (Vec<usize>, Vec<Unknown>) =
            tree.unknowns.iter().enumerate().filter_map(|(g, own)| Some((g, unknown(own)?))).unzip();
        let last = candidate.solved_last(&global, fast)?;
        let numbers = Numbers {
            nodes: range.clone(),
            parent,
            offset: parent.map_or(0, |_| 1 + usize::from(!last.is_empty())),
            first: Extent { q: q.start, v: v.start, rows: rows.start },
            velocities: v.clone(),
            first_entry: constraints.first().map_or(0, |c| c.entry),
            unknowns: &global,
        };
        Some(Branch {
            root: range.start,
            nodes: range.map(|i| numbers.node(&tree.nodes[i])).collect::<Option<_>>()?,
            constraints: constraints.into_iter().map(|c| numbers.constraint(c)).collect::<Option<_>>()?,
            solve_last: numbers.list(&last)?,
            unknowns,
            first: numbers.first,
            size: Extent { q: q.len(), v: v.len(), rows: rows.len() },
        })
    }

    /// The same structure, placements apart.
    pub fn is_like(&self, other: &Branch) -> bool {
        let same = |(a, b): (&Node<f64>, &Node<f64>)| {
            same_joint(a, b) && a.parent == b.parent && a.source == b.source && a.passive.len() == b.passive.len()
        };
        self.nodes.len() == other.nodes.len()
            && self.unknowns == other.unknowns
            && self.solve_last == other.solve_last
            && self.size == other.size
            && self.nodes.iter().zip(&other.nodes).all(same)
            && self.constraints.iter().map(form).eq(other.constraints.iter().map(form))
    }

    /// The steps of its placements: those of the nodes, then those of the frames of the constraints.
    pub fn places(&self) -> impl Iterator<Item = &Steps> {
        let frames = self.constraints.iter().filter_map(|c| match &c.bond {
            Bond::Cut(cut) => Some([&cut.a.place, &cut.b.place]),
            Bond::Coupling { .. } => None,
        });
        self.nodes.iter().map(|node| &node.place).chain(frames.flatten())
    }

    /// The same with placements that have given steps.
    pub fn with_steps(&self, steps: &[Steps], turns: bool) -> Option<Branch> {
        let mut branch = self.clone();
        let frames = branch.constraints.iter_mut().filter_map(|c| match &mut c.bond {
            Bond::Cut(cut) => Some([&mut cut.a.place, &mut cut.b.place]),
            Bond::Coupling { .. } => None,
        });
        let places = branch.nodes.iter_mut().map(|node| &mut node.place).chain(frames.flatten());
        for (place, steps) in places.zip(steps) {
            *place = padded(place, steps, turns)?;
        }
        Some(branch)
    }
}

/// A constraint without its numbers and placements.
fn form(constraint: &Constraint<f64>) -> Constraint<f64> {
    let mut form = map_constraint(constraint, &mut |_| 0.0);
    if let Bond::Cut(cut) = &mut form.bond {
        cut.a.place.clear();
        cut.b.place.clear();
    }
    form
}

/// The numbers of a branch.
struct Numbers<'a> {
    nodes: Range<usize>,
    /// Number that the first of them gets: after one that stands for the parent, where that is a node, and one at which rows are
    /// solved, where there are some.
    offset: usize,
    parent: Option<usize>,
    first: Extent,
    velocities: Range<usize>,
    first_entry: usize,
    /// The unknowns of the branch.
    unknowns: &'a [usize],
}

impl Numbers<'_> {
    fn of_node(&self, i: usize) -> usize {
        if Some(i) == self.parent {
            self.offset - 1
        } else {
            i - self.nodes.start + self.offset
        }
    }

    fn unknown(&self, g: usize) -> Option<usize> {
        self.unknowns.binary_search(&g).ok()
    }

    fn list(&self, list: &[usize]) -> Option<Vec<usize>> {
        list.iter().map(|g| self.unknown(*g)).collect()
    }

    /// A node with the numbers of its branch; `None` where it has constants that are not numbers, or columns of others.
    fn node(&self, node: &Node<Expr>) -> Option<Node<f64>> {
        let mut constant = true;
        let mut node = map_node(node, &mut number(&mut constant));
        if !constant {
            return None;
        }
        node.parent = node.parent.map(|p| self.of_node(p));
        if let Source::State { q, v } = &mut node.source {
            (*q, *v) = (*q - self.first.q, *v - self.first.v);
        }
        let Elimination { unknown, ends, screws, open, solve_before, solve_after, .. } = &node.elimination;
        node.elimination = Elimination {
            unknown: unknown.map(|g| self.unknown(g).ok_or(())).transpose().ok()?,
            ends: self.list(ends)?,
            screws: self.list(screws)?,
            open: self.list(open)?,
            solve_before: self.list(solve_before)?,
            solve_after: self.list(solve_after)?,
            ..node.elimination
        };
        Some(node)
    }

    /// The same for a constraint between nodes of the branch, its parent and the ground. The path to the ground ends at the parent.
    fn constraint(&self, constraint: &Constraint<Expr>) -> Option<Constraint<f64>> {
        let mut constant = true;
        let mut out = map_constraint(constraint, &mut number(&mut constant));
        if !constant {
            return None;
        }
        let local = |i: &mut usize| *i = self.of_node(*i);
        let own = |i: &usize| self.nodes.contains(i) || Some(*i) == self.parent;
        match &mut out.bond {
            Bond::Cut(cut) => {
                [&mut cut.a, &mut cut.b].into_iter().filter_map(|frame| frame.node.as_mut()).for_each(local);
                for path in [&mut cut.path_a, &mut cut.path_b] {
                    path.retain(own);
                    path.iter_mut().for_each(local);
                }
            }
            Bond::Coupling { terms, .. } => terms.iter_mut().map(|(i, _)| i).for_each(local),
        }
        out.slots = self.list(&out.slots)?;
        out.passes = out.passes.iter().map(|slots| self.list(slots)).collect::<Option<_>>()?;
        (out.first, out.entry) = (out.first - self.first.rows, out.entry.checked_sub(self.first_entry)?);
        out.velocities.retain(|v| self.velocities.contains(v));
        out.velocities.iter_mut().for_each(|v| *v -= self.first.v);
        Some(out)
    }
}

/// Takes constants as numbers, and tells whether there is one that is none.
fn number(constant: &mut bool) -> impl FnMut(Expr) -> f64 + '_ {
    |x| match x {
        Expr::Const(x) => x,
        Expr::Node { .. } => {
            *constant = false;
            0.0
        }
    }
}
