//! A model as read, of whatever format, as text of the TOML format: the inverse of the reader beside it.

use std::collections::HashSet;
use std::fmt::Display;

use super::contacts::LAWS;
use super::entries::INERTIA;
use crate::import::hull;
use crate::import::raw::{
    RawBody, RawConstraint, RawContact, RawCoupling, RawFrame, RawFreedoms, RawGravity, RawJoint, RawLimits, RawLoop,
    RawMimic, RawModel, RawMotion, RawNumber, RawPlacement, RawRotation, RawShape, RawSurface, RawValue, RawVariant,
    RawWrench,
};
use crate::import::source::Spanned;
use crate::model::WrenchAxes;

/// The text of a model that was read without errors; `name` is that of the checked model. Comments of the source are
/// lost.
pub fn write(raw: &RawModel, name: &str) -> String {
    let mut text = Text(String::new());
    text.entry("name", quoted(name));
    if raw.lenient {
        text.entry("checks", quoted("lenient"));
    }
    match &raw.gravity {
        None => {}
        Some(RawGravity::Input) => text.entry("gravity", quoted("input")),
        Some(RawGravity::Constant(g)) => text.entry("gravity", list(&g.value)),
    }
    if !raw.params.is_empty() {
        text.head("[params]");
        for param in &raw.params {
            text.entry(&quoted(&param.name.value), number(&param.default));
        }
    }
    let pairs = raw.all_pairs.map(|_| quoted("all"));
    if pairs.is_some() || raw.surface != RawSurface::default() {
        text.head("[contacts]");
        text.maybe("pairs", pairs);
        text.surface(&raw.surface);
    }
    text.parts("", raw);
    for variant in &raw.variants {
        text.variant(variant);
    }
    text.0
}

/// A number with as many digits as give it back.
fn number(number: &RawNumber) -> String {
    match &number.value {
        RawValue::Const(x) => constant(*x),
        RawValue::Param(name) => format!("{{ param = {} }}", quoted(name)),
        RawValue::Invalid => "nan".into(),
    }
}

/// The shortest text that is read as the same number.
fn constant(x: f64) -> String {
    format!("{x:?}")
}

/// A basic string.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

fn bracketed(items: impl Iterator<Item = String>) -> String {
    format!("[{}]", items.collect::<Vec<_>>().join(", "))
}

fn list(numbers: &[RawNumber]) -> String {
    bracketed(numbers.iter().map(number))
}

fn names(names: &[Spanned<String>]) -> String {
    bracketed(names.iter().map(|name| quoted(&name.value)))
}

fn direction(axis: &Spanned<[f64; 3]>) -> String {
    bracketed(axis.value.iter().map(|x| constant(*x)))
}

fn freedoms(freedoms: &RawFreedoms) -> String {
    match freedoms {
        RawFreedoms::All(all) => number(all),
        RawFreedoms::Each(each) => list(&each.value),
    }
}

fn limits(limits: &RawLimits) -> String {
    match (&limits.lower, &limits.upper) {
        (Some(lower), Some(upper)) => format!("[{}, {}]", number(lower), number(upper)),
        (Some(lower), None) => format!("{{ lower = {} }}", number(lower)),
        (None, Some(upper)) => format!("{{ upper = {} }}", number(upper)),
        (None, None) => "{}".into(),
    }
}

fn mimic(mimic: &RawMimic) -> String {
    let mut entries = vec![format!("joint = {}", quoted(&mimic.leader.value))];
    entries.extend(mimic.ratio.as_ref().map(|x| format!("ratio = {}", number(x))));
    entries.extend(mimic.offset.as_ref().map(|x| format!("offset = {}", number(x))));
    format!("{{ {} }}", entries.join(", "))
}

fn inertia(entries: &[RawNumber; 6]) -> String {
    if entries[3..].iter().all(|x| x.value == RawValue::Const(0.0)) {
        return list(&entries[..3]);
    }
    let each = INERTIA.iter().zip(entries).map(|(key, x)| format!("{key} = {}", number(x)));
    format!("{{ {} }}", each.collect::<Vec<_>>().join(", "))
}

/// Text under way.
struct Text(String);

impl Text {
    fn head(&mut self, head: &str) {
        self.0 += &format!("\n{head}\n");
    }

    fn entry(&mut self, key: &str, value: impl Display) {
        self.0 += &format!("{key} = {value}\n");
    }

    fn maybe(&mut self, key: &str, value: Option<impl Display>) {
        if let Some(value) = value {
            self.entry(key, value);
        }
    }

    /// Everything in lists, each body before the joints that carry it where their order allows it.
    fn parts(&mut self, prefix: &str, raw: &RawModel) {
        let head = |what: &str| format!("[[{prefix}{what}]]");
        let mut written = HashSet::new();
        let mut joints = raw.joints.iter().peekable();
        for body in &raw.bodies {
            self.head(&head("body"));
            self.body(body);
            written.insert(body.name.value.as_str());
            let there = |joint: &RawJoint| joint.child.as_ref().is_some_and(|c| written.contains(c.value.as_str()));
            while let Some(joint) = joints.next_if(|joint| there(joint)) {
                self.head(&head("joint"));
                self.joint(joint);
            }
        }
        for joint in joints {
            self.head(&head("joint"));
            self.joint(joint);
        }
        for frame in &raw.frames {
            self.head(&head("frame"));
            self.frame(frame);
        }
        for wrench in &raw.wrenches {
            self.head(&head("wrench"));
            self.wrench(wrench);
        }
        for constraint in &raw.constraints {
            self.head(&head(constraint.kind()));
            match constraint {
                RawConstraint::Loop(l) => self.closure(l),
                RawConstraint::Coupling(c) => self.coupling(c),
            }
        }
        for shape in &raw.shapes {
            self.head(&head("shape"));
            self.shape(shape);
        }
        for contact in &raw.contacts {
            self.head(&head("contact"));
            self.contact(contact);
        }
    }

    fn body(&mut self, body: &RawBody) {
        self.entry("name", quoted(&body.name.value));
        self.maybe("mass", body.mass.as_ref().map(number));
        self.maybe("com", body.com.as_ref().map(|com| list(&com.value)));
        self.maybe("inertia", body.inertia.as_ref().map(|i| inertia(&i.value)));
        if let Some(RawRotation::Rpy(rpy)) = &body.inertia_axes {
            self.entry("inertia_rpy", list(&rpy.value));
        }
    }

    fn placement(&mut self, placement: &RawPlacement) {
        self.maybe("xyz", placement.xyz.as_ref().map(|xyz| list(&xyz.value)));
        match &placement.rotation {
            None => {}
            Some(RawRotation::Rpy(rpy)) => self.entry("rpy", list(&rpy.value)),
            Some(RawRotation::AxisAngle { axis, angle }) => {
                let axis = axis.as_ref().map(|axis| format!("axis = {}, ", direction(axis))).unwrap_or_default();
                self.entry("rotate", format!("{{ {axis}angle = {} }}", number(angle)));
            }
        }
    }

    fn joint(&mut self, joint: &RawJoint) {
        self.entry("name", quoted(&joint.name.value));
        self.maybe("type", joint.kind.as_ref().map(|kind| quoted(kind.value.word())));
        self.maybe("parent", joint.parent.as_ref().map(|parent| quoted(&parent.value)));
        self.maybe("child", joint.child.as_ref().map(|child| quoted(&child.value)));
        self.placement(&joint.placement);
        self.maybe("axis", joint.axis.as_ref().map(direction));
        self.maybe("axis2", joint.axis2.as_ref().map(direction));
        self.maybe("pitch", joint.pitch.as_ref().map(number));
        for (key, numbers) in [
            ("damping", &joint.damping),
            ("stiffness", &joint.stiffness),
            ("rest", &joint.rest),
            ("armature", &joint.armature),
        ] {
            self.maybe(key, numbers.as_ref().map(freedoms));
        }
        self.maybe("unbounded", joint.unbounded.then_some(true));
        if let RawMotion::Prescribed(_) = joint.motion {
            self.entry("motion", quoted("prescribed"));
        }
        self.maybe("mimic", joint.mimic.as_ref().map(mimic));
        self.maybe("start", joint.start.as_ref().map(freedoms));
        self.maybe("start_velocity", joint.start_velocity.as_ref().map(freedoms));
        self.maybe("held", joint.held.as_ref().map(|held| held.value));
        self.maybe("limits", joint.limits.as_ref().map(limits));
        self.maybe("limit_restitution", joint.limit_restitution.as_ref().map(number));
        self.maybe("range", joint.range.as_ref().map(limits));
        self.maybe("max_velocity", joint.max_velocity.as_ref().map(number));
        self.maybe("max_effort", joint.max_effort.as_ref().map(number));
    }

    fn frame(&mut self, frame: &RawFrame) {
        self.entry("name", quoted(&frame.name.value));
        self.maybe("body", frame.body.as_ref().map(|body| quoted(&body.value)));
        self.placement(&frame.placement);
    }

    fn wrench(&mut self, wrench: &RawWrench) {
        self.maybe("name", wrench.name.as_ref().map(|name| quoted(&name.value)));
        self.entry("body", quoted(&wrench.body.value));
        if wrench.axes == WrenchAxes::World {
            self.entry("frame", quoted("world"));
        }
    }

    fn closure(&mut self, l: &RawLoop) {
        self.entry("name", quoted(&l.name.value));
        self.maybe("type", l.kind.as_ref().map(|kind| quoted(kind.value.word())));
        self.maybe("between", l.between.as_ref().map(|ends| names(ends)));
        for (key, axis) in &l.directions {
            self.entry(key, direction(axis));
        }
        for (key, x) in &l.numbers {
            self.entry(key, number(x));
        }
        for (key, numbers) in &l.lists {
            self.entry(key, list(&numbers.value));
        }
    }

    fn coupling(&mut self, coupling: &RawCoupling) {
        self.entry("name", quoted(&coupling.name.value));
        self.maybe("joints", coupling.joints.as_ref().map(|joints| names(&joints.value)));
        self.maybe("ratios", coupling.ratios.as_ref().map(|ratios| list(&ratios.value)));
        self.maybe("offset", coupling.offset.as_ref().map(number));
        self.maybe("decay", coupling.decay.as_ref().map(number));
    }

    fn shape(&mut self, shape: &RawShape) {
        self.entry("name", quoted(&shape.name.value));
        self.maybe("body", shape.body.as_ref().map(|body| quoted(&body.value)));
        self.maybe("type", shape.kind.as_ref().map(|kind| quoted(kind.value.word())));
        self.placement(&shape.placement);
        self.maybe("radius", shape.radius.as_ref().map(number));
        self.maybe("length", shape.length.as_ref().map(number));
        self.maybe("size", shape.size.as_ref().map(|size| list(&size.value)));
        self.maybe("sides", shape.sides.as_ref().map(number));
        self.maybe("rounding", shape.rounding.as_ref().map(number));
        self.maybe("semi_axes", shape.semi_axes.as_ref().map(|axes| list(&axes.value)));
        self.maybe("normal", shape.normal.as_ref().map(direction));
        if let Some(corners) = shape.hull.as_ref().and_then(|hull| hull.corners.as_ref()) {
            self.entry("points", bracketed(corners.iter().map(|c| bracketed(c.iter().map(|x| constant(*x))))));
            self.maybe("most", (corners.len() > hull::MOST.2).then_some(corners.len()));
        }
        #[cfg(feature = "height_fields")]
        if let Some(field) = &shape.field {
            let numbers = |all: &[f64]| bracketed(all.iter().map(|x| constant(*x)));
            self.maybe("spacing", field.spacing.map(|spacing| numbers(&spacing)));
            self.maybe("heights", field.heights.as_ref().map(|rows| bracketed(rows.iter().map(|row| numbers(row)))));
        }
    }

    fn contact(&mut self, contact: &RawContact) {
        self.entry("name", quoted(&contact.name.value));
        self.maybe("between", contact.between.as_ref().map(|ends| names(ends)));
        self.surface(&contact.surface);
    }

    fn surface(&mut self, surface: &RawSurface) {
        self.maybe("friction", surface.friction.as_ref().map(number));
        self.maybe("restitution", surface.restitution.as_ref().map(number));
        let law = surface.law.as_ref().and_then(|law| LAWS.iter().find(|(_, known)| *known == law.value));
        self.maybe("law", law.map(|(word, _)| quoted(word)));
    }

    fn variant(&mut self, variant: &RawVariant) {
        self.head("[[variant]]");
        self.entry("name", quoted(&variant.name.value));
        for (key, list) in [("remove", &variant.remove), ("cut", &variant.cut), ("lock", &variant.lock)] {
            self.maybe(key, (!list.is_empty()).then(|| names(list)));
        }
        self.parts("variant.", &variant.added);
    }
}
