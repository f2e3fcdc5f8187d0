//! Couplings: linear equations between the coordinates of joints.

use super::decay;
use super::joints::single;
use super::names::Names;
use super::numbers::{Numbers, Quantity};
use crate::import::raw::{RawCoupling, RawModel, RawMotion, RawNumber};
use crate::import::source::{Findings, Spanned};
use crate::import::words::quote;
use crate::model::{Constraint, ConstraintKind, Value};

/// A coupling, with joints by their index in the file; `None` where something was reported.
pub(super) fn constraint(
    raw: &RawCoupling,
    model: &RawModel,
    names: &Names,
    numbers: &mut Numbers,
) -> Option<Constraint> {
    let what = format!("coupling {}", quote(&raw.name.value));
    let joints = raw.joints.as_ref().and_then(|list| joints(list, model, names, &what, numbers.findings));
    let ratios: Option<Vec<Value>> =
        raw.ratios.as_ref().map(|list| list.value.iter().map(|r| ratio(r, &what, numbers)).collect());
    let offset = numbers.or_zero(&raw.offset, Quantity::Plain, &format!("{what}: `offset`"));
    let decay = decay(raw.decay.as_ref(), &what, numbers);
    if let (Some(named), Some(list)) = (&raw.joints, &raw.ratios) {
        let (n, m) = (named.value.len(), list.value.len());
        if n != m {
            let message = format!("{what}: {n} joint{} and {m} ratio{}", plural(n), plural(m));
            numbers.findings.error(list.span, message, "write one ratio for each joint, in the same order");
            return None;
        }
    }
    let terms = joints?.into_iter().zip(ratios?).collect();
    let kind = ConstraintKind::Coupling { terms, offset };
    Some(Constraint { name: raw.name.value.clone(), kind, decay, origin: numbers.findings.origin(raw.name.span) })
}

fn plural(n: usize) -> &'static str {
    if n == 1 {
        ""
    } else {
        "s"
    }
}

/// The joints of a coupling, if all of them can be coupled.
fn joints(
    list: &Spanned<Vec<Spanned<String>>>,
    model: &RawModel,
    names: &Names,
    what: &str,
    findings: &mut Findings,
) -> Option<Vec<usize>> {
    if list.value.len() < 2 {
        let message = format!("{what} has {} joint{}", list.value.len(), plural(list.value.len()));
        findings.error(list.span, message, "name at least two joints; a joint that never moves is `fixed`");
        return None;
    }
    let mut found = Vec::new();
    for name in &list.value {
        let Some(joint) = names.joint(name, "", what, findings) else { continue };
        if found.contains(&joint) {
            let message = format!("{what}: joint {} stands twice", quote(&name.value));
            findings.error(name.span, message, "keep one of them, with the sum of both ratios");
        } else if can_be_coupled(name, joint, model, what, findings) {
            found.push(joint);
        }
    }
    (found.len() == list.value.len()).then_some(found)
}

fn can_be_coupled(name: &Spanned<String>, joint: usize, model: &RawModel, what: &str, findings: &mut Findings) -> bool {
    let source = &model.joints[joint];
    let shown = quote(&name.value);
    let (message, help) = if let Some(mimic) = &source.mimic {
        let help = format!("couple its leader {} instead, with the ratio of both", quote(&mimic.leader.value));
        (format!("{what}: joint {shown} follows another by `mimic`"), help)
    } else if matches!(source.motion, RawMotion::Prescribed(_)) {
        let help = "couple joints that are free, or remove its `motion`: a prescribed joint does not yield";
        (format!("{what}: the motion of joint {shown} is prescribed"), help.into())
    } else if let Some(kind) = source.kind.as_ref().map(|k| k.value).filter(|k| k.nv() != 1) {
        let help = format!("only joints of one freedom can be coupled: {}", single());
        (format!("{what}: {shown} is a {} joint", kind.word()), help)
    } else {
        return true;
    };
    findings.error(name.span, message, help);
    false
}

fn ratio(raw: &RawNumber, what: &str, numbers: &mut Numbers) -> Value {
    let value = numbers.value(raw, Quantity::Plain, &format!("{what}: `ratios`"));
    if numbers.at_default(value) == 0.0 {
        let by_default = if value.constant().is_none() { ", the default of its parameter," } else { "" };
        let message = format!("{what}: a ratio of 0{by_default} leaves its joint out");
        numbers.findings.error(raw.span, message, "remove the joint and its ratio, or correct the ratio");
    }
    value
}
