//! `contact`: pairs of geoms that touch, and pairs of bodies that do not.

use std::collections::HashSet;

use super::build::Built;
use super::classes::{Classes, MAIN};
use super::element::{attribute, number, numbers};
use crate::import::raw::{RawContact, RawNumber, RawPairs, RawSurface};
use crate::import::source::Spanned;
use crate::import::words::{did_you_mean, quote};
use crate::import::xml::{place, Reader};
use crate::import::ImportOptions;
use roxmltree::Node;

/// Attributes of a `pair`; those of MuJoCo's solver are not read.
const PAIR: &[&str] = &[
    "name",
    "class",
    "geom1",
    "geom2",
    "condim",
    "friction",
    "solref",
    "solreffriction",
    "solimp",
    "margin",
    "gap",
    "adhesion",
];
const EXCLUDE: &[&str] = &["name", "body1", "body2"];

/// What is said where contacts between bodies are not asked for.
const IDLE: &str =
    "`contact` is not used: it is where contacts between bodies are asked for (`--self-contact` of `mbd simulate`)";

/// The names of the geoms in pairs. They are shapes, whatever their `contype` and `conaffinity`.
pub(super) fn listed<'d>(sections: &[Node<'d, 'd>]) -> HashSet<&'d str> {
    let pairs = sections.iter().flat_map(|section| section.children()).filter(|node| node.has_tag_name("pair"));
    pairs.flat_map(|node| ["geom1", "geom2"].map(|key| attribute(node, key))).flatten().map(|name| name.value).collect()
}

/// Reads the `contact` elements where the options ask for contacts between bodies.
pub(super) fn pairs(
    reader: &mut Reader,
    sections: &[Node],
    classes: &Classes,
    built: &Built,
    options: &ImportOptions,
) -> Option<RawPairs> {
    let Some(friction) = options.between_bodies() else {
        sections.iter().for_each(|section| reader.tally.notice(place(*section), IDLE));
        return None;
    };
    let mut pairs = RawPairs::new(friction);
    for section in sections {
        for node in reader.children(*section, &["pair", "exclude"], &[]) {
            if node.tag_name().name() == "exclude" {
                pairs.excluded.extend(excluded(reader, node, built));
            } else {
                pairs.listed.extend(pair(reader, node, classes, built));
            }
        }
    }
    Some(pairs)
}

/// The two bodies of an `exclude`, by their names here.
fn excluded(reader: &mut Reader, node: Node, built: &Built) -> Option<[String; 2]> {
    reader.leaf(node, EXCLUDE);
    let mut body = |key: &str| {
        let name = reader.required(node, key, "exclude: ")?;
        let found = built.bodies.get(name.value).and_then(|k| built.names.get(*k));
        if found.is_none() {
            unknown(reader, &name, ("exclude", "body"), built.bodies.keys().copied());
        }
        found.map(|name| name.value.clone())
    };
    let (first, second) = (body("body1"), body("body2"));
    Some([first?, second?])
}

/// A pair of geoms with its friction.
fn pair(reader: &mut Reader, node: Node, classes: &Classes, built: &Built) -> Option<RawContact> {
    reader.leaf(node, PAIR);
    let mut geom = |key: &str| {
        let name = reader.required(node, key, "pair: ")?;
        match built.geoms.get(name.value) {
            Some(shape) => {
                if shape.is_none() {
                    reader.tally.notice(name.span, "a `pair` is not used: the shape of one of its geoms is not read");
                }
                shape.clone().map(|shape| Spanned::new(shape, name.span))
            }
            None => {
                unknown(reader, &name, ("pair", "geom"), built.geoms.keys().copied());
                None
            }
        }
    };
    let (first, second) = (geom("geom1"), geom("geom2"));
    let element = classes.resolve(reader, node, &["pair"], MAIN);
    // The first coefficient of two along the surface; the others are about its normal and of rolling.
    let friction = numbers(reader, &element, "friction", 1..=5, "pair: ");
    let mut friction = friction.and_then(|all| Some(RawNumber::constant(*all.value.first()?, all.span)));
    if let Some(condim) = number(reader, &element, "condim", "pair: ").filter(|condim| condim.value == 1.0) {
        friction = Some(RawNumber::constant(0.0, condim.span));
    }
    let between = [first?, second?];
    let name = match element.name() {
        Some(name) => Spanned::new(name.value.to_string(), name.span),
        None => Spanned::new(format!("{}/{}", between[0].value, between[1].value), place(node)),
    };
    Some(RawContact { name, between: Some(between), surface: RawSurface { friction, ..RawSurface::default() } })
}

/// Reports a name that stands for nothing.
fn unknown<'n>(
    reader: &mut Reader,
    name: &Spanned<&str>,
    (tag, what): (&str, &str),
    names: impl Iterator<Item = &'n str>,
) {
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    let help = did_you_mean(name.value, names, || format!("name a `{what}` of the file, or remove the `{tag}`"));
    reader.findings.error(name.span, format!("{tag}: {} is not a {what}", quote(name.value)), help);
}
