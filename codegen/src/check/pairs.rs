//! Contacts between the bodies of a robot, which options ask for: of all pairs of shapes, those that can be followed and
//! that are meant to touch. Every pair that is left out is counted with its reason.

use std::collections::{HashMap, HashSet};

use super::contacts::{Pair, Surface, Surfaces};
use super::loops::{led, merged};
use super::overlaps::overlapping;
use crate::import::raw::{RawModel, RawPairs};
use crate::import::source::{Findings, Span, Spanned};
use crate::import::taken::Taken;
use crate::import::words::{list_of, SHOWN};
use crate::model::{Contact, Model, ShapeKind, Value};

/// Most contacts of a pair that the file does not list: a rod and a box have 14.
const DEAR: usize = 32;

/// Most contacts of all pairs together: work and memory grow with the square of their number.
const MOST: usize = 1000;

/// Most contacts that are looked at for overlaps.
const MOST_LOOKED_AT: usize = 10_000;

/// Why pairs are left out, in the order in which this is told.
const REASONS: [&str; 5] = [
    "because one joint connects their bodies",
    "because no freedom is between their bodies",
    "because such shapes cannot touch (a sphere or a capsule can touch a sphere, capsule, box, cylinder or hull)",
    "because each would be more than 32 contacts",
    "because they overlap at the described start, or at that within the ranges of the joints",
];
const JOINED: usize = 0;
const RIGID: usize = 1;
const UNSUPPORTED: usize = 2;
const MANY: usize = 3;
const OVERLAPPING: usize = 4;

/// A pair and the places where its shapes can touch.
pub(super) struct Candidate {
    name: String,
    pub(super) shapes: [usize; 2],
    pub(super) contacts: Vec<Contact>,
}

/// Adds the contacts between bodies to a model that has no errors.
pub(super) fn add(raw: &RawModel, surfaces: &Surfaces, model: &mut Model, findings: &mut Findings) {
    let (Some(pairs), Some(surfaces)) = (&raw.pairs, &surfaces.pairs) else { return };
    if findings.has_errors() || model.shapes.len() != raw.shapes.len() {
        return;
    }
    let mut gathered = Gathered::new(model);
    let bodies = Bodies::new(model);
    let listed = listed(pairs, &surfaces.0, &mut gathered, &bodies, findings);
    let whole = listed.and_then(|seen| others((raw, pairs), surfaces.1, &seen, &mut gathered, &bodies, findings));
    if whole.is_none() {
        return too_many(findings);
    }
    let Gathered { candidates, mut left_out, .. } = gathered;
    let (overlaps, before) = (overlapping(model, &candidates), model.contacts.len());
    for (candidate, overlaps) in candidates.into_iter().zip(overlaps) {
        match overlaps {
            true => left_out.add(OVERLAPPING, candidate.name),
            false => model.contacts.extend(candidate.contacts),
        }
    }
    if model.contacts.len() - before > MOST {
        too_many(findings);
    }
    if model.contacts.len() == before {
        let help = "give bodies that no joint connects spheres or capsules to touch with, or leave this option out";
        findings.warning(Span::FILE, "no contacts between bodies were found", help);
    }
    left_out.tell(findings);
}

fn too_many(findings: &mut Findings) {
    let help = "leave the contacts between bodies out, or describe the bodies by fewer shapes; in MJCF, `exclude` pairs of bodies";
    findings.error(
        Span::FILE,
        format!("the shapes of the bodies have more than {MOST} contacts with each other"),
        help,
    );
}

/// The pairs that were left out, by the reason: their number, and the first names.
#[derive(Default)]
struct LeftOut([(usize, Vec<String>); REASONS.len()]);

impl LeftOut {
    fn add(&mut self, reason: usize, name: String) {
        let (count, names) = &mut self.0[reason];
        *count += 1;
        if names.len() < SHOWN {
            names.push(name);
        }
    }

    fn tell(self, findings: &mut Findings) {
        for ((n, names), reason) in self.0.into_iter().zip(REASONS).filter(|((n, _), _)| *n > 0) {
            let s = if n == 1 { "" } else { "s" };
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let names = list_of(&names, n);
            findings.notice(Span::FILE, format!("{n} pair{s} of shapes left without contacts, {reason}: {names}"));
        }
    }
}

/// The contacts of the pairs that were looked at.
struct Gathered<'m> {
    model: &'m Model,
    names: Taken,
    candidates: Vec<Candidate>,
    left_out: LeftOut,
    /// Number of contacts.
    total: usize,
}

impl<'m> Gathered<'m> {
    fn new(model: &'m Model) -> Self {
        let mut names = Taken::default();
        let known = model.constraints.iter().map(|c| &c.name).chain(model.contacts.iter().map(|c| &c.name));
        known.for_each(|name| drop(names.name(name, "_")));
        Gathered { model, names, candidates: Vec::new(), left_out: LeftOut::default(), total: 0 }
    }

    /// Takes a pair, with any number of contacts if the file lists it; `None` where there are too many.
    fn take(&mut self, pair: &Pair, of_file: bool, findings: &mut Findings) -> Option<()> {
        let shapes = pair.shapes.map(|k| &self.model.shapes[k]);
        let wanted = &pair.name.value;
        let mut contacts = match pair.contacts(shapes, findings) {
            None => {
                self.left_out.add(UNSUPPORTED, wanted.clone());
                return Some(());
            }
            Some(contacts) if !of_file && contacts.len() > DEAR => {
                self.left_out.add(MANY, wanted.clone());
                return Some(());
            }
            Some(contacts) => contacts,
        };
        #[cfg(feature = "height_fields")]
        super::contacts::tight(shapes, pair, findings);
        // Names of different shapes may come to the same with a stroke between them.
        let many = contacts.len() > 1;
        let name = self.names.numbered(wanted, "_pair_", if many { contacts.len() } else { 0 });
        for (k, contact) in contacts.iter_mut().enumerate() {
            contact.name = if many { format!("{name}/{}", k + 1) } else { name.clone() };
        }
        self.total += contacts.len();
        self.candidates.push(Candidate { name, shapes: pair.shapes, contacts });
        (self.total <= MOST_LOOKED_AT).then_some(())
    }
}

/// Takes the pairs that the file lists, and returns their shapes.
fn listed(
    pairs: &RawPairs,
    surfaces: &[Surface],
    gathered: &mut Gathered,
    bodies: &Bodies,
    findings: &mut Findings,
) -> Option<HashSet<[usize; 2]>> {
    let shapes = &gathered.model.shapes;
    let index: HashMap<&str, usize> = shapes.iter().enumerate().map(|(k, s)| (s.name.as_str(), k)).collect();
    let mut seen = HashSet::new();
    for (contact, surface) in pairs.listed.iter().zip(surfaces) {
        let Some(ends) = &contact.between else { continue };
        // A variant may have removed one of them.
        let [Some(&a), Some(&b)] = [0, 1].map(|k: usize| index.get(ends[k].value.as_str())) else { continue };
        if !seen.insert([a.min(b), a.max(b)]) {
            continue;
        }
        if bodies.led([a, b].map(|k| shapes[k].mount.body)) {
            gathered.left_out.add(RIGID, contact.name.value.clone());
            continue;
        }
        let pair = Pair { name: contact.name.clone(), shapes: [a, b], surface: *surface, at: ends[1].span };
        gathered.take(&pair, true, findings)?;
    }
    Some(seen)
}

/// Takes the other pairs, in the order of the file.
fn others(
    (raw, pairs): (&RawModel, &RawPairs),
    surface: Surface,
    seen: &HashSet<[usize; 2]>,
    gathered: &mut Gathered,
    bodies: &Bodies,
    findings: &mut Findings,
) -> Option<()> {
    let model = gathered.model;
    let name = |body: Option<usize>| body.map_or("ground", |b| model.bodies[b].name.as_str());
    let excluded: HashSet<[&str; 2]> =
        pairs.excluded.iter().flat_map(|[a, b]| [[a.as_str(), b.as_str()], [b.as_str(), a.as_str()]]).collect();
    // Where there is a floor, it stands for the planes of the file.
    let aside = |k: &usize| {
        let plane = matches!(model.shapes[*k].kind, ShapeKind::Plane { .. });
        raw.floors.contains(k) || (plane && !raw.floors.is_empty())
    };
    let taking_part: Vec<usize> = (0..model.shapes.len()).filter(|k| !aside(k)).collect();
    for (n, &j) in taking_part.iter().enumerate() {
        for &i in &taking_part[..n] {
            let on = [i, j].map(|k| model.shapes[k].mount.body);
            let meant = !bodies.led(on) && masked(raw.shapes[i].bits, raw.shapes[j].bits);
            if !meant || seen.contains(&[i, j]) || excluded.contains(&on.map(name)) {
                continue;
            }
            let name = format!("{}/{}", model.shapes[i].name, model.shapes[j].name);
            if bodies.joined(on) {
                gathered.left_out.add(JOINED, name);
                continue;
            }
            let at = raw.shapes[j].name.span;
            let pair = Pair { name: Spanned::new(name, at), shapes: [i, j], surface, at };
            gathered.take(&pair, false, findings)?;
        }
    }
    Some(())
}

/// Whether two shapes may touch by their bits: all do in formats that have none.
fn masked(first: Option<[u32; 2]>, second: Option<[u32; 2]>) -> bool {
    match (first, second) {
        (Some([a, with_a]), Some([b, with_b])) => a & with_b != 0 || b & with_a != 0,
        _ => true,
    }
}

/// How bodies are joined.
struct Bodies {
    /// What moves as one, by its innermost body; the ground is `None`.
    welded: Vec<Option<usize>>,
    /// The same with prescribed joints, which nothing that touches can move.
    led: Vec<Option<usize>>,
    /// What joints connect, directly or by bodies without mass and shapes.
    joined: HashSet<[Option<usize>; 2]>,
}

impl Bodies {
    fn new(model: &Model) -> Bodies {
        let (joints, count) = (&model.joints, model.bodies.len());
        let welded = merged(joints, count, |j| j.kind.nv() == 0);
        let led = merged(joints, count, led);
        // Bodies without mass and shapes are parts of joints with several freedoms.
        let mut solid = vec![false; count];
        let heavy = model.bodies.iter().enumerate().filter(|(_, body)| body.mass != Value::ZERO).map(|(k, _)| k);
        for body in heavy.chain(model.shapes.iter().filter_map(|shape| shape.mount.body)) {
            if let Some(root) = welded[body] {
                solid[root] = true;
            }
        }
        // What a body hangs on, and whether it travels there. A body that travels over the ground is not joined to it.
        let mut hangs = vec![(None, false); count];
        let mut joined = HashSet::new();
        for joint in joints.iter().filter(|joint| joint.kind.nv() > 0) {
            let carrier = joint.parent.and_then(|b| welded[b]);
            let (on, moving) = match carrier {
                Some(b) if !solid[b] => hangs[b],
                _ => (carrier, false),
            };
            let moving = moving || joint.travels();
            hangs[joint.child] = (on, moving);
            if solid[joint.child] && !(moving && on.is_none()) {
                joined.insert([on, Some(joint.child)]);
            }
        }
        Bodies { welded, led, joined }
    }

    fn led(&self, on: [Option<usize>; 2]) -> bool {
        let [a, b] = on.map(|body| body.and_then(|b| self.led[b]));
        a == b
    }

    fn joined(&self, on: [Option<usize>; 2]) -> bool {
        let [a, b] = on.map(|body| body.and_then(|b| self.welded[b]));
        self.joined.contains(&[a, b]) || self.joined.contains(&[b, a])
    }
}
