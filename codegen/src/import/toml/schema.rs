//! A JSON Schema (draft 4) of the format, for editors: made from the lists of keys and words that the reader uses, so that
//! it cannot differ from it in them.

use super::{base, constraints, contacts, entries, variants, KEYS};
use crate::import::{hull, Base};
use crate::model::{Words, JOINTS, LOOPS, SHAPES, SIDES};

/// The definitions that the tables share.
const DEFINITIONS: &[(&str, &str)] = &[
    (
        "number",
        r#"{ "anyOf": [{ "type": "number" }, { "type": "object", "properties": { "param": { "type": "string" } }, "required": ["param"], "additionalProperties": false }] }"#,
    ),
    (
        "angle",
        r##"{ "anyOf": [{ "$ref": "#/definitions/number" }, { "type": "object", "properties": { "deg": { "type": "number" } }, "required": ["deg"], "additionalProperties": false }] }"##,
    ),
    (
        "angles",
        r##"{ "anyOf": [{ "type": "array", "items": { "$ref": "#/definitions/angle" } }, { "type": "object", "properties": { "deg": { "type": "array", "items": { "type": "number" } } }, "required": ["deg"], "additionalProperties": false }] }"##,
    ),
    ("vector", r##"{ "type": "array", "items": { "$ref": "#/definitions/number" }, "minItems": 3, "maxItems": 3 }"##),
    ("direction", r#"{ "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3 }"#),
    ("points", r##"{ "type": "array", "items": { "$ref": "#/definitions/direction" }, "minItems": 1 }"##),
    #[cfg(feature = "height_fields")]
    (
        "rows",
        r##"{ "type": "array", "items": { "type": "array", "items": { "type": "number" }, "minItems": 4 }, "minItems": 4 }"##,
    ),
    ("numbers", r##"{ "type": "array", "items": { "$ref": "#/definitions/number" } }"##),
    ("freedoms", r##"{ "anyOf": [{ "$ref": "#/definitions/angle" }, { "$ref": "#/definitions/angles" }] }"##),
    ("name", r#"{ "type": "string", "minLength": 1 }"#),
    ("names", r##"{ "type": "array", "items": { "$ref": "#/definitions/name" } }"##),
    ("between", r##"{ "type": "array", "items": { "$ref": "#/definitions/name" }, "minItems": 2, "maxItems": 2 }"##),
    ("flag", r#"{ "type": "boolean" }"#),
    (
        "rotation",
        r##"{ "type": "object", "properties": { "axis": { "$ref": "#/definitions/direction" }, "angle": { "$ref": "#/definitions/angle" } }, "required": ["axis", "angle"], "additionalProperties": false }"##,
    ),
    (
        "inertia",
        r##"{ "anyOf": [{ "$ref": "#/definitions/vector" }, { "type": "object", "properties": { "xx": { "$ref": "#/definitions/number" }, "yy": { "$ref": "#/definitions/number" }, "zz": { "$ref": "#/definitions/number" }, "xy": { "$ref": "#/definitions/number" }, "xz": { "$ref": "#/definitions/number" }, "yz": { "$ref": "#/definitions/number" } }, "required": ["xx", "yy", "zz"], "additionalProperties": false }] }"##,
    ),
    (
        "limits",
        r##"{ "anyOf": [{ "$ref": "#/definitions/angles" }, { "type": "object", "properties": { "lower": { "$ref": "#/definitions/angle" }, "upper": { "$ref": "#/definitions/angle" } }, "additionalProperties": false }] }"##,
    ),
    (
        "mimic",
        r##"{ "type": "object", "properties": { "joint": { "$ref": "#/definitions/name" }, "ratio": { "$ref": "#/definitions/number" }, "offset": { "$ref": "#/definitions/angle" } }, "required": ["joint"], "additionalProperties": false }"##,
    ),
    ("params", r##"{ "type": "object", "additionalProperties": { "$ref": "#/definitions/angle" } }"##),
    ("gravity", r##"{ "anyOf": [{ "$ref": "#/definitions/vector" }, { "enum": ["input"] }] }"##),
];

/// The schema as text.
pub fn schema() -> String {
    let mut text = String::from("{\n  \"$schema\": \"http://json-schema.org/draft-04/schema#\",\n");
    text += "  \"title\": \"A mechanism in the TOML format of multibody\",\n  \"type\": \"object\",\n";
    text += &format!("  \"properties\": {},\n", properties("model", KEYS.iter().copied(), 2));
    text += "  \"additionalProperties\": false,\n  \"definitions\": {\n";
    let plain = DEFINITIONS.iter().map(|(name, schema)| format!("    \"{name}\": {schema}"));
    let tables = tables().into_iter().map(|(name, keys, required)| {
        let required: Vec<String> = required.iter().map(|key| format!("\"{key}\"")).collect();
        let required = match required.is_empty() {
            true => String::new(),
            false => format!("      \"required\": [{}],\n", required.join(", ")),
        };
        let properties = properties(name, keys.into_iter(), 6);
        format!(
            "    \"{name}\": {{\n      \"type\": \"object\",\n      \"properties\": {properties},\n{required}      \"additionalProperties\": false\n    }}"
        )
    });
    text += &plain.chain(tables).collect::<Vec<_>>().join(",\n");
    text + "\n  }\n}\n"
}

/// The tables with their keys and those of them that have to be there. A body or joint of a base needs its name only.
fn tables() -> Vec<(&'static str, Vec<&'static str>, &'static [&'static str])> {
    vec![
        ("base", base::KEYS.to_vec(), &["file"]),
        ("body", entries::BODY.to_vec(), &["name"]),
        ("joint", entries::JOINT.to_vec(), &["name"]),
        ("frame", entries::FRAME.to_vec(), &["name", "body"]),
        ("wrench", entries::WRENCH.to_vec(), &["body"]),
        ("loop", constraints::loop_keys(), &["name", "type", "between"]),
        ("coupling", constraints::COUPLING.to_vec(), &["name", "joints", "ratios"]),
        ("shape", contacts::SHAPE.to_vec(), &["name", "type"]),
        ("contact", contacts::CONTACT.to_vec(), &["name", "between"]),
        ("contacts", contacts::CONTACTS.to_vec(), &[]),
        ("variant", variants::VARIANT.to_vec(), &["name"]),
    ]
}

fn properties(table: &str, keys: impl Iterator<Item = &'static str>, indent: usize) -> String {
    let space = " ".repeat(indent + 2);
    let each = keys.map(|key| format!("{space}\"{key}\": {}", property(table, key)));
    format!("{{\n{}\n{}}}", each.collect::<Vec<_>>().join(",\n"), " ".repeat(indent))
}

fn reference(name: &str) -> String {
    format!("{{ \"$ref\": \"#/definitions/{name}\" }}")
}

fn words<'w>(words: impl Iterator<Item = &'w str>) -> String {
    format!("{{ \"enum\": [{}] }}", words.map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", "))
}

fn kinds<'w>(all: impl Iterator<Item = &'w Words>) -> String {
    words(all.flat_map(|one| std::iter::once(one.word).chain(one.aliases.iter().copied())))
}

/// What stands under a key of a table.
fn property(table: &str, key: &str) -> String {
    match (table, key) {
        ("joint", "type") => kinds(JOINTS.iter().map(|spec| &spec.words)),
        ("loop", "type") => kinds(LOOPS.iter().map(|spec| &spec.words)),
        ("shape", "type") => kinds(SHAPES.iter().map(|spec| &spec.words)),
        ("joint", "motion") => words(["free", "prescribed"].into_iter()),
        ("wrench", "frame") => words(["body", "world"].into_iter()),
        ("base", "root") => words(Base::ALL.map(Base::name).into_iter()),
        ("contacts", "pairs") => words(["listed", "all"].into_iter()),
        ("model", "checks") => words(["strict", "lenient"].into_iter()),
        (_, "law") => words(contacts::LAWS.iter().map(|(word, _)| *word)),
        ("base", "limits") | (_, "held" | "unbounded") => reference("flag"),
        ("model", "base" | "contacts" | "params" | "gravity") => reference(key),
        (
            "model" | "variant",
            "body" | "joint" | "frame" | "wrench" | "loop" | "coupling" | "shape" | "contact" | "variant",
        ) => {
            format!("{{ \"type\": \"array\", \"items\": {} }}", reference(key))
        }
        (_, "points") => reference("points"),
        #[cfg(feature = "height_fields")]
        (_, "heights") => reference("rows"),
        #[cfg(feature = "height_fields")]
        (_, "spacing") => r#"{ "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 }"#.into(),
        (_, "most") => {
            format!("{{ \"type\": \"integer\", \"minimum\": {}, \"maximum\": {} }}", hull::MOST.0, hull::MOST.1)
        }
        (_, "sides") => {
            format!("{{ \"type\": \"integer\", \"minimum\": {}, \"maximum\": {} }}", SIDES.0, SIDES.1)
        }
        (_, "scale") => r#"{ "type": "number", "exclusiveMinimum": true, "minimum": 0 }"#.into(),
        (_, "name" | "parent" | "child" | "body" | "file") => reference("name"),
        (_, "between") => reference("between"),
        (_, "joints" | "remove" | "cut" | "lock") => reference("names"),
        (_, "xyz" | "com" | "size" | "semi_axes") => reference("vector"),
        (_, "rpy" | "inertia_rpy") => reference("angles"),
        (_, "rotate") => reference("rotation"),
        (_, "axis" | "axis2" | "normal") => reference("direction"),
        (_, "inertia" | "mimic" | "limits") => reference(key),
        (_, "range") => reference("limits"),
        (_, "damping" | "stiffness" | "rest" | "armature" | "start" | "start_velocity") => reference("freedoms"),
        (_, "ratios" | "radii" | "lengths" | "row") => reference("numbers"),
        (_, "offset") => reference("angle"),
        (
            _,
            "mass" | "pitch" | "length" | "radius" | "rounding" | "decay" | "friction" | "restitution"
            | "limit_restitution",
        ) => reference("number"),
        (_, "max_velocity" | "max_effort") => reference("number"),
        // A test sees to it that there is none.
        _ => "{}".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_has_a_type() {
        let top = KEYS.iter().map(|key| ("model", *key));
        let all = tables().into_iter().flat_map(|(table, keys, _)| keys.into_iter().map(move |key| (table, key)));
        for (table, key) in top.chain(all) {
            assert_ne!(property(table, key), "{}", "`{key}` of `{table}`");
        }
    }
}
