//! Writes shapes, contacts and stops in the TOML format.

use mbd_codegen::model::{ConstraintKind, Contact, ShapeKind, Value};
use mbd_runtime::contact::RestitutionLaw;

use super::{line, quoted, Writer};

impl Writer<'_> {
    /// Writes all shapes.
    pub(super) fn shapes(&self, out: &mut String) {
        for shape in &self.model.shapes {
            out.push_str("\n[[shape]]\n");
            line(out, "name", quoted(&shape.name));
            if let Some(body) = shape.mount.body {
                line(out, "body", quoted(&self.model.bodies[body].name));
            }
            line(out, "type", quoted(shape.kind.word()));
            self.placement(out, &shape.mount.placement);
            match &shape.kind {
                ShapeKind::Point => {}
                ShapeKind::Sphere { radius } => line(out, "radius", format!("{radius:?}")),
                ShapeKind::Capsule { radius, length } => {
                    line(out, "radius", format!("{radius:?}"));
                    line(out, "length", format!("{length:?}"));
                }
                ShapeKind::Cylinder { radius, length, sides, rounding } => {
                    line(out, "radius", format!("{radius:?}"));
                    line(out, "length", format!("{length:?}"));
                    if let Some(sides) = sides {
                        line(out, "sides", format!("{sides}"));
                        line(out, "rounding", format!("{rounding:?}"));
                    }
                }
                ShapeKind::Box { size, rounding } => {
                    line(out, "size", format!("{size:?}"));
                    line(out, "rounding", format!("{rounding:?}"));
                }
                ShapeKind::Ellipsoid { semi_axes } => line(out, "semi_axes", format!("{semi_axes:?}")),
                ShapeKind::Plane { normal } => line(out, "normal", format!("{normal:?}")),
                ShapeKind::HeightField { field, heights } => {
                    line(out, "spacing", format!("{:?}", field.spacing));
                    line(out, "heights", format!("{heights:?}"));
                }
                ShapeKind::Hull { points, rounding } => {
                    line(out, "rounding", format!("{rounding:?}"));
                    line(out, "points", format!("{points:?}"));
                    line(out, "most", format!("{}", points.len().max(4)));
                }
            }
        }
    }

    /// Writes every pair of shapes once, also where it is several contacts.
    pub(super) fn contacts(&self, out: &mut String) {
        for contact in &self.model.contacts {
            let Some([first, second]) = contact.shapes else { continue };
            let name = match contact.name.rsplit_once('/') {
                Some((name, "1")) => name,
                Some((_, number)) if number.parse::<usize>().is_ok() => continue,
                _ => &contact.name,
            };
            out.push_str("\n[[contact]]\n");
            line(out, "name", quoted(name));
            let [first, second] = [first, second].map(|k| quoted(&self.model.shapes[k].name));
            line(out, "between", format!("[{first}, {second}]"));
            line(out, "friction", format!("{:?}", contact.friction));
            line(out, "restitution", format!("{:?}", contact.restitution));
            line(out, "law", quoted(law(contact)));
        }
    }

    /// Writes the stops of a joint, if it has any.
    pub(super) fn limits(&self, out: &mut String, joint: usize) {
        let mut limits = Vec::new();
        let mut restitution = 0.0;
        for contact in &self.model.contacts {
            let ConstraintKind::Coupling { terms, offset: Value::Const(offset) } = &contact.kind else { continue };
            match terms[..] {
                [(j, Value::Const(ratio))] if j == joint => {
                    limits.push(format!("{} = {:?}", if ratio > 0.0 { "lower" } else { "upper" }, ratio * offset));
                    restitution = contact.restitution;
                }
                _ => {}
            }
        }
        if !limits.is_empty() {
            line(out, "limits", format!("{{ {} }}", limits.join(", ")));
            line(out, "limit_restitution", format!("{restitution:?}"));
        }
    }
}

fn law(contact: &Contact) -> &'static str {
    match contact.law {
        RestitutionLaw::Poisson => "poisson",
        RestitutionLaw::Stronge => "stronge",
        RestitutionLaw::Newton => "newton",
    }
}
