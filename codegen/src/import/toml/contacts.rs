//! `[[shape]]`, `[[contact]]` and `[contacts]`.

use mbd_runtime::contact::RestitutionLaw;

use super::super::raw::{RawContact, RawModel, RawShape, RawSurface};
use super::super::source::{Findings, Spanned};
use super::constraints::between;
use super::entries::placement;
use super::kinds::kind;
use super::numbers::Unit;
use super::table::Table;
use crate::model::SHAPES;

pub(super) const SHAPE: &[&str] =
    &["name", "body", "type", "xyz", "rpy", "rotate", "radius", "length", "size", "semi_axes", "normal"];
pub(super) const CONTACT: &[&str] = &["name", "between", "friction", "restitution", "law"];
pub(super) const CONTACTS: &[&str] = &["pairs", "friction", "restitution", "law"];

/// The laws of restitution by their words.
pub(super) const LAWS: [(&str, RestitutionLaw); 3] =
    [("poisson", RestitutionLaw::Poisson), ("stronge", RestitutionLaw::Stronge), ("newton", RestitutionLaw::Newton)];

/// Shapes and contacts.
pub(super) fn all(top: &Table, raw: &mut RawModel, findings: &mut Findings) {
    for table in top.tables("shape", findings) {
        shape(&table, raw, findings);
    }
    for table in top.tables("contact", findings) {
        contact(&table, raw, findings);
    }
}

/// What holds for all contacts.
pub(super) fn surfaces(top: &Table, raw: &mut RawModel, findings: &mut Findings) {
    if let Some(table) = top.table("contacts", findings) {
        table.reject_unknown(CONTACTS, "all contacts", findings);
        let pairs = table.choice("pairs", &["listed", "all"], findings);
        raw.all_pairs = pairs.filter(|choice| choice.value == 1).map(|choice| choice.span);
        raw.surface = surface(&table, findings);
    }
}

/// What to do about shapes of other programs.
fn special(lower: &str) -> Option<String> {
    let help = "describe it by a few spheres, capsules or points";
    ["mesh", "hull", "hfield", "height_field"].contains(&lower).then(|| help.into())
}

fn shape(table: &Table, raw: &mut RawModel, findings: &mut Findings) {
    table.reject_unknown(SHAPE, "a shape", findings);
    let name = table.required_text("name", findings);
    let shape = RawShape {
        name: name.clone().unwrap_or(Spanned::new(String::new(), table.span)),
        body: table.text("body", findings),
        kind: kind(table, &SHAPES, |spec| &spec.words, special, findings),
        placement: placement(table, findings),
        radius: table.number("radius", Unit::Plain, findings),
        length: table.number("length", Unit::Plain, findings),
        size: table.vec3("size", Unit::Plain, findings),
        semi_axes: table.vec3("semi_axes", Unit::Plain, findings),
        normal: table.direction("normal", findings),
    };
    match name {
        Some(_) => raw.shapes.push(shape),
        None => raw.incomplete = true,
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
