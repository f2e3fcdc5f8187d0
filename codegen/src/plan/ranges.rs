//! Positions within the ranges of their joints, for a start that nobody has stated.

use mbd_runtime::tree::Source;

use super::Plan;
use crate::model::{ConstraintKind, Contact, JointMotion, Model};

impl Plan {
    /// Moves coordinates that are outside of the range of their joint, or beyond its stops, to the middle of it; to its end where
    /// it has only one. Joints stay whose position the model states, and those that are part of a loop or a coupling, because
    /// these are often described as closed where they are.
    ///
    /// [`Plan::start`] does not do so: it is what the description says.
    pub fn move_into_ranges(&self, q: &mut [f64]) {
        let (ranges, mut stay) = (ranges(&self.model), closed(&self.model));
        self.model.starts.iter().filter(|start| start.stated).for_each(|start| stay[start.joint] = true);
        for slot in &self.slots {
            let Some(Source::State { q: at, .. }) = slot.at else { continue };
            let ([lower, upper], Some(q)) = (ranges[slot.joint], q.get_mut(at)) else { continue };
            if stay[slot.joint] || lower > upper || (lower..=upper).contains(&*q) {
                continue;
            }
            *q = match [lower, upper].map(f64::is_finite) {
                [true, true] => 0.5 * (lower + upper),
                [true, false] => lower,
                [false, _] => upper,
            };
        }
    }
}

/// What each joint may do by its range and by its stops; all that there is where it has none.
fn ranges(model: &Model) -> Vec<[f64; 2]> {
    let all = [f64::NEG_INFINITY, f64::INFINITY];
    let mut ranges: Vec<[f64; 2]> = model.joints.iter().map(|joint| joint.bounds.range.unwrap_or(all)).collect();
    for (joint, from_below, limit) in model.contacts.iter().filter_map(Contact::stop) {
        let [lower, upper] = &mut ranges[joint];
        match from_below {
            true => *lower = lower.max(limit),
            false => *upper = upper.min(limit),
        }
    }
    ranges
}

/// Which joints are part of a loop or a coupling, themselves or by joints that follow them.
fn closed(model: &Model) -> Vec<bool> {
    let mut above = vec![None; model.bodies.len()];
    for (k, joint) in model.joints.iter().enumerate() {
        above[joint.child] = Some(k);
    }
    let mut found = vec![false; model.joints.len()];
    for constraint in &model.constraints {
        let (first, second) = match &constraint.kind {
            ConstraintKind::Loop { first, second, .. } => (first, second),
            ConstraintKind::Coupling { terms, .. } => {
                terms.iter().for_each(|(joint, _)| found[*joint] = true);
                continue;
            }
        };
        // Joints above both bodies do not belong to the loop.
        let mut passed = vec![false; model.joints.len()];
        for mount in [first, second] {
            let mut body = mount.body;
            while let Some(joint) = body.and_then(|body| above[body]) {
                passed[joint] = !passed[joint];
                body = model.joints[joint].parent;
            }
        }
        found.iter_mut().zip(passed).for_each(|(found, passed)| *found |= passed);
    }
    for k in 0..found.len() {
        let mut follower = k;
        while let (true, JointMotion::Mimic { leader, .. }) = (found[k], &model.joints[follower].motion) {
            found[*leader] = true;
            follower = *leader;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::{self, ImportOptions};

    /// A body on the ground, by a joint of a type and with what else it has.
    fn grounded(body: &str, joint: &str, kind: &str, more: &str) -> String {
        format!(
            "\n[[body]]\nname = \"{body}\"\nmass = 1\ninertia = [1, 1, 1]\n\n[[joint]]\nname = \"{joint}\"\ntype = \"{kind}\"\n\
             child = \"{body}\"\naxis = [1, 0, 0]\n{more}\n"
        )
    }

    /// What moves of the coordinates of a four-bar linkage at zero, beside a slide, a door and two coupled wheels, by name.
    /// `of_door`: what the hinge of the door has beside its limits.
    fn moved(four_bar: &str, of_door: &str) -> Vec<(String, f64)> {
        let text = [
            four_bar.replace("name = \"crank_pin\"", "name = \"crank_pin\"\nrange = [1, 2]"),
            grounded("slide", "track", "prismatic", "range = [1, 2]"),
            grounded("door", "hinge", "revolute", &format!("limits = {{ upper = -1 }}\n{of_door}")),
            grounded("first", "first_axle", "revolute", "limits = [1, 2]"),
            grounded("second", "second_axle", "revolute", ""),
            "[[coupling]]\nname = \"belt\"\njoints = [\"first_axle\", \"second_axle\"]\nratios = [1, -1]\n".to_string(),
        ]
        .concat();
        let model = read::model("fourbar.toml", &text, &ImportOptions::default()).expect("a model").model;
        let plan = Plan::new(&model, 1e-9);
        let mut q = vec![0.0; plan.dims.nq];
        plan.move_into_ranges(&mut q);
        let moved = plan.coordinate_names().into_iter().zip(q).filter(|(_, q)| *q != 0.0);
        moved.collect()
    }

    /// The middle of a range, the one end of limits; but no joint of a loop or a coupling, and none whose position is stated, also
    /// where others state theirs, or velocities.
    #[test]
    fn positions_move_into_ranges() {
        let stated = include_str!("../../../models/mechanisms/fourbar.toml");
        let both = [("track".to_string(), 1.5), ("hinge".to_string(), -1.0)];
        assert_eq!(moved(stated, ""), both);
        let open = stated.lines().filter(|line| !line.starts_with("start") && !line.starts_with("held"));
        let open: String = open.map(|line| format!("{line}\n")).collect();
        assert_eq!(moved(&open, ""), both);
        assert_eq!(moved(&open, "start_velocity = 1"), both);
        assert_eq!(moved(&open, "start = 0"), both[..1]);
    }
}
