//! Correspondences with the state layouts of other programs.

use mbd_runtime::layout::{Form, Layout, Part};
use mbd_runtime::tree::Source;

use crate::plan::{Plan, Slot};

/// The places of the joints in Pinocchio's model of the same URDF: depth first, the children of a link in the
/// alphabetical order of their joints; angles of planar and unbounded joints as cosine and sine.
pub fn pinocchio(plan: &Plan) -> Layout {
    let mut order: Vec<&Slot> = Vec::new();
    visit(plan, None, &mut order);
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

fn visit<'a>(plan: &'a Plan, body: Option<usize>, order: &mut Vec<&'a Slot>) {
    // A stack in place of recursion, because chains may be long.
    let children = |body: Option<usize>| {
        let mut joints: Vec<usize> =
            (0..plan.model.joints.len()).filter(|&k| plan.model.joints[k].parent == body).collect();
        joints.sort_by(|&a, &b| plan.model.joints[b].name.cmp(&plan.model.joints[a].name));
        joints
    };
    let mut stack = children(body);
    while let Some(k) = stack.pop() {
        order.extend(plan.slots.iter().filter(|s| s.joint == k));
        stack.extend(children(Some(plan.model.joints[k].child)));
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
