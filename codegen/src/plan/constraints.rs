//! Loops, couplings and contacts of the model on the nodes of the plan.

use std::collections::BTreeSet;

use mbd_runtime::spatial::Axis;
use mbd_runtime::tree::{Source, Unknown};

use super::elements::{Carried, Elements};
use super::placement::{constant, direction, placement};
use super::rigid::Rigid;
use super::structure::{Plan, PlanBond, PlanConstraint, PlanFrame, PoseStep, RowsThatAct};
use crate::model::{Constraint, ConstraintKind, LoopKind, Model, Mount, Stands, Value};

/// Frames of loops and then of contacts: the element that carries each, and its pose with the axes that the rows need.
pub fn mounts(model: &Model, elements: &Elements, snap: f64) -> Vec<Option<[Carried; 2]>> {
    let carried = |mount: &Mount, turn: Option<PoseStep>| {
        let (carrier, mut pose) = mount.body.map_or((None, Vec::new()), |b| elements.bodies[b].clone());
        pose.extend(placement(&mount.placement, snap, &mut |_| {}));
        pose.extend(turn);
        (carrier, pose)
    };
    let loops = model.constraints.iter().map(|c| &c.kind);
    let each = loops.chain(model.contacts.iter().map(|c| &c.kind)).map(|kind| match kind {
        ConstraintKind::Loop { kind, first, second } => {
            let [a, b] = turns(kind, snap);
            Some([carried(first, a), carried(second, b)])
        }
        ConstraintKind::Coupling { .. } => None,
    });
    each.collect()
}

/// Rotations of the two frames that give them the axes that the rows need.
fn turns(kind: &LoopKind, snap: f64) -> [Option<PoseStep>; 2] {
    let to = |axis: [f64; 3]| Rigid::align_z(direction(axis, snap, &mut |_| {}));
    let z = |axis: [f64; 3]| {
        let turn = to(axis);
        (turn.rot != Rigid::IDENTITY.rot).then_some(PoseStep::Rotate(turn.rot))
    };
    let quarter = |axis, s| PoseStep::Turn { axis, c: 0.0, s };
    let after = |axis: [f64; 3], step: PoseStep| {
        constant(&[PoseStep::Rotate(to(axis).rot), step]).map(|pose| PoseStep::Rotate(pose.rot))
    };
    let mut turns = [None, None];
    for (direction, axis) in kind.spec().directions.iter().zip(kind.directions()) {
        let turn = match direction.along {
            Axis::X => after(axis, quarter(Axis::Y, -1.0)),
            Axis::Y => after(axis, quarter(Axis::X, 1.0)),
            Axis::Z => z(axis),
        };
        if direction.stands != Stands::InSecond {
            turns[0] = turn;
        }
        if direction.stands != Stands::InFirst {
            turns[1] = turn;
        }
    }
    turns
}

/// Puts constraints on the nodes, after [`super::shared::share`]. `frames` are theirs of [`mounts`].
pub fn constrain(plan: &mut Plan, constraints: &[Constraint], frames: &[Option<[PlanFrame; 2]>]) {
    for (constraint, frames) in constraints.iter().cloned().zip(frames.iter().cloned()) {
        let (bond, members) = match (constraint.kind, frames) {
            (ConstraintKind::Loop { kind, .. }, Some(mut frames)) => {
                let ground = frames.iter().any(|f| f.node.is_none());
                match kind.closure().is_joint() {
                    true if ground => frames.sort_by_key(|f| f.node.is_some()),
                    false if ground && matches!(kind, LoopKind::Distance { .. }) => {
                        frames.sort_by_key(|f| f.node.is_none())
                    }
                    _ => {}
                }
                let ways = frames.each_ref().map(|f| f.node.map_or(Vec::new(), |i| plan.ancestors(i)));
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
            PlanBond::Cut { kind, .. } => kind.closure().rows(),
            PlanBond::Coupling { .. } => 1,
        };
        let first = plan.dims.rows;
        let entry = plan.constraints.last().map_or(0, |c| c.entry + c.slots.len() * c.velocities.len());
        plan.dims.rows += count;
        let slots: Vec<usize> = (0..count).map(|k| plan.unknowns.len() + k).collect();
        plan.unknowns.extend((first..first + count).map(Unknown::Row));
        open(plan, &slots, &bond, &members);
        let velocities = velocities(plan, &bond.cycle());
        let decay = constraint.decay;
        let (name, passes) = (constraint.name, Vec::new());
        plan.constraints.push(PlanConstraint { name, bond, slots, passes, first, entry, velocities, decay });
    }
}

impl Plan {
    /// The plan with the rows of all contacts after those of the constraints, all of which act: for gaps.
    pub fn with_contacts(&self) -> Plan {
        let mut plan = self.clone();
        let contacts = self.model.contacts.iter();
        let contacts = contacts.map(|c| Constraint::new(c.name.clone(), c.kind.clone(), Value::ZERO));
        constrain(&mut plan, &contacts.collect::<Vec<_>>(), &self.contact_frames);
        plan.contact_frames.clear();
        plan.accelerations = self.accelerations.as_ref().map(|other| Box::new(other.with_contacts()));
        plan
    }
}

impl Plan {
    /// The plan in which only some rows act, one entry for each row. Rows keep their numbers. With every choice of rows,
    /// those that act are eliminated in the same order.
    pub fn acting(&self, acts: &[bool]) -> Plan {
        let mut plan = self.clone();
        plan.retain_rows(acts);
        plan.acts = RowsThatAct::Some(Box::new((self.clone(), acts.to_vec())));
        plan
    }

    /// Whether the rows of contacts are among its rows.
    pub fn has_contacts(&self) -> bool {
        !self.model.contacts.is_empty() && self.contact_frames.is_empty()
    }

    fn retain_rows(&mut self, acts: &[bool]) {
        let silent: Vec<usize> = self
            .constraints
            .iter()
            .flat_map(|c| c.passes.iter().chain([&c.slots]).map(|slots| (c.first, slots)))
            .flat_map(|(first, slots)| slots.iter().enumerate().filter(move |(k, _)| !acts[first + k]).map(|(_, g)| *g))
            .collect();
        self.close_columns(&silent);
        self.constraints.retain(|c| acts[c.first..c.first + c.slots.len()].contains(&true));
        if let Some(other) = &mut self.accelerations {
            other.retain_rows(acts);
        }
    }

    /// The plan whose rows act by numbers, the field `acts` of generated code.
    pub fn masked(&self) -> Plan {
        Plan { acts: RowsThatAct::Input, ..self.clone() }
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

/// Marks the nodes where the columns of the rows `slots` are open, and where they are solved: where all paths have met,
/// and all coordinates shared by several joints of the cycle have been solved.
fn open(plan: &mut Plan, slots: &[usize], bond: &PlanBond, members: &[Option<usize>]) {
    let ways: Vec<Vec<usize>> = members.iter().map(|i| i.map_or(Vec::new(), |i| plan.ancestors(i))).collect();
    let cycle = bond.cycle();
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
    // All ways end at the ground: where they have met, they are the same.
    let same = |way: &Vec<usize>| longest.iter().rev().zip(way.iter().rev()).take_while(|(a, b)| a == b).count();
    let met = &longest[longest.len() - ways.iter().map(same).min().unwrap_or(0)..];
    // A coordinate that is solved at its own node, as in a coupling, is eliminated before the row.
    let first = met.iter().rposition(|&i| solved(i) > 0).unwrap_or(0);
    let base = met.get(first).copied().filter(|_| !at_ground);
    let opened = ways.iter().flat_map(|way| way.iter().copied().take_while(|i| Some(*i) != base));
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
