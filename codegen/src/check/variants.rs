//! Variants: the description of a mechanism after changes of its tree, as a description of its own.

use crate::import::raw::{RawConstraint, RawContact, RawJoint, RawModel, RawMotion, RawVariant};
use crate::import::source::{Findings, Spanned};
use crate::import::words::{did_you_mean, list, quote};
use crate::model::FLOATING;

/// The description of a variant, to be checked as any other. Names of `remove`, `cut` and `lock` that mean nothing are
/// reported.
pub(crate) fn changed(base: &RawModel, variant: &RawVariant, findings: &mut Findings) -> RawModel {
    let mut raw = base.clone();
    raw.variants.clear();
    raw.incomplete |= variant.added.incomplete;
    for name in &variant.remove {
        remove(name, base, &mut raw, findings);
    }
    let mut changes: Vec<&Spanned<String>> = Vec::new();
    for name in &variant.cut {
        cut(name, base, &mut raw, findings);
        once(name, &mut changes, findings);
    }
    for name in &variant.lock {
        lock(name, base, &mut raw, findings);
        once(name, &mut changes, findings);
    }
    let RawModel { bodies, joints, frames, wrenches, constraints, shapes, contacts, .. } = variant.added.clone();
    raw.bodies.extend(bodies);
    joints.into_iter().for_each(|joint| add(joint, base, &mut raw, &changes, findings));
    raw.frames.extend(frames);
    raw.wrenches.extend(wrenches);
    raw.constraints.extend(constraints);
    raw.shapes.extend(shapes);
    raw.contacts.extend(contacts);
    raw
}

/// Reports a joint that is changed twice.
fn once<'v>(name: &'v Spanned<String>, changes: &mut Vec<&'v Spanned<String>>, findings: &mut Findings) {
    match changes.iter().find(|other| other.value == name.value) {
        Some(other) => {
            let line = findings.origin(other.span).line;
            let message = format!("{} is changed twice, first in line {line}", quote(&name.value));
            findings.error(name.span, message, "a joint is cut or locked: keep one of them");
        }
        None => changes.push(name),
    }
}

/// Leaves a body out, with its joint and what is fixed to it.
fn remove(name: &Spanned<String>, base: &RawModel, raw: &mut RawModel, findings: &mut Findings) {
    let is = |other: &Option<Spanned<String>>| other.as_ref().is_some_and(|other| other.value == name.value);
    let known = base.bodies.iter().any(|body| body.name.value == name.value);
    if !known {
        if !base.incomplete {
            let names = || base.bodies.iter().map(|body| body.name.value.as_str());
            let help = did_you_mean(&name.value, names(), || format!("the bodies are {}", list(names())));
            findings.error(name.span, format!("`remove`: {} is not a body", quote(&name.value)), help);
        }
        return;
    }
    raw.bodies.retain(|body| body.name.value != name.value);
    raw.joints.retain(|joint| !is(&joint.child));
    raw.frames.retain(|frame| !is(&frame.body));
    raw.wrenches.retain(|wrench| wrench.body.value != name.value);
    raw.shapes.retain(|shape| !is(&shape.body));
}

/// A joint becomes a floating one; a loop, coupling or contact is left out.
fn cut(name: &Spanned<String>, base: &RawModel, raw: &mut RawModel, findings: &mut Findings) {
    let is = |other: &Spanned<String>| other.value == name.value;
    let joint = base.joints.iter().any(|joint| is(&joint.name));
    let other = base.constraints.iter().find(|c| is(c.name())).map(RawConstraint::kind);
    let other = other.or_else(|| base.contacts.iter().any(|c| is(&c.name)).then_some("contact"));
    match (joint, other) {
        (true, Some(other)) => {
            let message = format!("`cut`: {} names a joint and a {other}", quote(&name.value));
            findings.error(name.span, message, "rename one of them");
        }
        (true, None) => {
            for joint in raw.joints.iter_mut().filter(|joint| is(&joint.name)) {
                // An unknown kind was reported where it stands.
                let kind = joint.kind.as_ref().map(|kind| Spanned::new(&FLOATING, kind.span));
                *joint = RawJoint::new(joint.name.clone(), kind, joint.child.clone());
            }
        }
        (false, Some(_)) => {
            raw.constraints.retain(|c| !is(c.name()));
            raw.contacts.retain(|c: &RawContact| !is(&c.name));
        }
        (false, None) => {
            let joints = || base.joints.iter().map(|joint| joint.name.value.as_str());
            let others = || base.constraints.iter().map(|c| c.name().value.as_str());
            let names = || joints().chain(others()).chain(base.contacts.iter().map(|c| c.name.value.as_str()));
            unknown("cut", "a joint, loop, coupling or contact", name, base, names, findings);
        }
    }
}

/// A joint becomes a prescribed one, without what acts on its coordinates.
fn lock(name: &Spanned<String>, base: &RawModel, raw: &mut RawModel, findings: &mut Findings) {
    let Some(at) = base.joints.iter().position(|joint| joint.name.value == name.value) else {
        let names = || base.joints.iter().map(|joint| joint.name.value.as_str());
        unknown("lock", "a joint", name, base, names, findings);
        return;
    };
    let refuse = |why: &str, help: &str, findings: &mut Findings| {
        findings.error(name.span, format!("`lock`: joint {} {why}", quote(&name.value)), help);
    };
    if base.joints[at].kind.as_ref().is_some_and(|kind| kind.value.nv() == 0) {
        return refuse("is fixed already", "name a joint that can move", findings);
    }
    if base.joints[at].mimic.is_some() {
        return refuse("follows another joint", "lock the one that it follows", findings);
    }
    for joint in raw.joints.iter_mut().filter(|joint| joint.name.value == name.value) {
        *joint = RawJoint {
            parent: joint.parent.clone(),
            placement: joint.placement.clone(),
            axis: joint.axis.clone(),
            axis2: joint.axis2.clone(),
            pitch: joint.pitch.clone(),
            motion: RawMotion::Prescribed(name.span),
            ..RawJoint::new(joint.name.clone(), joint.kind.clone(), joint.child.clone())
        };
    }
}

/// A joint takes the place of the one that carries its child, or is the joint of a new body.
fn add(joint: RawJoint, base: &RawModel, raw: &mut RawModel, changes: &[&Spanned<String>], findings: &mut Findings) {
    let child = joint.child.as_ref().map(|child| child.value.as_str());
    let carries = |j: &RawJoint| child.is_some() && j.child.as_ref().map(|c| c.value.as_str()) == child;
    let of_base = |name: &str| base.joints.iter().any(|j| j.name.value == name);
    // Only the joints of the model are replaced: a second new joint of a body is one too many.
    let found = raw.joints.iter().position(|j| carries(j) && of_base(&j.name.value) && base.joints.iter().any(carries));
    let Some(at) = found else { return raw.joints.push(joint) };
    let old = &raw.joints[at].name.value;
    if changes.iter().any(|change| change.value == *old) {
        let message = format!(
            "joint {}: it replaces joint {}, which the variant cuts or locks",
            quote(&joint.name.value),
            quote(old)
        );
        findings.error(joint.name.span, message, "keep one of the two changes");
    }
    raw.joints[at] = joint;
}

fn unknown<'r, I: Iterator<Item = &'r str>>(
    key: &str,
    what: &str,
    name: &Spanned<String>,
    base: &RawModel,
    names: impl Fn() -> I,
    findings: &mut Findings,
) {
    // What had to be left out may be what is missed.
    if base.incomplete {
        return;
    }
    let help = did_you_mean(&name.value, names(), || format!("there are {}", list(names())));
    findings.error(name.span, format!("`{key}`: {} is not {what}", quote(&name.value)), help);
}
