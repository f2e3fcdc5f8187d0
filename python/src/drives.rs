//! Prescribed joints that move in a rollout.

use std::sync::Arc;

use multibody::codegen::jit::{Compiled, Drives, SampledDrives};
use multibody::codegen::output::Sizes;
use multibody::codegen::plan::Plan;
use multibody::runtime::tree::Source;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Given, Rows};

/// Positions and rates at the ends of all steps, `(T + 1, DRIVE_Q)` each.
pub struct Moving<'py> {
    pub q: Given<'py>,
    pub v: Given<'py>,
}

impl<'py> Moving<'py> {
    /// Reads positions and rates; refuses what cannot move.
    pub fn read(
        (q, v): &(Bound<'py, PyAny>, Bound<'py, PyAny>),
        plan: &Plan,
        sizes: &Sizes,
        steps: usize,
    ) -> PyResult<Moving<'py>> {
        let refuse = |words: String| Err(PyValueError::new_err(words));
        if sizes.drive_q == 0 {
            return refuse("the model has no input `drive_q`".into());
        }
        if !plan.model.constraints.is_empty() || !plan.model.contacts.is_empty() {
            return refuse(
                "prescribed joints of a model with loops or contacts stand still in rollouts: leave `drive_v` out"
                    .into(),
            );
        }
        let driven = plan.slots.iter().filter(|slot| matches!(slot.at, Some(Source::Drive { .. })));
        let mut joints = driven.map(|slot| &plan.model.joints[slot.joint]);
        if let Some(joint) = joints.find(|joint| joint.kind.spec().group.is_some()) {
            return refuse(format!(
                "joint `{}` stands still in rollouts, because its rates are not those of its coordinates: leave `drive_v` out",
                joint.name
            ));
        }
        if steps == 0 {
            return refuse("`drive_v` needs at least one step".into());
        }
        let shape = [steps + 1, sizes.drive_q];
        Ok(Moving { q: Given::read(q, "drive_q", &shape)?, v: Given::read(v, "drive_v", &shape)? })
    }
}

/// Lets the prescribed joints of a machine follow the samples of a row.
pub fn follow(machine: &mut Compiled, dt: f64, (q, v): (Rows, Rows), row: usize) {
    let joints = machine.sizes().drive_q;
    let samples = SampledDrives::new(dt, joints, q.row(row), v.row(row));
    machine.set_drives(samples.map(|samples| Arc::new(samples) as Arc<dyn Drives<f64>>));
}
