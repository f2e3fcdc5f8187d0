//! `equality`: loops and couplings.

use std::collections::HashMap;

use super::build::{Built, Known};
use super::classes::{Classes, MAIN};
use super::element::{flag, numbers, vec3, Element};
use super::pose::{normalised, Pose};
use super::tendon::Tendon;
use crate::import::raw::{RawConstraint, RawCoupling, RawFrame, RawLoop, RawModel, RawNumber};
use crate::import::source::{Span, Spanned};
use crate::import::taken::Taken;
use crate::import::words::{did_you_mean, list, quote};
use crate::import::xml::{place, Reader};
use crate::model::{LoopSpec, LOOPS};
use roxmltree::Node;

const COMMON: [&str; 5] = ["name", "class", "active", "solref", "solimp"];

/// What equalities bind.
pub(super) struct Parts<'p, 'd> {
    /// Bodies, joints and sites.
    pub built: &'p mut Built<'d>,
    /// Tendons by their names; those that are not fixed have no terms.
    pub tendons: &'p HashMap<&'d str, Tendon>,
}

/// Adds all that an `equality` element holds.
pub(super) fn all<'d>(
    reader: &mut Reader,
    section: Node<'d, 'd>,
    classes: &Classes<'d>,
    parts: &mut Parts<'_, 'd>,
    taken: &mut Taken,
    raw: &mut RawModel,
) {
    let tags = ["connect", "weld", "joint", "tendon", "flex", "flexvert", "flexstrain"];
    for node in reader.children(section, &tags, &[]) {
        let tag = node.tag_name().name();
        let element = classes.resolve(reader, node, &["equality"], MAIN);
        let shown = element.name().map_or(format!("a {tag}"), |name| quote(name.value));
        let whose = format!("equality {shown}: ");
        if flag(reader, &element, "active", &whose) == Some(false) {
            reader.tally.notice(place(node), "an equality that is not active is not used");
            continue;
        }
        let wanted = element.name().map_or(tag, |name| name.value);
        let name = Spanned::new(taken.name(wanted, "_"), element.name().map_or(place(node), |name| name.span));
        let constraint = match tag {
            "connect" => connect(reader, &element, name, parts, &whose, raw),
            "weld" => weld(reader, &element, name, parts, &whose, raw),
            "joint" => joints(reader, &element, name, parts, &whose),
            "tendon" => tendons(reader, &element, name, parts, &whose),
            _ => {
                let message = format!("{whose}deformable bodies are not modelled");
                reader.findings.error(place(node), message, "remove it");
                None
            }
        };
        raw.constraints.extend(constraint);
    }
}

/// The kind of loop called so.
fn kind(word: &str) -> Option<&'static LoopSpec> {
    LOOPS.iter().find(|spec| spec.word() == word)
}

/// What something named is, among those of its sort; a name that is unknown is reported.
fn find<'m, T>(
    reader: &mut Reader,
    name: &Spanned<&str>,
    all: &'m HashMap<&str, T>,
    what: &str,
    whose: &str,
) -> Option<&'m T> {
    let found = all.get(name.value);
    if found.is_none() {
        let mut names: Vec<&str> = all.keys().copied().collect();
        names.sort_unstable();
        let help = did_you_mean(name.value, names.iter().copied(), || match names.len() {
            0 => "there are none in this file".into(),
            _ => format!("there are {}", list(names.iter().copied())),
        });
        reader.findings.error(name.span, format!("{whose}{} is not a {what}", quote(name.value)), help);
    }
    found
}

/// The bodies that `body1` and `body2` name, the second being the world where it is missing.
fn two_bodies(reader: &mut Reader, element: &Element, parts: &Parts, whose: &str) -> Option<[usize; 2]> {
    let body = |reader: &mut Reader, key| match element.attribute(key) {
        Some(name) => find(reader, &name, &parts.built.bodies, "body", whose).copied(),
        None => Some(0),
    };
    let (first, second) = (body(reader, "body1"), body(reader, "body2"));
    Some([first?, second?])
}

/// A loop between the frames of two sites.
fn of_sites(
    reader: &mut Reader,
    element: &Element,
    name: Spanned<String>,
    word: &str,
    parts: &Parts,
    whose: &str,
) -> Option<RawConstraint> {
    let (Some(first), Some(second)) = (element.attribute("site1"), element.attribute("site2")) else {
        let help = "name two bodies, or two sites: `site1=\"...\" site2=\"...\"`";
        reader.findings.error(place(element.node), format!("{whose}it names neither bodies nor sites"), help);
        return None;
    };
    let ends = [first, second].map(|site| {
        let frame = find(reader, &site, &parts.built.sites, "site", whose);
        frame.map(|frame| Spanned::new(frame.clone(), site.span))
    });
    let [Some(first), Some(second)] = ends else { return None };
    Some(between(name, word, [first, second]))
}

fn between(name: Spanned<String>, word: &str, ends: [Spanned<String>; 2]) -> RawConstraint {
    let span = name.span;
    RawConstraint::Loop(Box::new(RawLoop {
        name,
        kind: kind(word).map(|spec| Spanned::new(spec, span)),
        between: Some(ends),
        directions: Vec::new(),
        numbers: Vec::new(),
        lists: Vec::new(),
    }))
}

/// A frame on a body for the end of a loop.
fn frame(name: &str, body: usize, pose: &Pose, span: Span, parts: &mut Parts, raw: &mut RawModel) -> Spanned<String> {
    if *pose == Pose::IDENTITY {
        return Spanned::new(parts.built.names[body].value.clone(), span);
    }
    let name = Spanned::new(parts.built.taken.name(name, "_"), span);
    let body = Some(parts.built.names[body].clone());
    raw.frames.push(RawFrame { name: name.clone(), body, placement: pose.raw(span) });
    name
}

/// `connect`: a point of the first body stays where it is in the second, as the file places them.
fn connect<'d>(
    reader: &mut Reader,
    element: &Element<'d>,
    name: Spanned<String>,
    parts: &mut Parts<'_, 'd>,
    whose: &str,
    raw: &mut RawModel,
) -> Option<RawConstraint> {
    reader.leaf(element.node, &[&COMMON[..], &["body1", "body2", "anchor", "site1", "site2"]].concat());
    if element.attribute("body1").is_none() || element.attribute("anchor").is_none() {
        return of_sites(reader, element, name, "spherical", parts, whose);
    }
    let [first, second] = two_bodies(reader, element, parts, whose)?;
    let anchor = vec3(reader, element, "anchor", whose)?;
    let at = Pose::translation(anchor.value);
    let there = parts.built.poses[second].inverse().point(parts.built.poses[first].point(anchor.value));
    let ends = [
        frame(&format!("{}_1", name.value), first, &at, anchor.span, parts, raw),
        frame(&format!("{}_2", name.value), second, &Pose::translation(there), anchor.span, parts, raw),
    ];
    Some(between(name, "spherical", ends))
}

/// `weld`: the second body stays where it is in the first, as the file places them or as `relpose` says.
fn weld<'d>(
    reader: &mut Reader,
    element: &Element<'d>,
    name: Spanned<String>,
    parts: &mut Parts<'_, 'd>,
    whose: &str,
    raw: &mut RawModel,
) -> Option<RawConstraint> {
    let own = ["body1", "body2", "anchor", "relpose", "site1", "site2", "torquescale"];
    reader.leaf(element.node, &[&COMMON[..], &own].concat());
    if element.attribute("body1").is_none() {
        return of_sites(reader, element, name, "fixed", parts, whose);
    }
    let [first, second] = two_bodies(reader, element, parts, whose)?;
    let anchor = vec3(reader, element, "anchor", whose).map_or([0.0; 3], |a| a.value);
    let stated = numbers(reader, element, "relpose", 7..=7, whose).and_then(|all| {
        let (xyz, quat) = (all.value[..3].try_into().ok()?, <[f64; 4]>::try_from(&all.value[3..]).ok()?);
        // A quaternion of zeros means that the file's own pose holds.
        Some(Pose { xyz, quat: normalised(quat)? })
    });
    let here = stated.unwrap_or_else(|| {
        let relative = parts.built.poses[first].inverse().then(&parts.built.poses[second]);
        relative.then(&Pose::translation(anchor))
    });
    let span = place(element.node);
    let ends = [
        frame(&format!("{}_1", name.value), first, &here, span, parts, raw),
        frame(&format!("{}_2", name.value), second, &Pose::translation(anchor), span, parts, raw),
    ];
    Some(between(name, "fixed", ends))
}

/// The first two coefficients of a polynomial whose others are zero.
fn line(reader: &mut Reader, element: &Element, whose: &str) -> Option<[f64; 2]> {
    let Some(given) = numbers(reader, element, "polycoef", 1..=5, whose) else {
        return element.attribute("polycoef").is_none().then_some([0.0, 1.0]);
    };
    let mut all = [0.0, 1.0, 0.0, 0.0, 0.0];
    all[..given.value.len()].copy_from_slice(&given.value);
    if all[2..].iter().any(|x| *x != 0.0) {
        let message = format!("{whose}a `polycoef` of more than the first power is not modelled");
        reader.findings.error(given.span, message, "write `polycoef=\"a b 0 0 0\"`");
        return None;
    }
    Some([all[0], all[1]])
}

/// `joint`: one coordinate is a linear function of another one.
fn joints(
    reader: &mut Reader,
    element: &Element,
    name: Spanned<String>,
    parts: &Parts,
    whose: &str,
) -> Option<RawConstraint> {
    reader.leaf(element.node, &[&COMMON[..], &["joint1", "joint2", "polycoef"]].concat());
    let line = line(reader, element, whose);
    reader.required(element.node, "joint1", whose)?;
    let known = |reader: &mut Reader, key| {
        let name = element.attribute(key)?;
        let known = find(reader, &name, &parts.built.joints, "joint", whose)?;
        scalar(reader, known, &name, whose)?;
        Some(Spanned::new(known, name.span))
    };
    let (first, second) = (known(reader, "joint1"), known(reader, "joint2"));
    let [a, b] = line?;
    let (Some(second), true) = (second, b != 0.0) else {
        if element.attribute("joint2").is_none() || b == 0.0 {
            let message = format!("{whose}a joint that an equality holds is not read");
            reader.findings.error(place(element.node), message, "remove the joint");
        }
        return None;
    };
    let first = first?;
    let offset = a + first.value.reference - b * second.value.reference;
    let terms = [(first, 1.0), (second, -b)].map(|(joint, ratio)| (joint.value.name.clone(), joint.span, ratio));
    Some(coupling(name, &terms, offset))
}

/// Whether a joint has one coordinate; reports it otherwise.
pub(super) fn scalar(reader: &mut Reader, known: &Known, at: &Spanned<&str>, whose: &str) -> Option<()> {
    if known.kind.is_scalar() {
        return Some(());
    }
    let message = format!("{whose}{} is a {} joint", quote(at.value), known.kind.word());
    reader.findings.error(at.span, message, "only hinges and slides have one coordinate");
    None
}

fn coupling(name: Spanned<String>, terms: &[(String, Span, f64)], offset: f64) -> RawConstraint {
    let span = name.span;
    let joints = terms.iter().map(|(name, span, _)| Spanned::new(name.clone(), *span)).collect();
    let ratios = terms.iter().map(|(_, span, ratio)| RawNumber::constant(*ratio, *span)).collect();
    RawConstraint::Coupling(RawCoupling {
        name,
        joints: Some(Spanned::new(joints, span)),
        ratios: Some(Spanned::new(ratios, span)),
        offset: (offset != 0.0).then(|| RawNumber::constant(offset, span)),
        decay: None,
    })
}

/// `tendon`: the length of a fixed tendon is constant, or a linear function of that of another one.
fn tendons(
    reader: &mut Reader,
    element: &Element,
    name: Spanned<String>,
    parts: &Parts,
    whose: &str,
) -> Option<RawConstraint> {
    reader.leaf(element.node, &[&COMMON[..], &["tendon1", "tendon2", "polycoef"]].concat());
    let line = line(reader, element, whose);
    reader.required(element.node, "tendon1", whose)?;
    let mut terms: Vec<(String, Span, f64)> = Vec::new();
    let [a, b] = line?;
    let mut offset = a;
    for (key, factor) in [("tendon1", 1.0), ("tendon2", -b)] {
        let Some(at) = element.attribute(key) else { continue };
        let tendon = find(reader, &at, parts.tendons, "tendon", whose)?;
        if tendon.terms.is_empty() {
            let message = format!("{whose}the length of {} is not read: it is no fixed tendon", quote(at.value));
            reader.findings.error(at.span, message, "remove it, or load and save the file without it");
            return None;
        }
        for (joint, reference, ratio) in &tendon.terms {
            offset += factor * ratio * reference;
            match terms.iter_mut().find(|(name, ..)| name == joint) {
                Some(term) => term.2 += factor * ratio,
                None => terms.push((joint.clone(), at.span, factor * ratio)),
            }
        }
    }
    terms.retain(|(.., ratio)| *ratio != 0.0);
    if terms.len() < 2 {
        let message = format!("{whose}an equality that holds one joint is not read");
        reader.findings.error(place(element.node), message, "remove the joint");
        return None;
    }
    Some(coupling(name, &terms, offset))
}
