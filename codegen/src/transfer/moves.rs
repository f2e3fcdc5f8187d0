//! How a state is carried over by generated code: from where each joint of the new model takes its coordinates.

use std::fmt;

use mbd_runtime::tree::Source;

use crate::model::{Joint, JointKind, JointMotion, Model, Placement};
use crate::plan::{Plan, Slot};

/// Coordinates and velocities of a joint in the new model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Move {
    /// Where they go.
    pub to: Source,
    /// From where they come.
    pub from: Origin,
    /// Numbers of coordinates and of velocities.
    pub sizes: (usize, usize),
}

/// Where coordinates and velocities come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Origin {
    /// The same joint of the old model.
    Joint(Source),
    /// The poses and velocities of two bodies (of the new model), `None` for the ground.
    Bodies(Option<usize>, usize),
}

/// Reason why generated code cannot carry a state over to another model. [`Transfer`](super::Transfer) can.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoCode {
    /// The models do not have the same parameters, or not the same bodies with the same inertia.
    Bodies {
        /// What differs.
        what: String,
    },
    /// A joint of the new model is neither one of the old one nor a floating one without placement.
    Joint {
        /// Its name.
        joint: String,
    },
    /// The new model has loops or couplings.
    Constraints,
}

impl fmt::Display for NoCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NoCode::Bodies { what } => {
                write!(f, "{what} differs: both models need the same parameters, and the same bodies by name")
            }
            NoCode::Joint { joint } => write!(
                f,
                "joint `{joint}` of the new model is neither the same in the old one (free or prescribed) nor a floating \
                 joint without `xyz`, `rpy` and `rotate`; `codegen::transfer::Transfer` carries over to any joint"
            ),
            NoCode::Constraints => write!(
                f,
                "the new model has loops or couplings; `codegen::transfer::Transfer` carries over to those"
            ),
        }
    }
}

impl std::error::Error for NoCode {}

/// The moves of all joints, in the order of the new model.
pub(crate) fn moves(from: &Plan, to: &Plan) -> Result<Vec<Move>, NoCode> {
    let (old, new) = (&from.model, &to.model);
    if !new.constraints.is_empty() {
        return Err(NoCode::Constraints);
    }
    let differs = |what: String| Err(NoCode::Bodies { what });
    if old.params != new.params {
        return differs("a parameter".into());
    }
    for (a, b) in [(old, new), (new, old)] {
        if let Some(body) = a.bodies.iter().find(|body| !b.bodies.contains(body)) {
            return differs(format!("body `{}`", body.name));
        }
    }
    let mut moves = Vec::new();
    for (k, joint) in new.joints.iter().enumerate() {
        let no_code = || NoCode::Joint { joint: joint.name.clone() };
        let before = old.joints.iter().position(|other| other.name == joint.name);
        let same = before.filter(|&b| same(old, &old.joints[b], new, joint));
        let source = |plan: &Plan, k: usize| Slot::of_joint(&plan.slots, k).and_then(|slot| slot.at);
        let spec = joint.kind.spec();
        let Some(to) = source(to, k) else {
            // Fixed, or following another joint.
            let follows = same.is_some_and(|b| leads(old, &old.joints[b]) == leads(new, joint));
            match follows {
                true => continue,
                false => return Err(no_code()),
            }
        };
        let from = match same.and_then(|b| source(from, b)) {
            Some(source) => Origin::Joint(source),
            None if joint.kind == JointKind::Floating && joint.placement == Placement::IDENTITY => {
                Origin::Bodies(joint.parent, joint.child)
            }
            None => return Err(no_code()),
        };
        moves.push(Move { to, from, sizes: (spec.nq(), spec.nv()) });
    }
    Ok(moves)
}

/// Whether two joints connect the same bodies in the same way.
fn same(old: &Model, a: &Joint, new: &Model, b: &Joint) -> bool {
    let name = |model: &Model, body: Option<usize>| body.map(|body| model.bodies[body].name.clone());
    a.kind == b.kind
        && a.placement == b.placement
        && name(old, a.parent) == name(new, b.parent)
        && name(old, Some(a.child)) == name(new, Some(b.child))
}

/// The leader of a joint that follows one, and how.
fn leads(model: &Model, joint: &Joint) -> Option<(String, crate::model::Value, crate::model::Value)> {
    match joint.motion {
        JointMotion::Mimic { leader, ratio, offset } => Some((model.joints[leader].name.clone(), ratio, offset)),
        _ => None,
    }
}
