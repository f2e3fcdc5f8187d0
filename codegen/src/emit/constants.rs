//! Constants of the generated type: dimensions, names, indices.

use std::fmt::Write;

use mbd_runtime::system::Row;
use mbd_runtime::tree::Source;

use super::names::constant;
use super::numbers::literal;
use crate::options::Options;
use crate::output::Output;
use crate::plan::Plan;

/// Writer of constants.
struct Constants<'a> {
    out: &'a mut String,
}

impl Constants<'_> {
    fn one(&mut self, doc: &str, name: &str, ty: &str, value: &str) {
        let _ = writeln!(self.out, "    /// {doc}\n    pub const {name}: {ty} = {value};");
    }

    fn list(&mut self, doc: &str, name: &str, ty: &str, values: &[String]) {
        self.one(doc, name, &format!("[{ty}; {}]", values.len()), &format!("[{}]", values.join(", ")));
    }

    fn index(&mut self, prefix: &str, what: &str, name: &str, at: usize) {
        let doc = format!("Index of {what} `{name}`.");
        self.one(&doc, &format!("{prefix}_{}", constant(name)), "usize", &at.to_string());
    }
}

/// Dimensions, names, indices; `frames` are those that were chosen.
pub fn constants(out: &mut String, plan: &Plan, options: &Options, frames: &[usize]) {
    let mut constants = Constants { out };
    let quoted = |names: Vec<String>| names.iter().map(|n| format!("{n:?}")).collect::<Vec<_>>();
    constants.one("Number of coordinates.", "NQ", "usize", &plan.dims.nq.to_string());
    constants.one("Number of velocities, momenta, joint forces.", "NV", "usize", &plan.dims.nv.to_string());
    let (q, v) = (quoted(plan.coordinate_names()), quoted(plan.velocity_names()));
    constants.list("Names of the coordinates, in the order of `q`.", "COORDINATES", "&'static str", &q);
    constants.list("Names of the velocities, in the order of `v`, `p`, `tau`.", "VELOCITIES", "&'static str", &v);
    if !plan.model.starts.is_empty() {
        let start: Vec<String> = plan.start().iter().map(|x| literal(*x, options.precision)).collect();
        constants.list("Coordinates that the model starts with.", "START", options.precision.name(), &start);
        let held: Vec<String> = plan.held().iter().map(|held| held.to_string()).collect();
        let doc = "Velocities of joints that stay where they start when loops are closed.";
        constants.list(doc, "HELD", "bool", &held);
    }
    let rows = plan.rows();
    if !rows.is_empty() {
        row_constants(&mut constants, plan, options, &rows);
    }
    indices(&mut constants, plan, options, frames);
}

/// Rows of the constraints, and the places of their entries.
fn row_constants(constants: &mut Constants, plan: &Plan, options: &Options, rows: &[Row]) {
    let (rt, columns) = (&options.runtime, plan.entry_columns());
    constants.one("Number of rows of the constraints.", "ROWS", "usize", &rows.len().to_string());
    let doc = "Number of entries of `Φ` that can be other than zero.";
    constants.one(doc, "ENTRIES", "usize", &columns.len().to_string());
    let each = rows.iter().map(|Row { constraint, holonomic, first, len }| {
        format!("{rt}::system::Row {{ constraint: {constraint}, holonomic: {holonomic}, first: {first}, len: {len} }}")
    });
    let each: Vec<String> = each.collect();
    constants.list("Rows of the constraints.", "CONSTRAINT_ROWS", &format!("{rt}::system::Row"), &each);
    let columns: Vec<String> = columns.iter().map(|column| column.to_string()).collect();
    constants.list("Velocity index of each entry of `Φ`.", "ENTRY_COLUMNS", "usize", &columns);
}

fn indices(constants: &mut Constants, plan: &Plan, options: &Options, frames: &[usize]) {
    for slot in &plan.slots {
        let name = &plan.model.joints[slot.joint].name;
        match slot.at {
            Some(Source::State { q, v }) => {
                constants.index("Q", "the first coordinate of joint", name, q);
                constants.index("V", "the first velocity of joint", name, v);
            }
            Some(Source::Drive { q, v }) => {
                constants.index("DRIVE_Q", "the first prescribed position of joint", name, q);
                constants.index("DRIVE_V", "the first prescribed rate of joint", name, v);
            }
            None => {}
        }
    }
    for constraint in &plan.constraints {
        constants.index("ROW", "the first row of constraint", &constraint.name, constraint.first);
    }
    for (k, wrench) in plan.model.wrenches.iter().enumerate() {
        constants.index("WRENCH", "external wrench", &wrench.name, k);
    }
    for (k, param) in plan.model.params.iter().enumerate() {
        constants.index("PARAM", "parameter", &param.name, k);
    }
    if options.outputs.iter().any(|output| output.spec().of_frames()) {
        for (k, &frame) in frames.iter().enumerate() {
            constants.index("FRAME", "frame", &plan.frames[frame].name, k);
        }
    }
    if options.outputs.contains(&Output::Regressor) {
        let names: Vec<String> = plan.parameter_names().iter().map(|n| format!("{n:?}")).collect();
        constants.list(
            "Names of the parameters, in the order of the columns of `y`.",
            "REGRESSOR",
            "&'static str",
            &names,
        );
    }
    if options.outputs.contains(&Output::Reactions) {
        for (k, &node) in plan.joint_nodes.iter().enumerate() {
            let joint = plan.nodes[node].joint.0;
            constants.index("REACTION", "the reaction of joint", &plan.model.joints[joint].name, k);
        }
    }
}
