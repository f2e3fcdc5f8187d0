//! `joint`: connects a link to its parent.

use super::link::read_origin;
use crate::diag::Severity;
use crate::import::raw::{RawFreedoms, RawJoint, RawLimits, RawMimic, RawNumber, RawValue};
use crate::import::source::{Span, Spanned};
use crate::import::words::{did_you_mean, quote};
use crate::import::xml::{place, Reader};
use crate::model::{JointSpec, JOINTS};
use roxmltree::Node;

/// Elements of a `joint` that have no effect on its free motion.
const IGNORED: [(&str, &str); 2] =
    [("safety_controller", "`safety_controller` is not used"), ("calibration", "`calibration` is not used")];

/// What is said of limits that are not asked for.
const UNUSED_LIMIT: &str =
    "`limit` makes no stops (`--limits` of `mbd simulate` asks for them); it bounds motion under control";

/// Reads a `joint`, with its limits as stops where they are `asked` for. Without a name, a parent or a child it is reported and left out.
pub(super) fn read(reader: &mut Reader, node: Node, asked: bool) -> Option<RawJoint> {
    reader.attributes(node, &["name", "type"]);
    let name = reader.required(node, "name", "");
    let whose = name.as_ref().map_or(String::new(), |n| format!("joint {}: ", quote(n.value)));
    let kind = read_kind(reader, node, &whose);
    let used = ["origin", "parent", "child", "axis", "dynamics", "mimic", "limit"];
    let [origin, parent, child, axis, dynamics, mimic, limit] = reader.single_children(node, used, &IGNORED);
    let parent = read_end(reader, node, parent, "parent", &whose);
    let child = read_end(reader, node, child, "child", &whose);
    let placement = origin.map(|o| read_origin(reader, o, &whose)).unwrap_or_default();
    let axis = read_axis(reader, node, axis, kind.as_ref().map(|k| k.value), &whose);
    let damping = dynamics.and_then(|d| read_dynamics(reader, d, kind.as_ref().map(|k| k.value), &whose));
    let mimic = mimic.and_then(|m| read_mimic(reader, m, kind.as_ref().map(|k| k.value), &whose));
    let limits = limit.and_then(|l| read_limit(reader, l, kind.as_ref().map(|k| k.value), asked, &whose));
    let name = name?;
    let unbounded = node.attribute("type") == Some("continuous");
    let mut joint = RawJoint::new(Spanned::new(name.value.to_string(), name.span), kind, Some(child?));
    joint.unbounded = unbounded;
    joint.parent = Some(parent?);
    joint.placement = placement;
    joint.axis = axis;
    joint.damping = damping;
    // The leader's stops are those of both.
    joint.limits = limits.filter(|_| !unbounded && mimic.is_none());
    joint.mimic = mimic;
    if let Some(limit) = limit {
        bounds(reader, &mut joint, limit, asked, &whose);
    }
    Some(joint)
}

fn read_kind(reader: &mut Reader, node: Node, whose: &str) -> Option<Spanned<&'static JointSpec>> {
    let names = || JOINTS.iter().flat_map(|spec| spec.urdf.iter().copied());
    let help = || format!("the types are {}", names().map(quote).collect::<Vec<_>>().join(", "));
    let Some(text) = reader.attribute(node, "type") else {
        reader.findings.error(place(node), format!("{whose}no `type`"), help());
        return None;
    };
    if let Some(kind) = JOINTS.iter().find(|spec| spec.urdf.contains(&text.value)) {
        return Some(Spanned::new(kind, text.span));
    }
    let message = format!("{whose}unknown type {}", quote(text.value));
    reader.findings.error(text.span, message, did_you_mean(text.value, names(), help));
    None
}

/// `<parent link="..."/>` or `<child link="..."/>`.
fn read_end(reader: &mut Reader, joint: Node, end: Option<Node>, which: &str, whose: &str) -> Option<Spanned<String>> {
    let Some(end) = end else {
        let help = format!("write `<{which} link=\"...\"/>`");
        reader.findings.error(place(joint), format!("{whose}no `{which}`"), help);
        return None;
    };
    reader.leaf(end, &["link"]);
    let text = reader.required(end, "link", whose)?;
    Some(Spanned::new(text.value.to_string(), text.span))
}

/// The axis, for the kinds that have one. URDF's own default is x.
fn read_axis(
    reader: &mut Reader,
    joint: Node,
    axis: Option<Node>,
    kind: Option<&JointSpec>,
    whose: &str,
) -> Option<Spanned<[f64; 3]>> {
    let wanted = kind.is_none_or(|spec| !spec.axes.is_empty());
    let Some(node) = axis else {
        if wanted && kind.is_some() {
            reader.tally.notice(place(joint), "a joint without `axis` turns about or slides along its x axis");
        }
        return wanted.then(|| Spanned::new([1.0, 0.0, 0.0], place(joint)));
    };
    reader.leaf(node, &["xyz"]);
    if !wanted {
        reader.tally.notice(place(node), "`axis` of a fixed, floating or spherical joint has no meaning");
        return None;
    }
    reader.required(node, "xyz", whose)?;
    let numbers = reader.vec3(node, "xyz", whose)?;
    let mut values = [0.0; 3];
    for (value, number) in values.iter_mut().zip(&numbers.value) {
        let RawValue::Const(x) = number.value else { return None };
        *value = x;
    }
    Some(Spanned::new(values, numbers.span))
}

/// Viscous damping; dry friction is reported.
fn read_dynamics(reader: &mut Reader, node: Node, kind: Option<&JointSpec>, whose: &str) -> Option<RawFreedoms> {
    reader.leaf(node, &["damping", "friction"]);
    let damping = reader.number(node, "damping", whose);
    let friction = reader.number(node, "friction", whose);
    if kind.is_some_and(|spec| spec.nv() == 0) {
        reader.tally.notice(place(node), "`dynamics` of a fixed joint has no meaning");
        return None;
    }
    if let Some(friction) = friction.filter(is_not_zero) {
        let message = "dry friction (`friction`) is not modelled";
        let help = "add it as a joint torque of your own, or set it to 0";
        reader.tally.add(Severity::Warning, "friction", friction.span, message, help);
    }
    let damping = damping?;
    let mixed = |spec: &JointSpec| spec.freedoms.windows(2).any(|pair| pair[0].unit != pair[1].unit);
    if kind.is_some_and(mixed) {
        if is_not_zero(&damping) {
            let message = format!("{whose}one `damping` for slides and turns together is not used");
            reader.findings.warning(
                damping.span,
                message,
                "add it as joint forces and torques of your own, or set it to 0",
            );
        }
        return None;
    }
    is_not_zero(&damping).then_some(RawFreedoms::All(damping))
}

/// The stops of a joint, where they are asked for.
fn read_limit(
    reader: &mut Reader,
    node: Node,
    kind: Option<&JointSpec>,
    asked: bool,
    whose: &str,
) -> Option<RawLimits> {
    if !asked {
        reader.tally.notice(place(node), UNUSED_LIMIT);
        return None;
    }
    reader.leaf(node, &["lower", "upper", "effort", "velocity"]);
    let (lower, upper) = (reader.number(node, "lower", whose), reader.number(node, "upper", whose));
    // A joint of several freedoms or none has no stops, and one without these numbers is not meant to have any.
    if kind.is_none_or(|spec| spec.nv() != 1) || (lower.is_none() && upper.is_none()) {
        return None;
    }
    let range = node.range();
    let span = Span::new(range.start, range.end);
    let zero = || Spanned::new(RawValue::Const(0.0), place(node));
    let (lower, upper) = (lower.unwrap_or_else(zero), upper.unwrap_or_else(zero));
    if let (RawValue::Const(a), RawValue::Const(b)) = (&lower.value, &upper.value) {
        if a >= b {
            unordered(reader, node, [*a, *b], whose);
            return None;
        }
    }
    Some(RawLimits { span, lower: Some(lower), upper: Some(upper) })
}

/// Says that a limit is not used because its ends are not in rising order.
fn unordered(reader: &mut Reader, node: Node, [lower, upper]: [f64; 2], whose: &str) {
    let message = format!("{whose}`limit` from {lower} to {upper} is not used");
    let help = "write a `lower` that is less than `upper`";
    reader.tally.add(Severity::Warning, "unordered limit", place(node), message, help);
}

/// What a joint is made for. Files are careless about it: zeros and what is no number say nothing. Ends in the wrong order
/// have been reported already where stops are `asked` for.
fn bounds(reader: &mut Reader, joint: &mut RawJoint, node: Node, asked: bool, whose: &str) {
    /// Numbers beyond this are meant as none.
    const LARGEST: f64 = 1e30;
    let number = |key: &str| node.attribute(key)?.trim().parse::<f64>().ok().filter(|x| x.abs() < LARGEST);
    let raw = |x: f64| RawNumber::constant(x, place(node));
    let mut greatest = |key: &str, what: &str| {
        let x = number(key)?;
        if x < 0.0 {
            let span = reader.attribute(node, key).map_or(place(node), |text| text.span);
            let message = format!("{whose}`{key}` {x} of `limit` is not used: it is less than 0");
            let help = format!("write the greatest {what} as a positive number, or 0 where it is not known");
            reader.tally.add(Severity::Warning, &format!("negative {key}"), span, message, help);
        }
        (x > 0.0).then(|| raw(x))
    };
    let Some(spec) = joint.kind.as_ref().map(|k| k.value).filter(|spec| spec.nv() > 0) else { return };
    joint.max_velocity = greatest("velocity", "speed");
    joint.max_effort = greatest("effort", "force or torque");
    if spec.nv() != 1 || joint.unbounded || joint.mimic.is_some() {
        return;
    }
    // Of the two, the one that is not stated is zero.
    let ends = ["lower", "upper"].map(|key| match node.attribute(key) {
        None => Some(0.0),
        Some(_) => number(key),
    });
    let [Some(lower), Some(upper)] = ends else { return };
    if lower < upper {
        let range = node.range();
        let span = Span::new(range.start, range.end);
        joint.range = Some(RawLimits { span, lower: Some(raw(lower)), upper: Some(raw(upper)) });
    } else if lower > upper && !asked {
        unordered(reader, node, [lower, upper], whose);
    }
}

fn is_not_zero(number: &RawNumber) -> bool {
    matches!(number.value, RawValue::Const(x) if x != 0.0)
}

fn read_mimic(reader: &mut Reader, node: Node, kind: Option<&JointSpec>, whose: &str) -> Option<RawMimic> {
    reader.leaf(node, &["joint", "multiplier", "offset"]);
    let leader = reader.required(node, "joint", whose);
    let ratio = reader.number(node, "multiplier", whose);
    let offset = reader.number(node, "offset", whose);
    // Robots with some joints frozen for a task keep the `mimic` of those.
    if kind.is_some_and(|spec| spec.nv() == 0) {
        reader.tally.notice(place(node), "`mimic` of a fixed joint has no meaning");
        return None;
    }
    let leader = leader?;
    let range = node.range();
    Some(RawMimic {
        span: Span::new(range.start, range.end),
        leader: Spanned::new(leader.value.to_string(), leader.span),
        ratio,
        offset,
    })
}
