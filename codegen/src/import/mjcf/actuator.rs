//! `actuator`: no actuator is part of a model, but each tells the largest effort of its joint.

use std::collections::HashMap;

use super::build::Built;
use super::classes::{Classes, MAIN};
use super::element::{limited, numbers, Element};
use super::joint::Rules;
use crate::diag::Severity;
use crate::import::raw::{RawModel, RawNumber, RawValue};
use crate::import::source::Span;
use crate::import::xml::{place, Reader};
use roxmltree::Node;

/// Actuators whose force is their input.
const MOTORS: [&str; 2] = ["motor", "general"];

/// Actuators with a law of their own.
const LAWS: [&str; 10] = [
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
    "pid",
    "orientation",
];

/// Reads all actuators of a section, and adds their largest efforts to `efforts`, by joints of the raw model; `None`
/// where one of them has no bound.
pub(super) fn all<'d>(
    reader: &mut Reader,
    section: Node<'d, 'd>,
    classes: &Classes<'d>,
    built: &Built<'d>,
    rules: Rules,
    efforts: &mut HashMap<usize, Option<(f64, Span)>>,
) {
    let tags: Vec<&str> = MOTORS.into_iter().chain(LAWS).chain(["plugin"]).collect();
    for node in reader.children(section, &tags, &[]) {
        let element = classes.resolve(reader, node, &tags, MAIN);
        let tag = node.tag_name().name();
        told(reader, &element, tag);
        let Some(known) = element.attribute("joint").and_then(|name| built.joints.get(name.value)) else { continue };
        if !known.kind.is_scalar() {
            continue;
        }
        let effort = effort(reader, &element, tag, rules);
        let sum = match (efforts.get(&known.index), effort) {
            (None, effort) => effort.map(|x| (x, place(node))),
            (Some(Some((old, span))), Some(x)) => Some((old + x, *span)),
            _ => None,
        };
        efforts.insert(known.index, sum);
    }
}

/// Says that an actuator is no part of the model.
fn told(reader: &mut Reader, element: &Element, tag: &str) {
    let states = |key: &str| element.attribute(key).is_some_and(|word| word.value != "none" && word.value != "fixed");
    let law = LAWS.contains(&tag) || tag == "plugin" || ["dyntype", "gaintype", "biastype"].iter().any(|k| states(k));
    if law {
        let message = format!("the law of an actuator (`{tag}`) is not part of the model: its effort is an input");
        let help = "compute it in your controller";
        reader.tally.add(Severity::Warning, &format!("actuator {tag}"), place(element.node), message, help);
    } else {
        reader.tally.notice(place(element.node), "actuators are not part of the model: joint efforts are its inputs");
    }
}

/// The largest effort of an actuator on its joint, N m or N.
fn effort(reader: &mut Reader, element: &Element, tag: &str, rules: Rules) -> Option<f64> {
    let auto = rules.compiler.autolimits;
    let mut bound = |limit: &str, range: &str| {
        if !limited(reader, element, (limit, range), auto, "actuator: ") {
            return None;
        }
        let ends = numbers(reader, element, range, 2..=2, "actuator: ")?.value;
        Some(ends[0].abs().max(ends[1].abs()))
    };
    let force = bound("forcelimited", "forcerange");
    let control = if tag == "motor" { bound("ctrllimited", "ctrlrange") } else { None };
    let gear = numbers(reader, element, "gear", 1..=6, "actuator: ").map_or(1.0, |gear| gear.value[0]);
    let least = force.into_iter().chain(control).reduce(f64::min)?;
    Some(least * gear.abs()).filter(|x| *x > 0.0)
}

/// Bounds the efforts of the joints by those of their actuators.
pub(super) fn bound(efforts: &HashMap<usize, Option<(f64, Span)>>, raw: &mut RawModel) {
    for (index, effort) in efforts {
        let (Some((effort, span)), Some(joint)) = (effort, raw.joints.get_mut(*index)) else { continue };
        let own = match &joint.max_effort {
            Some(RawNumber { value: RawValue::Const(x), .. }) => *x,
            _ => f64::INFINITY,
        };
        if *effort < own {
            joint.max_effort = Some(RawNumber::constant(*effort, *span));
        }
    }
}
