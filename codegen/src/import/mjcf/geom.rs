//! `geom`: shapes, their volumes and their inertias.

use std::collections::HashSet;
use std::f64::consts::PI;

use super::element::{choice, flag, number, parsed, Element};
use super::mesh::{Meshes, Solid};
use super::pose::{between, pose, raw_vec, Pose};
use super::settings::Compiler;
use super::tree::Part;
use crate::diag::Severity;
use crate::import::raw::{RawHull, RawNumber, RawShape};
use crate::import::source::{Span, Spanned};
use crate::import::taken::{Taken, CORNERS};
use crate::import::words::quote;
use crate::import::xml::{place, Reader};
use crate::model::SHAPES;

/// Masses and volumes up to this one are none, kg and m³.
pub(super) const NOTHING: f64 = 1e-14;

const ATTRIBUTES: &[&str] = &[
    "name",
    "class",
    "type",
    "contype",
    "conaffinity",
    "condim",
    "group",
    "priority",
    "size",
    "material",
    "friction",
    "mass",
    "density",
    "shellinertia",
    "solmix",
    "solref",
    "solimp",
    "margin",
    "gap",
    "surfacevel",
    "adhesion",
    "fromto",
    "pos",
    "quat",
    "axisangle",
    "xyaxes",
    "zaxis",
    "euler",
    "hfield",
    "mesh",
    "fitscale",
    "rgba",
    "fluidshape",
    "fluidcoef",
    "user",
];

const TYPES: &[&str] = &["plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"];

/// What geoms get their shapes from that are not primitives.
#[derive(Clone, Copy)]
pub(super) struct Solids<'s, 'm, 'd> {
    pub meshes: &'s Meshes<'m, 'd>,
    /// The geoms that the pairs of `contact` name, where contacts between bodies are asked for.
    pub listed: Option<&'s HashSet<&'d str>>,
    #[cfg(feature = "height_fields")]
    pub fields: &'s super::hfield::Fields<'m, 'd>,
}

/// A geom in its body.
pub(super) struct Geom<'d> {
    /// One of MuJoCo's types.
    kind: &'static str,
    /// MuJoCo's sizes: radius, half lengths, semi-axes, m.
    size: [f64; 3],
    /// Pose in the body.
    pub pose: Pose,
    /// Whether the mass is that of a thin shell.
    shell: bool,
    mass: Option<f64>,
    density: f64,
    group: f64,
    /// The mesh that it names.
    mesh: Option<Spanned<&'d str>>,
    /// The height field that it names.
    #[cfg(feature = "height_fields")]
    field: Option<Spanned<&'d str>>,
    /// The body that its mesh bounds, once it was read.
    solid: Option<Solid>,
    /// `contype` and `conaffinity`: a geom can touch another one where a bit of one is in the other of the other one.
    bits: [u32; 2],
    /// Its place.
    pub span: Span,
}

/// Reads a geom; `None` where something was reported that leaves it without meaning.
pub(super) fn read<'d>(reader: &mut Reader, part: &Part<'d>, compiler: &Compiler, whose: &str) -> Option<Geom<'d>> {
    let element = &part.element;
    reader.attributes(element.node, ATTRIBUTES);
    for plugin in reader.children(element.node, &["plugin"], &[]) {
        reader.findings.error(place(plugin), format!("{whose}`plugin` is not read"), "remove it");
    }
    let kind = match element.attribute("type") {
        None => "sphere",
        Some(_) => choice(reader, element, "type", TYPES, whose)?.value,
    };
    let number =
        |reader: &mut Reader, key, otherwise: f64| number(reader, element, key, whose).map_or(otherwise, |x| x.value);
    let mass = element.attribute("mass").map(|_| number(reader, "mass", 0.0));
    let density = number(reader, "density", 1000.0);
    for (key, x) in [("mass", mass.unwrap_or(0.0)), ("density", density)] {
        if x < 0.0 {
            let at = element.attribute(key).map_or(place(element.node), |text| text.span);
            reader.findings.error(at, format!("{whose}`{key}` is negative"), "write a number that is not negative");
        }
    }
    let bits = ["contype", "conaffinity"].map(|key| number(reader, key, 1.0) as i64 as u32);
    let group = number(reader, "group", 0.0);
    let mesh = element.attribute("mesh");
    let sized = mesh.is_none() && !["mesh", "sdf", "hfield"].contains(&kind);
    let ends = between(reader, element, whose);
    if ends.is_none() && element.attribute("fromto").is_some() {
        return None;
    }
    let own = match &ends {
        Some((pose, _)) => *pose,
        None => pose(reader, element, compiler, whose),
    };
    let size = if sized { size(reader, element, kind, ends.map(|e| e.1), whose)? } else { [0.0; 3] };
    let shell = flag(reader, element, "shellinertia", whose).unwrap_or(false);
    let pose = part.frame.then(&own);
    Some(Geom {
        kind,
        size,
        pose,
        shell,
        mass,
        density,
        group,
        mesh,
        #[cfg(feature = "height_fields")]
        field: element.attribute("hfield"),
        solid: None,
        bits,
        span: place(element.node),
    })
}

/// MuJoCo's sizes. A class states the first of them, and an element may replace some of these.
fn size(reader: &mut Reader, element: &Element, kind: &str, half: Option<f64>, whose: &str) -> Option<[f64; 3]> {
    let mut size = [0.0; 3];
    let mut span = place(element.node);
    for text in element.statements("size").rev() {
        let given = parsed(reader, &text, "size", 1..=3, whose)?;
        size[..given.value.len()].copy_from_slice(&given.value);
        span = given.span;
    }
    let count = match kind {
        "plane" => return Some(size),
        "sphere" => 1,
        "capsule" | "cylinder" => 2,
        _ => 3,
    };
    if let Some(half) = half {
        match count {
            1 => {
                let message = format!("{whose}`fromto` of a {kind}");
                reader.findings.error(span, message, "make it a capsule, cylinder, box or ellipsoid");
                return None;
            }
            2 => size[1] = half,
            _ => size = [size[0], size[0], half],
        }
    }
    if let Some(x) = size[..count].iter().find(|x| **x <= 0.0) {
        let message = format!("{whose}a {kind} with a `size` of {x}");
        let help = match kind {
            "sphere" => "write its radius, m",
            "capsule" | "cylinder" => "write its radius and half its length, m; with `fromto` its radius alone",
            _ => "write half of its three lengths, m",
        };
        reader.findings.error(span, message, help);
        return None;
    }
    Some(size)
}

impl Geom<'_> {
    /// Whether its mass counts.
    pub fn counts(&self, compiler: &Compiler) -> bool {
        let [first, last] = compiler.groups;
        (first..=last).contains(&self.group) && self.mass.unwrap_or(self.density) > 0.0 && self.kind != "plane"
    }

    /// What its shape is, where that is not read.
    fn unread(&self) -> Option<&'static str> {
        match (self.kind, &self.mesh) {
            ("hfield", _) => Some("height field"),
            ("sdf", _) => Some("signed distance field"),
            ("mesh", None) => Some("mesh without a name"),
            ("mesh", Some(_)) | (_, None) => None,
            (_, Some(_)) => Some("primitive that is fitted to a mesh"),
        }
    }

    /// Reads what its mass depends on, and says whether that is known. Where it is not, and the mass is `needed`, it is
    /// reported; `body` is what its body is called in findings.
    pub fn weigh(&mut self, reader: &mut Reader, meshes: &Meshes, (body, needed): (&str, bool)) -> bool {
        if let Some(what) = self.unread() {
            let message = format!("{body}: the mass of a {what} is not read");
            let help = "give the body an `inertial` (MuJoCo writes all of them with `saveinertial=\"true\"`), or the \
                        geom `mass=\"0\"`";
            if needed {
                reader.tally.add(Severity::Error, &format!("{what} {}", quote(body)), self.span, message, help);
            }
            return false;
        }
        let Some(mesh) = &self.mesh else { return true };
        self.solid = meshes.solid(reader, mesh, needed.then_some(body));
        self.solid.is_some()
    }

    /// Centre of mass in its own axes, m.
    pub fn com(&self) -> [f64; 3] {
        self.solid.map_or([0.0; 3], |solid| solid.com)
    }

    /// About its centre of mass, in its own axes, `[xx, yy, zz, xy, xz, yz]`, kg m².
    pub fn inertia(&self) -> [f64; 6] {
        let [a, b, c] = self.moments();
        self.solid.map_or([a, b, c, 0.0, 0.0, 0.0], |solid| solid.inertia.map(|x| x * self.mass()))
    }

    /// Mass, kg.
    pub fn mass(&self) -> f64 {
        let volume = self.volume();
        match self.mass {
            Some(mass) if volume > NOTHING => mass,
            Some(_) => 0.0,
            None => self.density * volume,
        }
    }

    /// Volume, m³, or area of a shell, m².
    fn volume(&self) -> f64 {
        if let Some(solid) = self.solid {
            return solid.volume;
        }
        let [a, b, c] = self.size;
        match (self.kind, self.shell) {
            ("sphere", false) => 4.0 * PI * a * a * a / 3.0,
            ("sphere", true) => 4.0 * PI * a * a,
            ("capsule", false) => PI * (a * a * 2.0 * b + 4.0 * a * a * a / 3.0),
            ("capsule", true) => 4.0 * PI * a * a + 4.0 * PI * a * b,
            ("cylinder", false) => PI * a * a * 2.0 * b,
            ("cylinder", true) => 2.0 * PI * a * a + 4.0 * PI * a * b,
            ("ellipsoid", false) => 4.0 * PI * a * b * c / 3.0,
            ("ellipsoid", true) => {
                // Thomsen's approximation.
                let p = 1.6075;
                let sum = libm::pow(a * b, p) + libm::pow(b * c, p) + libm::pow(c * a, p);
                4.0 * PI * libm::pow(sum / 3.0, 1.0 / p)
            }
            ("box", false) => 8.0 * a * b * c,
            ("box", true) => 8.0 * (a * b + b * c + c * a),
            _ => 0.0,
        }
    }

    /// Principal moments of a primitive about its centre, in its own axes, kg m².
    fn moments(&self) -> [f64; 3] {
        let (m, [a, b, c]) = (self.mass(), self.size);
        let (aa, bb, cc) = (a * a, b * b, c * c);
        match (self.kind, self.shell) {
            ("sphere", shell) => [if shell { 2.0 * m * aa / 3.0 } else { 2.0 * m * aa / 5.0 }; 3],
            ("capsule", shell) => capsule(m, a, b, shell),
            ("cylinder", false) => {
                let across = m * (3.0 * aa + 4.0 * bb) / 12.0;
                [across, across, m * aa / 2.0]
            }
            ("cylinder", true) => {
                let disc = m * aa / (2.0 * aa + 4.0 * a * b);
                let wall = m - 2.0 * disc;
                let across = wall * (6.0 * aa + 4.0 * bb) / 12.0 + 2.0 * disc * (aa / 4.0 + bb);
                [across, across, wall * aa + disc * aa]
            }
            ("ellipsoid", false) => [bb + cc, aa + cc, aa + bb].map(|s| m * s / 5.0),
            ("ellipsoid", true) => thin_ellipsoid(m, self.size),
            ("box", false) => [bb + cc, aa + cc, aa + bb].map(|s| m * s / 3.0),
            ("box", true) => thin_box(m, self.size),
            _ => [0.0; 3],
        }
    }

    /// The shape for contacts, that of a mesh where `hulls` are asked for; `None` where it touches nothing.
    pub fn shape(
        &self,
        reader: &mut Reader,
        (element, solids, hulls): (&Element, Solids, bool),
        body: &Spanned<String>,
        taken: &mut Taken,
    ) -> Option<RawShape> {
        let listed = |name: Spanned<&str>| solids.listed.is_some_and(|listed| listed.contains(name.value));
        if self.bits == [0; 2] && !element.name().is_some_and(listed) {
            return None;
        }
        #[cfg(feature = "height_fields")]
        if self.kind == "hfield" {
            let field = solids.fields.of_geom(reader, self.field.as_ref(), self.span)?;
            let shape = self.placed("height_field", CORNERS, element, body, taken)?;
            return Some(RawShape { field: Some(field), ..shape });
        }
        let corners = match (self.unread(), &self.mesh) {
            (Some(_), _) => {
                let message = match cfg!(feature = "height_fields") {
                    true => UNUSED[0],
                    false => UNUSED[1],
                };
                reader.tally.notice(self.span, message);
                return None;
            }
            (None, Some(_)) if !hulls => {
                let message =
                    "the mesh of a `geom` is not used for contacts: those of moving bodies are, where a floor or \
                               contacts between bodies are asked for";
                reader.tally.notice(self.span, message);
                return None;
            }
            (None, Some(mesh)) => Some(solids.meshes.hull(reader, mesh)?),
            (None, None) => None,
        };
        let span = self.span;
        let number = |x: f64| Some(RawNumber::constant(x, span));
        let [a, b, c] = self.size;
        let word = if corners.is_some() { "hull" } else { self.kind };
        let mut shape = self.placed(word, corners.as_ref().map_or(CORNERS, Vec::len), element, body, taken)?;
        shape.hull = corners.map(|corners| RawHull { keys: vec![("file", span)], corners: Some(corners) });
        match self.kind {
            "sphere" => shape.radius = number(a),
            "capsule" | "cylinder" => (shape.radius, shape.length) = (number(a), number(2.0 * b)),
            "box" => shape.size = Some(raw_vec([2.0 * a, 2.0 * b, 2.0 * c], span)),
            "ellipsoid" => shape.semi_axes = Some(raw_vec([a, b, c], span)),
            _ => {}
        }
        Some(shape)
    }

    /// A shape of a kind, without dimensions, that has as many contacts with a plane.
    fn placed(
        &self,
        word: &str,
        contacts: usize,
        element: &Element,
        body: &Spanned<String>,
        taken: &mut Taken,
    ) -> Option<RawShape> {
        let kind = SHAPES.iter().find(|spec| spec.word() == word)?;
        let name = taken.shape(element.name().map_or(body.value.as_str(), |name| name.value), contacts);
        let name = Spanned::new(name, element.name().map_or(self.span, |name| name.span));
        let shape = RawShape::new(name, Some(Spanned::new(kind, self.span)));
        let (body, bits) = (Some(body.clone()), Some(self.bits));
        Some(RawShape { body, bits, placement: self.pose.raw(self.span), ..shape })
    }
}

/// What is said about shapes that are not read, with and without height fields.
const UNUSED: [&str; 2] = [
    "shapes of signed distance fields and of primitives that are fitted to meshes are not used for contacts",
    "shapes of height fields, of signed distance fields and of primitives that are fitted to meshes are not used for contacts",
];

fn capsule(m: f64, a: f64, b: f64, shell: bool) -> [f64; 3] {
    let (aa, height) = (a * a, 2.0 * b);
    if shell {
        let balls = m * 4.0 * aa / (4.0 * aa + 2.0 * a * height);
        let wall = m - balls;
        // A half shell has its centre of mass half a radius from the middle.
        let (own, at) = (a / 2.0, b + a / 2.0);
        let ends = 2.0 * balls * aa / 3.0;
        let across = wall * (6.0 * aa + height * height) / 12.0 + ends + balls * (at * at - own * own);
        return [across, across, wall * aa + ends];
    }
    let balls = m * 4.0 * a / (4.0 * a + 3.0 * height);
    let wall = m - balls;
    let ends = 2.0 * balls * aa / 5.0;
    let across = wall * (3.0 * aa + height * height) / 12.0 + ends + balls * height * (3.0 * a + 2.0 * height) / 8.0;
    [across, across, wall * aa / 2.0 + ends]
}

/// Half the sum of the areas is distributed over the three pairs of sides.
fn thin_box(m: f64, [a, b, c]: [f64; 3]) -> [f64; 3] {
    let total = 8.0 * (a * b + b * c + c * a);
    // The mass of one side across z, x and y.
    let [mz, mx, my] = [a * b, b * c, c * a].map(|area| m * 4.0 * area / total);
    let (aa, bb, cc) = (a * a, b * b, c * c);
    [
        2.0 * (mz * cc + my * bb + (mz * bb + mx * (bb + cc) + my * cc) / 3.0),
        2.0 * (mz * cc + mx * aa + (mz * aa + mx * cc + my * (aa + cc)) / 3.0),
        2.0 * (mx * aa + my * bb + (mz * (aa + bb) + mx * bb + my * aa) / 3.0),
    ]
}

/// MuJoCo's approximation: an ellipsoid that is larger by a thousandth of a millimetre, without the ellipsoid.
fn thin_ellipsoid(m: f64, size: [f64; 3]) -> [f64; 3] {
    let outer = size.map(|x| x + 1e-6);
    let volume = |[a, b, c]: [f64; 3]| 4.0 * PI * a * b * c / 3.0;
    let density = m / (volume(outer) - volume(size));
    let moments = |size: [f64; 3]| {
        let mass = volume(size) * density;
        let [aa, bb, cc] = size.map(|x| x * x);
        [bb + cc, aa + cc, aa + bb].map(|s| mass * s / 5.0)
    };
    let (outer, inner) = (moments(outer), moments(size));
    [0, 1, 2].map(|k| outer[k] - inner[k])
}
