//! Inertias of what fixed joints connect.

use crate::inertia::{about_com, moved, own, sum, Inertia};
use crate::model::{Body, Joint, Param};

/// For each body the inertia about the centre of mass, `[xx, yy, zz, xy, xz, yz]`, of all that fixed joints connect it
/// with, and the mass; `None` for what is fixed to the ground. Joints stand depth first; a body without one is alone.
pub(super) fn together(bodies: &[Body], joints: &[Joint], params: &[Param]) -> Vec<Option<(f64, [f64; 6])>> {
    let mut total: Vec<Inertia> = bodies.iter().map(|body| own(body, params)).collect();
    let mut root: Vec<Option<usize>> = (0..bodies.len()).map(Some).collect();
    let fixed = || joints.iter().filter(|joint| joint.kind.nv() == 0);
    for joint in fixed() {
        root[joint.child] = joint.parent.and_then(|parent| root[parent]);
    }
    for joint in fixed().rev() {
        if let Some(parent) = joint.parent {
            total[parent] = sum(total[parent], moved(total[joint.child], &joint.placement, params));
        }
    }
    let about_com = |i: Inertia| {
        let (mass, _, entries) = about_com(i);
        (mass, entries)
    };
    root.iter().map(|root| root.map(|root| about_com(total[root]))).collect()
}
