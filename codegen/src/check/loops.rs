//! RolledCode: what they bind and how.

use super::decay;
use super::names::{norm, End, Names};
use super::numbers::{Numbers, Quantity};
use crate::import::raw::{LoopType, RawConstraint, RawLoop, RawModel, RawNumber};
use crate::import::source::{Findings, Span, Spanned};
use crate::import::words::quote;
use crate::model::{Body, Constraint, ConstraintKind, Frame, Joint, JointMotion, LoopKind, Mount, Placement, Value};

/// Cosine up to which two axes pass for being at right angles: seven digits.
const RIGHT_ANGLE: f64 = 1e-6;

/// Keys that a type has beside `name`, `type` and `between`.
fn keys(kind: LoopType) -> &'static [&'static str] {
    match kind {
        LoopType::Revolute | LoopType::Prismatic | LoopType::Cylindrical | LoopType::PointOnLine => &["axis", "decay"],
        LoopType::Helical => &["axis", "pitch", "decay"],
        LoopType::Universal => &["axis", "axis2", "decay"],
        LoopType::Planar | LoopType::PointOnPlane => &["normal", "decay"],
        LoopType::Spherical | LoopType::Fixed => &["decay"],
        LoopType::Distance => &["length", "decay"],
        LoopType::PointOnCylinder => &["axis", "radius", "decay"],
        LoopType::RollingDisc => &["normal", "axis", "radius", "decay"],
        LoopType::RollingBall => &["normal", "radius", "decay"],
        LoopType::KnifeEdge => &["axis"],
        LoopType::Pfaffian => &["row"],
    }
}

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
    let decay = decay(&raw.decay, &what, numbers);
    let mounts = raw.between.as_ref().and_then(|ends| mounts(ends, model, names, frames, &what, numbers.findings));
    let (kind, [first, second]) = (kind?, mounts?);
    Some(Constraint { name: raw.name.value.clone(), kind: ConstraintKind::Loop { kind, first, second }, decay })
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
fn entries(raw: &RawLoop, kind: LoopType, what: &str, findings: &mut Findings) {
    let axis = |a: &Option<Spanned<[f64; 3]>>| a.as_ref().map(|a| a.span);
    let number = |x: &Option<RawNumber>| x.as_ref().map(|x| x.span);
    let present = [
        ("axis", axis(&raw.axis)),
        ("axis2", axis(&raw.axis2)),
        ("normal", axis(&raw.normal)),
        ("pitch", number(&raw.pitch)),
        ("length", number(&raw.length)),
        ("radius", number(&raw.radius)),
        ("row", raw.row.as_ref().map(|r| r.span)),
        ("decay", number(&raw.decay)),
    ];
    let (name, allowed) = (kind.name(), keys(kind));
    for (key, span) in present {
        match (span, allowed.contains(&key)) {
            (Some(span), false) => {
                findings.error(span, format!("{what}: a {name} loop has no `{key}`"), instead(key, allowed));
            }
            (None, true) => {
                if let Some(example) = example(key) {
                    let message = format!("{what}: a {name} loop needs a `{key}`");
                    findings.error(raw.name.span, message, format!("add {example}"));
                }
            }
            _ => {}
        }
    }
}

/// What to do about a key that a type does not have.
fn instead(key: &str, allowed: &[&str]) -> &'static str {
    match key {
        "axis" if allowed.contains(&"normal") => "the direction across a plane is called `normal`",
        "normal" if allowed.contains(&"axis") => "its direction is called `axis`",
        "axis2" => "remove it, or make the loop `universal`",
        "pitch" => "remove it, or make the loop `helical`",
        "length" => "remove it, or make the loop `distance`",
        "row" => "remove it, or make the loop `pfaffian`",
        "decay" => "remove it: the loop holds velocities, and there are no positions whose errors could decay",
        _ => "remove it, or change the type of the loop",
    }
}

/// What to add where a key that has no default is missing.
fn example(key: &str) -> Option<&'static str> {
    match key {
        "pitch" => Some("`pitch = ..`, metres along the axis per radian (lead per turn / 2 pi)"),
        "length" => Some("`length = ..`, the distance of the two origins in metres"),
        "radius" => Some("`radius = ..`, in metres"),
        "row" => Some("`row = [vx, vy, vz, wx, wy, wz]`, the factors of velocity and angular velocity"),
        _ => None,
    }
}

fn loop_kind(raw: &RawLoop, kind: LoopType, what: &str, numbers: &mut Numbers) -> LoopKind {
    const Z: [f64; 3] = [0.0, 0.0, 1.0];
    let mut direction = |axis: &Option<Spanned<[f64; 3]>>, key: &str, default: [f64; 3]| match axis {
        Some(axis) => numbers.direction(axis, &format!("{what}: `{key}`")).unwrap_or(default),
        None => default,
    };
    let is_universal = kind == LoopType::Universal;
    let axis = direction(&raw.axis, "axis", if is_universal { [1.0, 0.0, 0.0] } else { Z });
    let axis2 = direction(&raw.axis2, "axis2", [0.0, 1.0, 0.0]);
    let normal = direction(&raw.normal, "normal", Z);
    let radius = positive(&raw.radius, "radius", "a radius in metres, greater than 0", what, numbers);
    let length = "the distance in metres, greater than 0; origins that coincide are a `spherical` loop";
    let length = positive(&raw.length, "length", length, what, numbers);
    let pitch = pitch(&raw.pitch, what, numbers);
    let row = row(raw, what, numbers);
    if is_universal {
        right_angle(raw, [axis, axis2], what, numbers.findings);
    }
    match kind {
        LoopType::Revolute => LoopKind::Revolute { axis },
        LoopType::Prismatic => LoopKind::Prismatic { axis },
        LoopType::Cylindrical => LoopKind::Cylindrical { axis },
        LoopType::Helical => LoopKind::Helical { axis, pitch },
        LoopType::Universal => LoopKind::Universal { axes: [axis, axis2] },
        LoopType::Planar => LoopKind::Planar { normal },
        LoopType::Spherical => LoopKind::Spherical,
        LoopType::Fixed => LoopKind::Fixed,
        LoopType::Distance => LoopKind::Distance { length },
        LoopType::PointOnLine => LoopKind::PointOnLine { axis },
        LoopType::PointOnPlane => LoopKind::PointOnPlane { normal },
        LoopType::PointOnCylinder => LoopKind::PointOnCylinder { axis, radius },
        LoopType::RollingDisc => LoopKind::RollingDisc { normal, axis, radius },
        LoopType::RollingBall => LoopKind::RollingBall { normal, radius },
        LoopType::KnifeEdge => LoopKind::KnifeEdge { axis },
        LoopType::Pfaffian => LoopKind::Pfaffian { row },
    }
}

/// Behind a value that only the default of a parameter gives.
fn by_default(value: Value) -> &'static str {
    match value {
        Value::Const(_) => "",
        Value::Param(_) => " with the default of its parameter",
    }
}

fn positive(raw: &Option<RawNumber>, key: &str, help: &str, what: &str, numbers: &mut Numbers) -> Value {
    let value = numbers.or_zero(raw, Quantity::Length, &format!("{what}: `{key}`"));
    if let (Some(at), true) = (raw, numbers.at_default(value) <= 0.0) {
        let message = format!("{what}: `{key}` is not positive{}", by_default(value));
        numbers.findings.error(at.span, message, format!("write {help}"));
    }
    value
}

fn pitch(raw: &Option<RawNumber>, what: &str, numbers: &mut Numbers) -> Value {
    let value = numbers.or_zero(raw, Quantity::Pitch, &format!("{what}: `pitch`"));
    if let (Some(at), true) = (raw, numbers.at_default(value) == 0.0) {
        let message = format!("{what}: `pitch` is 0{}, and so the loop a pin", by_default(value));
        numbers.findings.error(at.span, message, "make it a `pin`, or write metres along the axis per radian");
    }
    value
}

fn row(raw: &RawLoop, what: &str, numbers: &mut Numbers) -> [Value; 6] {
    let Some(at) = &raw.row else { return [Value::ZERO; 6] };
    let row = [0, 1, 2, 3, 4, 5].map(|k| numbers.value(&at.value[k], Quantity::Plain, &format!("{what}: `row`")));
    if row.iter().all(|x| numbers.at_default(*x) == 0.0) {
        let help = "write the factors of velocity and angular velocity: `[vx, vy, vz, wx, wy, wz]`, not all of them 0";
        numbers.findings.error(at.span, format!("{what}: a `row` of zeros binds nothing"), help);
    }
    row
}

fn right_angle(raw: &RawLoop, [a, b]: [[f64; 3]; 2], what: &str, findings: &mut Findings) {
    let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    if dot.abs() > RIGHT_ANGLE * norm(a) * norm(b) {
        let span = raw.axis2.as_ref().or(raw.axis.as_ref()).map_or(raw.name.span, |a| a.span);
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
    let led = merged(joints, bodies.len(), |j| j.kind.nv() == 0 || j.motion == JointMotion::Prescribed);
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

/// For each body the innermost one it is joined to without a freedom; `None` is the ground.
fn merged(joints: &[Joint], bodies: usize, rigid: impl Fn(&Joint) -> bool) -> Vec<Option<usize>> {
    let mut root = vec![None; bodies];
    for joint in joints {
        root[joint.child] = if rigid(joint) { joint.parent.and_then(|b| root[b]) } else { Some(joint.child) };
    }
    root
}
