//! `mesh`: volumes, inertias and hulls of meshes, from STL, OBJ and MSH files or from the vertices in the file itself.

use std::cell::RefCell;
use std::collections::HashMap;

use super::assets::{add_named, extension, Assets};
use super::classes::{Classes, MAIN};
use super::element::{choice, numbers, parsed, vec3, Element};
use super::pose::{normalised, rotate, Pose, Quat, NONE};
use crate::import::hull::{self, Told};
use crate::import::mesh::{self, corners, msh, stl, Triangle, MOST};
use crate::import::source::{Span, Spanned};
use crate::import::words::quote;
use crate::import::xml::{place, Reader};
use crate::inertia::{cross, dot};
use roxmltree::Node;

const ATTRIBUTES: &[&str] = &[
    "name",
    "class",
    "content_type",
    "file",
    "vertex",
    "normal",
    "texcoord",
    "face",
    "refpos",
    "refquat",
    "scale",
    "smoothnormal",
    "maxhullvert",
    "inertia",
    "builtin",
    "params",
    "material",
];

/// The homogeneous body that a mesh bounds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    /// Volume, m³, or area of a shell, m².
    pub volume: f64,
    /// Centre of mass in the axes of the mesh, m.
    pub com: [f64; 3],
    /// Inertia about it for a mass of 1, `[xx, yy, zz, xy, xz, yz]`, m².
    pub inertia: [f64; 6],
}

/// Why the body that a mesh bounds is not known.
enum Unread {
    /// A finding that is added where a mass depends on the mesh.
    Problem(Span, String),
    /// It was reported.
    Reported,
}

/// How the inertia of a mesh is computed.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Every pyramid between a face and the middle counts as full.
    Legacy,
    /// Pyramids count by the side of their face.
    Exact,
    /// The faces alone.
    Shell,
}

/// The meshes of a file, each of which is read where a mass depends on it.
pub(super) struct Meshes<'m, 'd> {
    all: HashMap<String, Element<'d>>,
    /// What was read, or why nothing was.
    read: RefCell<HashMap<String, Result<Solid, Unread>>>,
    /// Corners of hulls; `None` where something was reported.
    hulls: RefCell<HashMap<String, Option<Vec<[f64; 3]>>>>,
    told: RefCell<Told>,
    assets: &'m Assets<'m>,
}

impl<'m, 'd> Meshes<'m, 'd> {
    /// The meshes of the `asset` elements.
    pub fn new(reader: &mut Reader, sections: &[Node<'d, 'd>], classes: &Classes<'d>, assets: &'m Assets<'m>) -> Self {
        let mut all = HashMap::new();
        for node in sections.iter().flat_map(|asset| asset.children()).filter(|node| node.has_tag_name("mesh")) {
            let element = classes.resolve(reader, node, &["mesh"], MAIN);
            reader.attributes(node, ATTRIBUTES);
            add_named(reader, &mut all, element, "mesh");
        }
        Meshes { all, read: RefCell::default(), hulls: RefCell::default(), told: RefCell::default(), assets }
    }

    /// The body that a mesh bounds; `None` where it is not known. That is reported, once for each mesh, where the mass of a
    /// body depends on it, which is called `body` in findings.
    pub fn solid(&self, reader: &mut Reader, name: &Spanned<&str>, body: Option<&str>) -> Option<Solid> {
        let known = self.read.borrow_mut().remove(name.value);
        let known = known.unwrap_or_else(|| match self.asset(reader, name) {
            Some(element) => self.of_asset(reader, element, name.value),
            None => Err(Unread::Reported),
        });
        let known = match (known, body) {
            (Err(Unread::Problem(at, problem)), Some(body)) => {
                let message = format!("{problem}; the mass of {body} depends on it");
                let help = "give the bodies an `inertial` (MuJoCo writes all of them with `saveinertial=\"true\"`)";
                reader.findings.error(at, message, help);
                Err(Unread::Reported)
            }
            (known, _) => known,
        };
        let solid = known.as_ref().ok().copied();
        self.read.borrow_mut().insert(name.value.to_string(), known);
        solid
    }

    /// The element of a mesh; `None` where there is none, which is reported.
    fn asset(&self, reader: &mut Reader, name: &Spanned<&str>) -> Option<&Element<'d>> {
        let found = self.all.get(name.value);
        if found.is_none() {
            let message = format!("{} is not a mesh", quote(name.value));
            reader.findings.error(name.span, message, "add it to `asset`");
            // It is reported once.
            self.read.borrow_mut().insert(name.value.to_string(), Err(Unread::Reported));
        }
        found
    }

    /// The corners of the hull of a mesh, in the axes of the mesh, m; `None` where something was reported, once for each
    /// mesh.
    pub fn hull(&self, reader: &mut Reader, name: &Spanned<&str>) -> Option<Vec<[f64; 3]>> {
        if let Some(known) = self.hulls.borrow().get(name.value) {
            if known.is_some() {
                self.told.borrow_mut().add(name.span, None);
            }
            return known.clone();
        }
        let corners = self.asset(reader, name).and_then(|element| match self.points(reader, element, name.value) {
            Ok(corners) => {
                self.told.borrow_mut().add(name.span, Some(&corners));
                Some(corners.corners)
            }
            Err(problem) => {
                let at = element.attribute("file").map_or(place(element.node), |file| file.span);
                let message = format!("mesh {}: {problem}; its geoms touch nothing", quote(name.value));
                reader.findings.warning(at, message, "give the body geoms of a primitive type for contacts");
                None
            }
        });
        self.hulls.borrow_mut().insert(name.value.to_string(), corners.clone());
        corners
    }

    #[cfg(feature = "hulls")]
    fn points(&self, reader: &mut Reader, element: &Element, name: &str) -> Result<hull::Corners, String> {
        let whose = format!("mesh {}: ", quote(name));
        let frame = Frame::read(reader, element, &whose);
        // A mesh of vertices alone is a hull to MuJoCo too.
        let points = match (element.attribute("file"), element.attribute("vertex")) {
            (None, Some(text)) => vertices(reader, &text, &whose)?,
            _ => self.triangles(reader, element, &whose)?.into_flattened(),
        };
        let points = points.into_iter().map(|v| frame.point(v)).collect();
        hull::corners(&hull::near(points)?, hull::MOST.2)
    }

    #[cfg(not(feature = "hulls"))]
    fn points(&self, _: &mut Reader, _: &Element, _: &str) -> Result<hull::Corners, String> {
        Err(hull::WITHOUT.into())
    }

    /// Says how many hulls there are.
    pub fn tell(&self, reader: &mut Reader) {
        self.told.borrow().tell(reader.findings);
    }

    fn of_asset(&self, reader: &mut Reader, element: &Element, name: &str) -> Result<Solid, Unread> {
        let whose = format!("mesh {}: ", quote(name));
        let kind = choice(reader, element, "inertia", &["legacy", "exact", "shell", "convex"], &whose);
        let kind = match kind.as_ref().map_or("legacy", |word| word.value) {
            "exact" => Ok(Kind::Exact),
            "shell" => Ok(Kind::Shell),
            "convex" => Err("the inertia of the convex hull of a mesh is not read"),
            _ => Ok(Kind::Legacy),
        };
        let frame = Frame::read(reader, element, &whose);
        let at = element.attribute("file").map_or(place(element.node), |file| file.span);
        let read = kind.map_err(String::from).and_then(|kind| {
            let mirrored = frame.scale.iter().product::<f64>() <= 0.0;
            if mirrored && kind == Kind::Exact {
                return Err("the exact inertia of a mirrored mesh is not read".into());
            }
            let triangles = self.triangles(reader, element, &whose)?;
            solid(&triangles.iter().map(|t| t.map(|v| frame.point(v))).collect::<Vec<_>>(), kind)
        });
        read.map_err(|problem| Unread::Problem(at, format!("{whose}{problem}")))
    }

    /// The faces of a mesh in its own axes.
    fn triangles(&self, reader: &mut Reader, element: &Element, whose: &str) -> Result<Vec<Triangle>, String> {
        if element.attribute("builtin").is_some() {
            return Err("a mesh that MuJoCo makes is not read".into());
        }
        let Some(file) = element.attribute("file") else { return inline(reader, element, whose) };
        let bytes = self.assets.bytes(file.value)?;
        match extension(file.value).as_deref() {
            Some("stl") => stl(&bytes),
            Some("msh") => msh(&bytes),
            Some("obj") => obj(&bytes),
            _ => Err("meshes are read from STL, OBJ and MSH files".into()),
        }
    }
}

/// What is done to the vertices.
struct Frame {
    origin: [f64; 3],
    quat: Quat,
    scale: [f64; 3],
}

impl Frame {
    fn read(reader: &mut Reader, element: &Element, whose: &str) -> Frame {
        let quat = numbers(reader, element, "refquat", 4..=4, whose);
        Frame {
            origin: vec3(reader, element, "refpos", whose).map_or([0.0; 3], |x| x.value),
            quat: quat.and_then(|q| normalised(<Quat>::try_from(q.value).ok()?)).unwrap_or(NONE),
            scale: vec3(reader, element, "scale", whose).map_or([1.0; 3], |x| x.value),
        }
    }

    fn point(&self, v: [f64; 3]) -> [f64; 3] {
        let inverse = Pose { xyz: [0.0; 3], quat: self.quat }.inverse();
        let turned = rotate(inverse.quat, [0, 1, 2].map(|k| v[k] - self.origin[k]));
        [0, 1, 2].map(|k| turned[k] * self.scale[k])
    }
}

/// Vertices and faces that stand in the file.
fn inline(reader: &mut Reader, element: &Element, whose: &str) -> Result<Vec<Triangle>, String> {
    let (Some(vertex), Some(face)) = (element.attribute("vertex"), element.attribute("face")) else {
        return Err("a mesh without `file`, or without `face`, is not read".into());
    };
    let (vertices, faces) = (vertices(reader, &vertex, whose)?, list(reader, &face, "face", whose)?);
    if faces.iter().any(|x| x.fract() != 0.0) {
        return Err("its `face` has a number that is no whole one".into());
    }
    let faces = faces.chunks_exact(3).map(|f| [0, 1, 2].map(|k| if f[k] >= 0.0 { f[k] as usize } else { usize::MAX }));
    corners(&vertices, faces)
}

/// The numbers of an attribute, in threes.
fn list(reader: &mut Reader, text: &Spanned<&str>, key: &str, whose: &str) -> Result<Vec<f64>, String> {
    let all = parsed(reader, text, key, 3..=9 * MOST, whose);
    let all = all.map(|all| all.value).ok_or_else(|| format!("its `{key}` is not read"))?;
    match all.len() % 3 {
        0 => Ok(all),
        _ => Err(format!("its `{key}` has {} numbers, which are not threes", all.len())),
    }
}

/// Vertices that stand in the file. MuJoCo keeps them in single precision.
fn vertices(reader: &mut Reader, text: &Spanned<&str>, whose: &str) -> Result<Vec<[f64; 3]>, String> {
    let all = list(reader, text, "vertex", whose)?;
    Ok(all.chunks_exact(3).map(|v| [0, 1, 2].map(|k| f64::from(v[k] as f32))).collect())
}

/// The triangles of an OBJ file. MuJoCo keeps vertices in single precision.
fn obj(bytes: &[u8]) -> Result<Vec<Triangle>, String> {
    let (obj, problems) = mesh::obj(bytes);
    if let Some(problem) = problems.first() {
        return Err(match problem.line {
            0 => problem.message.clone(),
            line => format!("line {line} of the OBJ file is not read"),
        });
    }
    let mut faces = Vec::new();
    for (line, face) in obj.faces {
        let face = <[usize; 3]>::try_from(face);
        faces.push(face.map_err(|_| format!("line {line} of the OBJ file is no triangle"))?);
    }
    let vertices: Vec<[f64; 3]> = obj.vertices.iter().map(|v| v.map(|x| f64::from(x as f32))).collect();
    corners(&vertices, faces.into_iter())
}

/// Volume, centre of mass and inertia as MuJoCo computes them.
fn solid(triangles: &[Triangle], kind: Kind) -> Result<Solid, String> {
    let normal = |[a, b, c]: &Triangle| {
        let edge = |p: &[f64; 3]| [0, 1, 2].map(|k| p[k] - a[k]);
        cross(edge(b), edge(c)).map(|x| x / 2.0)
    };
    let middle = |[a, b, c]: &Triangle| [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
    let area = |t: &Triangle| dot(normal(t), normal(t)).sqrt();
    // The volume of the pyramid over a face, or the area of the face.
    let measure = |t: &Triangle, from: [f64; 3]| {
        let centre = middle(t);
        let volume = dot([0, 1, 2].map(|k| centre[k] - from[k]), normal(t)) / 3.0;
        match kind {
            Kind::Legacy => volume.abs(),
            Kind::Exact => volume,
            Kind::Shell => area(t),
        }
    };
    let total = |weight: &dyn Fn(&Triangle) -> f64, point: &dyn Fn(&Triangle) -> [f64; 3]| {
        let mut sum = (0.0, [0.0; 3]);
        for t in triangles {
            let (w, p) = (weight(t), point(t));
            sum.0 += w;
            (0..3).for_each(|k| sum.1[k] += w * p[k]);
        }
        (sum.0, sum.1.map(|x| x / sum.0))
    };
    let (_, centre) = total(&area, &middle);
    let pyramid = |t: &Triangle| {
        let face = middle(t);
        [0, 1, 2].map(|k| face[k] * 3.0 / 4.0 + centre[k] / 4.0)
    };
    let (volume, com) = total(&|t| measure(t, centre), &pyramid);
    if !(volume > 1e-15 && volume.is_finite() && com.iter().all(|x| x.is_finite())) {
        return Err("the mesh bounds no volume".into());
    }
    let centred = |t: &Triangle| t.map(|v| [0, 1, 2].map(|k| v[k] - com[k]));
    let (mut volume, mut products) = (0.0, [0.0; 6]);
    for t in triangles {
        let [d, e, f] = centred(t);
        let w = measure(&[d, e, f], [0.0; 3]);
        volume += w;
        let share = w / if kind == Kind::Shell { 12.0 } else { 20.0 };
        for (slot, (i, j)) in products.iter_mut().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]) {
            let own = 2.0 * (d[i] * d[j] + e[i] * e[j] + f[i] * f[j]);
            let mixed = [(d, e), (d, f), (e, f)].map(|(p, q)| p[i] * q[j] + p[j] * q[i]);
            *slot += share * (own + mixed[0] + mixed[1] + mixed[2]);
        }
    }
    let [x, y, z, xy, xz, yz] = products.map(|p| p / volume);
    Ok(Solid { volume, com, inertia: [y + z, x + z, x + y, -xy, -xz, -yz] })
}
