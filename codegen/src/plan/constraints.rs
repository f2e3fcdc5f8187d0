//! Loops and couplings of the model on the nodes of the plan.

use std::collections::BTreeSet;

use mbd_runtime::spatial::Axis;
use mbd_runtime::sweep::Sweeps;
use mbd_runtime::tree::{Bond, Closure, Constraint, Cut, Source, Tree, TreeFrame, Unknown};
use mbd_runtime::workspace::Workspace;
use mbd_runtime::Scalar;

use super::elements::{Carried, Elements};
use super::instantiate::{steps, value};
use super::placement::{direction, placement};
use super::shared::ancestors;
use super::{Plan, PlanFrame, PoseStep, Rigid};
use crate::model::{ConstraintKind, JointKind, LoopKind, Model, Mount, Value};
use crate::options::Options;
use crate::output::Output;
use crate::symbolic::{Expr, Graph};
use crate::trace::SymbolicInputs;

/// What a constraint binds, on nodes.
#[derive(Clone, Debug)]
pub enum PlanBond {
    /// Two frames.
    Cut {
        /// What it binds.
        kind: LoopKind,
        /// First and second frame, axes along z, or along x and y for a universal joint. The ground, if it is one of them
        /// and the kind is that of a joint, is the first: rows are constants of the body then. Of a rod it is the second.
        frames: Box<[PlanFrame; 2]>,
        /// Nodes from the innermost common one, which is left out, to those of the frames.
        paths: [Vec<usize>; 2],
    },
    /// Freedoms of nodes, with ratios.
    Coupling {
        /// Node and ratio.
        terms: Vec<(usize, Value)>,
        /// Offset.
        offset: Value,
    },
}

/// A constraint.
#[derive(Clone, Debug)]
pub struct PlanConstraint {
    /// Name.
    pub name: String,
    /// What it binds.
    pub bond: PlanBond,
    /// Its place among [`Plan::shared`], one for each row.
    pub slots: Vec<usize>,
    /// Its first row.
    pub first: usize,
    /// Velocities that it binds, in ascending order.
    pub velocities: Vec<usize>,
    /// See [`mbd_runtime::tree::Constraint`].
    pub decay: Value,
}

/// Frames of loops: carrier and pose with the axes where the rows want them.
pub fn mounts(model: &Model, elements: &Elements, snap: f64) -> Vec<Option<[Carried; 2]>> {
    let carried = |mount: &Mount, turn: Option<PoseStep>| {
        let (carrier, mut pose) = mount.body.map_or((None, Vec::new()), |b| elements.bodies[b].clone());
        pose.extend(placement(&mount.placement, snap, &mut |_| {}));
        pose.extend(turn);
        (carrier, pose)
    };
    let each = model.constraints.iter().map(|c| match &c.kind {
        ConstraintKind::Loop { kind, first, second } => {
            let [a, b] = turns(kind, snap);
            Some([carried(first, a), carried(second, b)])
        }
        ConstraintKind::Coupling { .. } => None,
    });
    each.collect()
}

/// Turns of the two frames that put their axes where the rows want them.
fn turns(kind: &LoopKind, snap: f64) -> [Option<PoseStep>; 2] {
    let to = |axis: [f64; 3]| Rigid::align_z(direction(axis, snap, &mut |_| {}));
    let z = |axis: [f64; 3]| {
        let turn = to(axis);
        (turn.rot != Rigid::IDENTITY.rot).then_some(PoseStep::Rotate(turn.rot))
    };
    let quarter = |axis, s| PoseStep::Turn { axis, c: 0.0, s };
    let after = |axis: [f64; 3], step: PoseStep| {
        super::placement::constant(&[PoseStep::Rotate(to(axis).rot), step]).map(|pose| PoseStep::Rotate(pose.rot))
    };
    match *kind {
        LoopKind::Revolute { axis }
        | LoopKind::Prismatic { axis }
        | LoopKind::Cylindrical { axis }
        | LoopKind::Helical { axis, .. }
        | LoopKind::Planar { normal: axis } => [z(axis), z(axis)],
        LoopKind::Universal { axes: [x, y] } => [after(x, quarter(Axis::Y, -1.0)), after(y, quarter(Axis::X, 1.0))],
        LoopKind::PointOnLine { axis }
        | LoopKind::PointOnPlane { normal: axis }
        | LoopKind::PointOnCylinder { axis, .. }
        | LoopKind::RollingBall { normal: axis, .. } => [z(axis), None],
        LoopKind::RollingDisc { normal, axis, .. } => [z(normal), z(axis)],
        LoopKind::KnifeEdge { axis } => [None, z(axis)],
        LoopKind::Spherical | LoopKind::Fixed | LoopKind::Distance { .. } | LoopKind::Pfaffian { .. } => [None, None],
    }
}

/// Puts the model's constraints on the nodes, after [`super::shared::share`]. `frames` are those of [`mounts`].
pub fn constrain(plan: &mut Plan, frames: Vec<Option<[PlanFrame; 2]>>) {
    let constraints = plan.model.constraints.clone();
    for (constraint, frames) in constraints.into_iter().zip(frames) {
        let (bond, members) = match (constraint.kind, frames) {
            (ConstraintKind::Loop { kind, .. }, Some(mut frames)) => {
                let ground = frames.iter().any(|f| f.node.is_none());
                match closure::<f64>(&kind, &[]).is_joint() {
                    true if ground => frames.sort_by_key(|f| f.node.is_some()),
                    false if ground && matches!(kind, LoopKind::Distance { .. }) => {
                        frames.sort_by_key(|f| f.node.is_none())
                    }
                    _ => {}
                }
                let ways = frames.each_ref().map(|f| f.node.map_or(Vec::new(), |i| ancestors(plan, i)));
                let [a, b] = &ways;
                let inward = |own: &[usize], other: &[usize]| {
                    own.iter().copied().take_while(|i| !other.contains(i)).collect::<Vec<_>>()
                };
                let paths = [inward(a, b), inward(b, a)].map(|mut path| {
                    path.reverse();
                    path
                });
                let members: Vec<Option<usize>> = frames.iter().map(|f| f.node).collect();
                (PlanBond::Cut { kind, frames: Box::new(frames), paths }, members)
            }
            (ConstraintKind::Coupling { terms, offset }, _) => {
                let node = |joint: usize| plan.nodes.iter().position(|n| n.joint.0 == joint);
                let terms: Vec<(usize, Value)> =
                    terms.into_iter().filter_map(|(joint, ratio)| Some((node(joint)?, ratio))).collect();
                let members = terms.iter().map(|(i, _)| Some(*i)).collect();
                (PlanBond::Coupling { terms, offset }, members)
            }
            (ConstraintKind::Loop { .. }, None) => continue,
        };
        let count = match &bond {
            PlanBond::Cut { kind, .. } => closure::<f64>(kind, &[]).rows(),
            PlanBond::Coupling { .. } => 1,
        };
        let first = plan.dims.rows;
        plan.dims.rows += count;
        let slots: Vec<usize> = (0..count).map(|k| plan.unknowns.len() + k).collect();
        plan.unknowns.extend((first..first + count).map(Unknown::Row));
        open(plan, &slots, &bond, &members);
        let velocities = velocities(plan, &cycle(&bond));
        let decay = constraint.decay;
        plan.constraints.push(PlanConstraint { name: constraint.name, bond, slots, first, velocities, decay });
    }
}

/// Closes the columns of rows along which nothing can move whatever the coordinates are: those of a pin that closes a loop of
/// parallel pins, three of five. The structure of the tree says so, in zeros.
pub fn rest_idle(plan: &mut Plan) {
    if plan.constraints.is_empty() {
        return;
    }
    let graph = Graph::default();
    let given = SymbolicInputs::new(&graph, plan, Output::PositionCorrection.spec(), &Options::default());
    let tree: Tree<Expr> = plan.tree(&given.params);
    let mut w = Workspace::new(&tree);
    let [mut phi, mut pivots] = [plan.dims.rows, plan.dims.rows].map(|n| vec![Expr::Const(0.0); n]);
    let mut dq = vec![Expr::Const(0.0); plan.dims.nv];
    let sweeps = Sweeps { tree: &tree, trace: &graph };
    sweeps.position_correction(&given.q, &given.inputs(), &mut w, &mut phi, &mut dq, &mut pivots);
    let rows = plan.constraints.iter().flat_map(|c| c.slots.iter().zip(c.first..));
    let idle: Vec<usize> =
        rows.filter(|(_, r)| matches!(pivots[*r], Expr::Const(x) if x == 0.0)).map(|(g, _)| *g).collect();
    for node in &mut plan.nodes {
        node.elimination.retain_columns(|g| !idle.contains(&g));
    }
    plan.solve_at_ground.retain(|g| !idle.contains(g));
}

/// Nodes whose freedoms a constraint binds.
fn cycle(bond: &PlanBond) -> Vec<usize> {
    match bond {
        PlanBond::Cut { paths, .. } => paths.concat(),
        PlanBond::Coupling { terms, .. } => terms.iter().map(|(i, _)| *i).collect(),
    }
}

/// Velocities of nodes, in ascending order.
fn velocities(plan: &Plan, nodes: &[usize]) -> Vec<usize> {
    let each = nodes.iter().map(|&i| &plan.nodes[i]).filter_map(|node| match node.source {
        Source::State { v, .. } => Some(v..v + node.kind.nv()),
        Source::Drive { .. } => None,
    });
    let all: BTreeSet<usize> = each.flatten().collect();
    all.into_iter().collect()
}

/// Marks the nodes where the columns of the rows `slots` are open, and where they are solved: where all paths have met, and all
/// coordinates shared by several joints of the cycle have been solved.
fn open(plan: &mut Plan, slots: &[usize], bond: &PlanBond, members: &[Option<usize>]) {
    let ways: Vec<Vec<usize>> = members.iter().map(|i| i.map_or(Vec::new(), |i| ancestors(plan, i))).collect();
    let cycle = cycle(bond);
    let shared: Vec<usize> = cycle.iter().filter_map(|&i| plan.nodes[i].elimination.unknown).collect();
    let solved = |i: usize| {
        let node = &plan.nodes[i];
        shared
            .iter()
            .filter(|g| node.elimination.solve_before.contains(g) || node.elimination.solve_after.contains(g))
            .count()
    };
    let at_ground = shared.iter().any(|g| plan.solve_at_ground.contains(g));
    let longest = ways.iter().max_by_key(|way| way.len()).cloned().unwrap_or_default();
    // A member that is its own base, as that of a coupling, is eliminated before the row.
    let base = longest.iter().copied().find(|i| {
        let met = ways.iter().all(|way| way.contains(i));
        let inboard = |k: usize| ancestors(plan, *i).iter().skip(1).any(|&a| a == k);
        met && !at_ground && !(0..plan.nodes.len()).any(|k| inboard(k) && solved(k) > 0)
    });
    let opened: Vec<usize> = ways.iter().flatten().copied().collect();
    let outboard = |i: usize| base.is_none_or(|b| i != b && ancestors(plan, i).contains(&b));
    let opened: Vec<usize> = opened.into_iter().filter(|&i| outboard(i)).collect();
    for i in opened {
        for g in slots {
            if !plan.nodes[i].elimination.open.contains(g) {
                plan.nodes[i].elimination.open.push(*g);
            }
        }
    }
    let Some(base) = base else {
        plan.solve_at_ground.extend(slots);
        return;
    };
    let after = cycle.contains(&base) || plan.nodes[base].elimination.solve_after.iter().any(|g| shared.contains(g));
    let node = &mut plan.nodes[base];
    if after { &mut node.elimination.solve_after } else { &mut node.elimination.solve_before }.extend(slots);
}

/// A kind of loop as the sweeps know it.
fn closure<S: Scalar>(kind: &LoopKind, params: &[S]) -> Closure<S> {
    let of = |v: Value| match v {
        Value::Const(x) => S::constant(x),
        // The number of rows is asked for without parameters.
        Value::Param(k) => params.get(k).copied().unwrap_or(S::one()),
    };
    match *kind {
        LoopKind::Revolute { .. } => Closure::Revolute,
        LoopKind::Prismatic { .. } => Closure::Prismatic,
        LoopKind::Cylindrical { .. } => Closure::Cylindrical,
        LoopKind::Helical { pitch, .. } => Closure::Helical { pitch: of(pitch) },
        LoopKind::Universal { .. } => Closure::Universal,
        LoopKind::Planar { .. } => Closure::Planar,
        LoopKind::Spherical => Closure::Spherical,
        LoopKind::Fixed => Closure::Fixed,
        LoopKind::Distance { length } => Closure::Distance { length: of(length) },
        LoopKind::PointOnLine { .. } => Closure::PointOnLine,
        LoopKind::PointOnPlane { .. } => Closure::PointOnPlane,
        LoopKind::PointOnCylinder { radius, .. } => Closure::PointOnCylinder { radius: of(radius) },
        LoopKind::RollingDisc { radius, .. } => Closure::RollingDisc { radius: of(radius) },
        LoopKind::RollingBall { radius, .. } => Closure::RollingBall { radius: of(radius) },
        LoopKind::KnifeEdge { .. } => Closure::KnifeEdge,
        LoopKind::Pfaffian { row } => Closure::Pfaffian { row: row.map(of) },
    }
}

impl Plan {
    /// Coordinates that the model starts with: those of its `start`s, neutral where it states none.
    pub fn start(&self) -> Vec<f64> {
        let mut q = vec![0.0; self.dims.nq];
        for slot in &self.slots {
            let Some(Source::State { q: at, .. }) = slot.at else { continue };
            let kind = self.model.joints[slot.joint].kind;
            let stated = self.model.starts.iter().find(|s| s.joint == slot.joint);
            if let Some(stated) = stated {
                q[at..].iter_mut().zip(&stated.q).for_each(|(q, stated)| *q = *stated);
            }
            if let JointKind::Spherical | JointKind::Floating = kind {
                let turn = &mut q[at + kind.nq() - 4..at + kind.nq()];
                match turn.iter().fold(0.0_f64, |n, x| n.hypot(*x)) {
                    0.0 => turn[3] = 1.0,
                    norm => turn.iter_mut().for_each(|x| *x /= norm),
                }
            }
        }
        q
    }

    /// Velocities of joints that stay where they start when loops are closed.
    pub fn held(&self) -> Vec<bool> {
        let mut held = vec![false; self.dims.nv];
        for start in self.model.starts.iter().filter(|s| s.held) {
            let slot = self.slots.iter().find(|s| s.joint == start.joint);
            if let Some(Source::State { v, .. }) = slot.and_then(|s| s.at) {
                held[v..v + self.model.joints[start.joint].kind.nv()].fill(true);
            }
        }
        held
    }
}

impl PlanConstraint {
    /// Nodes that it acts on.
    pub(super) fn nodes(&self) -> impl Iterator<Item = usize> + '_ {
        let (frames, terms) = match &self.bond {
            PlanBond::Cut { frames, .. } => (Some(frames.iter().filter_map(|f| f.node)), None),
            PlanBond::Coupling { terms, .. } => (None, Some(terms.iter().map(|(i, _)| *i))),
        };
        frames.into_iter().flatten().chain(terms.into_iter().flatten())
    }

    /// Nodes whose freedoms it binds.
    pub(super) fn cycle(&self) -> Vec<usize> {
        cycle(&self.bond)
    }

    /// With other numbers for the nodes, all of which have one.
    pub(super) fn renumbered(&self, numbers: &[Option<usize>]) -> PlanConstraint {
        let mut out = self.clone();
        let renumber = |i: &mut usize| *i = numbers[*i].unwrap_or_default();
        match &mut out.bond {
            PlanBond::Cut { frames, paths, .. } => {
                frames.iter_mut().filter_map(|f| f.node.as_mut()).for_each(renumber);
                paths.iter_mut().flatten().for_each(renumber);
            }
            PlanBond::Coupling { terms, .. } => terms.iter_mut().map(|(i, _)| i).for_each(renumber),
        }
        out
    }

    /// What of it decides which form is best.
    pub(super) fn letters(&self) -> String {
        match &self.bond {
            PlanBond::Cut { kind, frames, paths } => {
                format!("c{:?}{:?}{paths:?}", std::mem::discriminant(kind), frames.each_ref().map(|f| f.node))
            }
            PlanBond::Coupling { terms, .. } => format!("g{}", terms.len()),
        }
    }

    /// The constraint over any scalar.
    pub(super) fn instantiate<S: Scalar>(&self, params: &[S]) -> Constraint<S> {
        let bond = match &self.bond {
            PlanBond::Cut { kind, frames, paths: [path_a, path_b] } => {
                let [a, b] = frames.each_ref().map(|f| TreeFrame { node: f.node, place: steps(&f.pose, params) });
                let closure = closure(kind, params);
                Bond::Cut(Cut { closure, a, b, path_a: path_a.clone(), path_b: path_b.clone() })
            }
            PlanBond::Coupling { terms, offset } => Bond::Coupling {
                terms: terms.iter().map(|(i, ratio)| (*i, value(*ratio, params))).collect(),
                offset: value(*offset, params),
            },
        };
        let decay = (self.decay != Value::ZERO).then(|| value(self.decay, params));
        let (slots, velocities) = (self.slots.clone(), self.velocities.clone());
        Constraint { bond, slots, first: self.first, velocities, decay, compliance: None }
    }
}
