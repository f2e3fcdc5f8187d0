//! Like branches of one node: legs, arms, fingers.
//!
//! Branches are alike if their nodes have the same kinds of joints and the same elimination. Constants may differ in
//! everything, their zeros and signs included: what is not the same in all branches becomes a column of the table. Steps
//! that only some of the placements have are let in elsewhere as identities.

use mbd_runtime::spatial::ElementaryTransform;
use mbd_runtime::tree::{Elimination, Node, Source, Tree, Unknown};

use super::runs::{columns_of, map_node, same_joint, same_step, Branches, Run};
use crate::symbolic::Expr;

/// Largest number of branches in a set: the lanes of a vector register.
pub const WIDTH: usize = 4;

/// A branch by itself: nodes, coordinates and unknowns are numbered from its first ones.
struct Branch {
    root: usize,
    nodes: Vec<Node<f64>>,
    unknowns: Vec<Unknown>,
    first: (usize, usize),
    size: (usize, usize),
}

/// Sets of like branches, each of nodes that are in no other set, inner nodes first. With `turns`, placements may be
/// made alike by turns about no angle, which round in other places than the sweeps.
pub fn find(tree: &Tree<Expr>, turns: bool) -> Vec<Run> {
    if !tree.wrenches.is_empty() || !tree.constraints.is_empty() {
        return Vec::new();
    }
    let n = tree.nodes.len();
    let mut taken = vec![false; n];
    let mut sets = Vec::new();
    for parent in (0..n).filter(|&p| !tree.nodes[p].elimination.non_rotating) {
        if taken[parent] {
            continue;
        }
        let roots = (parent + 1..n).filter(|&i| tree.nodes[i].parent == Some(parent));
        let mut rest: Vec<Branch> = roots.filter_map(|root| Branch::new(tree, root)).collect();
        while !rest.is_empty() {
            let first = rest.remove(0);
            let (mut like, mut other) = (vec![first], Vec::new());
            for branch in rest {
                match like[0].is_like(&branch) && union_of(like.iter().chain([&branch]), turns).is_some() {
                    true => like.push(branch),
                    false => other.push(branch),
                }
            }
            rest = other;
            for like in like.chunks(WIDTH) {
                let Some(run) = run(&tree.nodes[parent].elimination, parent, like, turns) else { continue };
                for branch in like {
                    taken[branch.root..branch.root + branch.nodes.len()].fill(true);
                }
                sets.push(run);
            }
        }
    }
    sets
}

impl Branch {
    /// The branch that starts at a node, if it can be evaluated by itself.
    fn new(tree: &Tree<Expr>, root: usize) -> Option<Branch> {
        let inside = |i: usize| tree.nodes[i].parent.is_some_and(|p| p >= root);
        let end = (root + 1..tree.nodes.len()).find(|&i| !inside(i)).unwrap_or(tree.nodes.len());
        // Descendants follow their ancestors without a gap.
        if (end..tree.nodes.len()).any(|i| tree.nodes[i].parent.is_some_and(|p| (root..end).contains(&p))) {
            return None;
        }
        let states: Vec<[usize; 4]> = (root..end)
            .map(|i| match tree.nodes[i].source {
                Source::State { q, v } => Some([q, v, q + tree.nodes[i].kind.nq(), v + tree.nodes[i].kind.nv()]),
                Source::Drive { .. } => None,
            })
            .collect::<Option<_>>()?;
        let least = |k: usize| states.iter().map(|s| s[k]).min().unwrap_or(0);
        let most = |k: usize| states.iter().map(|s| s[k]).max().unwrap_or(0);
        let first = (least(0), least(1));
        let size = (most(2) - first.0, most(3) - first.1);
        let own = |v: usize| (first.1..first.1 + size.1).contains(&v);
        // Coordinates of the branch are those of no other node.
        let elsewhere = (0..tree.nodes.len())
            .filter(|i| !(root..end).contains(i))
            .any(|i| matches!(tree.nodes[i].source, Source::State { v, .. } if own(v) && tree.nodes[i].kind.nv() > 0));
        if elsewhere || !tree.nodes[root].elimination.open.is_empty() {
            return None;
        }
        let numbers: Vec<usize> =
            (0..tree.unknowns.len()).filter(|&g| tree.unknowns[g].velocity().is_some_and(own)).collect();
        if tree.solve_at_ground.iter().any(|g| numbers.contains(g)) {
            return None;
        }
        let mut nodes = Vec::new();
        for i in root..end {
            nodes.push(local(tree, i, root, first, &numbers)?);
        }
        let unknown = |g: &usize| tree.unknowns[*g].velocity().map(|v| Unknown::Velocity(v - first.1));
        let unknowns = numbers.iter().map(unknown).collect::<Option<_>>()?;
        Some(Branch { root, nodes, unknowns, first, size })
    }

    /// The same structure, placements apart.
    fn is_like(&self, other: &Branch) -> bool {
        let same = |(a, b): (&Node<f64>, &Node<f64>)| {
            same_joint(a, b) && a.parent == b.parent && a.source == b.source && a.passive.len() == b.passive.len()
        };
        self.nodes.len() == other.nodes.len()
            && self.unknowns == other.unknowns
            && self.size == other.size
            && self.nodes.iter().zip(&other.nodes).all(same)
    }
}

/// Node `i` with the numbers of its branch; `None` where it has constants that are not numbers, or columns of others.
fn local(tree: &Tree<Expr>, i: usize, root: usize, first: (usize, usize), unknowns: &[usize]) -> Option<Node<f64>> {
    let mut constant = true;
    let mut node = map_node(&tree.nodes[i], &mut |x| match x {
        Expr::Const(x) => x,
        Expr::Node { .. } => {
            constant = false;
            0.0
        }
    });
    if !constant {
        return None;
    }
    // Node 0 stands for the parent of the branch.
    node.parent = Some(if i == root { 0 } else { node.parent? - root + 1 });
    if let Source::State { q, v } = &mut node.source {
        (*q, *v) = (*q - first.0, *v - first.1);
    }
    let number = |g: usize| unknowns.iter().position(|h| *h == g);
    let numbers = |list: &[usize]| list.iter().map(|g| number(*g)).collect::<Option<Vec<usize>>>();
    let Elimination { unknown, ends, screws, open, solve_before, solve_after, .. } = &node.elimination;
    node.elimination = Elimination {
        unknown: unknown.map(|g| number(g).ok_or(())).transpose().ok()?,
        ends: numbers(ends)?,
        screws: numbers(screws)?,
        open: numbers(open)?,
        solve_before: numbers(solve_before)?,
        solve_after: numbers(solve_after)?,
        ..node.elimination
    };
    Some(node)
}

type Steps = Vec<ElementaryTransform<f64>>;

/// The steps of all branches, node by node: the shortest lists that contain those of every branch in order.
fn union_of<'a>(mut branches: impl Iterator<Item = &'a Branch>, turns: bool) -> Option<Vec<Steps>> {
    let first = branches.next()?.nodes.iter().map(|node| node.place.clone()).collect();
    branches.try_fold(first, |all: Vec<Steps>, branch| {
        all.iter().zip(&branch.nodes).map(|(steps, node)| union(steps, &node.place, turns)).collect()
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
fn run(parent: &Elimination, at: usize, like: &[Branch], turns: bool) -> Option<Run> {
    let (first, second) = (like.first()?, like.get(1)?);
    let stride = (second.first.0.checked_sub(first.first.0)?, second.first.1.checked_sub(first.first.1)?);
    let steady = like.windows(2).all(|pair| {
        let ([a, b], [q, v]) = ([pair[0].first, pair[1].first], [stride.0, stride.1]);
        (a.0 + q, a.1 + v) == b
    });
    if !steady {
        return None;
    }
    let steps = union_of(like.iter(), turns)?;
    let mut table = vec![Vec::new(); like.len()];
    let mut template = Vec::new();
    for (k, steps) in steps.iter().enumerate() {
        let node = |branch: &Branch| {
            let node = branch.nodes[k].clone();
            Some(Node { place: padded(&node.place, steps, turns)?, ..node })
        };
        template.push(columns_of(&like.iter().map(node).collect::<Option<Vec<_>>>()?, &mut table));
    }
    let branches = Branches {
        parent: at,
        roots: like.iter().map(|branch| branch.root).collect(),
        stride,
        size: first.size,
        unknowns: first.unknowns.clone(),
        accumulates: parent.accumulates_momentum,
    };
    let nodes = first.root..first.root + first.nodes.len();
    Some(Run { period: nodes.len(), nodes, template, table, branches: Some(branches) })
}
