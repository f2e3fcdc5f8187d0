//! The generated type: its fields, its constructor, the same with lanes.

use std::fmt::Write;

use mbd_runtime::contact::{rows_that_act, Mode};
use mbd_runtime::tree::Source;

use super::modes::Contacts;
use super::signature::nested;
use crate::options::Options;
use crate::output::{Sizes, FIELDS};
use crate::plan::Plan;

/// One field of the type.
pub struct Field {
    /// Its name.
    pub name: &'static str,
    /// Lengths, the outermost first.
    pub dims: Vec<usize>,
    /// Initial value in the constructor where it is not zero.
    pub value: Option<Vec<f64>>,
    /// What it is.
    pub doc: &'static str,
}

impl Field {
    /// Initial values of all entries.
    pub fn values(&self) -> Vec<f64> {
        self.value.clone().unwrap_or_else(|| vec![0.0; self.dims.iter().product()])
    }

    /// Initial value as an array literal.
    fn literal(&self) -> String {
        self.value.as_ref().map_or_else(|| nested(&self.dims, "0.0"), |value| format!("{value:?}"))
    }
}

/// What the fields are at first, for comments.
pub fn initial(fields: &[Field]) -> &'static str {
    match ["gravity", "drive_q"].map(|name| fields.iter().any(|field| field.name == name)) {
        [false, false] => "All inputs zero, parameters at their defaults.",
        [true, false] => "Parameters and gravity at their defaults, all other inputs zero.",
        [false, true] => "Parameters at their defaults, prescribed joints in their neutral positions, all other inputs zero.",
        [true, true] => "Parameters and gravity at their defaults, prescribed joints in their neutral positions, all other inputs zero.",
    }
}

/// The fields of a type.
pub fn fields(plan: &Plan, sizes: &Sizes) -> Vec<Field> {
    let present = FIELDS.into_iter().filter(|field| field.array.len(sizes) > 0);
    let field = present.map(|field| {
        let (name, dims) = (field.array.name, field.array.lengths(sizes));
        let value = match name {
            "drive_q" => Some(neutral(plan, true)),
            "params" => Some(plan.default_params()),
            "gravity" => Some(vec![0.0, 0.0, -9.81]),
            // Loops and couplings act, and all contacts are open.
            "acts" => Some(acting(plan)),
            _ => None,
        };
        Field { name, dims, value, doc: field.doc }
    });
    field.collect()
}

/// 1 for each row that acts while all contacts are open.
fn acting(plan: &Plan) -> Vec<f64> {
    let contacts = plan.contacts::<f64>();
    let open = vec![Mode::Open; contacts.len()];
    rows_that_act(plan.dims.rows, &contacts, &open).into_iter().map(|acts| f64::from(u8::from(acts))).collect()
}

/// The neutral configuration, of the state or of the drives.
pub fn neutral(plan: &Plan, drives: bool) -> Vec<f64> {
    let parts = plan.slots.iter().filter(|s| matches!(s.at, Some(Source::Drive { .. })) == drives && s.at.is_some());
    parts.flat_map(|s| plan.model.joints[s.joint].kind.spec().neutral()).collect()
}

/// The type with its fields, whose entries have type `entry`.
pub fn type_definition(out: &mut String, ty: &str, fields: &[Field], entry: &str, contacts: Option<&Contacts>) {
    let _ = writeln!(out, "#[derive(Clone, Debug, PartialEq)]\n#[rustfmt::skip]\npub struct {ty} {{");
    for Field { name, dims, doc, .. } in fields {
        // The rows that act follow from the modes of contacts.
        let public = if *name == "acts" { "" } else { "pub " };
        let _ = writeln!(out, "    /// {doc}\n    {public}{name}: {},", nested(dims, entry));
    }
    if let Some(contacts) = contacts {
        contacts.fields(out);
    }
    let _ = writeln!(out, "}}");
}

/// The constructor.
pub fn constructor(out: &mut String, options: &Options, fields: &[Field], contacts: Option<&Contacts>) {
    let mut values: Vec<String> = fields.iter().map(|field| format!("{}: {}", field.name, field.literal())).collect();
    values.extend(contacts.map_or(Vec::new(), Contacts::values));
    let _ = writeln!(
        out,
        "
    /// {}
    pub const fn new() -> Self {{
        {} {{ {} }}
    }}",
        initial(fields),
        options.type_name,
        values.join(", ")
    );
}

/// The method that copies the fields into all lanes.
pub fn broadcast(out: &mut String, options: &Options, fields: &[Field]) {
    let name = &options.type_name;
    let copy = |Field { name, dims, .. }: &Field| match dims.len() {
        1 => format!("{name}: self.{name}.map(|x| [x; LANES])"),
        _ => format!("{name}: self.{name}.map(|row| row.map(|x| [x; LANES]))"),
    };
    let _ = writeln!(
        out,
        "
    /// The same for several states at once; the inputs are copied into every lane.
    pub fn lanes<const LANES: usize>(&self) -> {name}Lanes<LANES> {{
        {name}Lanes {{ {} }}
    }}",
        fields.iter().map(copy).collect::<Vec<_>>().join(", ")
    );
}

/// `impl Default`, of a type with generic parameters or without.
pub fn default(out: &mut String, generics: &str, ty: &str) {
    let _ = writeln!(
        out,
        "
#[rustfmt::skip]
impl{generics} ::core::default::Default for {ty} {{
    fn default() -> Self {{
        Self::new()
    }}
}}"
    );
}
