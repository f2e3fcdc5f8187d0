//! The floor that import options ask for.

use super::raw::{RawModel, RawNumber, RawPlacement, RawShape};
use super::source::{Span, Spanned};
use super::taken::{Taken, CORNERS};
use super::Floor;
use crate::model::SHAPES;

/// Puts a floor among the shapes of a model that has none yet, with its friction as that of all contacts.
pub(super) fn add(floor: Floor, taken: &mut Taken, raw: &mut RawModel) {
    raw.floors.push(raw.shapes.len());
    raw.shapes.push(plane(taken.shape("floor", CORNERS), floor));
    raw.surface.friction = Some(RawNumber::constant(floor.friction, Span::FILE));
}

/// The plane across z of the ground.
fn plane(name: String, floor: Floor) -> RawShape {
    let xyz = [0.0, 0.0, floor.height].map(|x| RawNumber::constant(x, Span::FILE));
    let kind = SHAPES.iter().find(|spec| spec.word() == "plane").map(|spec| Spanned::new(spec, Span::FILE));
    RawShape {
        placement: RawPlacement { xyz: Some(Spanned::new(xyz, Span::FILE)), rotation: None },
        ..RawShape::new(Spanned::new(name, Span::FILE), kind)
    }
}
