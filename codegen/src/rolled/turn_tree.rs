//! The tree of one turn of a run: its links, behind nodes that stand for what it hangs on.

use mbd_runtime::spatial::RigidInertia;
use mbd_runtime::tree::{
    Bond, Closure, Constraint, Cut, Dims, Elimination, Kind, Node, Passive, Source, Tree, TreeFrame, Unknown,
};
use mbd_runtime::Scalar;

use super::mapped::{map_constraint, map_node};
use super::runs::{Branches, Extent, Run, Slot};
use crate::symbolic::Expr;

/// Coordinates, velocities and rows of one turn.
pub fn size_of(run: &Run) -> Extent {
    let kinds = || run.template.iter().map(|node| &node.kind);
    let own = || Extent { q: kinds().map(Kind::nq).sum(), v: kinds().map(Kind::nv).sum(), rows: 0 };
    run.branches.as_ref().map_or_else(own, |branches| branches.size)
}

/// The tree of one turn of a run in a whole tree, with constants as `slot` gives them. Its first node stands for what the turn
/// hangs on, unless that is the ground.
pub fn turn_tree<'g>(
    run: &Run,
    size: Extent,
    whole: &Tree<Expr<'_>>,
    slot: &mut impl FnMut(Slot) -> Expr<'g>,
) -> Tree<Expr<'g>> {
    let (nodes, constraints, rows, unknowns, solve_at_ground) = match &run.branches {
        Some(branches) => {
            let mut nodes = stand_ins(branches);
            nodes.extend(run.template.iter().map(|node| map_node(node, slot)));
            let constraints = run.constraints.iter().map(|c| map_constraint(c, slot)).collect();
            let last = if branches.parent.is_none() { branches.solve_last.clone() } else { Vec::new() };
            (nodes, constraints, size.rows, branches.unknowns.clone(), last)
        }
        None => {
            let constraints: Vec<Constraint<Expr<'g>>> = whole.constraints.iter().map(|c| on_path(c, run)).collect();
            // Numbered as in the whole tree; coordinates are open nowhere in a chain.
            let row = |g: &Unknown| if let Unknown::Row(_) = g { *g } else { Unknown::Row(0) };
            let unknowns = whole.unknowns.iter().filter(|_| !constraints.is_empty()).map(row).collect();
            (chain(run, slot), constraints, whole.dims.rows, unknowns, Vec::new())
        }
    };
    Tree {
        nodes,
        dims: Dims { nq: size.q, nv: size.v, rows, drive_q: 3, drive_v: 3, ..Dims::default() },
        unknowns,
        solve_at_ground,
        ground_moment: [Expr::zero(); 3],
        wrenches: Vec::new(),
        constraints,
        tolerance: match whole.tolerance {
            Expr::Const(x) => Expr::Const(x),
            Expr::Node { .. } => Expr::rank_tolerance(),
        },
        early_tolerance: whole.early_tolerance,
        row_factors: None,
        frames: Vec::new(),
        joint_nodes: Vec::new(),
        accelerations: None,
        matrix_depth: 0,
    }
}

/// What branches hang on: nothing on the ground, else their parent, and where they have rows that are solved at it, the node at
/// which a branch solves them.
fn stand_ins<'g>(branches: &Branches) -> Vec<Node<Expr<'g>>> {
    if branches.parent.is_none() {
        return Vec::new();
    }
    let solver = (!branches.solve_last.is_empty()).then(|| solver(branches.solve_last.clone()));
    std::iter::once(dummy(branches.accumulates)).chain(solver).collect()
}

/// The links of a turn of a chain, behind a dummy.
fn chain<'g>(run: &Run, slot: &mut impl FnMut(Slot) -> Expr<'g>) -> Vec<Node<Expr<'g>>> {
    let mut nodes = vec![dummy(false)];
    let (mut q, mut v) = (0, 0);
    for (k, node) in run.template.iter().enumerate() {
        let parent = Some(run.parent_in_turn(k).map_or(0, |parent| parent + 1));
        nodes.push(Node { parent, source: Source::State { q, v }, ..map_node(node, &mut *slot) });
        (q, v) = (q + node.kind.nq(), v + node.kind.nv());
    }
    nodes
}

/// The nodes of a turn of a chain that lie between the turns before and after it, inner first, behind a dummy.
fn way_through(run: &Run) -> Vec<usize> {
    let mut way: Vec<usize> =
        std::iter::successors(Some(run.exit), |k| run.parent_in_turn(*k)).map(|k| k + 1).collect();
    way.reverse();
    way
}

/// A constraint as a turn of a chain sees it: on the path to a frame if all of the run is.
fn on_path<'g>(constraint: &Constraint<Expr<'_>>, run: &Run) -> Constraint<Expr<'g>> {
    let path = |path: &[usize]| match path.contains(&run.nodes.start) {
        true => way_through(run),
        false => Vec::new(),
    };
    let [path_a, path_b] = match &constraint.bond {
        Bond::Cut(cut) => [path(&cut.path_a), path(&cut.path_b)],
        Bond::Coupling { .. } => [Vec::new(), Vec::new()],
    };
    let grounded = matches!(&constraint.bond, Bond::Cut(cut) if cut.grounded);
    Constraint {
        bond: only_paths([path_a, path_b], grounded),
        slots: constraint.slots.clone(),
        passes: Vec::new(),
        first: constraint.first,
        entry: constraint.entry,
        decay: None,
        compliance: None,
        own_axes: false,
        velocities: Vec::new(),
    }
}

/// A bond of which nothing but the paths to its two frames is known.
pub fn only_paths<'g>([path_a, path_b]: [Vec<usize>; 2], grounded: bool) -> Bond<Expr<'g>> {
    let nowhere = || TreeFrame { node: None, place: Vec::new() };
    Bond::Cut(Cut { closure: Closure::Fixed, a: nowhere(), b: nowhere(), path_a, path_b, grounded })
}

/// A node without inertia and motion, at which rows are solved that bind branches of one node to one another, or to that node: it
/// stands between them and the node.
fn solver<'g>(rows: Vec<usize>) -> Node<Expr<'g>> {
    let zero = Expr::zero();
    let none = Passive { damping: zero, stiffness: zero, rest: zero, armature: zero };
    let elimination = Elimination { solve_before: rows, ..Elimination::default() };
    Node { parent: Some(0), passive: vec![none; 3], elimination, ..dummy(false) }
}

/// Stands for whatever is inboard of a turn: has no inertia, and is never stepped.
fn dummy<'g>(accumulates_momentum: bool) -> Node<Expr<'g>> {
    Node {
        parent: None,
        place: Vec::new(),
        kind: Kind::Planar,
        source: Source::Drive { q: 0, v: 0 },
        ratio: Expr::one(),
        offset: Expr::zero(),
        phase: Expr::zero(),
        quarter: 0,
        slide: Expr::zero(),
        slides: false,
        inertia: RigidInertia::zero(),
        passive: Vec::new(),
        elimination: Elimination { accumulates_momentum, ..Elimination::default() },
    }
}
