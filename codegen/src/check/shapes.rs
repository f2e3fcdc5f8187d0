//! Shapes: where they are, and how large.

use super::names::Names;
use super::numbers::{Numbers, Quantity};
use crate::import::raw::{RawModel, RawNumber, RawShape};
use crate::import::source::Span;
use crate::import::words::quote;
use crate::model::{Mount, Rotation, Shape, ShapeKind, ShapeSpec, Value, SHAPES, SIDES};

/// What to write in place of a parameter.
const CONSTANT: &str = "write a constant: parameters do not change shapes";

/// All shapes, in the order of the file; `None` where something was reported that leaves a shape without meaning.
pub(super) fn shapes(raw: &RawModel, names: &Names, numbers: &mut Numbers) -> Vec<Option<Shape>> {
    raw.shapes.iter().map(|s| shape(s, names, numbers)).collect()
}

fn shape(raw: &RawShape, names: &Names, numbers: &mut Numbers) -> Option<Shape> {
    let what = format!("shape {}", quote(&raw.name.value));
    let body = match &raw.body {
        None => Some(None),
        Some(name) => names.body(name, "", &what, numbers.findings),
    };
    let placement = numbers.placement(&raw.placement, &what);
    let spec = raw.kind.as_ref()?.value;
    entries(raw, spec, &what, numbers);
    let kind = kind(raw, spec, &what, numbers)?;
    let shape = Shape { name: raw.name.value.clone(), mount: Mount { body: body?, placement }, kind };
    still(raw, &shape, &what, numbers);
    Some(shape)
}

/// Reports dimensions that are superfluous or missing.
fn entries(raw: &RawShape, spec: &ShapeSpec, what: &str, numbers: &mut Numbers) {
    let word = a(spec.word());
    let lists = [
        raw.hull.as_ref().map(|hull| &hull.keys),
        #[cfg(feature = "height_fields")]
        raw.field.as_ref().map(|field| &field.keys),
    ];
    let listed = |key: &str| lists.iter().flatten().copied().flatten().find(|(k, _)| *k == key).map(|(_, span)| *span);
    let given = [
        ("radius", raw.radius.as_ref().map(|x| x.span), "`radius = ..`, in metres"),
        ("length", raw.length.as_ref().map(|x| x.span), "`length = ..`, along its z axis in metres"),
        ("size", raw.size.as_ref().map(|x| x.span), "`size = [x, y, z]`, the lengths of its edges in metres"),
        ("sides", raw.sides.as_ref().map(|x| x.span), ""),
        ("rounding", raw.rounding.as_ref().map(|x| x.span), ""),
        ("semi_axes", raw.semi_axes.as_ref().map(|x| x.span), "`semi_axes = [x, y, z]`, in metres"),
        ("normal", raw.normal.as_ref().map(|x| x.span), ""),
        ("points", listed("points"), ""),
        ("file", listed("file"), ""),
        ("scale", listed("scale"), ""),
        ("most", listed("most"), ""),
        #[cfg(feature = "height_fields")]
        ("spacing", listed("spacing"), "`spacing = [x, y]`, the distances of neighbouring heights in metres"),
        #[cfg(feature = "height_fields")]
        ("heights", listed("heights"), ""),
    ];
    for (key, span, example) in given {
        match (span, spec.keys.contains(&key)) {
            (Some(span), false) => {
                let takers = SHAPES.iter().filter(|s| s.keys.contains(&key)).map(|s| quote(s.word()));
                let takers = takers.collect::<Vec<_>>().join(" or ");
                let help = format!("remove it, or make the shape {takers}");
                numbers.findings.error(span, format!("{what}: {word} has no `{key}`"), help);
            }
            // A plane without a normal is across z.
            (None, true) if !example.is_empty() => {
                let message = format!("{what}: {word} needs a `{key}`");
                numbers.findings.error(raw.name.span, message, format!("add {example}"));
            }
            _ => {}
        }
    }
    #[cfg(feature = "height_fields")]
    if spec.word() == "height_field" && listed("heights").or(listed("file")).is_none() {
        let help = "add `heights = [[0, 0, 0, 0], ..]`, rows along x in metres, or `file = \"heights.csv\"`";
        numbers.findings.error(raw.name.span, format!("{what}: a height field needs `heights` or a `file`"), help);
    }
    if spec.word() == "hull" && listed("points").or(listed("file")).is_none() {
        let help = "add `points = [[x, y, z], ..]`, in metres, or `file = \"mesh.stl\"`, an STL or OBJ file";
        numbers.findings.error(raw.name.span, format!("{what}: a hull needs `points` or a `file`"), help);
    }
}

/// A word of a shape with its article.
pub(super) fn a(word: &str) -> String {
    let article = if word.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {}", word.replace('_', " "))
}

fn kind(raw: &RawShape, spec: &ShapeSpec, what: &str, numbers: &mut Numbers) -> Option<ShapeKind> {
    let mut length = |number: &Option<RawNumber>, key: &str, least: &str| {
        number.as_ref().map(|x| size(x, key, least, what, numbers))
    };
    match spec.word() {
        "point" => Some(ShapeKind::Point),
        "sphere" => Some(ShapeKind::Sphere { radius: length(&raw.radius, "radius", MORE)? }),
        "capsule" => {
            let (radius, length) = (length(&raw.radius, "radius", MORE), length(&raw.length, "length", MORE));
            Some(ShapeKind::Capsule { radius: radius?, length: length? })
        }
        "cylinder" => {
            let (radius, length) = (length(&raw.radius, "radius", MORE), length(&raw.length, "length", DISC));
            let sides = sides(raw, what, numbers);
            let rounding = raw.rounding.as_ref().map_or(0.0, |x| size(x, "rounding", SHARP, what, numbers));
            let (radius, length) = (radius?, length?);
            if let (Some(given), None) = (&raw.rounding, &raw.sides) {
                let message = format!("{what}: the `rounding` of a cylinder without `sides`");
                let help = "add `sides = 12`: the rounding is that of the prism which it is for boxes, hulls and other cylinders";
                numbers.findings.error(given.span, message, help);
            }
            // What is not greater than zero, or not a number, was reported.
            if let (Some(given), true) =
                (&raw.rounding, rounding > 0.0 && (rounding >= radius || 2.0 * rounding >= length))
            {
                let message = format!("{what}: `rounding` leaves nothing of it");
                let help = "write a radius below that of the cylinder and below half of its length";
                numbers.findings.error(given.span, message, help);
            }
            Some(ShapeKind::Cylinder { radius, length, sides, rounding })
        }
        "box" => {
            let edges = raw.size.as_ref()?;
            let lengths = [0, 1, 2].map(|k| size(&edges.value[k], "size", MORE, what, numbers));
            let rounding = raw.rounding.as_ref().map_or(0.0, |x| size(x, "rounding", SHARP, what, numbers));
            // What is not greater than zero, or not a number, was reported.
            let shortest = lengths.into_iter().fold(f64::INFINITY, f64::min);
            if let (Some(given), true) = (&raw.rounding, shortest > 0.0 && 2.0 * rounding >= shortest) {
                let message = format!("{what}: `rounding` leaves nothing of its shortest edge, {shortest} m");
                let help = "write a radius below half of it: it is that of edges and corners, within `size`";
                numbers.findings.error(given.span, message, help);
            }
            Some(ShapeKind::Box { size: lengths, rounding })
        }
        "ellipsoid" => {
            let axes = raw.semi_axes.as_ref()?;
            let semi_axes = [0, 1, 2].map(|k| size(&axes.value[k], "semi_axes", MORE, what, numbers));
            Some(ShapeKind::Ellipsoid { semi_axes })
        }
        "hull" => {
            let points = raw.hull.as_ref()?.corners.clone()?;
            let at = raw.hull.as_ref()?.keys.first().map_or(raw.name.span, |(_, span)| *span);
            let far = points.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
            numbers.value(&RawNumber::constant(far, at), Quantity::Length, &format!("{what}: a point"));
            let rounding = raw.rounding.as_ref().map_or(0.0, |x| size(x, "rounding", SHARP, what, numbers));
            Some(ShapeKind::Hull { points, rounding })
        }
        #[cfg(feature = "height_fields")]
        "height_field" => height_field(raw, what, numbers),
        _ => {
            let normal = raw.normal.as_ref().map(|n| numbers.direction(n, &format!("{what}: `normal`")));
            Some(ShapeKind::Plane { normal: normal.unwrap_or(Some([0.0, 0.0, 1.0]))? })
        }
    }
}

/// The sides of a cylinder; `None` where there are none, or something was reported.
fn sides(raw: &RawShape, what: &str, numbers: &mut Numbers) -> Option<usize> {
    let given = raw.sides.as_ref()?;
    let value = numbers.constant(given, Quantity::Plain, &format!("{what}: `sides`"), CONSTANT);
    let (least, most) = SIDES;
    if value.fract() == 0.0 && (least as f64..=most as f64).contains(&value) {
        return Some(value as usize);
    }
    // NaN stands for what was reported.
    if !value.is_nan() {
        let message = format!("{what}: `sides` is no whole number from {least} to {most}");
        let help = "write how many sides the prism has that it is for boxes, hulls and other cylinders";
        numbers.findings.error(given.span, message, help);
    }
    None
}

/// Slopes above this one are suspicious: 84°.
#[cfg(feature = "height_fields")]
const STEEP: f64 = 10.0;

#[cfg(feature = "height_fields")]
fn height_field(raw: &RawShape, what: &str, numbers: &mut Numbers) -> Option<ShapeKind> {
    let given = raw.field.as_ref()?;
    let (spacing, heights) = (given.spacing?, given.heights.as_ref()?);
    let place = |key: &str| given.keys.iter().find(|(k, _)| *k == key).map_or(raw.name.span, |(_, span)| *span);
    let far = heights.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let mut length = |x: f64, at, name: &str| {
        numbers.value(&RawNumber::constant(x, at), Quantity::Length, &format!("{what}: {name}"));
    };
    length(far, place("heights"), "a height");
    spacing.iter().for_each(|x| length(*x, place("spacing"), "`spacing`"));
    let field = crate::field::field(spacing, heights);
    if !field.slope.is_finite() || field.slope > STEEP {
        let message = format!("{what}: its slope comes up to {:.3}", field.slope);
        let help = "both `spacing` and heights are in metres; `scale` is the length of the unit of a `file`";
        numbers.findings.warning(place("spacing"), message, help);
    }
    Some(ShapeKind::HeightField { field, heights: heights.clone() })
}

const MORE: &str = "write a length in metres, greater than 0";
const SHARP: &str = "write a radius in metres; 0 leaves edges sharp";
const DISC: &str = "write a length in metres; 0 makes it a thin disc";

/// A length that is not negative, and not zero where `help` does not allow it.
fn size(x: &RawNumber, key: &str, help: &str, what: &str, numbers: &mut Numbers) -> f64 {
    let value = numbers.constant(x, Quantity::Length, &format!("{what}: `{key}`"), CONSTANT);
    if value < 0.0 || (value == 0.0 && help == MORE) {
        let problem = if value < 0.0 { "is negative" } else { "is 0" };
        numbers.findings.error(x.span, format!("{what}: `{key}` {problem}"), help);
    }
    value
}

/// Corners and ends are places that are known when the code is generated; only a point, a sphere, an ellipsoid, a plane or a
/// height field, which are their origins with a size, can be moved by a parameter.
fn still(raw: &RawShape, shape: &Shape, what: &str, numbers: &mut Numbers) {
    #[cfg(feature = "height_fields")]
    if let ShapeKind::HeightField { .. } = shape.kind {
        return;
    }
    if matches!(
        shape.kind,
        ShapeKind::Point | ShapeKind::Sphere { .. } | ShapeKind::Plane { .. } | ShapeKind::Ellipsoid { .. }
    ) {
        return;
    }
    let rotation = match shape.mount.placement.rotation {
        Rotation::Rpy(rpy) => rpy.to_vec(),
        Rotation::AxisAngle { angle, .. } => vec![angle],
    };
    if shape.mount.placement.xyz.iter().chain(&rotation).any(|v| matches!(v, Value::Param(_))) {
        let span: Span = raw.placement.xyz.as_ref().map_or(raw.name.span, |xyz| xyz.span);
        let message = format!("{what}: the place of {} cannot depend on a parameter", a(shape.kind.word()));
        numbers.findings.error(span, message, "write constants, or use spheres or points, which may be moved");
    }
}
