//! `collision`: the shapes of a link.
//!
//! Most readers of a robot want no contacts. What is wrong with a shape is therefore a warning, and the shape left out.

use super::mesh::{self, Meshes};
use crate::diag::Severity;
use crate::import::raw::{RawHull, RawNumber, RawPlacement, RawRotation, RawShape, RawValue, RawVec3};
use crate::import::source::{Span, Spanned};
use crate::import::taken::{Taken, CORNERS};
use crate::import::tally::Tally;
use crate::import::words::quote;
use crate::import::xml::{is_own, place, Reader};
use crate::model::{ShapeSpec, SHAPES};
use roxmltree::Node;

const IDLE: &str =
    "a `collision` touches nothing unless that is asked for (`--floor`, `--self-contact` of `mbd simulate`)";

/// Reads the shapes of a link. Where nothing is asked for that they touch, there are no `meshes`, and
/// shapes are said to touch nothing.
pub(super) fn all(
    reader: &mut Reader,
    link: Node,
    body: &Spanned<String>,
    meshes: &mut Option<Meshes>,
    taken: &mut Taken,
    shapes: &mut Vec<RawShape>,
) {
    for node in elements(link).filter(|n| n.tag_name().name() == "collision") {
        match shape(reader, node, body, meshes.as_mut(), taken) {
            Ok(shape) => {
                shapes.push(shape);
                if meshes.is_none() {
                    reader.tally.notice(place(node), IDLE);
                }
            }
            Err(Unread::Mesh(at, why)) => reader.tally.notice(at, why),
            Err(Unread::Faulty(at, what)) => faulty(&mut reader.tally, at, &what),
        }
    }
}

fn elements<'a, 'i>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(|child| child.is_element() && is_own(*child))
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    elements(node).find(|child| child.tag_name().name() == name)
}

/// Why a shape was left out.
pub(super) enum Unread {
    /// A mesh, and what is said about all such.
    Mesh(Span, &'static str),
    Faulty(Span, String),
}

fn faulty(tally: &mut Tally, at: Span, what: &str) {
    let message = format!("a `collision` is not used: {what}");
    let help = "write one box, sphere, cylinder, capsule or mesh with lengths in metres, greater than 0; or remove it";
    tally.add(Severity::Warning, "collision", at, message, help);
}

fn shape(
    reader: &Reader,
    node: Node,
    body: &Spanned<String>,
    meshes: Option<&mut Meshes>,
    taken: &mut Taken,
) -> Result<RawShape, Unread> {
    let geometry = child(node, "geometry").ok_or_else(|| Unread::Faulty(place(node), "it has no `geometry`".into()))?;
    let solid = elements(geometry).next().ok_or_else(|| Unread::Faulty(place(geometry), "it has no shape".into()))?;
    let word = solid.tag_name().name();
    let own = if word == "mesh" { "hull" } else { word };
    let Some(spec) = SHAPES
        .iter()
        .find(|spec| spec.word() == own && ["box", "sphere", "cylinder", "capsule", "mesh"].contains(&word))
    else {
        return Err(Unread::Faulty(place(solid), format!("{} is no shape", quote(word))));
    };
    let hull = match (word, meshes) {
        ("mesh", None) => return Err(Unread::Mesh(place(solid), mesh::IDLE)),
        ("mesh", Some(meshes)) => Some(meshes.hull(reader, solid)?),
        _ => None,
    };
    let key = |key: &str| spec.keys.contains(&key);
    let radius = key("radius").then(|| length(reader, solid, "radius")).transpose()?;
    let length = key("length").then(|| length(reader, solid, "length")).transpose()?;
    let size = key("size").then(|| lengths(reader, solid)).transpose()?;
    let placement = match child(node, "origin") {
        None => RawPlacement::default(),
        Some(origin) => RawPlacement {
            xyz: triple(reader, origin, "xyz")?,
            rotation: triple(reader, origin, "rpy")?.map(RawRotation::Rpy),
        },
    };
    let given = reader.attribute(node, "name").map(|n| n.value.trim()).filter(|n| !n.is_empty());
    let contacts = hull.as_ref().map_or(CORNERS, Vec::len);
    let name = Spanned::new(taken.shape(given.unwrap_or(&body.value), contacts), place(node));
    let hull = hull.map(|corners| RawHull { keys: vec![("file", place(solid))], corners: Some(corners) });
    let kind = Some(Spanned::new(spec as &'static ShapeSpec, place(solid)));
    Ok(RawShape { body: Some(body.clone()), placement, radius, length, size, hull, ..RawShape::new(name, kind) })
}

/// Finite numbers under a key; `None` where there is no such attribute.
pub(super) fn numbers<const N: usize>(
    reader: &Reader,
    node: Node,
    key: &str,
) -> Result<Option<Spanned<[f64; N]>>, Unread> {
    let Some(text) = reader.attribute(node, key) else { return Ok(None) };
    let all: Vec<f64> = text.value.split_whitespace().map_while(|word| word.parse().ok()).collect();
    match <[f64; N]>::try_from(all) {
        Ok(all) if all.iter().all(|x| x.is_finite()) && text.value.split_whitespace().count() == N => {
            Ok(Some(Spanned::new(all, text.span)))
        }
        _ => Err(Unread::Faulty(text.span, format!("its `{key}` is {}", quote(text.value)))),
    }
}

fn positive<const N: usize>(reader: &Reader, node: Node, key: &str) -> Result<Spanned<[f64; N]>, Unread> {
    let missing = || Unread::Faulty(place(node), format!("a {} needs a `{key}`", node.tag_name().name()));
    let all = numbers::<N>(reader, node, key)?.ok_or_else(missing)?;
    match all.value.iter().find(|x| **x <= 0.0) {
        Some(x) => Err(Unread::Faulty(all.span, format!("its `{key}` is {x}"))),
        None => Ok(all),
    }
}

fn length(reader: &Reader, node: Node, key: &str) -> Result<RawNumber, Unread> {
    let Spanned { value: [x], span } = positive::<1>(reader, node, key)?;
    Ok(Spanned::new(RawValue::Const(x), span))
}

fn lengths(reader: &Reader, node: Node) -> Result<RawVec3, Unread> {
    Ok(raw(positive::<3>(reader, node, "size")?))
}

fn triple(reader: &Reader, node: Node, key: &str) -> Result<Option<RawVec3>, Unread> {
    Ok(numbers::<3>(reader, node, key)?.map(raw))
}

fn raw(all: Spanned<[f64; 3]>) -> RawVec3 {
    Spanned::new(all.value.map(|x| Spanned::new(RawValue::Const(x), all.span)), all.span)
}
