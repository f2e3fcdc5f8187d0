//! Where a motion starts that nobody has described: of the command and of its page.

use multibody::codegen::model::{Coordinate, Model, Unit};
use multibody::codegen::plan::Plan;
use multibody::runtime::tree::Source;
use multibody::runtime::{Interpreter, System};

/// Whether the description says where a motion starts: a mechanism with loops or contacts has a meaning only somewhere.
pub fn states_start(model: &Model) -> bool {
    !model.constraints.is_empty() || !model.starts.is_empty() || !model.contacts.is_empty()
}

/// The default start; `mbd simulate --help` states it.
pub fn default_start(plan: &Plan) -> Vec<f64> {
    let mut q = if states_start(&plan.model) { plan.start() } else { bent(plan) };
    plan.move_into_ranges(&mut q);
    q
}

/// Angles and displacements of which no joint is at zero.
fn bent(plan: &Plan) -> Vec<f64> {
    let interpreter: Interpreter<f64> = plan.default_interpreter();
    let mut q = interpreter.neutral();
    let mut angle = 0.3;
    for slot in &plan.slots {
        let Some(Source::State { q: at, .. }) = slot.at else { continue };
        match plan.model.joints[slot.joint].kind.spec().coordinates {
            [Coordinate { unit: Unit::Radian, .. }] => {
                q[at] = angle;
                angle = -angle;
            }
            [_] => q[at] = 0.05,
            _ => {}
        }
    }
    q
}

/// The velocities of that start.
pub fn default_velocity(plan: &Plan) -> Vec<f64> {
    let speed = if states_start(&plan.model) { 0.0 } else { 0.1 };
    plan.start_velocity().unwrap_or_else(|| vec![speed; plan.dims.nv])
}
