//! Masses and inertias of bodies: as stated, or from their geoms.

use super::element::{number, numbers, vec3, Element};
use super::geom::{Geom, NOTHING};
use super::mesh::Meshes;
use super::pose::{orientation, raw_vec, roll_pitch_yaw, rotation, Quat, NONE};
use super::settings::{Compiler, FromGeoms};
use super::tree::Body;
use crate::import::raw::{RawBody, RawNumber};
use crate::import::source::{Span, Spanned};
use crate::import::xml::{place, Reader};
use crate::inertia::{about_com, moved, own, sum, Inertia};
use crate::model::{self, Placement, Rotation, Value};
use crate::symmetric::eigenvectors;
use roxmltree::Node;

/// Mass and inertia of a body.
#[derive(Clone, Debug)]
pub(super) struct Mass {
    /// kg.
    mass: f64,
    /// Centre of mass in the body frame, m.
    com: [f64; 3],
    /// About the centre of mass, `[xx, yy, zz, xy, xz, yz]` in `axes`, kg m².
    inertia: [f64; 6],
    axes: Quat,
    span: Span,
}

/// Mass and inertia of a body with these geoms; the world has none. Where no motion depends on it, the mass is not `needed`:
/// it is left out if a part of it cannot be read.
pub(super) fn of_body(
    reader: &mut Reader,
    (body, needed): (&Body, bool),
    geoms: &mut [Geom],
    compiler: &Compiler,
    meshes: &Meshes,
) -> Mass {
    let whose = format!("{}: ", body.shown());
    let mut mass = body.inertial.and_then(|node| inertial(reader, node, compiler, &whose));
    let inferred = match compiler.from_geoms {
        FromGeoms::Never => false,
        FromGeoms::Always => true,
        FromGeoms::Missing => body.inertial.is_none(),
    };
    if inferred {
        let (shown, mut known) = (body.shown(), true);
        for geom in geoms.iter_mut().filter(|geom| geom.counts(compiler)) {
            known &= geom.weigh(reader, meshes, (shown.as_str(), needed));
        }
        mass = if known || needed { of_geoms(geoms, compiler).or(mass) } else { None };
        if !known && !needed {
            let message =
                "the mass of a body that cannot move is left out where it is not read: no motion depends on it";
            reader.tally.notice(place(body.node), message);
        }
    }
    // Without anything that states it, MuJoCo's centre of mass stands where the body stands in its parent.
    let nowhere = body.own_pose;
    let nothing = Mass { mass: 0.0, com: nowhere.xyz, inertia: [0.0; 6], axes: nowhere.quat, span: place(body.node) };
    let mut mass = mass.unwrap_or(nothing);
    mass.bound(compiler);
    if mass.mass == 0.0 && mass.inertia == [0.0; 6] {
        (mass.com, mass.axes) = ([0.0; 3], NONE);
    }
    mass
}

/// Reads an `inertial`.
fn inertial(reader: &mut Reader, node: Node, compiler: &Compiler, whose: &str) -> Option<Mass> {
    let element = Element::plain(node);
    reader.leaf(node, &["pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "mass", "diaginertia", "fullinertia"]);
    let there = [reader.required(node, "pos", whose), reader.required(node, "mass", whose)];
    let com = vec3(reader, &element, "pos", whose);
    let mass = number(reader, &element, "mass", whose);
    let axes = orientation(reader, &element, compiler, whose);
    let moments = vec3(reader, &element, "diaginertia", whose);
    let entries = numbers(reader, &element, "fullinertia", 6..=6, whose);
    if let (Some(_), Some(second)) = (&moments, &entries) {
        let message = format!("{whose}`diaginertia` and `fullinertia` together");
        reader.findings.error(second.span, message, "keep one of them");
    }
    let [Some(_), Some(_)] = there else { return None };
    let inertia = match (moments, entries) {
        (_, Some(all)) => <[f64; 6]>::try_from(all.value).ok()?,
        (Some(Spanned { value: [a, b, c], .. }), None) => [a, b, c, 0.0, 0.0, 0.0],
        (None, None) => [0.0; 6],
    };
    Some(Mass { mass: mass?.value, com: com?.value, inertia, axes, span: place(node) })
}

/// The inertia of the geoms that count; `None` where none does.
fn of_geoms(geoms: &[Geom], compiler: &Compiler) -> Option<Mass> {
    let all: Vec<&Geom> = geoms.iter().filter(|geom| geom.counts(compiler) && geom.mass() > NOTHING).collect();
    let span = all.first()?.span;
    if let [only] = all.as_slice() {
        let com = only.pose.point(only.com());
        return Some(Mass { mass: only.mass(), com, inertia: only.inertia(), axes: only.pose.quat, span });
    }
    let each = all.iter().map(|geom| moved(own(&alone(geom), &[]), &placement(geom), &[]));
    let (mass, com, inertia) = about_com(each.fold(Inertia::default(), sum));
    Some(Mass { mass, com, inertia, axes: NONE, span })
}

/// A geom as a body in its own axes.
fn alone(geom: &Geom) -> model::Body {
    model::Body {
        name: String::new(),
        mass: Value::Const(geom.mass()),
        com: geom.com().map(Value::Const),
        inertia: geom.inertia().map(Value::Const),
        inertia_axes: Rotation::NONE,
    }
}

fn placement(geom: &Geom) -> Placement {
    let raw = rotation(geom.pose.quat, geom.span);
    let rotation = raw
        .and_then(|raw| raw.constant())
        .map_or(Rotation::NONE, |(axis, angle)| Rotation::AxisAngle { axis, angle: Value::Const(angle) });
    Placement { xyz: geom.pose.xyz.map(Value::Const), rotation }
}

impl Mass {
    /// Applies the bounds of `compiler`: to the mass and to the principal moments.
    fn bound(&mut self, compiler: &Compiler) {
        self.mass = self.mass.max(compiler.least_mass);
        let principal = |[a, b, c, d, e, f]: [f64; 6]| (d == 0.0 && e == 0.0 && f == 0.0).then_some([a, b, c]);
        let bounded = |moments: [f64; 3]| {
            let moments = moments.map(|x| x.max(compiler.least_moment));
            let [a, b, c] = moments;
            let impossible = a + b < c || a + c < b || b + c < a;
            if impossible && compiler.balance {
                [(a + b + c) / 3.0; 3]
            } else {
                moments
            }
        };
        if let Some(moments) = principal(self.inertia) {
            let [a, b, c] = bounded(moments);
            self.inertia = [a, b, c, 0.0, 0.0, 0.0];
            return;
        }
        let Some((moments, axes)) = eigenvectors(self.inertia) else { return };
        let new = bounded(moments);
        if new != moments {
            let entry = |i: usize, j: usize| (0..3).map(|k| axes[i][k] * new[k] * axes[j][k]).sum::<f64>();
            self.inertia = [entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)];
        }
    }

    /// The body with this inertia.
    pub fn raw(&self, name: Spanned<String>) -> RawBody {
        let span = self.span;
        let number = |x: f64| RawNumber::constant(x, span);
        let some = self.inertia != [0.0; 6];
        RawBody {
            name,
            mass: (self.mass != 0.0).then(|| number(self.mass)),
            com: (self.com != [0.0; 3]).then(|| raw_vec(self.com, span)),
            inertia: some.then(|| Spanned::new(self.inertia.map(number), span)),
            inertia_axes: if some { roll_pitch_yaw(self.axes, span) } else { None },
        }
    }
}

/// Scales all bodies to a mass in total, kg.
pub(super) fn scale(masses: &mut [Mass], total: f64) {
    let sum: f64 = masses.iter().map(|m| m.mass).sum();
    if sum <= 0.0 {
        return;
    }
    let factor = total / sum;
    for mass in masses {
        mass.mass *= factor;
        mass.inertia = mass.inertia.map(|x| x * factor);
    }
}
