//! Where the closing of loops begins.

use super::joints::{quantities, span_of};
use super::numbers::{Numbers, Quantity};
use crate::import::raw::{RawFreedoms, RawJoint, RawModel, RawMotion, RawNumber};
use crate::import::source::{Findings, Span};
use crate::import::words::quote;
use crate::model::{JointSpec, Start};
use crate::rounded_once::norm;

/// What is stated, with joints by their index in the file.
pub(super) fn starts(raw: &RawModel, numbers: &mut Numbers) -> Vec<Start> {
    let mut starts = Vec::new();
    for (index, joint) in raw.joints.iter().enumerate() {
        let what = format!("joint {}", quote(&joint.name.value));
        if idle(joint, &what, numbers.findings) {
            continue;
        }
        let held = joint.held.as_ref().is_some_and(|h| h.value);
        if let (Some(at), true, true) = (&joint.held, held, raw.constraints.is_empty()) {
            let message = format!("{what}: `held` has no effect where there are no loops");
            numbers.findings.warning(at.span, message, "remove it, or add what closes the loop as a `[[loop]]`");
        }
        let Some(kind) = joint.kind.as_ref().map(|k| k.value) else { continue };
        let q = match &joint.start {
            Some(start) => coordinates_of(start, kind, &what, numbers),
            None => kind.neutral(),
        };
        let v = match &joint.start_velocity {
            Some(velocity) => velocities_of(velocity, kind, &what, numbers),
            None => vec![0.0; kind.nv()],
        };
        if joint.start.is_some() || joint.start_velocity.is_some() || held {
            let stated = joint.start.is_some() || held;
            starts.push(Start { joint: index, q, v, held, stated });
        }
    }
    starts
}

/// With final joint indices, in their order.
pub(super) fn placed(mut starts: Vec<Start>, place: &[usize]) -> Vec<Start> {
    for start in &mut starts {
        start.joint = place[start.joint];
    }
    starts.sort_by_key(|s| s.joint);
    starts
}

/// Reports a start of coordinates that are not free, and says whether there was one.
fn idle(joint: &RawJoint, what: &str, findings: &mut Findings) -> bool {
    let start = joint.start.as_ref().map(|s| ("start", span_of(s)));
    let velocity = joint.start_velocity.as_ref().map(|v| ("start_velocity", span_of(v)));
    let held = joint.held.as_ref().map(|h| ("held", h.span));
    let mut found = false;
    for (key, span) in start.into_iter().chain(velocity).chain(held) {
        let (why, help) = if let Some(mimic) = &joint.mimic {
            let leader = quote(&mimic.leader.value);
            (format!("`{key}` on a joint that follows {leader}"), format!("move it to {leader}"))
        } else if matches!(joint.motion, RawMotion::Prescribed(_)) {
            let help = "remove it: the position of a prescribed joint comes with every call";
            (format!("`{key}` on a joint whose motion is prescribed"), help.into())
        } else if joint.kind.as_ref().is_some_and(|k| k.value.nv() == 0) {
            (format!("a fixed joint has no `{key}`"), "remove it, or change the type of the joint".into())
        } else {
            continue;
        };
        findings.error(span, format!("{what}: {why}"), help);
        found = true;
    }
    found
}

/// The numbers under a key, alone or in a list.
fn each(given: &RawFreedoms) -> &[RawNumber] {
    match given {
        RawFreedoms::All(x) => std::slice::from_ref(x),
        RawFreedoms::Each(list) => &list.value,
    }
}

fn velocities_of(given: &RawFreedoms, kind: &JointSpec, what: &str, numbers: &mut Numbers) -> Vec<f64> {
    let number = |x| constant(x, Quantity::Plain, "start_velocity", what, numbers);
    let v: Vec<f64> = each(given).iter().map(number).collect();
    let wanted = kind.nv();
    if v.len() == wanted {
        return v;
    }
    let plural = |n: usize| if n == 1 { "" } else { "s" };
    let message = format!(
        "{what}: `start_velocity` has {} number{}, and a {} joint has {wanted} velocit{}",
        v.len(),
        plural(v.len()),
        kind.word(),
        if wanted == 1 { "y" } else { "ies" }
    );
    let names: Vec<&str> = kind.freedoms.iter().map(|freedom| freedom.name).collect();
    let help = match wanted {
        1 => "write one number".into(),
        _ => format!("write them in this order: {}", names.join(", ")),
    };
    numbers.findings.error(span_of(given), message, help);
    vec![0.0; wanted]
}

fn coordinates_of(start: &RawFreedoms, kind: &JointSpec, what: &str, numbers: &mut Numbers) -> Vec<f64> {
    let wanted = quantities(kind);
    let mut q: Vec<f64> = each(start)
        .iter()
        .enumerate()
        .map(|(k, x)| constant(x, wanted.get(k).copied().unwrap_or(Quantity::Plain), "start", what, numbers))
        .collect();
    if q.len() != wanted.len() {
        // A joint without coordinates is told so already.
        if !wanted.is_empty() {
            length(q.len(), wanted.len(), kind, what, span_of(start), numbers.findings);
        }
        return kind.neutral();
    }
    if let Some(first) = kind.quaternion() {
        unit(&mut q[first..], what, span_of(start), numbers.findings);
    }
    q
}

fn length(got: usize, n: usize, kind: &JointSpec, what: &str, span: Span, findings: &mut Findings) {
    let plural = |n: usize| if n == 1 { "" } else { "s" };
    let message = format!(
        "{what}: `start` has {got} number{}, and a {} joint has {n} coordinate{}",
        plural(got),
        kind.word(),
        plural(n)
    );
    let help = match kind.quaternion() {
        Some(0) => "write the unit quaternion: `[x, y, z, w]`".into(),
        Some(_) => "write the origin, then the unit quaternion: `[x, y, z, qx, qy, qz, qw]`".into(),
        None if n == 1 => "write one number".into(),
        None => format!("write {n} numbers, in the order of the coordinates"),
    };
    findings.error(span, message, help);
}

/// A constant; NaN where there is none.
fn constant(x: &RawNumber, quantity: Quantity, key: &str, what: &str, numbers: &mut Numbers) -> f64 {
    let help = "write a constant: the model begins there, whatever its parameters";
    numbers.constant(x, quantity, &format!("{what}: `{key}`"), help)
}

/// Scales a quaternion to unit length.
fn unit(q: &mut [f64], what: &str, span: Span, findings: &mut Findings) {
    let n = norm([q[0], q[1], q[2], q[3]]);
    let order = "write a unit quaternion in the order x, y, z, w: no rotation is `0, 0, 0, 1`";
    if n < 1e-9 {
        findings.error(span, format!("{what}: the quaternion in `start` is zero"), order);
        return;
    }
    if (n - 1.0).abs() > 1e-3 {
        let message = format!("{what}: the quaternion in `start` has length {}", (n * 1e4).round() / 1e4);
        findings.warning(span, message, format!("it is scaled to 1; {order}"));
    }
    // One of unit length to rounding stays as it is written.
    if (n - 1.0).abs() > 4.0 * f64::EPSILON {
        q.iter_mut().for_each(|x| *x /= n);
    }
}
