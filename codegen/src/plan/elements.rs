//! Splits joints into elementary joints, and merges bodies that are connected by fixed joints.

use mbd_runtime::tree::Kind;

use super::early::partners;
use super::placement::{direction, placement, rotation};
use super::structure::PoseStep;
use crate::model::{ConstraintKind, Model, Mount, Value};

/// An elementary joint. Its *element frame* is the child body's frame, or for the first half of a joint of two halves
/// that frame at zero coordinates of the second.
#[derive(Clone, Debug)]
pub struct Element {
    /// The element that carries it.
    pub parent: Option<usize>,
    /// Element frame in the parent's element frame, at zero coordinates.
    pub pose: Vec<PoseStep>,
    /// Kind.
    pub kind: Kind<Value>,
    /// Unit axis in the element frame, for joints that have one.
    pub axis: Option<[f64; 3]>,
    /// Model joint and first freedom in it.
    pub joint: (usize, usize),
    /// Whether the element frame carries the joint's child body.
    pub last: bool,
}

/// A body or frame: element that carries it (`None`: ground) and pose in the element frame.
pub type Carried = (Option<usize>, Vec<PoseStep>);

/// The elementary joints of a model.
#[derive(Clone, Debug)]
pub struct Elements {
    /// Joints, parents first.
    pub list: Vec<Element>,
    /// For every body of the model.
    pub bodies: Vec<Carried>,
    /// For every frame of the model.
    pub frames: Vec<Carried>,
    /// Rotation of each body's inertia axes in its body frame.
    pub inertia_axes: Vec<Vec<PoseStep>>,
}

/// Elementary joints, merged bodies, snapped angles.
pub fn elements(model: &Model, snap: f64, notices: &mut Vec<String>) -> Elements {
    let mut list: Vec<Element> = Vec::new();
    let mut bodies: Vec<Carried> = vec![(None, Vec::new()); model.bodies.len()];
    for (k, joint) in platforms_first(model).into_iter().map(|k| (k, &model.joints[k])) {
        let mut worst = 0.0_f64;
        let mut note = |off: f64| worst = worst.max(off);
        let (carrier, mut pose) = joint.parent.map_or((None, Vec::new()), |b| bodies[b].clone());
        pose.extend(placement(&joint.placement, snap, &mut note));
        let halves = joint.kind.elements();
        let mut at: Carried = (carrier, pose);
        let count = halves.len();
        for (half, (kind, axis)) in halves.into_iter().enumerate() {
            let axis = axis.map(|a| direction(a, snap, &mut note));
            let (parent, pose) = std::mem::replace(&mut at, (Some(list.len()), Vec::new()));
            list.push(Element { parent, pose, kind, axis, joint: (k, half), last: half + 1 == count });
        }
        bodies[joint.child] = at;
        if worst > 0.0 {
            notices
                .push(format!("joint `{}`: an angle {worst:.1e} rad off a right angle is taken as exact", joint.name));
        }
    }
    let mut quiet = |_: f64| {};
    let frames = model.frames.iter().map(|frame| {
        let (carrier, mut pose) = frame.body.map_or((None, Vec::new()), |b| bodies[b].clone());
        pose.extend(placement(&frame.placement, snap, &mut quiet));
        (carrier, pose)
    });
    let frames = frames.collect();
    let axes = model.bodies.iter().map(|b| rotation(&b.inertia_axes, snap, &mut |_| {}));
    Elements { inertia_axes: axes.collect(), list, bodies, frames }
}

/// Numbers of the joints, parents first: in the order of the model, but branches from the ground that loops bind to several
/// others come before them, so that they are eliminated after these ([`super::early`]).
fn platforms_first(model: &Model) -> Vec<usize> {
    // Of every body, the first joint that moves on its way from the ground.
    let mut roots: Vec<Option<usize>> = vec![None; model.bodies.len()];
    for (k, joint) in model.joints.iter().enumerate() {
        let inner = joint.parent.and_then(|body| roots[body]);
        roots[joint.child] = inner.or((joint.kind.nv() > 0).then_some(k));
    }
    let root = |mount: &Mount| roots[mount.body?];
    let pairs = model.constraints.iter().filter_map(|constraint| match &constraint.kind {
        ConstraintKind::Loop { first, second, .. } => Some([root(first)?, root(second)?]),
        ConstraintKind::Coupling { .. } => None,
    });
    let bound = partners(model.joints.len(), pairs);
    // Bodies that are fixed to the ground carry others, and have no elements.
    let class = |k: usize| roots[model.joints[k].child].map(|root| bound[root].len() < 2);
    let of = |wanted: Option<bool>| (0..model.joints.len()).filter(move |&k| class(k) == wanted);
    of(None).chain(of(Some(false))).chain(of(Some(true))).collect()
}
