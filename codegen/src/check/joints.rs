//! Joints: axes, passive elements, source of motion.

use super::names::Names;
use super::numbers::{Numbers, Quantity};
use crate::import::raw::{RawFreedoms, RawJoint, RawModel, RawMotion, RawNumber, RawValue};
use crate::import::source::{Findings, Span};
use crate::import::words::{list, quote};
use crate::model::{Joint, JointBounds, JointKind, JointMotion, JointSpec, Value, JOINTS};
use crate::rounded_once::norm;

/// What each coordinate measures.
pub(super) fn quantities(kind: &JointSpec) -> Vec<Quantity> {
    kind.coordinates.iter().map(|c| c.unit.into()).collect()
}

/// The kinds of one freedom, for messages.
pub(super) fn single() -> String {
    list(JOINTS.iter().filter(|kind| kind.nv() == 1).map(JointSpec::word))
}

/// A joint with everything but its indices, which are filled in when the tree is known.
pub(super) fn joint(raw: &RawJoint, numbers: &mut Numbers) -> Joint {
    let what = format!("joint {}", quote(&raw.name.value));
    let placement = numbers.placement(&raw.placement, &what);
    let kind = raw.kind.as_ref().map(|k| k.value);
    let motion = motion(raw, kind, &what, numbers);
    let joint_kind = match kind {
        Some(kind) => {
            superfluous(raw, kind, &what, numbers.findings);
            joint_kind(raw, kind, &what, numbers)
        }
        None => JointKind::Fixed,
    };
    let mut joint = Joint::new(&raw.name.value, joint_kind, None, 0, placement);
    (joint.unbounded, joint.motion) = (raw.unbounded, motion);
    joint.origin = numbers.findings.origin(raw.name.span);
    // How many freedoms an unknown type has is unknown.
    let Some(kind) = kind else { return joint };
    let plain = vec![Quantity::Plain; joint_kind.nv()];
    let rest = if kind.has_springs() { quantities(kind) } else { plain.clone() };
    joint.damping = freedoms(&raw.damping, &plain, "damping", kind, &what, numbers);
    joint.stiffness = freedoms(&raw.stiffness, &plain, "stiffness", kind, &what, numbers);
    joint.rest = freedoms(&raw.rest, &rest, "rest", kind, &what, numbers);
    joint.armature = freedoms(&raw.armature, &plain, "armature", kind, &what, numbers);
    joint.bounds = bounds(raw, &what, numbers.findings);
    signs(raw, &joint, &what, numbers);
    joint
}

/// What a joint is made for: constants.
fn bounds(raw: &RawJoint, what: &str, findings: &mut Findings) -> JointBounds {
    let mut constant = |number: &RawNumber, key: &str| match number.value {
        RawValue::Const(x) => Some(x),
        RawValue::Invalid => None,
        _ => {
            findings.error(number.span, format!("{what}: `{key}` cannot be a parameter"), "write a number");
            None
        }
    };
    let range = raw.range.as_ref().map(|range| {
        let mut end = |x: &Option<RawNumber>, open: f64| match x {
            None => Some(open),
            Some(x) => constant(x, "range"),
        };
        (range.span, end(&range.lower, f64::NEG_INFINITY), end(&range.upper, f64::INFINITY))
    });
    let mut largest = |number: &Option<RawNumber>, key| {
        number.as_ref().and_then(|number| constant(number, key).map(|x| (number.span, key, x)))
    };
    let (velocity, effort) = (largest(&raw.max_velocity, "max_velocity"), largest(&raw.max_effort, "max_effort"));
    for (span, key, x) in [velocity, effort].into_iter().flatten() {
        if x <= 0.0 {
            let help = "leave it out for a joint without a limit";
            findings.error(span, format!("{what}: `{key}` is {x} and must be positive"), help);
        }
    }
    let range = range.and_then(|(span, lower, upper)| {
        let (lower, upper) = (lower?, upper?);
        if lower >= upper {
            let help = "write the lower end first: `[lower, upper]`";
            findings.error(span, format!("{what}: `range` from {lower} to {upper} is empty"), help);
        }
        Some([lower, upper])
    });
    JointBounds { range, velocity: velocity.map(|v| v.2), effort: effort.map(|e| e.2) }
}

fn joint_kind(raw: &RawJoint, kind: &JointSpec, what: &str, numbers: &mut Numbers) -> JointKind {
    let mut axes = [[0.0; 3]; 2];
    for (k, (key, given)) in [("axis", &raw.axis), ("axis2", &raw.axis2)].into_iter().enumerate() {
        let Some(default) = kind.axes.get(k) else { continue };
        let given = given.as_ref().and_then(|axis| numbers.direction(axis, &format!("{what}: `{key}`")));
        axes[k] = given.unwrap_or(*default);
    }
    if kind.axes.len() == 2 && parallel(axes[0], axes[1]) {
        let span = raw.axis2.as_ref().or(raw.axis.as_ref()).map_or(raw.name.span, |a| a.span);
        let message = format!("{what}: the two axes of a {} joint are parallel", kind.word());
        let help = "the second axis has to cross the first: by default they are x and y";
        numbers.findings.error(span, message, help);
    }
    let pitch = if kind.pitch { pitch(raw, kind.word(), what, numbers) } else { Value::ZERO };
    (kind.make)(axes, pitch)
}

fn pitch(raw: &RawJoint, word: &str, what: &str, numbers: &mut Numbers) -> Value {
    if raw.pitch.is_none() {
        let help = "add `pitch = ..`, metres along the axis per radian (lead per turn / 2 pi)";
        numbers.findings.error(raw.name.span, format!("{what}: a {word} joint needs a `pitch`"), help);
    }
    let pitch = numbers.or_zero(&raw.pitch, Quantity::Pitch, &format!("{what}: `pitch`"));
    if let (Some(p), Some(0.0)) = (&raw.pitch, pitch.constant()) {
        let message = format!("{what}: a {word} joint of pitch 0 is a revolute joint");
        numbers.findings.warning(p.span, message, "make it `revolute`");
    }
    pitch
}

/// Within a microradian of parallel: the two rates could not be told apart.
pub(super) fn parallel(a: [f64; 3], b: [f64; 3]) -> bool {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    norm(cross) <= 1e-6 * norm(a) * norm(b)
}

/// Entries that mean nothing on a joint of this type.
fn superfluous(raw: &RawJoint, kind: &JointSpec, what: &str, findings: &mut Findings) {
    let at = |f: &Option<RawFreedoms>| f.as_ref().map(span_of);
    let (has_spring, moves) = (kind.has_springs(), kind.nv() > 0);
    let entries = [
        ("axis", raw.axis.as_ref().map(|a| a.span), !kind.axes.is_empty()),
        ("axis2", raw.axis2.as_ref().map(|a| a.span), kind.axes.len() > 1),
        ("pitch", raw.pitch.as_ref().map(|p| p.span), kind.pitch),
        ("damping", at(&raw.damping), moves),
        ("stiffness", at(&raw.stiffness), has_spring),
        ("rest", at(&raw.rest), has_spring),
        ("armature", at(&raw.armature), moves),
        ("range", raw.range.as_ref().map(|range| range.span), kind.nv() == 1),
        ("max_velocity", raw.max_velocity.as_ref().map(|x| x.span), moves),
        ("max_effort", raw.max_effort.as_ref().map(|x| x.span), moves),
    ];
    for (key, span, allowed) in entries {
        if let (Some(span), false) = (span, allowed) {
            let help = match key {
                "stiffness" | "rest" if moves => {
                    "there is no linear spring on its coordinates: remove it, or give its torque from outside"
                }
                "axis2" => "remove it, or make the joint `universal`",
                "pitch" => "remove it, or make the joint `helical`",
                _ => "remove it, or change the type of the joint",
            };
            findings.error(span, format!("{what}: a {} joint has no `{key}`", kind.word()), help);
        }
    }
}

pub(super) fn span_of(f: &RawFreedoms) -> Span {
    match f {
        RawFreedoms::All(x) => x.span,
        RawFreedoms::Each(list) => list.span,
    }
}

/// One value per freedom, zeros where nothing is given or nothing belongs.
fn freedoms(
    raw: &Option<RawFreedoms>,
    quantities: &[Quantity],
    key: &str,
    kind: &JointSpec,
    what: &str,
    numbers: &mut Numbers,
) -> Vec<Value> {
    let n = quantities.len();
    let named = format!("{what}: `{key}`");
    match raw {
        None => vec![Value::ZERO; n],
        Some(RawFreedoms::All(x)) => {
            // An angle among the coordinates makes the number one.
            let quantity = quantities.iter().copied().find(|q| *q == Quantity::Angle).or(quantities.first().copied());
            vec![numbers.value(x, quantity.unwrap_or(Quantity::Plain), &named); n]
        }
        Some(RawFreedoms::Each(list)) => {
            let quantity = |k: usize| quantities.get(k).copied().unwrap_or(Quantity::Plain);
            let mut values: Vec<Value> =
                list.value.iter().enumerate().map(|(k, x)| numbers.value(x, quantity(k), &named)).collect();
            if values.len() != n {
                // A joint without freedoms is told so already.
                if n > 0 {
                    let message =
                        format!("{named} has {} numbers, and a {} joint has {}", values.len(), kind.word(), of(n));
                    let help =
                        if n == 1 { "write one number".into() } else { format!("write {n} numbers, or one for all") };
                    numbers.findings.error(list.span, message, help);
                }
                values.resize(n, Value::ZERO);
            }
            values
        }
    }
}

fn of(n: usize) -> String {
    format!("{n} freedom{}", if n == 1 { "" } else { "s" })
}

/// Signs and idle springs.
fn signs(raw: &RawJoint, joint: &Joint, what: &str, numbers: &mut Numbers) {
    let negative = |values: &[Value]| values.iter().any(|v| v.constant().is_some_and(|x| x < 0.0));
    if let (Some(f), true) = (&raw.damping, negative(&joint.damping)) {
        let message = format!("{what}: negative damping feeds energy into the motion");
        numbers.findings.warning(span_of(f), message, "damping that brakes is positive");
    }
    if let (Some(f), true) = (&raw.stiffness, negative(&joint.stiffness)) {
        let message = format!("{what}: a spring of negative stiffness pushes away from its rest position");
        numbers.findings.warning(span_of(f), message, "stiffness that pulls back is positive");
    }
    if let (Some(f), true) = (&raw.armature, negative(&joint.armature)) {
        let message = format!("{what}: armature is an inertia and cannot be negative");
        numbers.findings.error(span_of(f), message, "write the rotor inertia times the square of the gear ratio");
    }
    if let (Some(f), None) = (&raw.rest, &raw.stiffness) {
        let message = format!("{what}: `rest` has no effect without `stiffness`");
        numbers.findings.warning(span_of(f), message, "add `stiffness`, or remove `rest`");
    }
}

fn motion(raw: &RawJoint, kind: Option<&JointSpec>, what: &str, numbers: &mut Numbers) -> JointMotion {
    if let RawMotion::Prescribed(span) = raw.motion {
        if kind.is_some_and(|kind| kind.nv() == 0) {
            let message = format!("{what}: a fixed joint has no motion to prescribe");
            numbers.findings.error(span, message, "remove `motion`, or change the type of the joint");
        }
        if raw.mimic.is_some() {
            let message = format!("{what}: motion is prescribed and follows another joint at the same time");
            numbers.findings.error(span, message, "remove `motion` or `mimic`");
        }
    }
    let Some(mimic) = &raw.mimic else {
        return match raw.motion {
            RawMotion::Free => JointMotion::Free,
            RawMotion::Prescribed(_) => JointMotion::Prescribed,
        };
    };
    if let Some(kind) = kind.filter(|k| k.nv() != 1) {
        let message = format!("{what}: a {} joint cannot mimic another", kind.word());
        let help = format!("only joints of one freedom can: {}", single());
        numbers.findings.error(mimic.span, message, help);
    }
    let ratio = mimic.ratio.as_ref().map(|r| numbers.value(r, Quantity::Plain, &format!("{what}: `ratio`")));
    if let (Some(0.0), Some(r)) = (ratio.and_then(Value::constant), &mimic.ratio) {
        let message = format!("{what}: with a ratio of 0 it never moves");
        numbers.findings.warning(r.span, message, "make it a `fixed` joint, or correct the ratio");
    }
    let quantity = kind.and_then(|kind| kind.coordinates.first()).map_or(Quantity::Plain, |c| c.unit.into());
    let offset = numbers.or_zero(&mimic.offset, quantity, &format!("{what}: `offset`"));
    JointMotion::Mimic { leader: 0, ratio: ratio.unwrap_or(Value::ONE), offset }
}

/// File index of the leader of each joint that mimics one. Reports leaders that cannot lead and rings.
pub(super) fn leaders(raw: &RawModel, names: &Names, findings: &mut Findings) -> Vec<Option<usize>> {
    let mut leaders = Vec::new();
    for j in &raw.joints {
        let what = format!("joint {}", quote(&j.name.value));
        let leader = j.mimic.as_ref().and_then(|m| {
            let leader = names.joint(&m.leader, "leader ", &what, findings)?;
            let kind = raw.joints[leader].kind.as_ref().map(|k| k.value);
            if let Some(kind) = kind.filter(|k| k.nv() != 1) {
                let message = format!("{what}: leader {} is a {} joint", quote(&m.leader.value), kind.word());
                let help = format!("only joints of one freedom can lead: {}", single());
                findings.error(m.leader.span, message, help);
            }
            Some(leader)
        });
        leaders.push(leader);
    }
    rings(raw, &leaders, findings);
    leaders
}

/// Reports each ring of leaders once.
fn rings(raw: &RawModel, leaders: &[Option<usize>], findings: &mut Findings) {
    // 0: not visited; k: visited by the walk that started at joint k - 1.
    let mut walk = vec![0; leaders.len()];
    for start in 0..leaders.len() {
        let mut at = start;
        while walk[at] == 0 {
            walk[at] = start + 1;
            let Some(next) = leaders[at] else { break };
            at = next;
            if walk[at] != start + 1 {
                continue;
            }
            let mut ring = vec![at];
            let mut next = leaders[at];
            while let Some(j) = next.filter(|&j| j != at) {
                ring.push(j);
                next = leaders[j];
            }
            ring.sort_unstable();
            let first = &raw.joints[ring[0]];
            let span = first.mimic.as_ref().map_or(first.name.span, |m| m.leader.span);
            let message = match ring.len() {
                1 => format!("joint {} mimics itself", quote(&first.name.value)),
                _ => format!(
                    "joints {} mimic one another in a circle",
                    list(ring.iter().map(|&j| raw.joints[j].name.value.as_str()))
                ),
            };
            findings.error(span, message, "name a joint that moves by itself as the leader");
        }
    }
}
