//! Which pairs of shapes overlap where a mechanism starts.

use mbd_runtime::constrained::{close, Closing};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::system::Constrained;

use super::elementary::{Core, Rounded};
use super::pairs::Candidate;
#[cfg(feature = "hulls")]
use crate::inertia::dot;
use crate::inertia::{apply, transpose};
use crate::model::{Frame, Model, ShapeKind};
use crate::options::PlanOptions;
use crate::plan::Plan;

/// Overlaps up to this one are rounding, m.
const ROUNDING: f64 = 1e-10;

/// Contacts that are looked at together, or those of one pair: what an interpreter stores grows with the square of their number.
const TOGETHER: usize = 64;

/// Whether the shapes of each pair overlap where the motion starts, with all parameters at their defaults and loops closed.
pub(super) fn overlapping(model: &Model, candidates: &[Candidate]) -> Vec<bool> {
    if candidates.is_empty() {
        return Vec::new();
    }
    let mut trial = model.clone();
    // Stops bound where it starts.
    trial.contacts.retain(|contact| contact.stop().is_some());
    let frame = |shape: &crate::model::Shape| {
        let mount = &shape.mount;
        Frame { name: shape.name.clone(), body: mount.body, placement: mount.placement }
    };
    trial.frames = model.shapes.iter().map(frame).collect();
    let plan = Plan::new(&trial, PlanOptions::default().snap);
    let params = plan.default_params();
    let mut starts = vec![plan.start()];
    // Where the description states none, a motion may start within the ranges of the joints as well.
    let mut moved = starts[0].clone();
    plan.move_into_ranges(&mut moved);
    if moved != starts[0] {
        starts.push(moved);
    }
    for q in starts.iter_mut().filter(|_| !plan.constraints.is_empty()) {
        let mut closed = q.clone();
        // A loop that does not close is reported by whoever starts a motion there.
        if close(&mut plan.interpreter::<f64>(&params), &mut closed, &Closing::holding(&plan.held())).is_ok() {
            *q = closed;
        }
    }
    let (mut overlaps, mut rest) = (Vec::with_capacity(candidates.len()), candidates);
    while let Some(first) = rest.first() {
        let (mut count, mut contacts) = (1, first.contacts.len());
        while let Some(next) = rest.get(count).filter(|next| contacts + next.contacts.len() <= TOGETHER) {
            (count, contacts) = (count + 1, contacts + next.contacts.len());
        }
        let (these, others) = rest.split_at(count);
        trial.contacts = these.iter().flat_map(|candidate| candidate.contacts.iter().cloned()).collect();
        overlaps.extend(overlapping_at(&starts, &trial, these));
        rest = others;
    }
    overlaps
}

/// The same at any of these coordinates, for a model that has the contacts of the pairs, and a frame on each shape.
fn overlapping_at(starts: &[Vec<f64>], model: &Model, candidates: &[Candidate]) -> Vec<bool> {
    let plan = Plan::new(model, PlanOptions::default().snap);
    let params = plan.default_params();
    let mut full = plan.with_contacts().interpreter::<f64>(&params);
    let (mut residuals, mut entries) = (full.zero_rows(), full.zero_entries());
    let mut all = vec![FrameState::ground(); full.tree().frames.len()];
    let rows = plan.contacts::<f64>();
    let mut found = vec![false; candidates.len()];
    for q in starts {
        full.residuals(q, &mut residuals, &mut entries);
        full.frames(q, &vec![0.0; plan.dims.nv], &mut all);
        // Those of the bodies come first.
        let frames = &all[all.len().saturating_sub(model.frames.len())..];
        let mut first = 0;
        for (found, candidate) in found.iter_mut().zip(candidates) {
            let own = &rows[first..first + candidate.contacts.len()];
            first += candidate.contacts.len();
            let [a, b] = candidate.shapes;
            *found |= own.iter().any(|contact| residuals[contact.row] < -ROUNDING)
                || pierces([&model.shapes[a].kind, &model.shapes[b].kind], [&frames[a], &frames[b]])
                || pierces([&model.shapes[b].kind, &model.shapes[a].kind], [&frames[b], &frames[a]]);
        }
    }
    found
}

/// Whether the line of a capsule goes through the second shape from side to side. Its ends are then outside, and the edges
/// of the other shape may be far, so that no gap tells.
fn pierces([rod, solid]: [&ShapeKind; 2], [at, of]: [&FrameState<f64>; 2]) -> bool {
    let &ShapeKind::Capsule { length, .. } = rod else { return false };
    let inside = |z: f64| {
        let along = apply(&at.rotation, [0.0, 0.0, z]);
        let from = [0, 1, 2].map(|k| at.position[k] + along[k] - of.position[k]);
        apply(&transpose(&of.rotation), from)
    };
    Rounded::new(solid).is_some_and(|solid| solid.is_crossed([inside(-0.5 * length), inside(0.5 * length)]))
}

impl Rounded {
    /// Whether the line between two points goes through a face of the core, whose axes are those of the shape.
    fn is_crossed(&self, [a, b]: [[f64; 3]; 2]) -> bool {
        match self.core {
            Core::Line => false,
            Core::Box(size) => (0..3).any(|k| {
                [-0.5, 0.5].into_iter().any(|side| {
                    let at = side * size[k];
                    crossing([a, b], [a[k] - at, b[k] - at])
                        .is_some_and(|p| (0..3).all(|i| i == k || p[i].abs() <= 0.5 * size[i]))
                })
            }),
            #[cfg(feature = "hulls")]
            Core::Hull(hull) => hull.faces.iter().any(|face| {
                let above = |plane: &mbd_runtime::hull::Plane, p: [f64; 3]| dot(plane.normal, p) - plane.height;
                crossing([a, b], [above(&face.plane, a), above(&face.plane, b)])
                    .is_some_and(|p| face.sides.iter().all(|side| above(side, p) <= 0.0))
            }),
        }
    }
}

/// Where the line between two points at these heights above a plane goes through it.
fn crossing([a, b]: [[f64; 3]; 2], [from, to]: [f64; 2]) -> Option<[f64; 3]> {
    let share = from / (from - to);
    (from * to < 0.0).then(|| [0, 1, 2].map(|k| a[k] + share * (b[k] - a[k])))
}

#[cfg(test)]
mod tests {
    #[cfg(feature = "hulls")]
    use super::super::elementary::corners;
    #[cfg(feature = "hulls")]
    use super::*;

    /// A line crosses a body from side to side, or has an end inside, or passes beside it.
    #[cfg(feature = "hulls")]
    #[test]
    fn lines_cross_faces() {
        let size = [2.0, 2.0, 0.2];
        let hull = ShapeKind::Hull { points: corners(size), rounding: 0.0 };
        for shape in [ShapeKind::Box { size, rounding: 0.0 }, hull] {
            let solid = Rounded::new(&shape).expect("faces");
            for (x, wanted) in [(0.3, true), (0.9, true), (1.1, false)] {
                assert_eq!(solid.is_crossed([[x, 0.2, -3.0], [x, 0.1, 3.0]]), wanted, "{shape:?} {x}");
            }
            assert!(solid.is_crossed([[0.3, 0.2, 0.0], [0.3, 0.2, 3.0]]));
            assert!(!solid.is_crossed([[0.3, 0.2, 0.2], [0.3, 0.2, 3.0]]));
        }
    }
}
