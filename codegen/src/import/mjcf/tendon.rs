//! `tendon`: fixed tendons as sums of coordinates. Those that act are expressed by the joints, or refused.

use std::collections::HashMap;

use super::build::Built;
use super::classes::{Classes, MAIN};
use super::element::{attribute, limited, number, numbers, Element};
use super::equality::scalar;
use super::joint::Rules;
use crate::diag::Severity;
use crate::import::raw::{RawFreedoms, RawJoint, RawModel, RawNumber, RawValue};
use crate::import::source::Spanned;
use crate::import::words::quote;
use crate::import::xml::{place, Reader};
use roxmltree::Node;

/// The length of a fixed tendon: a sum over joints.
#[derive(Default)]
pub(super) struct Tendon {
    /// Name of each joint, its reference coordinate and its coefficient; none for spatial tendons.
    pub terms: Vec<(String, f64, f64)>,
    /// Joint of the only term among those of the raw model, and the coordinate at which its springs are relaxed.
    only: Option<(usize, f64)>,
}

impl Tendon {
    /// Index of the only joint among those of the raw model, and its coefficient; `None` where there are several, or none.
    pub fn only(&self) -> Option<(usize, f64)> {
        Some((self.only?.0, self.terms.first()?.2))
    }
}

const ATTRIBUTES: &[&str] = &[
    "name",
    "class",
    "group",
    "limited",
    "actuatorfrclimited",
    "range",
    "actuatorfrcrange",
    "solreflimit",
    "solimplimit",
    "solreffriction",
    "solimpfriction",
    "frictionloss",
    "springlength",
    "width",
    "material",
    "margin",
    "stiffness",
    "damping",
    "armature",
    "rgba",
    "user",
];

/// Reads all tendons of a section.
pub(super) fn all<'d>(
    reader: &mut Reader,
    section: Node<'d, 'd>,
    classes: &Classes<'d>,
    built: &Built<'d>,
    rules: Rules,
    raw: &mut RawModel,
    tendons: &mut HashMap<&'d str, Tendon>,
) {
    for node in reader.children(section, &["fixed", "spatial"], &[]) {
        let element = classes.resolve(reader, node, &["tendon"], MAIN);
        reader.attributes(node, ATTRIBUTES);
        let shown = element.name().map_or("without a name".into(), |name| quote(name.value));
        let whose = format!("tendon {shown}: ");
        let tendon = match node.tag_name().name() {
            "fixed" => fixed(reader, node, built, &whose),
            _ => Some(Tendon::default()),
        };
        let Some(tendon) = tendon else { continue };
        act(reader, &element, &tendon, rules, raw, &whose);
        if let Some(name) = element.name() {
            if tendons.insert(name.value, tendon).is_some() {
                let message = format!("{whose}it is defined twice");
                reader.findings.error(name.span, message, "rename one of them");
            }
        }
    }
}

fn fixed(reader: &mut Reader, node: Node, built: &Built, whose: &str) -> Option<Tendon> {
    let mut tendon = Tendon::default();
    for term in reader.children(node, &["joint"], &[]) {
        reader.leaf(term, &["joint", "coef"]);
        reader.required(term, "joint", whose)?;
        let name = attribute(term, "joint")?;
        let Some(known) = built.joints.get(name.value) else {
            let message = format!("{whose}{} is not a joint", quote(name.value));
            reader.findings.error(name.span, message, "name a joint of this file");
            return None;
        };
        scalar(reader, known, &name, whose)?;
        let ratio = number(reader, &Element::plain(term), "coef", whose)?.value;
        tendon.only = tendon.terms.is_empty().then_some((known.index, known.rest));
        tendon.terms.push((known.name.clone(), known.reference, ratio));
    }
    Some(tendon)
}

/// Springs, dampers, rotors and limits of a tendon: on one joint they are that joint's own; otherwise they are refused.
fn act(reader: &mut Reader, element: &Element, tendon: &Tendon, rules: Rules, raw: &mut RawModel, whose: &str) {
    let spatial = tendon.terms.is_empty();
    if limited(reader, element, ("limited", "range"), rules.compiler.autolimits, whose) {
        let span = element.attribute("range").map_or(place(element.node), |text| text.span);
        let message = format!("{whose}the limit of a tendon is not modelled");
        match spatial {
            true => reader.findings.error(span, message, "write `limited=\"false\"`, or a loop in a TOML model"),
            false => reader.tally.add(Severity::Warning, "tendon", span, message, "write `limited=\"false\"`"),
        }
    }
    if let Some(loss) = number(reader, element, "frictionloss", whose).filter(|x| x.value != 0.0) {
        let message = "dry friction (`frictionloss`) of a tendon is not modelled";
        reader.tally.add(Severity::Warning, "tendon friction", loss.span, message, "set it to 0");
    }
    for (key, flag) in [("stiffness", "spring"), ("damping", "damper"), ("armature", "")] {
        let Some(given) = numbers(reader, element, key, 1..=3, whose).filter(|x| x.value.iter().any(|x| *x != 0.0))
        else {
            continue;
        };
        if !flag.is_empty() && !rules.options.on(flag) {
            continue;
        }
        let linear = given.value[1..].iter().all(|x| *x == 0.0);
        let joint = tendon.only.filter(|_| linear).and_then(|(k, rest)| Some((raw.joints.get_mut(k)?, rest)));
        let fits = joint.is_some_and(|(joint, rest)| match key {
            "stiffness" => spring(element, joint, rest, tendon.terms[0].2, &given),
            "damping" => add(&mut joint.damping, tendon.terms[0].2, &given),
            _ => add(&mut joint.armature, tendon.terms[0].2, &given),
        });
        if !fits {
            let message = format!("{whose}`{key}` of a tendon is not modelled");
            let help = "set it to 0, and add its effort as one of your own";
            reader.findings.error(given.span, message, help);
        }
    }
    if spatial {
        reader.tally.notice(place(element.node), "spatial tendons are not used");
    }
}

/// A spring on one joint whose length is relaxed where the joint's own springs are; others are not expressed.
fn spring(element: &Element, joint: &mut RawJoint, rest: f64, ratio: f64, given: &Spanned<Vec<f64>>) -> bool {
    let own_length = element.attribute("springlength").is_none_or(|text| text.value.trim() == "-1");
    if own_length {
        joint.rest = (rest != 0.0).then(|| RawFreedoms::All(RawNumber::constant(rest, given.span)));
        add(&mut joint.stiffness, ratio, given);
    }
    own_length
}

/// Adds to the coefficient of a joint of one freedom what acts on its coordinate times a ratio.
pub(super) fn add(slot: &mut Option<RawFreedoms>, ratio: f64, given: &Spanned<Vec<f64>>) -> bool {
    let old = match slot {
        Some(RawFreedoms::All(Spanned { value: RawValue::Const(x), .. })) => *x,
        _ => 0.0,
    };
    *slot = Some(RawFreedoms::All(RawNumber::constant(old + given.value[0] * ratio * ratio, given.span)));
    true
}
