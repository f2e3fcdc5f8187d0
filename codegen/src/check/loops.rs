//! Loops: what they bind and how.

use super::decay;
use super::names::{End, Names};
use super::numbers::{Numbers, Quantity};
use crate::import::raw::{RawConstraint, RawLoop, RawModel, RawNumber};
use crate::import::source::{Findings, Span, Spanned};
use crate::import::words::quote;
use crate::model::{
    Body, Constraint, ConstraintKind, Frame, Joint, JointMotion, LoopKind, LoopNumbers, LoopSpec, Mount, NumberKey,
    Placement, Value, LOOPS,
};
use crate::rounded_once::norm;

/// Cosine up to which two axes pass for being at right angles: seven digits.
const RIGHT_ANGLE: f64 = 1e-6;

/// A loop; `None` where something about it was reported that leaves it without meaning.
pub(super) fn constraint(
    raw: &RawLoop,
    model: &RawModel,
    names: &Names,
    frames: &[Frame],
    numbers: &mut Numbers,
) -> Option<Constraint> {
    let what = format!("loop {}", quote(&raw.name.value));
    if let Some(kind) = &raw.kind {
        entries(raw, kind.value, &what, numbers.findings);
    }
    let kind = raw.kind.as_ref().map(|k| loop_kind(raw, k.value, &what, numbers));
    let decay = decay(raw.number("decay"), &what, numbers);
    let mounts = raw.between.as_ref().and_then(|ends| mounts(ends, model, names, frames, &what, numbers.findings));
    let (kind, [first, second]) = (kind?, mounts?);
    let kind = ConstraintKind::Loop { kind, first, second };
    Some(Constraint { name: raw.name.value.clone(), kind, decay, origin: numbers.findings.origin(raw.name.span) })
}

fn mounts(
    ends: &[Spanned<String>; 2],
    model: &RawModel,
    names: &Names,
    frames: &[Frame],
    what: &str,
    findings: &mut Findings,
) -> Option<[Mount; 2]> {
    let mut end = |name: &Spanned<String>| names.end(name, what, findings);
    let [first, second] = [end(&ends[0]), end(&ends[1])];
    let mount = |end: End| match end {
        End::Body(body) => Some(Mount { body, placement: Placement::IDENTITY }),
        // A frame on something unknown was reported.
        End::Frame(f) => {
            let on = model.frames[f].body.as_ref()?;
            names.is_known(&on.value).then_some(Mount { body: frames[f].body, placement: frames[f].placement })
        }
    };
    let (first, second) = (mount(first?)?, mount(second?)?);
    if first.body != second.body {
        return Some([first, second]);
    }
    let body = first.body.map_or("the ground".into(), |b| format!("body {}", quote(&model.bodies[b].name.value)));
    let help = "let `between` name two different bodies, or frames on them; one of them may be `ground`";
    findings.error(ends[1].span, format!("{what} binds {body} to itself"), help);
    None
}

/// Reports what is superfluous or missing.
fn entries(raw: &RawLoop, kind: &LoopSpec, what: &str, findings: &mut Findings) {
    let (name, allowed) = (kind.word(), kind.keys().collect::<Vec<_>>());
    let directions = raw.directions.iter().map(|(key, direction)| (*key, direction.span));
    let numbers = raw.numbers.iter().map(|(key, number)| (*key, number.span));
    let lists = raw.lists.iter().map(|(key, list)| (*key, list.span));
    let present: Vec<_> = directions.chain(numbers).chain(lists).collect();
    for (key, span) in &present {
        if !allowed.contains(key) {
            findings.error(*span, format!("{what}: a {name} loop has no `{key}`"), instead(key, &allowed));
        }
    }
    for key in allowed.iter().filter(|key| !present.iter().any(|(given, _)| given == *key)) {
        if let Some(example) = example(key, kind) {
            let message = format!("{what}: a {name} loop needs a `{key}`");
            findings.error(raw.name.span, message, format!("add {example}"));
        }
    }
}

/// What to do about a key that a type does not have.
fn instead(key: &str, allowed: &[&str]) -> String {
    let mut takers = LOOPS.iter().filter(|spec| spec.keys().any(|k| k == key));
    match (key, takers.next(), takers.next()) {
        ("axis", ..) if allowed.contains(&"normal") => "the direction across a plane is called `normal`".into(),
        ("normal", ..) if allowed.contains(&"axis") => "its direction is called `axis`".into(),
        ("decay", ..) => {
            "remove it: the loop holds velocities, and there are no positions whose errors could decay".into()
        }
        (_, Some(only), None) => format!("remove it, or make the loop `{}`", only.word()),
        _ => "remove it, or change the type of the loop".into(),
    }
}

/// What to add where a key that has no default is missing.
fn example(key: &str, kind: &LoopSpec) -> Option<&'static str> {
    match key {
        "pitch" => Some("`pitch = ..`, metres along the axis per radian (lead per turn / 2 pi)"),
        "length" if kind.directions.is_empty() => Some("`length = ..`, the distance of the two origins in metres"),
        "length" => Some("`length = ..`, that of the cylinder in metres"),
        "lengths" => Some("`lengths = [first, second]`, in metres; 0 makes a ball"),
        "size" => Some("`size = [x, y, z]`, the lengths of its edges in metres"),
        "semi_axes" => Some("`semi_axes = [x, y, z]`, in metres"),
        "radius" => Some("`radius = ..`, in metres"),
        "radii" => Some("`radii = [first, second]`, in metres"),
        "row" => Some("`row = [vx, vy, vz, wx, wy, wz]`, the factors of velocity and angular velocity"),
        _ => None,
    }
}

fn loop_kind(raw: &RawLoop, kind: &LoopSpec, what: &str, numbers: &mut Numbers) -> LoopKind {
    let mut directions = [[0.0; 3]; 2];
    for (slot, direction) in directions.iter_mut().zip(kind.directions) {
        let given = raw.direction(direction.key);
        let given = given.and_then(|d| numbers.direction(d, &format!("{what}: `{}`", direction.key)));
        *slot = given.unwrap_or(direction.default);
    }
    let mut values = [Value::ZERO; 6];
    let mut slots = values.iter_mut();
    for NumberKey { key, count } in kind.numbers {
        let given: Vec<Option<&RawNumber>> = match count {
            1 => vec![raw.number(key)],
            _ => (0..*count).map(|k| raw.list(key).map(|list| &list.value[k])).collect(),
        };
        for (given, slot) in given.into_iter().zip(&mut slots) {
            *slot = number(given, key, kind, what, numbers);
        }
    }
    let kind = (kind.make)(LoopNumbers { directions, numbers: values });
    if let (LoopKind::Pfaffian { row }, Some(at)) = (kind, raw.list("row")) {
        not_all_zero(at.span, row, what, numbers);
    }
    if let LoopKind::Universal { axes } = kind {
        right_angle(raw, axes, what, numbers.findings);
    }
    kind
}

/// One of the numbers under a key.
fn number(raw: Option<&RawNumber>, key: &str, kind: &LoopSpec, what: &str, numbers: &mut Numbers) -> Value {
    match key {
        "pitch" => pitch(raw, what, numbers),
        "lengths" => not_negative(raw, key, "a length in metres; 0 makes a ball", what, numbers),
        "size" | "semi_axes" => positive(raw, key, "lengths in metres, greater than 0", what, numbers),
        "length" if !kind.directions.is_empty() => {
            positive(raw, key, "a length in metres, greater than 0", what, numbers)
        }
        "length" => {
            let help = "the distance in metres, greater than 0; origins that coincide are a `spherical` loop";
            positive(raw, key, help, what, numbers)
        }
        "row" => numbers.or_zero(raw, Quantity::Plain, &format!("{what}: `row`")),
        _ => positive(raw, key, "a radius in metres, greater than 0", what, numbers),
    }
}

/// Behind a value that only the default of a parameter gives.
fn by_default(value: Value) -> &'static str {
    match value {
        Value::Const(_) => "",
        Value::Param(_) => " with the default of its parameter",
    }
}

fn positive(raw: Option<&RawNumber>, key: &str, help: &str, what: &str, numbers: &mut Numbers) -> Value {
    let value = numbers.or_zero(raw, Quantity::Length, &format!("{what}: `{key}`"));
    if let (Some(at), true) = (raw, numbers.at_default(value) <= 0.0) {
        let message = format!("{what}: `{key}` is not positive{}", by_default(value));
        numbers.findings.error(at.span, message, format!("write {help}"));
    }
    value
}

fn not_negative(raw: Option<&RawNumber>, key: &str, help: &str, what: &str, numbers: &mut Numbers) -> Value {
    let value = numbers.or_zero(raw, Quantity::Length, &format!("{what}: `{key}`"));
    if let (Some(at), true) = (raw, numbers.at_default(value) < 0.0) {
        let message = format!("{what}: `{key}` is negative{}", by_default(value));
        numbers.findings.error(at.span, message, format!("write {help}"));
    }
    value
}

fn pitch(raw: Option<&RawNumber>, what: &str, numbers: &mut Numbers) -> Value {
    let value = numbers.or_zero(raw, Quantity::Pitch, &format!("{what}: `pitch`"));
    if let (Some(at), true) = (raw, numbers.at_default(value) == 0.0) {
        let message = format!("{what}: `pitch` is 0{}, and so the loop a revolute one", by_default(value));
        numbers.findings.error(at.span, message, "make it `revolute`, or write metres along the axis per radian");
    }
    value
}

fn not_all_zero(at: Span, row: [Value; 6], what: &str, numbers: &mut Numbers) {
    if row.iter().all(|x| numbers.at_default(*x) == 0.0) {
        let help = "write the factors of velocity and angular velocity: `[vx, vy, vz, wx, wy, wz]`, not all of them 0";
        numbers.findings.error(at, format!("{what}: a `row` of zeros binds nothing"), help);
    }
}

fn right_angle(raw: &RawLoop, [a, b]: [[f64; 3]; 2], what: &str, findings: &mut Findings) {
    let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    if dot.abs() > RIGHT_ANGLE * norm(a) * norm(b) {
        let span = raw.direction("axis2").or(raw.direction("axis")).map_or(raw.name.span, |a| a.span);
        let help = "the arms of its cross are square to each other; by default they are x and y";
        findings.error(span, format!("{what}: the two axes of a universal loop are not at right angles"), help);
    }
}

/// Reports loops between bodies that cannot move against each other. `constraints` as in `raw`.
pub(super) fn rigid(
    raw: &RawModel,
    constraints: &[Option<Constraint>],
    joints: &[Joint],
    bodies: &[Body],
    findings: &mut Findings,
) {
    let welded = merged(joints, bodies.len(), |j| j.kind.nv() == 0);
    let led = merged(joints, bodies.len(), led);
    for (source, constraint) in raw.constraints.iter().zip(constraints) {
        let (RawConstraint::Loop(source), Some(constraint)) = (source, constraint) else { continue };
        let ConstraintKind::Loop { first, second, .. } = &constraint.kind else { continue };
        let same = |root: &[Option<usize>]| {
            let of = |mount: &Mount| mount.body.and_then(|b| root[b]);
            of(first) == of(second)
        };
        let name = |mount: &Mount| mount.body.map_or("the ground".into(), |b| quote(&bodies[b].name));
        let what = format!("loop {} binds {} to {}", quote(&source.name.value), name(first), name(second));
        let span = source.between.as_ref().map_or(Span::FILE, |ends| ends[0].span);
        if same(&welded) {
            let help = "remove the loop, or give a joint between them a type other than `fixed`";
            findings.error(span, format!("{what}, which fixed joints join already"), help);
        } else if same(&led) {
            let help = "remove the loop, or free one of those joints";
            findings.error(span, format!("{what}, and every joint between them is fixed or prescribed"), help);
        }
    }
}

/// Whether a joint leaves no freedom.
pub(super) fn led(joint: &Joint) -> bool {
    joint.kind.nv() == 0 || joint.motion == JointMotion::Prescribed
}

/// For each body the innermost one it is joined to without a freedom; `None` is the ground.
pub(super) fn merged(joints: &[Joint], bodies: usize, rigid: impl Fn(&Joint) -> bool) -> Vec<Option<usize>> {
    let mut root = vec![None; bodies];
    for joint in joints {
        root[joint.child] = if rigid(joint) { joint.parent.and_then(|b| root[b]) } else { Some(joint.child) };
    }
    root
}
