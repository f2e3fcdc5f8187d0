//! Differences of states: displacements with a component for each velocity, rotations as vectors.

use multibody::codegen::plan::Plan;
use multibody::runtime::integrate::{Chart, Point};
use multibody::runtime::tree::Source;
use multibody::runtime::{Real, System};

/// A component of a displacement.
pub struct Component {
    /// Name: that of the coordinate, or of the joint with the axis of a rotation.
    pub name: String,
    /// Index of the coordinate, where it is a length, m. Other components are angles, rad.
    pub position: Option<usize>,
}

/// The components of a plan's displacements.
pub fn components(plan: &Plan) -> Vec<Component> {
    let coordinates = plan.coordinate_names();
    let mut list = Vec::new();
    for slot in &plan.slots {
        let Some(Source::State { q, .. }) = slot.at else { continue };
        let joint = &plan.model.joints[slot.joint];
        let spec = joint.kind.spec();
        let (nq, nv) = (spec.coordinates.len(), spec.freedoms.len());
        // A quaternion stands behind the positions; its displacement has one component less.
        let plain = if nq == nv { nv } else { nv - 3 };
        list.extend((0..plain).map(|k| Component {
            name: coordinates[q + k].clone(),
            position: (spec.coordinates[k].unit.symbol() == "m").then_some(q + k),
        }));
        let axes = ["x", "y", "z"].into_iter().take(nv - plain);
        list.extend(axes.map(|axis| Component { name: format!("{}.rotation_{axis}", joint.name), position: None }));
    }
    list
}

/// Largest range of a position over coordinates of a run, m; zero where none moves.
pub fn range(components: &[Component], rows: &[Vec<f64>]) -> f64 {
    let ranges = components.iter().filter_map(|c| c.position).map(|k| {
        let values = rows.iter().map(|row| row[k]);
        let [low, high] = values.fold([f64::MAX, f64::MIN], |[low, high], x| [low.min(x), high.max(x)]);
        high - low
    });
    ranges.fold(0.0, f64::max)
}

/// Displacement from the first state to the second, which is near. Rotations are in outer axes.
pub fn displacement<Y>(
    system: &Y,
    from: (&Y::Coordinates, &Y::Momenta),
    to: (&Y::Coordinates, &Y::Momenta),
) -> Y::Momenta
where
    Y: System,
    Y::Scalar: Real,
{
    let mut point = Point::zero(system);
    Chart::correct(system, from, to, &mut point);
    point.x
}
