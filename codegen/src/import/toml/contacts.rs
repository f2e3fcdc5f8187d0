//! `[[shape]]`, `[[contact]]` and `[contacts]`.

use mbd_runtime::contact::RestitutionLaw;

use super::super::hull;
use super::super::raw::{RawContact, RawHull, RawModel, RawShape, RawSurface, RawValue};
use super::super::source::{Findings, Spanned};
use super::super::words::quote;
use super::constraints::between;
use super::entries::placement;
use super::kinds::kind;
use super::numbers::{direction, Unit};
use super::table::Table;
use super::Named;
use crate::model::SHAPES;
use ::toml::de::DeValue;

pub(super) const SHAPE: &[&str] = &[
    "name",
    "body",
    "type",
    "xyz",
    "rpy",
    "rotate",
    "radius",
    "length",
    "size",
    "sides",
    "rounding",
    "semi_axes",
    "normal",
    "points",
    "file",
    "scale",
    "most",
    #[cfg(feature = "height_fields")]
    "spacing",
    #[cfg(feature = "height_fields")]
    "heights",
];
pub(super) const CONTACT: &[&str] = &["name", "between", "friction", "restitution", "law"];
pub(super) const CONTACTS: &[&str] = &["pairs", "friction", "restitution", "law"];

/// The laws of restitution by their words.
pub(super) const LAWS: [(&str, RestitutionLaw); 3] =
    [("poisson", RestitutionLaw::Poisson), ("stronge", RestitutionLaw::Stronge), ("newton", RestitutionLaw::Newton)];

/// Shapes and contacts.
pub(super) fn all(top: &Table, named: &Named, raw: &mut RawModel, findings: &mut Findings) {
    for table in top.tables("shape", findings) {
        shape(&table, named, raw, findings);
    }
    for table in top.tables("contact", findings) {
        contact(&table, raw, findings);
    }
}

/// What holds for all contacts.
pub(super) fn surfaces(top: &Table, raw: &mut RawModel, findings: &mut Findings) {
    if let Some(table) = top.table("contacts", findings) {
        table.reject_unknown(CONTACTS, "all contacts", findings);
        // What is not stated stays as the base has it.
        if let Some(choice) = table.choice("pairs", &["listed", "all"], findings) {
            raw.all_pairs = (choice.value == 1).then_some(choice.span);
        }
        let RawSurface { friction, restitution, law } = surface(&table, findings);
        let before = std::mem::take(&mut raw.surface);
        raw.surface = RawSurface {
            friction: friction.or(before.friction),
            restitution: restitution.or(before.restitution),
            law: law.or(before.law),
        };
    }
}

/// What to do about shapes of other programs.
fn special(lower: &str) -> Option<String> {
    let help = "this program was built without the feature `height_fields`";
    ["hfield", "height_field", "heightfield"].contains(&lower).then(|| help.into())
}

fn shape(table: &Table, named: &Named, raw: &mut RawModel, findings: &mut Findings) {
    table.reject_unknown(SHAPE, "a shape", findings);
    let name = table.required_text("name", findings);
    let kind = kind(table, SHAPES, |spec| &spec.words, special, findings);
    let word = kind.as_ref().map_or("", |kind| kind.value.word());
    let shape = RawShape {
        bits: None,
        name: name.clone().unwrap_or(Spanned::new(String::new(), table.span)),
        body: table.text("body", findings),
        kind,
        placement: placement(table, findings),
        radius: table.number("radius", Unit::Plain, findings),
        length: table.number("length", Unit::Plain, findings),
        size: table.vec3("size", Unit::Plain, findings),
        sides: table.number("sides", Unit::Plain, findings),
        rounding: table.number("rounding", Unit::Plain, findings),
        semi_axes: table.vec3("semi_axes", Unit::Plain, findings),
        normal: table.direction("normal", findings),
        hull: hull(table, word == "hull", named, findings),
        #[cfg(feature = "height_fields")]
        field: super::heights::field(table, word == "height_field", named, findings),
    };
    match name {
        Some(_) => raw.shapes.push(shape),
        None => raw.incomplete = true,
    }
}

/// The entries of a hull, and its corners where the shape `is_hull`.
fn hull(table: &Table, is_hull: bool, named: &Named, findings: &mut Findings) -> Option<RawHull> {
    let keys = ["points", "file", "scale", "most"].into_iter().filter(|key| table.has(key));
    let keys: Vec<_> = keys.map(|key| (key, table.key_span(key))).collect();
    (!keys.is_empty()).then(|| {
        let corners = if is_hull { corners(table, named, findings) } else { None };
        RawHull { keys, corners }
    })
}

/// The corners of a hull; `None` where something was reported, or it has neither points nor a file.
fn corners(table: &Table, named: &Named, findings: &mut Findings) -> Option<Vec<[f64; 3]>> {
    let most = most(table, findings);
    let factor = scale(table, findings);
    let (points, file) = (points(table, findings), table.text("file", findings));
    let (points, source) = match (table.has("points"), table.has("file")) {
        (true, true) => {
            let message = format!("{}`points` and `file` together", table.prefix());
            findings.error(table.key_span("file"), message, "keep one of them");
            return None;
        }
        (true, false) if table.has("scale") => {
            let message = format!("{}`scale` is that of a `file`", table.prefix());
            findings.error(table.key_span("scale"), message, "remove it, and write the points in metres");
            return None;
        }
        (true, false) => (points?, None),
        (false, _) => {
            let file = file?;
            let factor = factor?;
            let (path, bytes) = named.read(&file, &table.prefix(), findings)?;
            match hull::of_mesh(&path, &bytes, [factor; 3]) {
                Ok(points) => (points, Some(file)),
                Err(problems) => {
                    hull::report(&problems, &path, &file, &table.prefix(), findings);
                    return None;
                }
            }
        }
    };
    let span = source.as_ref().map_or(table.get("points").map_or(table.span, |(span, _)| span), |file| file.span);
    match hull::corners(&points, most?) {
        Ok(found) => {
            if let Some(told) = found.told(source.map(|file| quote(&file.value)).as_deref()) {
                findings.notice(span, format!("{}{told}", table.prefix()));
            }
            if found.flat {
                let [message, help] = hull::FLAT;
                findings.warning(span, format!("{}{message}", table.prefix()), help);
            }
            Some(found.corners)
        }
        Err(problem) => {
            let help = if points.is_empty() { "write at least one" } else { "leave points out, or raise `most`" };
            findings.error(span, format!("{}{problem}", table.prefix()), help);
            None
        }
    }
}

/// Points in the axes of the shape; `None` where something was reported.
fn points(table: &Table, findings: &mut Findings) -> Option<Vec<[f64; 3]>> {
    let value = table.raw("points")?;
    let DeValue::Array(items) = value.get_ref() else {
        table.wrong_type("points", "a list of points", "`points = [[x, y, z], ..]`, in metres", findings);
        return None;
    };
    let one = |(k, item)| direction(item, &format!("{}point {}", table.prefix(), k + 1), findings);
    let points: Vec<_> = items.iter().enumerate().map(one).collect();
    points.into_iter().map(|point| Some(point?.value)).collect()
}

/// The most corners of a hull; `None` where something was reported.
fn most(table: &Table, findings: &mut Findings) -> Option<usize> {
    let (least, greatest, otherwise) = hull::MOST;
    let Some(most) = table.number("most", Unit::Plain, findings) else { return Some(otherwise) };
    match most.value {
        RawValue::Const(x) if x.fract() == 0.0 && (least as f64..=greatest as f64).contains(&x) => Some(x as usize),
        RawValue::Invalid => None,
        _ => {
            let message = format!("{}`most` is no whole number from {least} to {greatest}", table.prefix());
            findings.error(most.span, message, "write how many corners the hull may have; every one is a contact");
            None
        }
    }
}

/// The factor from the unit of a mesh to metres; `None` where something was reported.
pub(super) fn scale(table: &Table, findings: &mut Findings) -> Option<f64> {
    let Some(scale) = table.number("scale", Unit::Plain, findings) else { return Some(1.0) };
    match scale.value {
        RawValue::Const(x) if x > 0.0 => Some(x),
        RawValue::Invalid => None,
        _ => {
            let message = format!("{}`scale` is no constant greater than 0", table.prefix());
            findings.error(scale.span, message, "write the length of the unit of the file in metres: 0.001 for mm");
            None
        }
    }
}

fn contact(table: &Table, raw: &mut RawModel, findings: &mut Findings) {
    table.reject_unknown(CONTACT, "a contact", findings);
    let name = table.required_text("name", findings);
    let between = between(table, "shapes", findings);
    let surface = surface(table, findings);
    raw.contacts.extend(name.map(|name| RawContact { name, between, surface }));
}

fn surface(table: &Table, findings: &mut Findings) -> RawSurface {
    let law = table.choice("law", &LAWS.map(|(word, _)| word), findings);
    RawSurface {
        friction: table.number("friction", Unit::Plain, findings),
        restitution: table.number("restitution", Unit::Plain, findings),
        law: law.map(|choice| Spanned::new(LAWS[choice.value].1, choice.span)),
    }
}
