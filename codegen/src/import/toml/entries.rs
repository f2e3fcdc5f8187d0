//! `[[body]]`, `[[joint]]`, `[[frame]]` and `[[wrench]]`.

use super::super::raw::{
    RawBody, RawFrame, RawFreedoms, RawJoint, RawLimits, RawMimic, RawModel, RawMotion, RawNumber, RawPlacement,
    RawRotation, RawValue, RawWrench,
};
use super::super::source::{Findings, Span, Spanned};
use super::base::{self, Known};
use super::kinds::kind;
use super::numbers::{self, Unit};
use super::table::Table;
use crate::model::{JointSpec, WrenchAxes, JOINTS, REVOLUTE};
use ::toml::de::DeValue;

pub(super) const BODY: &[&str] = &["name", "mass", "com", "inertia", "inertia_rpy"];
pub(super) const JOINT: &[&str] = &[
    "name",
    "type",
    "parent",
    "child",
    "xyz",
    "rpy",
    "rotate",
    "axis",
    "axis2",
    "pitch",
    "damping",
    "stiffness",
    "rest",
    "armature",
    "unbounded",
    "motion",
    "mimic",
    "start",
    "start_velocity",
    "held",
    "limits",
    "limit_restitution",
    "range",
    "max_velocity",
    "max_effort",
];
pub(super) const FRAME: &[&str] = &["name", "body", "xyz", "rpy", "rotate"];
pub(super) const WRENCH: &[&str] = &["name", "body", "frame"];
pub(super) const INERTIA: [&str; 6] = ["xx", "yy", "zz", "xy", "xz", "yz"];

pub(super) fn body(table: Table, known: &mut Known, raw: &mut RawModel, findings: &mut Findings) {
    let all_known = table.reject_unknown(BODY, "a body", findings);
    let name = table.required_text("name", findings);
    // A misspelt mass is reported as misspelt, and not as missing.
    let unread = (!all_known).then(|| Spanned::new(RawValue::Invalid, table.span));
    let mass = table.number("mass", Unit::Plain, findings).or(unread);
    let com = table.vec3("com", Unit::Plain, findings);
    let inertia = inertia(&table, findings);
    let inertia_axes = table.vec3("inertia_rpy", Unit::Angle, findings).map(RawRotation::Rpy);
    let Some(name) = name else {
        raw.incomplete = true;
        return;
    };
    let at = known.bodies.remove(&name.value);
    let body = RawBody { name, mass, com, inertia, inertia_axes };
    match at {
        Some(at) => base::change_body(&mut raw.bodies[at], body),
        None => raw.bodies.push(body),
    }
}

/// `[xx, yy, zz]` or `{ xx, yy, zz, xy, xz, yz }`.
fn inertia(table: &Table, findings: &mut Findings) -> Option<Spanned<[RawNumber; 6]>> {
    let (span, value) = table.get("inertia")?;
    let what = format!("{}`inertia`", table.prefix());
    let zero = || Spanned::new(RawValue::Const(0.0), span);
    let invalid = || Spanned::new([0; 6].map(|_| Spanned::new(RawValue::Invalid, span)), span);
    match value {
        DeValue::Array(items) if items.len() != 3 => {
            findings.error(
                span,
                format!("{what} needs 3 moments and has {} numbers", items.len()),
                "write `[xx, yy, zz]`, or `{ xx = .., yy = .., zz = .., xy = .., xz = .., yz = .. }`",
            );
            Some(invalid())
        }
        DeValue::Table(t) if !t.contains_key("param") && !t.contains_key("deg") => {
            let inner = Table::new(t, span, what);
            inner.reject_unknown(&INERTIA, "an inertia", findings);
            let mut missing = false;
            for key in &INERTIA[..3] {
                if !inner.has(key) {
                    inner.missing(key, &format!("`{key} = ..`, the moment about that axis in kg m²"), findings);
                    missing = true;
                }
            }
            let all = INERTIA.map(|key| inner.number(key, Unit::Plain, findings).unwrap_or_else(zero));
            Some(if missing { invalid() } else { Spanned::new(all, span) })
        }
        _ => {
            let [xx, yy, zz] = table.vec3("inertia", Unit::Plain, findings)?.value;
            Some(Spanned::new([xx, yy, zz, zero(), zero(), zero()], span))
        }
    }
}

pub(super) fn placement(table: &Table, findings: &mut Findings) -> RawPlacement {
    let xyz = table.vec3("xyz", Unit::Plain, findings);
    if table.has("rpy") && table.has("rotate") {
        let message = format!("{}`rpy` and `rotate` together", table.prefix());
        findings.error(table.key_span("rotate"), message, "keep one of them");
    }
    let rpy = table.vec3("rpy", Unit::Angle, findings).map(RawRotation::Rpy);
    let rotate = table.table("rotate", findings).map(|inner| {
        inner.reject_unknown(&["axis", "angle"], "a rotation", findings);
        for (key, example) in [("axis", "`axis = [0, 0, 1]`"), ("angle", "`angle = { deg = 90 }`")] {
            if !inner.has(key) {
                inner.missing(key, example, findings);
            }
        }
        let axis = inner.direction("axis", findings);
        let angle = inner.number("angle", Unit::Angle, findings);
        RawRotation::AxisAngle { axis, angle: angle.unwrap_or(Spanned::new(RawValue::Invalid, inner.span)) }
    });
    RawPlacement { xyz, rotation: rpy.or(rotate) }
}

/// Unit of each coordinate, for degrees.
fn units(kind: Option<&JointSpec>) -> Vec<Unit> {
    let known = kind.filter(|spec| spec.has_springs());
    // An unknown type is one finding; its units must not be another.
    known.map_or(vec![Unit::Angle], |spec| spec.coordinates.iter().map(|c| Unit::of(c.unit)).collect())
}

/// Initial coordinates; `units` are those of the coordinates where they have any.
fn start(table: &Table, kind: Option<&JointSpec>, units: &[Unit], findings: &mut Findings) -> Option<RawFreedoms> {
    let value = table.raw("start")?;
    let quaternion = kind.is_some_and(|spec| spec.quaternion().is_some());
    if quaternion && matches!(value.get_ref(), DeValue::Table(t) if t.contains_key("deg")) {
        let message = format!("{}`start` ends in a quaternion, which has no degrees", table.prefix());
        let help = "write the unit quaternion in the order x, y, z, w: no rotation is `0, 0, 0, 1`";
        findings.error(value.span().into(), message, help);
        return None;
    }
    let units = if quaternion { &[Unit::Plain] } else { units };
    numbers::freedoms(value, units, &format!("{}`start`", table.prefix()), findings)
}

pub(super) fn joint(table: Table, known: &mut Known, raw: &mut RawModel, findings: &mut Findings) {
    table.reject_unknown(JOINT, "a joint", findings);
    let name = table.required_text("name", findings);
    let at = name.as_ref().and_then(|name| known.joints.remove(&name.value));
    let described = at.is_some() || (table.has("type") && table.has("child"));
    let misspelt = match &name {
        Some(name) if !described => known.lacks_joint(name, raw, findings),
        _ => false,
    };
    let of_base = at.map(|at| &raw.joints[at]);
    let kind = match of_base.filter(|_| !table.has("type")) {
        Some(of_base) => of_base.kind.clone(),
        None if misspelt && !table.has("type") => None,
        None => kind(&table, &JOINTS, |spec| &spec.words, |_| None, findings),
    };
    let child = match of_base.filter(|_| !table.has("child")) {
        Some(of_base) => of_base.child.clone(),
        None if misspelt => table.text("child", findings),
        None => table.required_text("child", findings),
    };
    // Without its joint, the body would be reported as having none.
    raw.incomplete |= child.is_none() || name.is_none();
    let units = units(kind.as_ref().map(|k| k.value));
    let units = &units[..];
    let mut freedoms = |key: &str, units: &[Unit]| {
        table.raw(key).and_then(|v| numbers::freedoms(v, units, &format!("{}`{key}`", table.prefix()), findings))
    };
    let damping = freedoms("damping", &[Unit::Plain]);
    let stiffness = freedoms("stiffness", &[Unit::Plain]);
    let rest = freedoms("rest", units);
    let armature = freedoms("armature", &[Unit::Plain]);
    let start_velocity = freedoms("start_velocity", &[Unit::Plain]);
    let motion = match table.choice("motion", &["free", "prescribed"], findings) {
        Some(choice) if choice.value == 1 => RawMotion::Prescribed(choice.span),
        _ => RawMotion::Free,
    };
    let start = start(&table, kind.as_ref().map(|k| k.value), units, findings);
    let joint = RawJoint {
        parent: table.text("parent", findings),
        placement: placement(&table, findings),
        axis: table.direction("axis", findings),
        axis2: table.direction("axis2", findings),
        pitch: table.number("pitch", Unit::Plain, findings),
        damping,
        stiffness,
        rest,
        armature,
        unbounded: unbounded(&table, kind.as_ref().map(|k| k.value), findings),
        motion,
        mimic: mimic(&table, units, findings),
        start,
        start_velocity,
        held: table.flag("held", findings),
        limits: limits(&table, "limits", units[0], findings),
        range: limits(&table, "range", units[0], findings),
        max_velocity: table.number("max_velocity", Unit::Plain, findings),
        max_effort: table.number("max_effort", Unit::Plain, findings),
        limit_restitution: table.number("limit_restitution", Unit::Plain, findings),
        ..RawJoint::new(name.clone().unwrap_or(Spanned::new(String::new(), table.span)), kind, child)
    };
    match at {
        Some(at) => base::change_joint(&mut raw.joints[at], joint),
        None if name.is_some() => raw.joints.push(joint),
        None => {}
    }
}

/// Whether other programs may store the angle as cosine and sine.
fn unbounded(table: &Table, kind: Option<&JointSpec>, findings: &mut Findings) -> bool {
    let Some(flag) = table.flag("unbounded", findings).filter(|flag| flag.value) else { return false };
    if kind.is_some_and(|kind| *kind != REVOLUTE) {
        let help = "remove it: only a revolute joint turns without end in other programs";
        findings.error(flag.span, format!("{}`unbounded` is for revolute joints", table.prefix()), help);
    }
    true
}

/// `[lower, upper]`, or a table of one or both.
fn limits(table: &Table, key: &str, unit: Unit, findings: &mut Findings) -> Option<RawLimits> {
    let value = table.raw(key)?;
    let (span, what): (Span, _) = (value.span().into(), format!("{}`{key}`", table.prefix()));
    if let DeValue::Table(t) = value.get_ref() {
        if !t.contains_key("deg") && !t.contains_key("param") {
            let inner = Table::new(t, span, what.clone());
            inner.reject_unknown(&["lower", "upper"], &format!("the {key} of a joint"), findings);
            if t.is_empty() {
                findings.error(span, format!("{what} is an empty table"), "write `[lower, upper]`, or one of them");
            }
            let [lower, upper] = ["lower", "upper"].map(|key| inner.number(key, unit, findings));
            return Some(RawLimits { span, lower, upper });
        }
    }
    let list = numbers::numbers(value, &[unit], &what, findings)?;
    let count = list.len();
    let Ok([lower, upper]) = <[RawNumber; 2]>::try_from(list) else {
        let help = "write `[lower, upper]`, or `{ lower = .. }` or `{ upper = .. }` for one of them";
        findings.error(span, format!("{what} needs 2 numbers and has {count}"), help);
        return None;
    };
    Some(RawLimits { span, lower: Some(lower), upper: Some(upper) })
}

fn mimic(table: &Table, units: &[Unit], findings: &mut Findings) -> Option<RawMimic> {
    let inner = table.table("mimic", findings)?;
    inner.reject_unknown(&["joint", "ratio", "offset"], "a mimic", findings);
    let leader = inner.required_text("joint", findings);
    let ratio = inner.number("ratio", Unit::Plain, findings);
    let offset = inner.number("offset", units[0], findings);
    Some(RawMimic { span: inner.span, leader: leader?, ratio, offset })
}

pub(super) fn frame(table: Table, raw: &mut RawModel, findings: &mut Findings) {
    table.reject_unknown(FRAME, "a frame", findings);
    let name = table.required_text("name", findings);
    let body = table.required_text("body", findings);
    let placement = placement(&table, findings);
    if let Some(name) = name {
        raw.frames.push(RawFrame { name, body, placement });
    }
}

pub(super) fn wrench(table: Table, raw: &mut RawModel, findings: &mut Findings) {
    table.reject_unknown(WRENCH, "a wrench", findings);
    let axes = match table.choice("frame", &["body", "world"], findings) {
        Some(choice) if choice.value == 1 => WrenchAxes::World,
        _ => WrenchAxes::Body,
    };
    let name = table.text("name", findings);
    if let Some(body) = table.required_text("body", findings) {
        raw.wrenches.push(RawWrench { name, body, axes });
    }
}
