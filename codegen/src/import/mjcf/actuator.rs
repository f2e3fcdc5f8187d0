//! `actuator`: no actuator is part of a model, but each tells the largest effort of its joint, and has a rotor and a damper
//! that are passive: they are those of the joint.

use std::collections::HashMap;
use std::ops::Range;

use super::build::Built;
use super::classes::{Classes, MAIN};
use super::element::{limited, numbers, Element};
use super::joint::{Kind, Rules};
use super::tendon::{self, Tendon};
use crate::diag::Severity;
use crate::import::raw::{RawModel, RawNumber, RawValue};
use crate::import::source::{Span, Spanned};
use crate::import::words::quote;
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

/// What actuators act on.
pub(super) struct Driven<'p, 'd> {
    /// Joints.
    pub built: &'p Built<'d>,
    /// Tendons.
    pub tendons: &'p HashMap<&'d str, Tendon>,
    /// Largest efforts, by joints of the raw model; `None` where an actuator of the joint has no bound.
    pub efforts: HashMap<usize, Option<(f64, Span)>>,
}

/// Reads all actuators of a section: adds their largest efforts to those of `driven`, and their rotors and dampers to the
/// joints of the raw model.
pub(super) fn all<'d>(
    reader: &mut Reader,
    section: Node<'d, 'd>,
    classes: &Classes<'d>,
    rules: Rules,
    driven: &mut Driven<'_, 'd>,
    raw: &mut RawModel,
) {
    let tags: Vec<&str> = MOTORS.into_iter().chain(LAWS).chain(["plugin"]).collect();
    for node in reader.children(section, &tags, &[]) {
        let element = classes.resolve(reader, node, &tags, MAIN);
        let tag = node.tag_name().name();
        told(reader, &element, tag);
        let gear = numbers(reader, &element, "gear", 1..=6, "actuator: ").map_or(1.0, |gear| gear.value[0]);
        // The one that turns balls has neither, also where its class has.
        if tag != "orientation" {
            passive(reader, &element, gear, rules, driven, raw);
        }
        let Some(known) = joint(&element).and_then(|name| driven.built.joints.get(name.value)) else { continue };
        if !known.kind.is_scalar() {
            continue;
        }
        let (effort, efforts) = (effort(reader, &element, (tag, gear), rules), &mut driven.efforts);
        let sum = match (efforts.get(&known.index), effort) {
            (None, effort) => effort.map(|x| (x, place(node))),
            (Some(Some((old, span))), Some(x)) => Some((old + x, *span)),
            _ => None,
        };
        efforts.insert(known.index, sum);
    }
}

/// The joint that an actuator names. Where its gear is seen from matters to directions alone.
fn joint<'d>(element: &Element<'d>) -> Option<Spanned<&'d str>> {
    element.attribute("joint").or_else(|| element.attribute("jointinparent"))
}

/// Adds the rotor and the damper of an actuator to all freedoms of its joint, times the square of the gear ratio. Those of
/// a tendon over one joint are the joint's; others are refused.
fn passive(reader: &mut Reader, element: &Element, gear: f64, rules: Rules, driven: &Driven, raw: &mut RawModel) {
    let shown = element.name().map_or("without a name".into(), |name| quote(name.value));
    let whose = format!("actuator {shown}: ");
    for (key, most) in [("armature", 1), ("damping", 3)] {
        let Some(given) = numbers(reader, element, key, 1..=most, &whose).filter(|x| x.value.iter().any(|x| *x != 0.0))
        else {
            continue;
        };
        if key == "damping" && !rules.options.on("damper") {
            continue;
        }
        if given.value[1..].iter().any(|x| *x != 0.0) {
            let message = format!("{whose}a `{key}` that is not linear is not modelled");
            reader.findings.error(given.span, message, "write one number, or add its effort as one of your own");
            continue;
        }
        match target(element, driven, key) {
            Ok((joints, ratio)) => {
                for joint in raw.joints.get_mut(joints).into_iter().flatten() {
                    let slot = if key == "armature" { &mut joint.armature } else { &mut joint.damping };
                    tendon::add(slot, gear * ratio, &given);
                }
            }
            Err((at, problem, help)) => {
                reader.findings.error(at.unwrap_or(given.span), format!("{whose}{problem}"), help);
            }
        }
    }
}

/// Joints of the raw model, and their velocity ratio to a transmission without `gear`.
type Target = (Range<usize>, f64);

/// Where an actuator cannot be read, if not at the key itself, why, and what to do.
type Refused = (Option<Span>, String, &'static str);

/// The joints that have what an actuator has under a key.
fn target(element: &Element, driven: &Driven, key: &str) -> Result<Target, Refused> {
    let unknown = |name: Spanned<&str>, what: &str, help| {
        Err((Some(name.span), format!("{} is not a {what}", quote(name.value)), help))
    };
    if let Some(name) = joint(element) {
        let Some(known) = driven.built.joints.get(name.value) else {
            return unknown(name, "joint", "name a joint of this file");
        };
        // MuJoCo's rotors of a free joint act in the axes of the world: see `Joint::elements`.
        if known.kind == Kind::Free && key == "armature" && known.parts == 1 {
            let problem = format!("`{key}` of an actuator on a free joint without one of its own is not modelled");
            let help = "give it to the joint (`type=\"free\"`), times the square of the first number of `gear`";
            return Err((None, problem, help));
        }
        return Ok((known.index..known.index + known.parts, 1.0));
    }
    let name = element.attribute("tendon");
    if let Some(name) = name.clone() {
        let Some(tendon) = driven.tendons.get(name.value) else {
            return unknown(name, "tendon", "name a tendon of this file");
        };
        if let Some((index, ratio)) = tendon.only() {
            return Ok((index..index + 1, ratio));
        }
    }
    let what = match name {
        Some(_) => "a tendon that is not a fixed one over one joint",
        None => "neither a joint nor a tendon",
    };
    let problem = format!("`{key}` of an actuator on {what} is not modelled");
    Err((None, problem, "set it to 0, and add its effort as one of your own"))
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

/// The largest effort of an actuator with a tag and a gear ratio on its joint, N m or N.
fn effort(reader: &mut Reader, element: &Element, (tag, gear): (&str, f64), rules: Rules) -> Option<f64> {
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
