//! Like branches of one node: legs, arms, fingers; and like mechanisms side by side on the ground.
//!
//! Branches are alike if their nodes have the same kinds of joints and the same elimination, and the loops inside of them are
//! of the same kinds. Constants may differ in everything, their zeros and signs included: what is not the same in all branches
//! becomes a column of the table. Steps that only some of the placements have are let in elsewhere as identities.

use std::ops::Range;

use mbd_runtime::spatial::ElementaryTransform;
use mbd_runtime::tree::{Bond, Constraint, Elimination, Node, Source, Tree, Unknown};

use super::runs::{columns_of, map_constraint, map_node, same_joint, same_step, slots_of, Branches, Extent, Run, Slot};
use crate::symbolic::Expr;

/// Largest number of branches in a set: the lanes of a vector register.
pub const WIDTH: usize = 4;

/// A branch by itself: nodes, coordinates, unknowns, rows and entries of `Φ` are numbered from its first ones.
#[derive(Clone)]
struct Branch {
    root: usize,
    nodes: Vec<Node<f64>>,
    constraints: Vec<Constraint<f64>>,
    unknowns: Vec<Unknown>,
    /// Unknowns that are solved where the branch hangs: at the ground, or at its parent.
    solve_last: Vec<usize>,
    first: Extent,
    size: Extent,
}

/// Sets of like branches, each of nodes that are in no other set, inner nodes first. In `fast` arithmetic, what rounds in other
/// places than the sweeps is allowed: turns about no angle that make placements alike; and rows that are solved at the parent
/// of a branch, which then are solved before the branches are added up.
pub fn find(tree: &Tree<Expr>, fast: bool) -> Vec<Run> {
    if !tree.wrenches.is_empty() || tree.row_factors.is_some() {
        return Vec::new();
    }
    let n = tree.nodes.len();
    let mut taken = vec![false; n];
    let mut sets = Vec::new();
    let mut branches = vec![Vec::new(); n + 1];
    // Those of the ground come first.
    let place = |parent: Option<usize>| parent.map_or(0, |p| p + 1);
    (0..n).for_each(|root| branches[place(tree.nodes[root].parent)].push(root..end_of(tree, root)));
    for (parent, mut nodes) in std::iter::once(None).chain((0..n).map(Some)).zip(branches) {
        if parent.is_none() || fast {
            join(tree, parent, &mut nodes);
        }
        let unfit = |p: usize| taken[p] || tree.nodes[p].elimination.non_rotating;
        if nodes.len() < 2 || parent.is_some_and(unfit) {
            continue;
        }
        let mut rest: Vec<Branch> =
            nodes.into_iter().filter_map(|nodes| Branch::new(tree, parent, nodes, fast)).collect();
        while !rest.is_empty() {
            let first = rest.remove(0);
            let (mut like, mut other) = (vec![first], Vec::new());
            for branch in rest {
                match like[0].is_like(&branch) && union_of(like.iter().chain([&branch]), fast).is_some() {
                    true => like.push(branch),
                    false => other.push(branch),
                }
            }
            rest = other;
            for like in like.chunks(WIDTH) {
                let Some(run) = run(tree, parent, like, fast) else { continue };
                for branch in like {
                    taken[branch.root..branch.root + branch.nodes.len()].fill(true);
                }
                sets.push(run);
            }
        }
    }
    sets
}

/// The node after the last of those that follow `root` and descend from it.
fn end_of(tree: &Tree<Expr>, root: usize) -> usize {
    let inside = |i: usize| tree.nodes[i].parent.is_some_and(|p| p >= root);
    (root + 1..tree.nodes.len()).find(|&i| !inside(i)).unwrap_or(tree.nodes.len())
}

/// Joins branches of a node or of the ground that constraints bind to one another, with those between them.
fn join(tree: &Tree<Expr>, parent: Option<usize>, branches: &mut Vec<Range<usize>>) {
    for constraint in &tree.constraints {
        let of = |i: usize| branches.iter().position(|nodes| nodes.contains(&i));
        let ends = nodes_of(&constraint.bond).into_iter().filter(|end| *end != parent);
        // What leads elsewhere makes no branch.
        let Some(all) = ends.map(|end| of(end?)).collect::<Option<Vec<usize>>>() else { continue };
        let (Some(&first), Some(&last)) = (all.iter().min(), all.iter().max()) else { continue };
        let joined = branches[first].start..branches[last].end;
        branches.splice(first..=last, [joined]);
    }
}

/// The nodes that a constraint acts on; `None` for the ground.
fn nodes_of<S>(bond: &Bond<S>) -> Vec<Option<usize>> {
    match bond {
        Bond::Cut(cut) => vec![cut.a.node, cut.b.node],
        Bond::Coupling { terms, .. } => terms.iter().map(|(node, _)| Some(*node)).collect(),
    }
}

impl Branch {
    /// The branch of some nodes, if it can be evaluated by itself.
    fn new(tree: &Tree<Expr>, parent: Option<usize>, range: Range<usize>, fast: bool) -> Option<Branch> {
        let inside = |i: usize| range.contains(&i);
        // Descendants follow their ancestors without a gap.
        let alone = (0..tree.nodes.len()).all(|i| match tree.nodes[i].parent {
            Some(p) if inside(p) => inside(i),
            other => !inside(i) || other == parent,
        });
        if !alone {
            return None;
        }
        let states: Vec<[usize; 4]> = range
            .clone()
            .map(|i| match tree.nodes[i].source {
                Source::State { q, v } => Some([q, v, q + tree.nodes[i].kind.nq(), v + tree.nodes[i].kind.nv()]),
                Source::Drive { .. } => None,
            })
            .collect::<Option<_>>()?;
        let least = |k: usize| states.iter().map(|s| s[k]).min().unwrap_or(0);
        let most = |k: usize| states.iter().map(|s| s[k]).max().unwrap_or(0);
        let (q, v) = (least(0)..most(2), least(1)..most(3));
        // Coordinates of the branch are those of no other node.
        let elsewhere = (0..tree.nodes.len()).filter(|i| !inside(*i)).any(|i| {
            matches!(tree.nodes[i].source, Source::State { v: at, .. } if v.contains(&at) && tree.nodes[i].kind.nv() > 0)
        });
        if elsewhere {
            return None;
        }
        let binds = |c: &&Constraint<Expr>| nodes_of(&c.bond).into_iter().flatten().any(inside);
        let own: Vec<&Constraint<Expr>> = tree.constraints.iter().filter(binds).collect();
        let rows_of = |c: &Constraint<Expr>| c.first..c.first + c.slots.len();
        let within = |end: Option<usize>| end.is_some_and(inside) || (end == parent && (fast || parent.is_none()));
        let whole = own.iter().all(|c| nodes_of(&c.bond).into_iter().all(within))
            && own.windows(2).all(|pair| rows_of(pair[0]).end == pair[1].first);
        if !whole {
            return None;
        }
        let rows = own.first().map_or(0, |c| c.first)..own.last().map_or(0, |c| rows_of(c).end);
        let mine = |g: usize| match tree.unknowns[g] {
            Unknown::Velocity(at) => v.contains(&at),
            Unknown::Row(row) => rows.contains(&row),
        };
        let global: Vec<usize> = (0..tree.unknowns.len()).filter(|&g| mine(g)).collect();
        let unknown = |g: &usize| match tree.unknowns[*g] {
            Unknown::Velocity(at) => Unknown::Velocity(at - v.start),
            Unknown::Row(row) => Unknown::Row(row - rows.start),
        };
        let unknowns = global.iter().map(unknown).collect();
        let last = parent.map_or(&tree.solve_at_ground, |p| &tree.nodes[p].elimination.solve_before);
        let last: Vec<usize> = last.iter().copied().filter(|&g| mine(g)).collect();
        let solved = |g: usize| last.contains(&g) && matches!(tree.unknowns[g], Unknown::Row(_));
        let open =
            range.clone().filter(|&i| tree.nodes[i].parent == parent).flat_map(|i| &tree.nodes[i].elimination.open);
        if parent.is_some() && !(open.copied().all(solved) && (fast || last.is_empty())) {
            return None;
        }
        let numbers = Numbers {
            root: range.start,
            parent,
            offset: parent.map_or(0, |_| 1 + usize::from(!last.is_empty())),
            first: Extent { q: q.start, v: v.start, rows: rows.start },
            first_entry: own.first().map_or(0, |c| c.entry),
            unknowns: &global,
        };
        if parent.is_some() && tree.solve_at_ground.iter().any(|&g| mine(g)) {
            return None;
        }
        Some(Branch {
            root: range.start,
            nodes: range.map(|i| numbers.node(&tree.nodes[i])).collect::<Option<_>>()?,
            constraints: own.into_iter().map(|c| numbers.constraint(c)).collect::<Option<_>>()?,
            unknowns,
            solve_last: numbers.list(&last)?,
            first: numbers.first,
            size: Extent { q: q.len(), v: v.len(), rows: rows.len() },
        })
    }

    /// The same structure, placements apart.
    fn is_like(&self, other: &Branch) -> bool {
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
    fn places(&self) -> impl Iterator<Item = &Steps> {
        let frames = self.constraints.iter().filter_map(|c| match &c.bond {
            Bond::Cut(cut) => Some([&cut.a.place, &cut.b.place]),
            Bond::Coupling { .. } => None,
        });
        self.nodes.iter().map(|node| &node.place).chain(frames.flatten())
    }

    /// The same with placements that have given steps.
    fn with_steps(&self, steps: &[Steps], turns: bool) -> Option<Branch> {
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
    /// First node.
    root: usize,
    /// Number that it gets: after one that stands for the parent, where that is a node, and one at which rows are solved, where
    /// there are some.
    offset: usize,
    parent: Option<usize>,
    first: Extent,
    first_entry: usize,
    /// The unknowns of the branch.
    unknowns: &'a [usize],
}

impl Numbers<'_> {
    fn of_node(&self, i: usize) -> usize {
        if Some(i) == self.parent {
            self.offset - 1
        } else {
            i - self.root + self.offset
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

    /// The same for a constraint between nodes of the branch.
    fn constraint(&self, constraint: &Constraint<Expr>) -> Option<Constraint<f64>> {
        let mut constant = true;
        let mut out = map_constraint(constraint, &mut number(&mut constant));
        if !constant {
            return None;
        }
        let local = |i: &mut usize| *i = self.of_node(*i);
        match &mut out.bond {
            Bond::Cut(cut) => {
                [&mut cut.a, &mut cut.b].into_iter().filter_map(|frame| frame.node.as_mut()).for_each(local);
                cut.path_a.iter_mut().chain(&mut cut.path_b).for_each(local);
            }
            Bond::Coupling { terms, .. } => terms.iter_mut().map(|(i, _)| i).for_each(local),
        }
        out.slots = self.list(&out.slots)?;
        out.passes = out.passes.iter().map(|slots| self.list(slots)).collect::<Option<_>>()?;
        (out.first, out.entry) = (out.first - self.first.rows, out.entry.checked_sub(self.first_entry)?);
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

type Steps = Vec<ElementaryTransform<f64>>;

/// The steps of all branches, placement by placement: the shortest lists that contain those of every branch in order.
fn union_of<'a>(mut branches: impl Iterator<Item = &'a Branch>, turns: bool) -> Option<Vec<Steps>> {
    let first = branches.next()?.places().cloned().collect();
    branches.try_fold(first, |all: Vec<Steps>, branch| {
        all.iter().zip(branch.places()).map(|(steps, place)| union(steps, place, turns)).collect()
    })
}

/// The shortest list that contains both in order, if what either lacks can be let in.
fn union(a: &[ElementaryTransform<f64>], b: &[ElementaryTransform<f64>], turns: bool) -> Option<Steps> {
    let (Some((x, rest_of_a)), Some((y, rest_of_b))) = (a.split_first(), b.split_first()) else {
        let rest = [a, b].concat();
        return rest.iter().all(|step| identity(step, turns).is_some()).then_some(rest);
    };
    let after = |step: &ElementaryTransform<f64>, rest: Option<Steps>| Some([vec![*step], rest?].concat());
    if same_step(x, y) {
        return after(x, union(rest_of_a, rest_of_b, turns));
    }
    let without = |step, rest| identity(step, turns).and_then(|_| after(step, rest));
    let ways = [without(x, union(rest_of_a, b, turns)), without(y, union(a, rest_of_b, turns))];
    ways.into_iter().flatten().min_by_key(Vec::len)
}

/// The step that does nothing in the place of another one. A shift by zero is exact.
fn identity(step: &ElementaryTransform<f64>, turns: bool) -> Option<ElementaryTransform<f64>> {
    match *step {
        ElementaryTransform::Shift { axis, .. } => Some(ElementaryTransform::Shift { axis, r: 0.0 }),
        ElementaryTransform::Turn { axis, .. } if turns => Some(ElementaryTransform::Turn { axis, c: 1.0, s: 0.0 }),
        ElementaryTransform::Turn { .. } | ElementaryTransform::Rotate(_) => None,
    }
}

/// A placement with the steps of a longer one.
fn padded(place: &[ElementaryTransform<f64>], steps: &[ElementaryTransform<f64>], turns: bool) -> Option<Steps> {
    let Some((step, others)) = steps.split_first() else { return place.is_empty().then(Vec::new) };
    let taken = place.split_first().filter(|(own, _)| same_step(own, step));
    let with = |own: ElementaryTransform<f64>, rest: Steps| [vec![own], rest].concat();
    let as_is = taken.and_then(|(own, rest)| Some(with(*own, padded(rest, others, turns)?)));
    as_is.or_else(|| Some(with(identity(step, turns)?, padded(place, others, turns)?)))
}

/// The set of some like branches; `None` where there is only one, or their coordinates do not move on steadily.
fn run(tree: &Tree<Expr>, parent: Option<usize>, like: &[Branch], turns: bool) -> Option<Run> {
    let (first, second) = (like.first()?, like.get(1)?);
    let stride = second.first.checked_sub(first.first)?;
    if !like.windows(2).all(|pair| pair[1].first.checked_sub(pair[0].first) == Some(stride)) {
        return None;
    }
    let steps = union_of(like.iter(), turns)?;
    let all: Vec<Branch> = like.iter().map(|branch| branch.with_steps(&steps, turns)).collect::<Option<_>>()?;
    let mut table = vec![Vec::new(); like.len()];
    let node = |k: usize| all.iter().map(|branch| branch.nodes[k].clone()).collect::<Vec<_>>();
    let template = (0..first.nodes.len()).map(|k| columns_of(&node(k), &mut table)).collect();
    let mut constraints = Vec::new();
    for (k, constraint) in all[0].constraints.iter().enumerate() {
        let numbers = |branch: &Branch| {
            let mut numbers = Vec::new();
            map_constraint(&branch.constraints[k], &mut |x| numbers.push(x));
            numbers
        };
        let mut slots = slots_of(&all.iter().map(numbers).collect::<Vec<_>>(), &mut table).into_iter();
        constraints.push(map_constraint(constraint, &mut |_| slots.next().unwrap_or(Slot::Const(0.0))));
    }
    let branches = Branches {
        parent,
        roots: like.iter().map(|branch| branch.root).collect(),
        stride,
        first: first.first,
        size: first.size,
        unknowns: first.unknowns.clone(),
        solve_last: first.solve_last.clone(),
        accumulates: parent.is_some_and(|p| tree.nodes[p].elimination.accumulates_momentum),
    };
    let nodes = first.root..first.root + first.nodes.len();
    Some(Run { period: nodes.len(), nodes, template, constraints, table, branches: Some(branches) })
}
