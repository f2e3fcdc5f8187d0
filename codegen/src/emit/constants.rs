//! Constants of a generated type: dimensions, names, indices.

use std::fmt::Write;

use mbd_runtime::system::Row;
use mbd_runtime::tree::Source;

use super::names::constant;
use super::numbers::literal;
use super::Input;
use crate::options::Options;
use crate::output::Output;

/// A constant.
pub struct Constant {
    /// One line of documentation.
    pub doc: String,
    /// Its name in upper case.
    pub name: String,
    /// Its value.
    pub value: Content,
}

/// The value of a constant.
pub enum Content {
    /// A number or an index.
    Number(usize),
    /// Numbers or indices.
    Numbers(Vec<usize>),
    /// Names of the model.
    Names(Vec<String>),
    /// Numbers of the chosen precision.
    Floats(Vec<f64>),
    /// Yes or no for each of several things.
    Flags(Vec<bool>),
    /// Rows of constraints.
    Rows(Vec<Row>),
}

impl Constant {
    fn new(doc: &str, name: &str, value: Content) -> Constant {
        Constant { doc: doc.to_string(), name: name.to_string(), value }
    }

    fn index(prefix: &str, what: &str, name: &str, at: usize) -> Constant {
        let doc = format!("Index of {what} `{name}`.");
        Constant { doc, name: format!("{prefix}_{}", constant(name)), value: Content::Number(at) }
    }
}

/// Dimensions, names, indices.
pub fn constants(input: &Input) -> Vec<Constant> {
    let plan = input.plan;
    let mut constants = vec![
        Constant::new("Number of coordinates.", "NQ", Content::Number(plan.dims.nq)),
        Constant::new("Number of velocities, momenta, joint forces.", "NV", Content::Number(plan.dims.nv)),
    ];
    let (q, v) = (Content::Names(plan.coordinate_names()), Content::Names(plan.velocity_names()));
    constants.push(Constant::new("Names of the coordinates, in the order of `q`.", "COORDINATES", q));
    constants.push(Constant::new("Names of the velocities, in the order of `v`, `p`, `tau`.", "VELOCITIES", v));
    if !plan.model.starts.is_empty() {
        let start = Content::Floats(plan.start());
        constants.push(Constant::new("Coordinates that the model starts with.", "START", start));
        if let Some(v) = plan.start_velocity() {
            let doc = "Velocities that the model starts with.";
            constants.push(Constant::new(doc, "START_VELOCITY", Content::Floats(v)));
        }
        let doc = "Velocities of joints that stay where they start when loops are closed.";
        constants.push(Constant::new(doc, "HELD", Content::Flags(plan.held())));
    }
    let rows = plan.rows();
    if !rows.is_empty() {
        let columns = plan.entry_columns();
        constants.push(Constant::new("Number of rows of the constraints.", "ROWS", Content::Number(rows.len())));
        let doc = "Number of entries of `Φ` that can be other than zero.";
        constants.push(Constant::new(doc, "ENTRIES", Content::Number(columns.len())));
        constants.push(Constant::new("Rows of the constraints.", "CONSTRAINT_ROWS", Content::Rows(rows)));
        let columns = Content::Numbers(columns);
        constants.push(Constant::new("Velocity index of each entry of `Φ`.", "ENTRY_COLUMNS", columns));
    }
    constants.extend(indices(input));
    constants
}

fn indices(Input { plan, options, programs }: &Input) -> Vec<Constant> {
    let mut constants = Vec::new();
    for slot in &plan.slots {
        let name = &plan.model.joints[slot.joint].name;
        match slot.at {
            Some(Source::State { q, v }) => {
                constants.push(Constant::index("Q", "the first coordinate of joint", name, q));
                constants.push(Constant::index("V", "the first velocity of joint", name, v));
            }
            Some(Source::Drive { q, v }) => {
                constants.push(Constant::index("DRIVE_Q", "the first prescribed position of joint", name, q));
                constants.push(Constant::index("DRIVE_V", "the first prescribed rate of joint", name, v));
            }
            None => {}
        }
    }
    for constraint in &plan.constraints {
        constants.push(Constant::index("ROW", "the first row of constraint", &constraint.name, constraint.first));
    }
    for (k, wrench) in plan.model.wrenches.iter().enumerate() {
        constants.push(Constant::index("WRENCH", "external wrench", &wrench.name, k));
    }
    for (k, param) in plan.model.params.iter().enumerate() {
        constants.push(Constant::index("PARAM", "parameter", &param.name, k));
    }
    if options.outputs.iter().any(|output| output.spec().of_frames()) {
        for (k, &frame) in programs.frames.iter().enumerate() {
            constants.push(Constant::index("FRAME", "frame", &plan.frames[frame].name, k));
        }
    }
    if options.outputs.contains(&Output::Regressor) {
        let doc = "Names of the parameters, in the order of the columns of `y`.";
        constants.push(Constant::new(doc, "REGRESSOR", Content::Names(plan.parameter_names())));
    }
    if options.outputs.contains(&Output::Reactions) {
        for (k, &node) in plan.joint_nodes.iter().enumerate() {
            let joint = plan.nodes[node].joint.0;
            let name = &plan.model.joints[joint].name;
            constants.push(Constant::index("REACTION", "the reaction of joint", name, k));
        }
    }
    constants
}

/// The constants as Rust.
pub fn write(out: &mut String, constants: &[Constant], options: &Options) {
    let (rt, precision) = (&options.runtime, options.precision);
    let list =
        |ty: &str, values: Vec<String>| (format!("[{ty}; {}]", values.len()), format!("[{}]", values.join(", ")));
    for Constant { doc, name, value } in constants {
        let (ty, value) = match value {
            Content::Number(n) => ("usize".to_string(), n.to_string()),
            Content::Numbers(all) => list("usize", all.iter().map(usize::to_string).collect()),
            Content::Names(all) => list("&'static str", all.iter().map(|name| format!("{name:?}")).collect()),
            Content::Floats(all) => list(precision.name(), all.iter().map(|x| literal(*x, precision)).collect()),
            Content::Flags(all) => list("bool", all.iter().map(bool::to_string).collect()),
            Content::Rows(all) => {
                list(&format!("{rt}::system::Row"), all.iter().map(|row| row_literal(row, rt)).collect())
            }
        };
        let _ = writeln!(out, "    /// {doc}\n    pub const {name}: {ty} = {value};");
    }
}

#[cfg(feature = "height_fields")]
pub use of_fields::{table, tables};

/// Tables of height fields.
#[cfg(feature = "height_fields")]
mod of_fields {
    use std::collections::BTreeMap;
    use std::fmt::Write;

    use crate::model::ShapeKind;
    use crate::plan::Plan;
    use crate::symbolic::hash::fingerprint;

    /// Name of a constant with a table, which is the same wherever the table is.
    pub fn table(table: &[f64]) -> String {
        let hash = fingerprint(table.iter().flat_map(|x| x.to_bits().to_le_bytes()));
        format!("TABLE_{hash:016X}")
    }

    /// The tables of height fields as Rust, each once.
    pub fn tables(out: &mut String, plan: &Plan) {
        let mut all = BTreeMap::new();
        for shape in &plan.model.shapes {
            if let ShapeKind::HeightField { field, .. } = shape.kind {
                let tables = [field.net].into_iter().chain(field.cells).chain(field.inside);
                all.extend(tables.map(|numbers| (table(numbers), numbers)));
            }
        }
        for (name, numbers) in all {
            let n = numbers.len();
            let _ = writeln!(out, "    /// A table of height fields.\n    const {name}: &'static [f64; {n}] = &[");
            for row in numbers.chunks(8) {
                let row: Vec<String> = row.iter().map(|x| format!("{x:?}")).collect();
                let _ = writeln!(out, "        {},", row.join(", "));
            }
            let _ = writeln!(out, "    ];");
        }
    }
}

fn row_literal(Row { constraint, holonomic, first, len }: &Row, rt: &str) -> String {
    format!("{rt}::system::Row {{ constraint: {constraint}, holonomic: {holonomic}, first: {first}, len: {len} }}")
}
