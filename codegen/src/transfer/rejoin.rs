//! Models of the same bodies with one joint exchanged: what a transfer leads to.

use mbd_runtime::spatial::Vec3;
use mbd_runtime::transfer::quaternion;

use super::error::RejoinError;
use crate::model::{ConstraintKind, Joint, JointKind, JointMotion, Model, Placement, Rotation, Value};
use crate::plan::Rigid;
use crate::rounded_once::{atan2, norm};

impl Placement {
    /// A pose as a constant placement, to the last digits.
    pub fn of_pose(pose: &Rigid) -> Placement {
        let [x, y, z, w] = quaternion(&pose.rot);
        let axis: Vec3<f64> = [x, y, z];
        let angle = Value::Const(2.0 * atan2(norm(axis), w));
        let rotation = if axis == [0.0; 3] { Rotation::NONE } else { Rotation::AxisAngle { axis, angle } };
        Placement { xyz: pose.pos.map(Value::Const), rotation }
    }
}

impl Model {
    /// The same bodies after a joint has been cut (6.4 of the thesis): its child and all that the child carries float.
    /// The joint keeps its name; its coordinates are the pose of the child in the ground.
    ///
    /// # Errors
    /// [`RejoinError`]: there is no such joint, or something refers to its coordinate.
    pub fn cut(&self, joint: &str) -> Result<Model, RejoinError> {
        let found = self.joints.iter().find(|j| j.name == joint);
        let found = found.ok_or_else(|| RejoinError::NoJoint { joint: joint.into() })?;
        let body = self.bodies[found.child].name.clone();
        self.rejoined(&body, None, JointKind::Floating, Placement::IDENTITY)
    }

    /// The same bodies with another joint above `body`, free and without passive elements: of kind `kind`, from the
    /// body `parent` (`None`: the ground), with the child's frame at `placement` in the parent's at zero coordinates.
    /// The joint keeps its name.
    ///
    /// # Errors
    /// [`RejoinError`]: there is no such body, the parent hangs on the body, or something refers to the coordinate of
    /// the joint that goes.
    pub fn rejoined(
        &self,
        body: &str,
        parent: Option<&str>,
        kind: JointKind,
        placement: Placement,
    ) -> Result<Model, RejoinError> {
        let index = |name: &str| {
            let found = self.bodies.iter().position(|b| b.name == name);
            found.ok_or_else(|| RejoinError::NoBody { body: name.into() })
        };
        let child = index(body)?;
        let parent = parent.map(index).transpose()?;
        let Some(at) = self.joints.iter().position(|j| j.child == child) else {
            return Err(RejoinError::NoBody { body: body.into() });
        };
        self.refuse_references(at)?;
        // The bodies that go with it.
        let mut carried = vec![false; self.bodies.len()];
        carried[child] = true;
        for joint in &self.joints {
            carried[joint.child] |= joint.parent.is_some_and(|p| carried[p]);
        }
        if let Some(p) = parent.filter(|&p| carried[p]) {
            return Err(RejoinError::Cycle { body: body.into(), parent: self.bodies[p].name.clone() });
        }
        // Joints stay depth first: what is carried follows the last joint of the new parent's own subtree, or all.
        let (moved, stay): (Vec<usize>, Vec<usize>) =
            (0..self.joints.len()).partition(|&k| carried[self.joints[k].child]);
        let mut above = vec![parent.is_none(); self.bodies.len()];
        if let Some(p) = parent {
            above[p] = true;
        }
        let mut place = stay.len();
        if parent.is_some() {
            for (k, &j) in stay.iter().enumerate() {
                let joint = &self.joints[j];
                if above[joint.child] || joint.parent.is_some_and(|p| above[p]) {
                    above[joint.child] = true;
                    place = k + 1;
                }
            }
        }
        let order = [&stay[..place], &moved, &stay[place..]].concat();
        let mut number = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, &old)| number[old] = new);

        let mut out = self.clone();
        let name = self.joints[at].name.clone();
        out.joints[at] =
            Joint { origin: self.joints[at].origin.clone(), ..Joint::new(name, kind, parent, child, placement) };
        out.joints = order.iter().map(|&k| out.joints[k].clone()).collect();
        for joint in &mut out.joints {
            if let JointMotion::Mimic { leader, .. } = &mut joint.motion {
                *leader = number[*leader];
            }
        }
        let kinds = out.constraints.iter_mut().map(|c| &mut c.kind).chain(out.contacts.iter_mut().map(|c| &mut c.kind));
        for kind in kinds {
            if let ConstraintKind::Coupling { terms, .. } = kind {
                terms.iter_mut().for_each(|(joint, _)| *joint = number[*joint]);
            }
        }
        out.starts.retain(|start| start.joint != at);
        out.starts.iter_mut().for_each(|start| start.joint = number[start.joint]);
        Ok(out)
    }

    /// Nothing may refer to the coordinate of a joint that goes.
    fn refuse_references(&self, at: usize) -> Result<(), RejoinError> {
        let used = |by: String| Err(RejoinError::Used { joint: self.joints[at].name.clone(), by });
        for joint in &self.joints {
            if matches!(joint.motion, JointMotion::Mimic { leader, .. } if leader == at) {
                return used(format!("joint `{}`, which mimics it,", joint.name));
            }
        }
        let constraints = self.constraints.iter().map(|c| (c.word(), &c.name, &c.kind));
        for (word, name, kind) in constraints.chain(self.contacts.iter().map(|c| ("contact", &c.name, &c.kind))) {
            if matches!(kind, ConstraintKind::Coupling { terms, .. } if terms.iter().any(|(joint, _)| *joint == at)) {
                return used(format!("{word} `{name}`"));
            }
        }
        Ok(())
    }
}
