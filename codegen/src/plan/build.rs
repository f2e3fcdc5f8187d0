//! Builds the plan of a model.

use std::collections::HashMap;

use mbd_runtime::tree::{Dims, Source, WrenchAxes};

use super::structure::{Plan, PlanFrame, RowsThatAct, Slot};
use super::{constraints, elements, frames, row_order, shared};
use crate::model::{self, JointMotion, Model};

impl Plan {
    /// The plan of a model, with its freedoms eliminated one joint at a time. Angles of placements and directions of
    /// axes closer than `snap` to right angles become exact, rad; 0 keeps every number of the description.
    pub fn new(model: &Model, snap: f64) -> Plan {
        let mut notices = Vec::new();
        let elements = elements::elements(model, snap, &mut notices);
        let (dims, slots) = slots(model);
        let mounts = constraints::mounts(model, &elements, snap);
        let framed = frames::choose(model, &elements, &slots, &mounts);
        let mut loops = framed.mounts;
        let contact_frames = loops.split_off(model.constraints.len());
        let mut plan = Plan {
            model: model.clone(),
            snap,
            nodes: framed.nodes,
            dims: Dims { wrenches: model.wrenches.len(), ..dims },
            unknowns: Vec::new(),
            solve_at_ground: Vec::new(),
            frames: framed.frames,
            joint_nodes: framed.joint_nodes,
            slots,
            wrenches: Vec::new(),
            constraints: Vec::new(),
            contact_frames,
            acts: RowsThatAct::All,
            early_tolerance: None,
            notices,
            matrix_depth: 0,
            accelerations: None,
            step: None,
        };
        plan.wrenches = wrenches(model, &plan.frames);
        shared::share(&mut plan);
        constraints::constrain(&mut plan, &model.constraints, &loops);
        row_order::order(&mut plan);
        plan
    }
}

/// Frame index and axes of each wrench.
fn wrenches(model: &Model, frames: &[PlanFrame]) -> Vec<(usize, WrenchAxes)> {
    // Of several frames with one name, the first one counts.
    let places: HashMap<&str, usize> = frames.iter().enumerate().rev().map(|(k, f)| (f.name.as_str(), k)).collect();
    let of = |w: &model::Wrench| {
        let frame = places.get(model.bodies[w.body].name.as_str()).copied();
        let axes = match w.axes {
            model::WrenchAxes::Body => WrenchAxes::Frame,
            model::WrenchAxes::World => WrenchAxes::Ground,
        };
        (frame.unwrap_or_default(), axes)
    };
    model.wrenches.iter().map(of).collect()
}

/// Indices of the moving joints into the state and the drives, depth first.
fn slots(model: &Model) -> (Dims, Vec<Slot>) {
    let mut dims = Dims::default();
    let mut slots = Vec::new();
    for (k, joint) in model.joints.iter().enumerate() {
        let (nq, nv) = (joint.kind.nq(), joint.kind.nv());
        if nv == 0 {
            continue;
        }
        let at = match joint.motion {
            JointMotion::Free => {
                let at = Source::State { q: dims.nq, v: dims.nv };
                dims.nq += nq;
                dims.nv += nv;
                Some(at)
            }
            JointMotion::Prescribed => {
                let at = Source::Drive { q: dims.drive_q, v: dims.drive_v };
                dims.drive_q += nq;
                dims.drive_v += nv;
                Some(at)
            }
            JointMotion::Mimic { .. } => None,
        };
        slots.push(Slot { joint: k, at });
    }
    (dims, slots)
}
