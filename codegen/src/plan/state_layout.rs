//! Correspondences with the state layouts of other programs.

use mbd_runtime::layout::{Form, Layout, Part};
use mbd_runtime::tree::Source;

use crate::plan::{Plan, Slot};

/// The places of the joints in Pinocchio's model of the same URDF: depth first, the children of a link in the
/// alphabetical order of their joints; angles of planar and unbounded joints as cosine and sine.
pub fn pinocchio(plan: &Plan) -> Layout {
    let mut order: Vec<&Slot> = Vec::new();
    visit(plan, &mut order);
    layout(plan, &order, |plan, slot| {
        let joint = &plan.model.joints[slot.joint];
        let spec = joint.kind.spec();
        let unbounded = spec.pinocchio_unbounded.filter(|_| joint.unbounded);
        unbounded.or(spec.pinocchio).unwrap_or_else(|| spec.form())
    })
}

/// The places of the joints in a MuJoCo model whose bodies have the order of this one: quaternions w, x, y, z, the
/// linear velocity of a free joint in world axes.
pub fn mujoco(plan: &Plan) -> Layout {
    let order: Vec<&Slot> = plan.slots.iter().collect();
    layout(plan, &order, |plan, slot| {
        let spec = plan.model.joints[slot.joint].kind.spec();
        spec.mujoco.unwrap_or_else(|| spec.form())
    })
}

fn visit<'a>(plan: &'a Plan, order: &mut Vec<&'a Slot>) {
    let joints = &plan.model.joints;
    // Joints on the ground, then those on every body.
    let mut children = vec![Vec::new(); plan.model.bodies.len() + 1];
    for (k, joint) in joints.iter().enumerate() {
        children[joint.parent.map_or(0, |b| b + 1)].push(k);
    }
    children.iter_mut().for_each(|list| list.sort_by(|&a, &b| joints[b].name.cmp(&joints[a].name)));
    // A stack in place of recursion, because chains may be long.
    let mut stack = std::mem::take(&mut children[0]);
    while let Some(k) = stack.pop() {
        order.extend(Slot::of_joint(&plan.slots, k));
        stack.append(&mut children[joints[k].child + 1]);
    }
}

fn layout(plan: &Plan, order: &[&Slot], form: impl Fn(&Plan, &Slot) -> Form) -> Layout {
    let (mut q_there, mut v_there) = (0, 0);
    let mut parts = Vec::new();
    for slot in order {
        let Some(Source::State { q, v }) = slot.at else { continue };
        let form = form(plan, slot);
        let (_, nq, nv) = form.sizes();
        parts.push(Part { form, q: (q, q_there), v: (v, v_there) });
        q_there += nq;
        v_there += nv;
    }
    Layout { parts }
}
