//! Parts of a mechanism. The cost of an elimination in a branch hardly depends on the other branches.

use std::mem::discriminant;

use super::structure::{Plan, PlanConstraint, PlanNode, PoseStep};
use crate::model::Value;

impl Plan {
    /// The part of the mechanism that consists of node `i`, its ancestors and its descendants, and the new number of
    /// every node. The rest is removed completely, so that the results of such a plan are those of another mechanism.
    pub(crate) fn branch(&self, i: usize) -> (Plan, Vec<Option<usize>>) {
        let mut keep = vec![false; self.nodes.len()];
        std::iter::successors(Some(i), |&k| self.nodes[k].parent).for_each(|k| keep[k] = true);
        for k in i + 1..self.nodes.len() {
            keep[k] = self.nodes[k].parent.is_some_and(|p| p >= i && keep[p]);
        }
        let mut next = 0..;
        let numbers: Vec<Option<usize>> = keep.iter().map(|k| if *k { next.next() } else { None }).collect();
        let follows: Vec<bool> = (0..self.unknowns.len())
            .map(|g| self.nodes.iter().zip(&keep).any(|(node, keep)| *keep && node.elimination.unknown == Some(g)))
            .collect();
        let inside = |c: &PlanConstraint| c.nodes().all(|k| keep[k]);
        let constraints: Vec<PlanConstraint> =
            self.constraints.iter().filter(|c| inside(c)).map(|c| c.renumbered(&numbers)).collect();
        let rows: Vec<usize> = constraints.iter().flat_map(|c| c.slots.iter().copied()).collect();
        let follows: Vec<bool> = follows.iter().enumerate().map(|(g, follows)| *follows || rows.contains(&g)).collect();
        let left = |list: &[usize]| list.iter().copied().filter(|&g| follows[g]).collect::<Vec<_>>();
        let kept = self.nodes.iter().zip(&keep).filter(|(_, keep)| **keep);
        let nodes = kept.map(|(node, _)| {
            let mut node = PlanNode { parent: node.parent.and_then(|p| numbers[p]), ..node.clone() };
            node.elimination.retain_columns(|g| follows[g]);
            node
        });
        let mut plan = Plan { nodes: nodes.collect(), solve_at_ground: left(&self.solve_at_ground), ..self.clone() };
        // Frames are needed for wrenches only.
        plan.wrenches.retain(|(frame, _)| self.frames[*frame].node.is_some_and(|k| keep[k]));
        for frame in &mut plan.frames {
            frame.node = frame.node.and_then(|k| numbers[k]);
        }
        plan.dims.wrenches = plan.wrenches.len();
        plan.joint_nodes.clear();
        plan.contact_frames.clear();
        plan.constraints = constraints;
        (plan, numbers)
    }

    /// The structure of a plan as text: two plans with the same text differ in numbers only, and have the same best
    /// elimination.
    pub(crate) fn letters(&self) -> String {
        let value = |v: &Value| match v {
            Value::Const(x) if *x == 0.0 => '0',
            Value::Const(x) if x.abs() == 1.0 => '1',
            Value::Const(_) => 'x',
            Value::Param(_) => 'p',
        };
        let number = |x: f64| value(&Value::Const(x));
        let mut letters = String::new();
        // Numbers of the unknowns in the order in which they are met.
        let mut met: Vec<usize> = Vec::new();
        let mut place = |g: &usize| {
            let k = met.iter().position(|other| other == g);
            k.unwrap_or_else(|| {
                met.push(*g);
                met.len() - 1
            })
        };
        for node in &self.nodes {
            let (kind, source) = (discriminant(&node.kind), discriminant(&node.source));
            letters.push_str(&format!("|{:?} {kind:?} {source:?} {}: ", node.parent, node.quarter));
            for step in &node.place {
                match step {
                    PoseStep::Turn { axis, c, s } => {
                        letters.push_str(&format!("t{axis:?}{}{}", number(*c), number(*s)))
                    }
                    PoseStep::TurnBy { axis, angle } => letters.push_str(&format!("b{axis:?}{}", value(angle))),
                    PoseStep::Shift { axis, r } => letters.push_str(&format!("s{axis:?}{}", value(r))),
                    PoseStep::Rotate(m) => letters.extend(m.iter().flatten().map(|x| number(*x))),
                }
            }
            letters.push(' ');
            letters.extend(node.inertia.iter().map(|x| number(*x)));
            let (joint, elimination) = (&self.model.joints[node.joint.0], &node.elimination);
            for list in [&joint.damping, &joint.stiffness, &joint.rest, &joint.armature] {
                letters.push(' ');
                letters.extend(list.iter().map(value));
            }
            letters.push_str(&format!(
                " {}{}{}{} {:?}",
                number(node.phase),
                number(node.slide),
                node.variable.len(),
                node.follow.len(),
                [&elimination.open, &elimination.solve_before, &elimination.solve_after]
                    .map(|list| list.iter().map(&mut place).collect::<Vec<usize>>()),
            ));
        }
        for &(frame, axes) in &self.wrenches {
            letters.push_str(&format!("w{:?}{axes:?}", self.frames[frame].node));
        }
        self.constraints.iter().for_each(|c| letters.push_str(&c.letters()));
        letters
    }
}
