//! `[[loop]]` and `[[coupling]]`.

use std::collections::HashSet;

use super::super::raw::{
    JointType, LoopType, RawConstraint, RawCoupling, RawJoint, RawLoop, RawModel, RawNumber, RawValue,
};
use super::super::source::{Findings, Spanned};
use super::super::words::{did_you_mean, quote};
use super::entries::ALIASES;
use super::numbers::{self, Unit};
use super::table::Table;

const LOOP: &[&str] =
    &["name", "type", "between", "axis", "axis2", "normal", "pitch", "length", "radius", "row", "decay"];
const COUPLING: &[&str] = &["name", "joints", "ratios", "offset", "decay"];

/// What loops are called elsewhere, beside the names that joints have.
const OTHER_NAMES: [(&str, &str); 12] = [
    ("rod", "distance"),
    ("bar", "distance"),
    ("link", "distance"),
    ("inline", "point_on_line"),
    ("inplane", "point_on_plane"),
    ("point_on_surface", "point_on_plane"),
    ("disc", "rolling_disc"),
    ("disk", "rolling_disc"),
    ("rolling_disk", "rolling_disc"),
    ("wheel", "rolling_disc"),
    ("skate", "knife_edge"),
    ("nonholonomic", "pfaffian"),
];

/// What is written as a coupling.
const COUPLINGS: [&str; 4] = ["coupling", "gear", "gears", "rack"];

/// All loops and couplings, in the order of the file.
pub(super) fn all(top: &Table, raw: &mut RawModel, findings: &mut Findings) {
    let mut found = Vec::new();
    for table in top.tables("loop", findings) {
        let at = table.span.start;
        found.extend(one_loop(&table, findings).map(|l| (at, RawConstraint::Loop(Box::new(l)))));
    }
    let sliders: HashSet<&str> = raw.joints.iter().filter(|j| slides(j)).map(|j| j.name.value.as_str()).collect();
    for table in top.tables("coupling", findings) {
        let at = table.span.start;
        found.extend(coupling(&table, &sliders, findings).map(|c| (at, RawConstraint::Coupling(c))));
    }
    found.sort_by_key(|(at, _)| *at);
    raw.constraints = found.into_iter().map(|(_, c)| c).collect();
}

fn one_loop(table: &Table, findings: &mut Findings) -> Option<RawLoop> {
    table.reject_unknown(LOOP, "a loop", findings);
    let name = table.required_text("name", findings);
    let kind = loop_type(table, findings);
    let between = between(table, findings);
    let axis = table.direction("axis", findings);
    let axis2 = table.direction("axis2", findings);
    let normal = table.direction("normal", findings);
    let mut number = |key: &str| table.number(key, Unit::Plain, findings);
    let (pitch, length, radius, decay) = (number("pitch"), number("length"), number("radius"), number("decay"));
    let row = row(table, findings);
    Some(RawLoop { name: name?, kind, between, axis, axis2, normal, pitch, length, radius, row, decay })
}

fn loop_type(table: &Table, findings: &mut Findings) -> Option<Spanned<LoopType>> {
    let names = || LoopType::ALL.iter().map(|(name, _)| *name);
    let all = || names().map(quote).collect::<Vec<_>>();
    if !table.has("type") {
        table.missing("type", &format!("`type = \"pin\"`, or one of {}", all()[1..].join(", ")), findings);
    }
    let text = table.text("type", findings)?;
    if let Some((_, kind)) = LoopType::ALL.iter().find(|(name, _)| *name == text.value) {
        return Some(Spanned::new(*kind, text.span));
    }
    let lower = text.value.to_lowercase();
    let alias = ALIASES.iter().chain(&OTHER_NAMES).find(|(alias, _)| *alias == lower).map(|(_, name)| *name);
    if alias == Some("floating") || lower == "floating" {
        let message = format!("{}a floating loop leaves everything free", table.prefix());
        findings.error(text.span, message, format!("remove the loop, or choose from {}", all().join(", ")));
        return None;
    }
    let help = match alias {
        Some(name) => format!("it is called `{name}` here"),
        None if COUPLINGS.contains(&lower.as_str()) => {
            "joints are geared by a `[[coupling]]` with `joints` and `ratios`".into()
        }
        None => did_you_mean(&text.value, names(), || format!("the types are {}", all().join(", "))),
    };
    findings.error(text.span, format!("{}unknown type {}", table.prefix(), quote(&text.value)), help);
    None
}

fn between(table: &Table, findings: &mut Findings) -> Option<[Spanned<String>; 2]> {
    let example = "`between = [\"first\", \"second\"]`, bodies, frames or `ground`";
    if !table.has("between") {
        table.missing("between", example, findings);
    }
    let list = table.texts("between", example, findings)?;
    let count = list.value.len();
    <[Spanned<String>; 2]>::try_from(list.value)
        .map_err(|_| {
            let message = format!("{}`between` needs 2 names and has {count}", table.prefix());
            findings.error(list.span, message, format!("write {example}"));
        })
        .ok()
}

/// Six numbers; invalid ones where something else is there.
fn row(table: &Table, findings: &mut Findings) -> Option<Spanned<[RawNumber; 6]>> {
    let value = table.raw("row")?;
    let span = value.span();
    let what = format!("{}`row`", table.prefix());
    let six = numbers::numbers(value, &[Unit::Plain], &what, findings).and_then(|list| {
        let count = list.len();
        let six = <[RawNumber; 6]>::try_from(list).ok();
        if six.is_none() {
            let help = "write the factors of velocity and angular velocity: `[vx, vy, vz, wx, wy, wz]`";
            findings.error(span.clone().into(), format!("{what} needs 6 numbers and has {count}"), help);
        }
        six
    });
    let invalid = || [0; 6].map(|_| Spanned::new(RawValue::Invalid, span.clone()));
    Some(Spanned::new(six.unwrap_or_else(invalid), span.clone()))
}

fn coupling(table: &Table, sliders: &HashSet<&str>, findings: &mut Findings) -> Option<RawCoupling> {
    table.reject_unknown(COUPLING, "a coupling", findings);
    let name = table.required_text("name", findings);
    let examples =
        [("joints", "`joints = [\"first\", \"second\"]`"), ("ratios", "`ratios = [1, -2]`, one for each joint")];
    for (key, example) in examples {
        if !table.has(key) {
            table.missing(key, example, findings);
        }
    }
    let joints = table.texts("joints", examples[0].1, findings);
    let ratios = table.raw("ratios").and_then(|value| {
        let list = numbers::numbers(value, &[Unit::Plain], &format!("{}`ratios`", table.prefix()), findings)?;
        Some(Spanned::new(list, value.span()))
    });
    let mut named = joints.iter().flat_map(|list| &list.value);
    let unit = if named.any(|name| sliders.contains(name.value.as_str())) { Unit::Plain } else { Unit::Angle };
    let offset = table.number("offset", unit, findings);
    let decay = table.number("decay", Unit::Plain, findings);
    Some(RawCoupling { name: name?, joints, ratios, offset, decay })
}

fn slides(joint: &RawJoint) -> bool {
    joint.kind.as_ref().is_some_and(|k| k.value == JointType::Prismatic)
}
