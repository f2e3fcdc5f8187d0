//! Stops: the limits of joints.

use mbd_runtime::contact::RestitutionLaw;

use super::contacts::restitution;
use super::joints::{quantities, single};
use super::numbers::Numbers;
use crate::import::raw::{RawJoint, RawModel, RawMotion, RawNumber, RawValue};
use crate::import::source::Findings;
use crate::import::words::quote;
use crate::model::{ConstraintKind, Contact, Start, Value};

/// What to write in place of a parameter.
const CONSTANT: &str = "write a constant: parameters do not move stops";

/// All stops, with joints by their index in the file.
pub(super) fn stops(raw: &RawModel, numbers: &mut Numbers) -> Vec<Contact> {
    raw.joints.iter().enumerate().flat_map(|(index, joint)| of_joint(joint, index, numbers)).collect()
}

/// With final joint indices, in their order.
pub(super) fn placed(mut stops: Vec<Contact>, place: &[usize]) -> Vec<Contact> {
    let joint = |stop: &Contact| match &stop.kind {
        ConstraintKind::Coupling { terms, .. } => terms.first().map_or(0, |(joint, _)| *joint),
        ConstraintKind::Loop { .. } => 0,
    };
    for stop in &mut stops {
        if let ConstraintKind::Coupling { terms, .. } = &mut stop.kind {
            terms.iter_mut().for_each(|(joint, _)| *joint = place[*joint]);
        }
    }
    stops.sort_by_key(joint);
    stops
}

fn of_joint(joint: &RawJoint, index: usize, numbers: &mut Numbers) -> Vec<Contact> {
    let what = format!("joint {}", quote(&joint.name.value));
    let bounce = joint.limit_restitution.as_ref();
    let e = bounce.map_or(0.0, |x| restitution(x, "limit_restitution", &what, numbers));
    let Some(limits) = &joint.limits else {
        if let Some(x) = bounce {
            let message = format!("{what}: `limit_restitution` has no effect without `limits`");
            numbers.findings.warning(x.span, message, "add `limits = [lower, upper]`, or remove it");
        }
        return Vec::new();
    };
    let Some(kind) = joint.kind.as_ref().map(|k| k.value) else { return Vec::new() };
    if let Some((problem, help)) = unfit(joint, kind.nv(), kind.word()) {
        numbers.findings.error(limits.span, format!("{what}: {problem}"), help);
        return Vec::new();
    }
    let quantity = quantities(kind)[0];
    let mut limit = |x: &RawNumber| numbers.constant(x, quantity, &format!("{what}: `limits`"), CONSTANT);
    let (lower, upper) = (limits.lower.as_ref().map(&mut limit), limits.upper.as_ref().map(&mut limit));
    if let (Some(a), Some(b)) = (lower, upper) {
        if a >= b {
            let problem = if a == b { "are equal, so that it cannot move" } else { "are reversed" };
            let help = "write the lower one first: `limits = [lower, upper]`";
            numbers.findings.error(limits.span, format!("{what}: its `limits` {problem}"), help);
        }
    }
    // The gaps q - lower and upper - q.
    let stop = |(word, ratio, limit): (&str, f64, Option<f64>)| {
        limit.map(|limit| Contact {
            name: format!("{}/{word}", joint.name.value),
            kind: ConstraintKind::Coupling {
                terms: vec![(index, Value::Const(ratio))],
                offset: Value::Const(ratio * limit),
            },
            friction: 0.0,
            restitution: e,
            law: RestitutionLaw::default(),
            shapes: None,
            origin: numbers.findings.origin(limits.span),
        })
    };
    [("lower", 1.0, lower), ("upper", -1.0, upper)].into_iter().filter_map(stop).collect()
}

/// Why a joint cannot have stops, and what to do.
fn unfit(joint: &RawJoint, nv: usize, word: &str) -> Option<(String, String)> {
    if nv != 1 {
        return Some((
            format!("a {word} joint has no `limits`"),
            format!("only joints of one freedom have: {}", single()),
        ));
    }
    if let Some(mimic) = &joint.mimic {
        let leader = quote(&mimic.leader.value);
        return Some((format!("`limits` on a joint that follows {leader}"), format!("move them to {leader}")));
    }
    let help = "remove them: the position of a prescribed joint comes with every call";
    let prescribed = matches!(joint.motion, RawMotion::Prescribed(_));
    prescribed.then(|| ("`limits` on a joint whose motion is prescribed".into(), help.into()))
}

/// Warns about joints that start behind one of their stops. `order` gives the file index of each joint of `starts`.
pub(super) fn starts_between(raw: &RawModel, order: &[usize], starts: &[Start], findings: &mut Findings) {
    for start in starts {
        let joint = &raw.joints[order[start.joint]];
        let (Some(limits), [q]) = (&joint.limits, &start.q[..]) else { continue };
        let beyond = |limit: &Option<RawNumber>, sign: f64| matches!(limit.as_ref().map(|x| &x.value), Some(RawValue::Const(x)) if sign * (q - x) < 0.0);
        if beyond(&limits.lower, 1.0) || beyond(&limits.upper, -1.0) {
            let message = format!("joint {} starts outside its `limits`", quote(&joint.name.value));
            findings.warning(limits.span, message, "change its `start`, or the limits");
        }
    }
}
