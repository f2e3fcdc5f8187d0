//! `link`: a body and its inertia.

use crate::import::raw::{RawBody, RawNumber, RawPlacement, RawRotation, RawValue, RawVec3};
use crate::import::source::{Span, Spanned};
use crate::import::words::quote;
use crate::import::xml::{place, Reader};
use roxmltree::Node;

/// Message for elements that only concern appearance.
pub(super) const LOOKS: &str = "shapes and colours to look at (`visual`, `material`) are not used";

/// Elements of a `link` that have no effect on its motion.
const IGNORED: [(&str, &str); 5] = [
    ("visual", LOOKS),
    // Read beside the link.
    ("collision", ""),
    ("collision_checking", "`collision_checking` is not used"),
    ("self_filter", "`self_filter` is not used"),
    ("contact", "`contact` is not used"),
];

/// Reads a `link`; without a name it is reported and left out.
pub(super) fn read(reader: &mut Reader, node: Node) -> Option<RawBody> {
    reader.attributes(node, &["name"]);
    let name = reader.required(node, "name", "").map(|n| Spanned::new(n.value.to_string(), n.span));
    let [inertial] = reader.single_children(node, ["inertial"], &IGNORED);
    let whose = name.as_ref().map_or(String::new(), |n| format!("link {}: ", quote(&n.value)));
    let inertial = inertial.map(|i| read_inertial(reader, i, &whose)).unwrap_or_default();
    let Inertial { mass, com, inertia, inertia_axes } = inertial;
    Some(RawBody { name: name?, mass, com, inertia, inertia_axes })
}

/// Reads an `inertial`; it is ignored for a link without mass.
#[derive(Default)]
struct Inertial {
    mass: Option<RawNumber>,
    com: Option<RawVec3>,
    inertia: Option<Spanned<[RawNumber; 6]>>,
    inertia_axes: Option<RawRotation>,
}

fn read_inertial(reader: &mut Reader, node: Node, whose: &str) -> Inertial {
    reader.attributes(node, &[]);
    let [origin, mass, inertia] = reader.single_children(node, ["origin", "mass", "inertia"], &[]);
    let RawPlacement { xyz, rotation } = origin.map(|o| read_origin(reader, o, whose)).unwrap_or_default();
    let mass = match mass {
        Some(mass) => {
            reader.leaf(mass, &["value"]);
            let there = reader.required(mass, "value", whose);
            there.and_then(|_| reader.number(mass, "value", whose)).unwrap_or(invalid(place(mass)))
        }
        None => {
            let help = "write `<mass value=\"...\"/>`, or remove `inertial` for a link without mass";
            reader.findings.error(place(node), format!("{whose}`inertial` has no `mass`"), help);
            invalid(place(node))
        }
    };
    let inertia = match inertia {
        Some(inertia) => read_inertia(reader, inertia, whose),
        None => {
            let help = "write `<inertia ixx=\"...\" .../>`; all zero for a point mass";
            reader.findings.error(place(node), format!("{whose}`inertial` has no `inertia`"), help);
            Spanned::new(std::array::from_fn(|_| invalid(place(node))), place(node))
        }
    };
    Inertial { mass: Some(mass), com: xyz, inertia: Some(inertia), inertia_axes: rotation }
}

fn read_inertia(reader: &mut Reader, node: Node, whose: &str) -> Spanned<[RawNumber; 6]> {
    const NAMES: [&str; 6] = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"];
    reader.leaf(node, &NAMES);
    let numbers = NAMES.map(|name| reader.number(node, name, whose));
    let missing = |range: std::ops::Range<usize>| {
        let names: Vec<_> = range.filter(|&k| numbers[k].is_none()).map(|k| format!("`{}`", NAMES[k])).collect();
        names.join(", ")
    };
    let (moments, products) = (missing(0..3), missing(3..6));
    if !moments.is_empty() {
        let help = "give all three moments of inertia about the centre of mass, kg m²";
        reader.findings.error(place(node), format!("{whose}`inertia` has no {moments}"), help);
    }
    if !products.is_empty() {
        let message = format!("{whose}`inertia` has no {products}, taken as 0");
        reader.findings.warning(place(node), message, "give all six numbers");
    }
    let entry = |k: usize| {
        let absent = if k < 3 { RawValue::Invalid } else { RawValue::Const(0.0) };
        numbers[k].clone().unwrap_or(Spanned::new(absent, place(node)))
    };
    Spanned::new(std::array::from_fn(entry), place(node))
}

/// Reads an `origin`: of an inertia or of a joint.
pub(super) fn read_origin(reader: &mut Reader, node: Node, whose: &str) -> RawPlacement {
    reader.leaf(node, &["xyz", "rpy", "quat_xyzw"]);
    if let Some(quaternion) = reader.attribute(node, "quat_xyzw") {
        let message = format!("{whose}orientation by `quat_xyzw` is not read");
        reader.findings.error(quaternion.span, message, "write it as `rpy`: roll, pitch and yaw");
    }
    let xyz = reader.vec3(node, "xyz", whose);
    let rotation = reader.vec3(node, "rpy", whose).map(RawRotation::Rpy);
    RawPlacement { xyz, rotation }
}

fn invalid(span: Span) -> RawNumber {
    Spanned::new(RawValue::Invalid, span)
}
