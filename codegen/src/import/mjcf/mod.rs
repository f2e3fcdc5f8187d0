//! The MJCF reader: the models of MuJoCo.
//!
//! What a file says means here what it means to MuJoCo: angles are in degrees unless `compiler` says otherwise,
//! quaternions have their real part first, classes of defaults are applied, bodies get the inertia of their geoms. What
//! acts on the motion and cannot be expressed is an error; what acts only through MuJoCo's own solvers and controllers
//! is a warning or a notice, one for each kind; what is there to look at is read over.
//!
//! A body with several joints becomes as many bodies without mass between them. The frame of a body is that of the file:
//! where a joint is anchored elsewhere, a fixed joint leads from the anchor to it.

mod actuator;
mod assets;
mod build;
mod classes;
mod contact;
mod element;
mod equality;
mod geom;
#[cfg(feature = "height_fields")]
mod hfield;
mod include;
mod inertia;
mod joint;
mod mesh;
mod pose;
mod settings;
mod tendon;
mod tree;

use std::collections::HashMap;
use std::path::Path;

use super::raw::{RawGravity, RawModel};
use super::source::{Findings, Span, Spanned};
use super::taken::Taken;
use super::tally::Tally;
use super::words::quote;
use super::xml::{place, shown, syntax_error, without_late_declaration, Reader};
use super::{floor, Base, ImportOptions, ReadFile};
use assets::Assets;
use classes::Classes;
use geom::Solids;
use joint::Rules;
use mesh::Meshes;
use roxmltree::{Document, Node};
use settings::{Compiler, Options};

/// Elements of a `mujoco` that are not read, and what is said of them.
const IGNORED: [(&str, &str); 6] = [
    ("size", ""),
    ("visual", ""),
    ("statistic", ""),
    ("custom", "`custom` is not used"),
    ("sensor", "`sensor` is not used"),
    ("keyframe", "`keyframe` is not used: a motion starts where the file places the bodies"),
];

const USED: [&str; 12] = [
    "compiler",
    "option",
    "default",
    "worldbody",
    "equality",
    "tendon",
    "actuator",
    "deformable",
    "extension",
    "include",
    "asset",
    "contact",
];

/// Reads a model without checking the mechanism; `None` where the text is no model of MuJoCo, or says something that
/// leaves the mechanism without meaning.
///
/// The files that it includes are read by `files`, to which their paths are given as they are relative to the file.
pub fn read(text: &str, options: &ImportOptions, findings: &mut Findings, files: ReadFile) -> Option<RawModel> {
    let text = without_late_declaration(text, findings);
    let text = include::expand(&text, findings, files)?;
    let document = match Document::parse(&text) {
        Ok(document) => document,
        Err(error) => {
            let (span, message, help) = syntax_error(&error, &text, "mujoco");
            findings.error(span, message, help);
            return None;
        }
    };
    if options.base != Base::default() {
        let help = "leave the option out; in the file, the joints of a body say how it is attached";
        findings.error(Span::FILE, "a model of MuJoCo states its own base", help);
    }
    let main = findings.origin(place(document.root_element())).file;
    let mut reader = Reader { findings, tally: Tally::default() };
    let raw = read_mujoco(&mut reader, document.root_element(), options, (Path::new(&*main), files));
    let Reader { findings, tally } = reader;
    tally.report(findings);
    raw.filter(|_| !findings.has_errors())
}

fn read_mujoco<'d>(
    reader: &mut Reader,
    root: Node<'d, 'd>,
    options: &ImportOptions,
    files: (&Path, ReadFile),
) -> Option<RawModel> {
    if root.tag_name().name() != "mujoco" {
        let message = format!("{} is not a model of MuJoCo", quote(shown(root)));
        reader.findings.error(place(root), message, "an MJCF file is one `mujoco` element");
        return None;
    }
    let mut raw = RawModel::empty();
    raw.lenient = true;
    reader.attributes(root, &["model"]);
    raw.name = match reader.attribute(root, "model") {
        Some(name) if !name.value.trim().is_empty() => Some(Spanned::new(name.value.to_string(), name.span)),
        _ => None,
    };
    let sections = reader.children(root, &USED, &IGNORED);
    let called =
        |name: &str| -> Vec<Node> { sections.iter().copied().filter(|node| node.tag_name().name() == name).collect() };
    let (mut compiler, mut settings) = (Compiler::default(), Options::default());
    called("compiler").into_iter().for_each(|node| compiler.read(reader, node));
    called("option").into_iter().for_each(|node| settings.read(reader, node));
    raw.gravity = gravity(&settings, options);
    deformable(reader, &called("deformable"));
    let classes = Classes::read(reader, &called("default"));
    let bodies = tree::bodies(reader, &called("worldbody"), &classes, &compiler);
    // Bodies that are there and not read have been reported; what stands in the world itself is looked at all the same.
    let unread = bodies.len() == 1 && bodies[0].unread;
    if bodies.len() < 2 && !unread {
        let at = called("worldbody").first().map_or(place(root), |node| place(*node));
        reader.findings.error(at, "a model without bodies", "give at least one `body` in `worldbody`");
        return None;
    }
    let mut shapes = Taken::default();
    if let Some(floor) = options.floor {
        floor::add(floor, &mut shapes, &mut raw);
    }
    let rules = Rules { compiler: &compiler, options: &settings, stops: options.limits };
    let assets = Assets::new(reader, &called("compiler"), files);
    let meshes = Meshes::new(reader, &called("asset"), &classes, &assets);
    let listed = options.between_bodies().map(|_| contact::listed(&called("contact")));
    let solids = Solids {
        meshes: &meshes,
        listed: listed.as_ref(),
        #[cfg(feature = "height_fields")]
        fields: &hfield::Fields::new(
            reader,
            &called("asset"),
            &assets,
            options.floor.is_some() || options.between_bodies().is_some(),
        ),
    };
    let mut built = build::all(reader, &bodies, rules, (solids, shapes), &mut raw);
    meshes.tell(reader);
    // All that names bodies and joints would find none.
    if unread {
        return None;
    }
    touching(reader, root, options, &raw);
    raw.pairs = contact::pairs(reader, &called("contact"), &classes, &built, options);
    let mut tendons = HashMap::new();
    for section in called("tendon") {
        tendon::all(reader, section, &classes, &built, rules, &mut raw, &mut tendons);
    }
    if settings.on("equality") {
        let mut taken = Taken::default();
        let mut parts = equality::Parts { built: &mut built, tendons: &tendons };
        for section in called("equality") {
            equality::all(reader, section, &classes, &mut parts, &mut taken, &mut raw);
        }
    }
    let mut driven = actuator::Driven { built: &built, tendons: &tendons, efforts: HashMap::new() };
    for section in called("actuator") {
        actuator::all(reader, section, &classes, rules, &mut driven, &mut raw);
    }
    actuator::bound(&driven.efforts, &mut raw);
    Some(raw)
}

/// Gravity of the options, or that of the file.
fn gravity(settings: &Options, options: &ImportOptions) -> Option<RawGravity> {
    if let Some(g) = options.gravity {
        return Some(RawGravity::of_options(g));
    }
    if !settings.on("gravity") {
        return Some(RawGravity::of_options([0.0; 3]));
    }
    let g = settings.gravity.as_ref()?;
    Some(RawGravity::Constant(pose::raw_vec(g.value, g.span)))
}

/// Skins are there to look at; all else that bends is refused.
fn deformable(reader: &mut Reader, sections: &[Node]) {
    for section in sections {
        for node in reader.children(*section, &["flex"], &[("skin", "")]) {
            let message = "deformable bodies (`flex`) are not modelled";
            reader.findings.error(place(node), message, "remove it");
        }
    }
}

/// Says what shapes are for.
fn touching(reader: &mut Reader, root: Node, options: &ImportOptions, raw: &RawModel) {
    let of_bodies = |raw: &RawModel| raw.shapes.iter().any(|s| s.body.as_ref().is_some_and(|b| b.value != "ground"));
    match options.floor {
        None if options.between_bodies().is_some() => {}
        None => {
            for shape in &raw.shapes {
                reader.tally.notice(
                    shape.kind.as_ref().map_or(Span::FILE, |kind| kind.span),
                    "a `geom` touches nothing unless that is asked for (`--floor`, `--self-contact` of `mbd simulate`)",
                );
            }
        }
        Some(_) if !of_bodies(raw) => {
            let help = "give its bodies geoms of a primitive type, or meshes, with a `contype`; or leave the floor out";
            reader.findings.warning(place(root), "nothing touches the floor: no shape of a body was read", help);
        }
        Some(_) => {}
    }
}
