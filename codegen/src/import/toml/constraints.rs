//! `[[loop]]` and `[[coupling]]`.

use std::collections::HashSet;

use super::super::raw::{RawConstraint, RawCoupling, RawJoint, RawLoop, RawModel, RawNumber, RawValue};
use super::super::source::{Findings, Spanned};
use super::super::words::quote;
use super::kinds::kind;
use super::numbers::{self, Unit};
use super::table::Table;
use crate::model::{LoopSpec, NumberKey, Unit as Measures, FLOATING, LOOPS};

pub(super) const COUPLING: &[&str] = &["name", "joints", "ratios", "offset", "decay"];

/// The entry of a coupling.
const COUPLINGS: [&str; 4] = ["coupling", "gear", "gears", "rack"];

/// All loops and couplings, in the order of the file, between joints of the model and `joints`.
pub(super) fn all(top: &Table, joints: &[RawJoint], raw: &mut RawModel, findings: &mut Findings) {
    let mut found = Vec::new();
    for table in top.tables("loop", findings) {
        let at = table.span.start;
        found.extend(one_loop(&table, findings).map(|l| (at, RawConstraint::Loop(Box::new(l)))));
    }
    let sliding = raw.joints.iter().chain(joints).filter(|j| slides(j));
    let lengths: HashSet<&str> = sliding.map(|j| j.name.value.as_str()).collect();
    for table in top.tables("coupling", findings) {
        let at = table.span.start;
        found.extend(coupling(&table, &lengths, findings).map(|c| (at, RawConstraint::Coupling(c))));
    }
    found.sort_by_key(|(at, _)| *at);
    raw.constraints.extend(found.into_iter().map(|(_, c)| c));
}

/// Keys of directions of all types of loops.
fn direction_keys() -> Vec<&'static str> {
    distinct(LOOPS.iter().flat_map(|spec| spec.directions.iter().map(|d| d.key)))
}

/// Keys of numbers of all types of loops.
fn number_keys() -> Vec<NumberKey> {
    distinct(LOOPS.iter().flat_map(|spec| spec.numbers.iter().copied()))
}

/// Keys of all types of loops.
pub(super) fn loop_keys() -> Vec<&'static str> {
    let numbers: Vec<&str> = number_keys().iter().map(|n| n.key).collect();
    [&["name", "type", "between"], &direction_keys()[..], &numbers[..], &["decay"]].concat()
}

fn one_loop(table: &Table, findings: &mut Findings) -> Option<RawLoop> {
    let (directions, numbers) = (direction_keys(), number_keys());
    table.reject_unknown(&loop_keys(), "a loop", findings);
    let name = table.required_text("name", findings);
    let kind = loop_type(table, findings);
    let between = between(table, "bodies, frames or `ground`", findings);
    let directions = directions.into_iter().filter_map(|key| Some((key, table.direction(key, findings)?))).collect();
    let several = numbers.iter().filter(|n| n.count > 1);
    let lists = several.filter_map(|n| Some((n.key, list(table, *n, findings)?))).collect();
    let single = numbers.iter().filter(|n| n.count == 1).map(|n| n.key).chain(["decay"]);
    let numbers = single.filter_map(|key| Some((key, table.number(key, Unit::Plain, findings)?))).collect();
    Some(RawLoop { name: name?, kind, between, directions, numbers, lists })
}

/// Each key once, in the order of the first.
fn distinct<K: PartialEq>(keys: impl Iterator<Item = K>) -> Vec<K> {
    let mut list = Vec::new();
    for key in keys {
        if !list.contains(&key) {
            list.push(key);
        }
    }
    list
}

fn loop_type(table: &Table, findings: &mut Findings) -> Option<Spanned<&'static LoopSpec>> {
    let special = |lower: &str| {
        if FLOATING.words.mean(lower) {
            let all = LOOPS.iter().map(|spec| quote(spec.word())).collect::<Vec<_>>().join(", ");
            return Some(format!("a floating loop would leave everything free: remove it, or choose from {all}"));
        }
        let help = "joints are geared by a `[[coupling]]` with `joints` and `ratios`";
        COUPLINGS.contains(&lower).then(|| help.into())
    };
    kind(table, &LOOPS, |spec| &spec.words, special, findings)
}

/// Two names of what `ends` says.
pub(super) fn between(table: &Table, ends: &str, findings: &mut Findings) -> Option<[Spanned<String>; 2]> {
    let example = format!("`between = [\"first\", \"second\"]`, {ends}");
    if !table.has("between") {
        table.missing("between", &example, findings);
    }
    let list = table.texts("between", &example, findings)?;
    let count = list.value.len();
    <[Spanned<String>; 2]>::try_from(list.value)
        .map_err(|_| {
            let message = format!("{}`between` needs 2 names and has {count}", table.prefix());
            findings.error(list.span, message, format!("write {example}"));
        })
        .ok()
}

/// As many numbers as belong under a key; invalid ones where something else is there.
fn list(
    table: &Table,
    NumberKey { key, count }: NumberKey,
    findings: &mut Findings,
) -> Option<Spanned<Vec<RawNumber>>> {
    let value = table.raw(key)?;
    let span = value.span();
    let what = format!("{}`{key}`", table.prefix());
    let list = numbers::numbers(value, &[Unit::Plain], &what, findings).filter(|list| {
        let right = list.len() == count;
        if !right {
            let help = match key {
                "row" => "write the factors of velocity and angular velocity: `[vx, vy, vz, wx, wy, wz]`",
                "size" => "write the lengths of its edges along x, y and z",
                "semi_axes" => "write half of its extents along x, y and z",
                _ => "write one for the first of the two that `between` names and one for the second",
            };
            let message = format!("{what} needs {count} numbers and has {}", list.len());
            findings.error(span.clone().into(), message, help);
        }
        right
    });
    let invalid = || vec![Spanned::new(RawValue::Invalid, span.clone()); count];
    Some(Spanned::new(list.unwrap_or_else(invalid), span.clone()))
}

fn coupling(table: &Table, lengths: &HashSet<&str>, findings: &mut Findings) -> Option<RawCoupling> {
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
    let unit = if named.any(|name| lengths.contains(name.value.as_str())) { Unit::Plain } else { Unit::Angle };
    let offset = table.number("offset", unit, findings);
    let decay = table.number("decay", Unit::Plain, findings);
    Some(RawCoupling { name: name?, joints, ratios, offset, decay })
}

/// Whether the first coordinate of a joint is a length.
fn slides(joint: &RawJoint) -> bool {
    let first = joint.kind.as_ref().and_then(|kind| kind.value.coordinates.first());
    first.is_some_and(|coordinate| coordinate.unit == Measures::Metre)
}
