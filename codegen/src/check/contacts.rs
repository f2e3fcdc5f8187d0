//! Contacts between shapes.

use std::collections::{HashMap, HashSet};

use mbd_runtime::contact::RestitutionLaw;

use super::elementary::{elementary, moved, Elementary, Rounded, MOST, SUPPORTED};
use super::loops::{led, merged};
use super::numbers::{Numbers, Quantity};
use super::shapes::a as with_article;
use crate::import::raw::{RawContact, RawModel, RawNumber, RawSurface};
use crate::import::source::{Findings, Span, Spanned};
use crate::import::words::{did_you_mean, list, quote};
use crate::model::{Body, ConstraintKind, Contact, Joint, Shape, ShapeKind};
use crate::names::identifier;

/// Coefficients of friction above this one are suspicious: racing tyres have 2.
const ROUGH: f64 = 10.0;

/// What to write in place of a parameter.
const CONSTANT: &str = "write a constant: coefficients of contacts are given again when they are simulated";

/// What two surfaces do to each other.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    friction: f64,
    restitution: f64,
    law: RestitutionLaw,
}

/// The surfaces of all contacts.
pub(super) struct Surfaces {
    /// Those of the contacts that are described one by one.
    each: Vec<Surface>,
    /// That of the others.
    others: Surface,
    /// Those of the contacts between bodies that options ask for: of the pairs that the file lists, and of the others.
    pub(super) pairs: Option<(Vec<Surface>, Surface)>,
}

impl Surfaces {
    /// Reads the surfaces and judges their numbers.
    pub(super) fn new(raw: &RawModel, numbers: &mut Numbers) -> Surfaces {
        let none = Surface { friction: 0.0, restitution: 0.0, law: RestitutionLaw::default() };
        let others = surface(&raw.surface, none, "`contacts`", numbers);
        let each = own(&raw.contacts, others, numbers);
        let pairs = raw.pairs.as_ref().filter(|_| cfg!(feature = "self_contact")).map(|pairs| {
            let friction = friction(&pairs.friction, "contacts between bodies", numbers);
            let others = Surface { friction, ..others };
            (own(&pairs.listed, others, numbers), others)
        });
        Surfaces { each, others, pairs }
    }
}

/// The surface of each contact, with what it does not state from another one.
fn own(contacts: &[RawContact], otherwise: Surface, numbers: &mut Numbers) -> Vec<Surface> {
    let mut one =
        |c: &RawContact| surface(&c.surface, otherwise, &format!("contact {}", quote(&c.name.value)), numbers);
    contacts.iter().map(&mut one).collect()
}

fn surface(raw: &RawSurface, otherwise: Surface, what: &str, numbers: &mut Numbers) -> Surface {
    let friction = raw.friction.as_ref().map(|x| friction(x, what, numbers));
    let surface = Surface {
        friction: friction.unwrap_or(otherwise.friction),
        restitution: raw
            .restitution
            .as_ref()
            .map_or(otherwise.restitution, |x| restitution(x, "restitution", what, numbers)),
        law: raw.law.as_ref().map_or(otherwise.law, |law| law.value),
    };
    // Where the entry repeats nothing of its own, the finding stands at what it takes over.
    let own = raw.law.as_ref().map(|law| law.span);
    let own = own.or(raw.restitution.as_ref().map(|x| x.span)).or(raw.friction.as_ref().map(|x| x.span));
    let gains = surface.law == RestitutionLaw::Newton && surface.friction > 0.0 && surface.restitution > 0.0;
    if let (Some(span), true) = (own, gains) {
        let message = format!("{what}: Newton's law of restitution with friction can add energy");
        numbers.findings.warning(span, message, "write `law = \"poisson\"` or `law = \"stronge\"`, which never do");
    }
    surface
}

fn friction(x: &RawNumber, what: &str, numbers: &mut Numbers) -> f64 {
    let value = numbers.constant(x, Quantity::Plain, &format!("{what}: `friction`"), CONSTANT);
    let help = "write the tangential force at which it slips over the normal force: 0 is smooth, rubber has about 1";
    if value < 0.0 {
        numbers.findings.error(x.span, format!("{what}: negative `friction`"), help);
    } else if value > ROUGH {
        numbers.findings.warning(x.span, format!("{what}: a `friction` of {value} is very rough"), help);
    }
    value
}

/// A coefficient of restitution under `key`.
pub(super) fn restitution(x: &RawNumber, key: &str, what: &str, numbers: &mut Numbers) -> f64 {
    let value = numbers.constant(x, Quantity::Plain, &format!("{what}: `{key}`"), CONSTANT);
    // NaN stands for what was reported.
    if !value.is_nan() && !(0.0..=1.0).contains(&value) {
        let help = "write a number from 0, nothing bounces, to 1, no energy is lost";
        numbers.findings.error(x.span, format!("{what}: `{key}` is not between 0 and 1"), help);
    }
    value
}

/// A pair of shapes with what stands in messages about it.
pub(super) struct Pair {
    pub(super) name: Spanned<String>,
    pub(super) shapes: [usize; 2],
    pub(super) surface: Surface,
    /// Place of the second shape's name.
    pub(super) at: Span,
}

/// The contacts between shapes. `shapes` as in `raw`, `joints` in their final order.
pub(super) fn between(
    raw: &RawModel,
    shapes: &[Option<Shape>],
    surfaces: &Surfaces,
    joints: &[Joint],
    bodies: &[Body],
    findings: &mut Findings,
) -> Vec<Contact> {
    let welded = merged(joints, bodies.len(), |j| j.kind.nv() == 0);
    let led = merged(joints, bodies.len(), led);
    let mut index = HashMap::new();
    for (k, shape) in raw.shapes.iter().enumerate() {
        index.entry(shape.name.value.as_str()).or_insert(k);
    }
    let mut contacts = Vec::new();
    let mut listed = HashSet::new();
    for (contact, surface) in raw.contacts.iter().zip(&surfaces.each) {
        let Some([a, b]) = ends(contact, raw, &index, findings) else { continue };
        listed.insert([a.min(b), a.max(b)]);
        let at = contact.between.as_ref().map_or(contact.name.span, |ends| ends[1].span);
        let pair = Pair { name: contact.name.clone(), shapes: [a, b], surface: *surface, at };
        let [Some(first), Some(second)] = [&shapes[a], &shapes[b]] else { continue };
        if apart(&pair, [first, second], &welded, &led, bodies, findings) {
            contacts.extend(pair.contacts([first, second], findings).unwrap_or_else(|| {
                unsupported(&pair, [first, second], findings);
                Vec::new()
            }));
            #[cfg(feature = "height_fields")]
            tight([first, second], &pair, findings);
            if catches([first, second]) {
                let what = format!("contact {}", quote(&pair.name.value));
                let message = format!("{what}: a point is caught by an edge that it slides over");
                findings.warning(pair.at, message, SMALL);
            }
        }
    }
    let every = raw.all_pairs.or((!raw.floors.is_empty()).then_some(Span::FILE));
    if let Some(span) = every {
        let neighbours = neighbours(joints, &welded);
        let far = |a: &Shape, b: &Shape| {
            let of = |root: &[Option<usize>], s: &Shape| s.mount.body.and_then(|b| root[b]);
            let (p, q) = (of(&welded, a), of(&welded, b));
            of(&led, a) != of(&led, b) && !neighbours.contains(&(p, q)) && !neighbours.contains(&(q, p))
        };
        contacts.extend(all(raw, shapes, surfaces.others, &listed, span, &far, findings));
    }
    contacts
}

/// The shapes that a contact names.
fn ends(
    contact: &RawContact,
    raw: &RawModel,
    index: &HashMap<&str, usize>,
    findings: &mut Findings,
) -> Option<[usize; 2]> {
    let names = contact.between.as_ref()?;
    let mut end = |name: &Spanned<String>| {
        let found = index.get(name.value.as_str()).copied();
        if found.is_none() && !raw.incomplete {
            let all = || raw.shapes.iter().map(|s| s.name.value.as_str());
            let help = did_you_mean(&name.value, all(), || match raw.shapes.is_empty() {
                true => "describe it as a `[[shape]]`".into(),
                false => format!("the shapes are {}", list(all())),
            });
            let message = format!("contact {}: {} is not a shape", quote(&contact.name.value), quote(&name.value));
            findings.error(name.span, message, help);
        }
        found
    };
    let (first, second) = (end(&names[0]), end(&names[1]));
    Some([first?, second?])
}

/// Whether the bodies of two shapes can move against each other; reports them otherwise.
fn apart(
    pair: &Pair,
    [a, b]: [&Shape; 2],
    welded: &[Option<usize>],
    led: &[Option<usize>],
    bodies: &[Body],
    findings: &mut Findings,
) -> bool {
    let of = |root: &[Option<usize>], s: &Shape| s.mount.body.and_then(|b| root[b]);
    let body = |s: &Shape| s.mount.body.map_or("the ground".into(), |b| format!("body {}", quote(&bodies[b].name)));
    let what = format!("contact {}", quote(&pair.name.value));
    let on = format!("{what}: {} and {}", quote(&a.name), quote(&b.name));
    let (message, help) = if a.mount.body == b.mount.body {
        let help = "let `between` name shapes on two different bodies, one of which may be the ground";
        (format!("{on} are both on {}", body(a)), help)
    } else if of(welded, a) == of(welded, b) {
        let help = "remove the contact, or give a joint between them a type other than `fixed`";
        (format!("{what}: fixed joints join {} to {}", body(a), body(b)), help)
    } else if of(led, a) == of(led, b) {
        let message = format!("{what}: every joint between {} and {} is fixed or prescribed", body(a), body(b));
        (message, "remove the contact, or free one of those joints")
    } else {
        return true;
    };
    findings.error(pair.at, message, help);
    false
}

impl Pair {
    /// As many contacts as the shapes have places to touch at; `None` where the pair is not supported.
    pub(super) fn contacts(&self, [a, b]: [&Shape; 2], findings: &Findings) -> Option<Vec<Contact>> {
        let direct = elementary(&a.kind, &b.kind).map(|places| (places, [a, b], self.shapes));
        let [i, j] = self.shapes;
        let (places, [a, b], shapes) = direct.or_else(|| Some((elementary(&b.kind, &a.kind)?, [b, a], [j, i])))?;
        let origin = findings.origin(self.name.span);
        let many = places.len() > 1;
        let one = |(k, place): (usize, &Elementary)| {
            let ([a, b], shapes) = match place.exchanged {
                true => ([b, a], [shapes[1], shapes[0]]),
                false => ([a, b], shapes),
            };
            let (first, second) = (moved(&a.mount, place.first), moved(&b.mount, place.second));
            Contact {
                name: if many { format!("{}/{}", self.name.value, k + 1) } else { self.name.value.clone() },
                kind: ConstraintKind::Loop { kind: place.kind, first, second },
                friction: self.surface.friction,
                restitution: self.surface.restitution,
                law: self.surface.law,
                shapes: Some(shapes),
                origin: origin.clone(),
            }
        };
        Some(places.iter().enumerate().map(one).collect())
    }
}

/// Why nothing is known of the faces of a hull.
#[cfg(feature = "hulls")]
const NO_FACES: &str =
    "the corners of the hull lie on a line or are more than 500, or rounding does not tell which of them are on one face: leave \
     some out, or write a smaller `most`";
#[cfg(not(feature = "hulls"))]
use crate::import::hull::WITHOUT as NO_FACES;

fn unsupported(pair: &Pair, [a, b]: [&Shape; 2], findings: &mut Findings) {
    let what = format!("contact {}", quote(&pair.name.value));
    let message = format!("{what}: {} and {} cannot touch", with_article(a.kind.word()), with_article(b.kind.word()));
    let simple = |s: &Shape| match s.kind {
        ShapeKind::Plane { .. } | ShapeKind::Point => true,
        #[cfg(feature = "height_fields")]
        ShapeKind::HeightField { .. } => {
            matches!((&a.kind, &b.kind), (ShapeKind::HeightField { .. }, ShapeKind::HeightField { .. }))
        }
        _ => false,
    };
    let solid =
        |s: &Shape| matches!(s.kind, ShapeKind::Capsule { .. } | ShapeKind::Box { .. } | ShapeKind::Hull { .. });
    let cylinder = |s: &Shape| matches!(s.kind, ShapeKind::Cylinder { .. });
    let bare = |s: &Shape| matches!(s.kind, ShapeKind::Cylinder { sides: None, .. });
    let faces = |s: &Shape| matches!(s.kind, ShapeKind::Hull { .. }) || cylinder(s);
    let faceless = |s: &Shape| faces(s) && Rounded::new(&s.kind).is_none();
    let meets = |s: &Shape| solid(s) || cylinder(s) || matches!(s.kind, ShapeKind::Point | ShapeKind::Sphere { .. });
    // Without the feature `hulls`, a cylinder touches no capsule either.
    let rod = |s: &Shape| matches!(s.kind, ShapeKind::Capsule { .. });
    if let ([true, true], false, Some(without)) =
        ([a, b].map(|s| solid(s) || cylinder(s)), rod(a) || rod(b), [a, b].into_iter().find(|s| bare(s)))
    {
        let message = format!("{message}: {} has no `sides`", quote(&without.name));
        let help = "add `sides = 12` to it: for what it touches it is then the prism with so many sides, whose corners are on its rims";
        findings.error(pair.at, message, help);
        return;
    }
    let (message, help) = match (Rounded::new(&a.kind), Rounded::new(&b.kind)) {
        (Some(first), Some(second)) if first.contacts(&second) > MOST => {
            let n = first.contacts(&second);
            let message = format!("{what}: corners and edges of both are {n} contacts, more than {MOST}");
            (message, "give a hull fewer corners by `most`, a cylinder fewer `sides`".into())
        }
        (Some(_), Some(_)) => {
            let help = "add `rounding = 0.001` to one of them: the radius of its edges and corners in metres";
            (format!("{message}: the edges of both are sharp"), help.into())
        }
        _ if meets(a) && meets(b) && (faceless(a) || faceless(b)) => (message, NO_FACES.into()),
        _ if simple(a) || simple(b) => (message, SUPPORTED.into()),
        _ => (message, format!("{SUPPORTED}; describe one of the two by spheres or points")),
    };
    findings.error(pair.at, message, help);
}

/// Contacts of every pair of shapes that is asked for and for which `far` holds, without those that are `listed`.
fn all(
    raw: &RawModel,
    shapes: &[Option<Shape>],
    surface: Surface,
    listed: &HashSet<[usize; 2]>,
    span: Span,
    far: &dyn Fn(&Shape, &Shape) -> bool,
    findings: &mut Findings,
) -> Vec<Contact> {
    let (mut contacts, mut left_out, mut caught) = (Vec::new(), Vec::new(), Vec::new());
    for (j, second) in shapes.iter().enumerate() {
        for (i, first) in shapes[..j].iter().enumerate() {
            let (Some(a), Some(b)) = (first, second) else { continue };
            let asked = raw.all_pairs.is_some() || [i, j].iter().any(|k| raw.floors.contains(k));
            // A geom that touches nothing in MuJoCo is a shape only for the pairs of the file that name it.
            let idle = |k: usize| raw.shapes[k].bits == Some([0; 2]);
            if !asked || idle(i) || idle(j) || listed.contains(&[i, j]) || !far(a, b) {
                continue;
            }
            let name = Spanned::new(format!("{}/{}", a.name, b.name), raw.shapes[j].name.span);
            let pair = Pair { name, shapes: [i, j], surface, at: span };
            if catches([a, b]) {
                caught.push(pair.name.value.clone());
            }
            match pair.contacts([a, b], findings) {
                Some(found) => {
                    #[cfg(feature = "height_fields")]
                    tight([a, b], &pair, findings);
                    contacts.extend(found);
                }
                None => left_out.push(pair.name.value),
            }
        }
    }
    if !left_out.is_empty() {
        let (n, names) = (left_out.len(), list(left_out.iter().map(String::as_str)));
        let message = format!("{n} pair{} of shapes cannot touch: {names}", if n == 1 { "" } else { "s" });
        findings.warning(span, message, SUPPORTED);
    }
    if !caught.is_empty() {
        let names = list(caught.iter().map(String::as_str));
        findings.warning(span, format!("points are caught by edges that they slide over: {names}"), SMALL);
    }
    contacts
}

/// Reports a ball that does not fit into every hollow of a height field.
#[cfg(feature = "height_fields")]
pub(super) fn tight([a, b]: [&Shape; 2], pair: &Pair, findings: &mut Findings) {
    use crate::field::fit;
    let (field, ball, ground) = match (&a.kind, &b.kind) {
        (ShapeKind::HeightField { field, .. }, _) => (*field, b, a),
        (_, ShapeKind::HeightField { field, .. }) => (*field, a, b),
        _ => return,
    };
    let radius = match ball.kind {
        ShapeKind::Sphere { radius } | ShapeKind::Capsule { radius, .. } => radius,
        ShapeKind::Box { rounding, .. } | ShapeKind::Hull { rounding, .. } => rounding,
        _ => return,
    };
    // Sharp corners follow all ground. What is not greater than zero otherwise was reported.
    if radius.is_nan() || radius <= 0.0 {
        return;
    }
    let (name, ball, ground) = (quote(&pair.name.value), quote(&ball.name), quote(&ground.name));
    let message = |at: [f64; 2], hollow: f64, beside: &str| {
        let [x, y] = at.map(|x| format!("{x:.3}").parse::<f64>().unwrap_or(x));
        let why = match hollow < 10.0 * radius {
            true => format!("the hollow at x = {x}, y = {y}{beside} has a radius of {hollow:.3} m"),
            false => format!("the ground bends too sharply around x = {x}, y = {y}{beside}"),
        };
        format!("contact {name}: {ball}, of radius {radius} m, cannot follow {ground}: {why}")
    };
    match fit(field, radius).narrow {
        [Some(on), _] => {
            let help = "make the ball smaller than all hollows or a `point`, or the ground smoother";
            findings.error(pair.at, message(on.at, on.radius, ""), help);
        }
        [None, Some(beside)] => {
            let help = "keep it on the grid, beside which the ground becomes level within two cells";
            findings.warning(pair.at, message(beside.at, beside.radius, ", beside the grid,"), help);
        }
        [None, None] => {}
    }
}

/// What to do about points at edges.
const SMALL: &str = "where it can get to an edge, make the point a `sphere` with a small radius";

/// Whether one of two shapes is a point, which has no radius with which it could turn about an edge of the other.
fn catches([a, b]: [&Shape; 2]) -> bool {
    let point = |s: &Shape| s.kind == ShapeKind::Point;
    let edged = |s: &Shape| match s.kind {
        ShapeKind::Box { rounding, .. } | ShapeKind::Hull { rounding, .. } => rounding == 0.0,
        ShapeKind::Cylinder { .. } => true,
        _ => false,
    };
    (point(a) && edged(b)) || (edged(a) && point(b))
}

/// Pairs of bodies (as roots of what is welded together) that one joint connects. A joint to the ground that lets its
/// body travel makes no neighbours: what falls onto the floor hangs on such a joint.
fn neighbours(joints: &[Joint], welded: &[Option<usize>]) -> HashSet<(Option<usize>, Option<usize>)> {
    let pair = |j: &Joint| (j.parent.and_then(|b| welded[b]), welded[j.child]);
    joints.iter().filter(|j| !(j.travels() && pair(j).0.is_none())).map(pair).collect()
}

/// Reports numbered contacts, contacts of pairs and stops whose names are taken. Names that stand in the file are
/// compared with the others.
pub(super) fn distinct(raw: &RawModel, contacts: &[Contact], findings: &mut Findings) {
    let written: HashSet<&str> = raw.contacts.iter().map(|c| c.name.value.as_str()).collect();
    let mut taken: HashMap<String, String> = HashMap::new();
    for constraint in &raw.constraints {
        taken.insert(identifier(&constraint.name().value), constraint.name().value.clone());
    }
    for name in &written {
        taken.insert(identifier(name), (*name).to_string());
    }
    for contact in contacts.iter().filter(|c| !written.contains(c.name.as_str())) {
        if let Some(other) = taken.insert(identifier(&contact.name), contact.name.clone()) {
            let message = format!(
                "contact {} and {} become the same identifier in generated code",
                quote(&contact.name),
                quote(&other)
            );
            let help = "rename what one of them is named after: a contact, a shape, a joint, a loop or a coupling";
            findings.error_at(&contact.origin, message, help);
        }
    }
}
