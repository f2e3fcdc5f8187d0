//! Bodies, joints and frames of the raw model from those of the file.

use std::collections::HashMap;

use super::geom::{self, Geom, Solids};
use super::inertia;
use super::joint::{self, Joint, Kind, Rules};
use super::pose::{between, pose, Pose};
use super::tree::{Body, Part};
use crate::import::raw::{RawBody, RawFrame, RawJoint, RawModel};
use crate::import::source::{Span, Spanned};
use crate::import::taken::Taken;
use crate::import::words::quote;
use crate::import::xml::{place, Reader};
use crate::model::FIXED;

const SITE: &[&str] = &[
    "name",
    "class",
    "type",
    "group",
    "pos",
    "quat",
    "axisangle",
    "xyaxes",
    "zaxis",
    "euler",
    "material",
    "size",
    "fromto",
    "rgba",
    "user",
];

/// A joint of the file, for what refers to it.
pub(super) struct Known {
    /// Its name here.
    pub name: String,
    /// Type.
    pub kind: Kind,
    /// Coordinate of the body as the file places it.
    pub reference: f64,
    /// Coordinate at which springs are relaxed.
    pub rest: f64,
    /// Index among the joints of the raw model.
    pub index: usize,
    /// How many joints of the raw model it is, from that index on.
    pub parts: usize,
}

/// What the names of the file stand for.
#[derive(Default)]
pub(super) struct Built<'d> {
    /// Index of each body; that of the world is 0.
    pub bodies: HashMap<&'d str, usize>,
    /// Names of the bodies here, the world being the ground.
    pub names: Vec<Spanned<String>>,
    /// Poses of the bodies in the world, as the file places them.
    pub poses: Vec<Pose>,
    /// Joints.
    pub joints: HashMap<&'d str, Known>,
    /// Names of the frames of sites here.
    pub sites: HashMap<&'d str, String>,
    /// Names of the shapes of geoms here; `None` for those that are none.
    pub geoms: HashMap<&'d str, Option<String>>,
    /// Names of bodies and frames.
    pub taken: Taken,
    joint_names: Taken,
    shape_names: Taken,
}

/// Adds all bodies with their joints, frames and shapes to a raw model.
pub(super) fn all<'d>(
    reader: &mut Reader,
    bodies: &[Body<'d>],
    rules: Rules,
    (solids, shape_names): (Solids<'_, '_, 'd>, Taken),
    raw: &mut RawModel,
) -> Built<'d> {
    let mut built = Built { shape_names, ..Built::default() };
    built.name(reader, bodies);
    let joint_names = built.name_joints(reader, bodies);
    let mut masses = Vec::new();
    // Which bodies no joint moves.
    let mut still: Vec<bool> = Vec::with_capacity(bodies.len());
    for (k, body) in bodies.iter().enumerate() {
        let parent = body.parent.map_or(Pose::IDENTITY, |parent| built.poses[parent]);
        built.poses.push(parent.then(&body.pose));
        let stands = body.parent.is_none_or(|parent| still[parent]);
        still.push(stands && body.joints.is_empty());
        let whose = |tag: &str, part: &Part| match part.element.name() {
            Some(name) => format!("{tag} {}: ", quote(name.value)),
            None => format!("{tag} in {}: ", body.shown()),
        };
        let read = body.geoms.iter().map(|part| {
            let whose = whose("geom", part);
            (part, geom::read(reader, part, rules.compiler, &whose))
        });
        let geoms: Vec<(&Part, Geom)> = read.filter_map(|(part, geom)| Some((part, geom?))).collect();
        let hulls = k > 0 && (!raw.floors.is_empty() || solids.listed.is_some());
        for (part, geom) in &geoms {
            let shape = geom.shape(reader, (&part.element, solids, hulls), &built.names[k], &mut built.shape_names);
            if let (Some(name), true) = (part.element.name(), cfg!(feature = "self_contact")) {
                built.geoms.entry(name.value).or_insert(shape.as_ref().map(|shape| shape.name.value.clone()));
            }
            let Some(shape) = shape else { continue };
            // Where there is a floor, height fields are others.
            #[cfg(feature = "height_fields")]
            if shape.field.is_some() && !raw.floors.is_empty() {
                raw.floors.push(raw.shapes.len());
            }
            raw.shapes.push(shape);
        }
        if k > 0 {
            let mut geoms: Vec<Geom> = geoms.into_iter().map(|(_, geom)| geom).collect();
            // A mass in total is that of all bodies.
            let needed = !still[k] || rules.compiler.total_mass.is_some();
            masses.push(inertia::of_body(reader, (body, needed), &mut geoms, rules.compiler, solids.meshes));
            built.chain(reader, (k, body), &joint_names[k], rules, raw);
        }
        for part in &body.sites {
            built.site(reader, part, k, rules, &whose("site", part), raw);
        }
    }
    if let Some(total) = rules.compiler.total_mass {
        inertia::scale(&mut masses, total);
    }
    // Bodies between joints were added without mass; those of the file stand before them.
    let own = masses.iter().zip(&built.names[1..]).map(|(mass, name)| mass.raw(name.clone()));
    raw.bodies.splice(0..0, own.collect::<Vec<_>>());
    built
}

impl<'d> Built<'d> {
    /// Gives the bodies their names: first those of the file.
    fn name(&mut self, reader: &mut Reader, bodies: &[Body<'d>]) {
        self.taken.name("ground", "_");
        self.bodies.insert("world", 0);
        self.names = vec![Spanned::new("ground".into(), Span::FILE); bodies.len()];
        for (k, body) in bodies.iter().enumerate().skip(1) {
            let Some(name) = &body.name else { continue };
            if self.bodies.insert(name.value, k).is_some() {
                let message = format!("body {} is defined twice", quote(name.value));
                reader.findings.error(name.span, message, "rename one of them");
            }
            let new = self.taken.name(name.value, "_");
            renamed(reader, "body", name, &new);
            self.names[k] = Spanned::new(new, name.span);
        }
        for site in bodies.iter().flat_map(|body| &body.sites) {
            let Some(name) = site.element.name() else { continue };
            let new = self.taken.name(name.value, "_site_");
            if self.sites.insert(name.value, new.clone()).is_some() {
                let message = format!("site {} is defined twice", quote(name.value));
                reader.findings.error(name.span, message, "rename one of them");
            }
            renamed(reader, "site", &name, &new);
        }
        for (k, body) in bodies.iter().enumerate().skip(1).filter(|(_, body)| body.name.is_none()) {
            let new = self.taken.name(&format!("body_{k}"), "_");
            self.names[k] = Spanned::new(new, place(body.node));
        }
    }

    /// The names of all joints: first those of the file.
    fn name_joints(&mut self, reader: &mut Reader, bodies: &[Body<'d>]) -> Vec<Vec<Option<Spanned<String>>>> {
        let mut seen = HashMap::new();
        let mut given = |part: &Part<'d>| {
            let name = part.element.name()?;
            if seen.insert(name.value, ()).is_some() {
                let message = format!("joint {} is defined twice", quote(name.value));
                reader.findings.error(name.span, message, "rename one of them");
            }
            let new = self.joint_names.name(name.value, "_");
            renamed(reader, "joint", &name, &new);
            Some(Spanned::new(new, name.span))
        };
        bodies.iter().map(|body| body.joints.iter().map(&mut given).collect()).collect()
    }

    /// Adds the joints of a body, one behind the other, with bodies without mass between them. The body's own frame is
    /// that of the file.
    fn chain(
        &mut self,
        reader: &mut Reader,
        (k, body): (usize, &Body<'d>),
        names: &[Option<Spanned<String>>],
        rules: Rules,
        raw: &mut RawModel,
    ) {
        let parent = body.parent.unwrap_or(0);
        let mut carrier = (parent > 0).then(|| self.names[parent].clone());
        // The body frame of the file as seen from the carrier.
        let mut pending = body.pose;
        self.judge(reader, body, parent);
        for (n, (part, name)) in body.joints.iter().zip(names).enumerate() {
            let whose = match part.element.name() {
                Some(name) => format!("joint {}: ", quote(name.value)),
                None => format!("joint in {}: ", body.shown()),
            };
            let Some(joint) = joint::read(reader, part, rules, &whose) else { continue };
            let free = joint.kind == Kind::Free;
            let anchor = match joint.kind {
                // Any point slides alike: one that needs no displacement.
                Kind::Slide if n == 0 => [0.0; 3],
                Kind::Slide => pending.inverse().xyz,
                Kind::Free => [0.0; 3],
                _ => joint.anchor,
            };
            let placement = if free { Pose::IDENTITY } else { pending.then(&joint.before(anchor)) };
            pending = Pose::translation(anchor.map(|x| -x));
            let last = n + 1 == body.joints.len() && pending.xyz == [0.0; 3];
            let name = name.clone().unwrap_or_else(|| {
                let wanted = format!("{}_{}", self.names[k].value, joint.kind.word());
                Spanned::new(self.joint_names.name(&wanted, "_"), place(part.element.node))
            });
            self.know(part, &joint, &name.value, raw.joints.len());
            let mut placement = placement.raw(place(part.element.node));
            for (end, joint, start) in joint.elements(&body.pose) {
                let name = match end {
                    "" => name.clone(),
                    end => Spanned::new(self.joint_names.name(&format!("{}{end}", name.value), "_"), name.span),
                };
                let child = if last && end.is_empty() { self.names[k].clone() } else { self.between(k, &name, raw) };
                let placement = std::mem::take(&mut placement);
                raw.joints.push(RawJoint {
                    parent: carrier,
                    placement,
                    ..joint.raw(name, child.clone(), &start, rules)
                });
                carrier = Some(child);
            }
        }
        if carrier.as_ref().is_none_or(|carrier| carrier.value != self.names[k].value) {
            let span = place(body.node);
            let name = self.joint_names.name(&format!("{}_fixed", self.names[k].value), "_");
            let kind = Some(Spanned::new(&FIXED, span));
            let joint = RawJoint::new(Spanned::new(name, span), kind, Some(self.names[k].clone()));
            raw.joints.push(RawJoint { parent: carrier, placement: pending.raw(span), ..joint });
        }
    }

    /// Reports joints that MuJoCo has in no such order.
    fn judge(&self, reader: &mut Reader, body: &Body, parent: usize) {
        let is_free = |part: &&Part| {
            part.element.node.has_tag_name("freejoint")
                || part.element.attribute("type").is_some_and(|t| t.value == "free")
        };
        let Some(free) = body.joints.iter().find(is_free) else { return };
        let at = place(free.element.node);
        if parent > 0 {
            let message = format!("{}: a free joint inside another body", body.shown());
            reader.findings.error(at, message, "put the body into `worldbody`");
        }
        if body.joints.len() > 1 {
            let message = format!("{}: a free joint among others", body.shown());
            reader.findings.error(at, message, "keep the free joint alone: it has all freedoms");
        }
    }

    /// Adds a body without mass behind a joint.
    fn between(&mut self, k: usize, joint: &Spanned<String>, raw: &mut RawModel) -> Spanned<String> {
        let wanted = format!("{}_{}", self.names[k].value, joint.value);
        let name = Spanned::new(self.taken.name(&wanted, "_"), joint.span);
        raw.bodies.push(RawBody { name: name.clone(), mass: None, com: None, inertia: None, inertia_axes: None });
        name
    }

    /// Notes a joint for what refers to it.
    fn know(&mut self, part: &Part<'d>, joint: &Joint, name: &str, index: usize) {
        let Some(given) = part.element.name() else { return };
        let Joint { kind, reference, rest, .. } = *joint;
        let parts = joint.parts();
        self.joints.insert(given.value, Known { name: name.to_string(), kind, reference, rest, index, parts });
    }

    /// Adds the frame of a site.
    fn site(&mut self, reader: &mut Reader, part: &Part, k: usize, rules: Rules, whose: &str, raw: &mut RawModel) {
        let element = &part.element;
        reader.leaf(element.node, SITE);
        let own = match between(reader, element, whose) {
            Some((pose, _)) => pose,
            None => pose(reader, element, rules.compiler, whose),
        };
        let Some(given) = element.name() else { return };
        let Some(name) = self.sites.get(given.value) else { return };
        raw.frames.push(RawFrame {
            name: Spanned::new(name.clone(), given.span),
            body: Some(self.names[k].clone()),
            placement: part.frame.then(&own).raw(place(element.node)),
        });
    }
}

/// Tells of a name that could not stay.
fn renamed(reader: &mut Reader, what: &str, old: &Spanned<&str>, new: &str) {
    if old.value != new {
        let message = format!("{what} {} is called {} here, since its own name is taken", quote(old.value), quote(new));
        reader.findings.notice(old.span, message);
    }
}
