//! The URDF reader: `robot` files of links and joints, as robot makers publish them.
//!
//! Every element and attribute is used, named in a finding, or an error. Elements without effect on the free motion
//! (what is there to look at, limits, extensions of simulators) are counted, with one notice for each kind; unknown
//! elements are warnings. Macros, entities and other formats are errors. Shapes are read, but act only where the options
//! ask for a floor or for contacts between bodies; limits are stops where the options ask for them.

mod joint;
mod link;
mod mesh;
mod shape;

#[cfg(test)]
mod tests;

use self::mesh::Meshes;
use super::raw::{RawBody, RawGravity, RawJoint, RawModel, RawPairs};
use super::source::{Findings, Spanned};
use super::taken::Taken;
use super::tally::Tally;
use super::words::{list, quote};
use super::xml::{place, shown, syntax_error, without_late_declaration, Reader};
use super::{floor, Base, ImportOptions, ReadFile};
use crate::model::{FIXED, FLOATING, PLANAR};
use roxmltree::{Document, Node};
use std::collections::HashSet;
use std::path::Path;

/// Elements of a `robot` that have no effect on its motion.
const IGNORED: [(&str, &str); 6] = [
    ("material", link::LOOKS),
    ("gazebo", "`gazebo` is not used, even where it speaks of physics"),
    ("transmission", "`transmission` is not used: motors and gears have no inertia"),
    ("ros2_control", "`ros2_control` is not used"),
    ("sensor", "`sensor` is not used"),
    ("group", "`group` is not used"),
];

/// Reads a model without checking the mechanism; `None` where the text is no robot.
///
/// The joint `root_joint`, of the kind in `options.base`, connects the root link to the ground. Links stay bodies and
/// fixed joints stay joints. A link called `ground`, a name this project keeps for the fixed world, becomes
/// `ground_link`. Where the options ask for what shapes touch, the meshes that the text names are read by `files`, from
/// places beside `path`.
pub fn read(
    text: &str,
    options: &ImportOptions,
    findings: &mut Findings,
    (path, files): (&Path, ReadFile),
) -> Option<RawModel> {
    let text = &*without_late_declaration(text, findings);
    let document = match Document::parse(text) {
        Ok(document) => document,
        Err(error) => {
            let (span, message, help) = syntax_error(&error, text, "robot");
            findings.error(span, message, help);
            return None;
        }
    };
    let mut reader = Reader { findings, tally: Tally::default() };
    let touching = options.floor.is_some() || options.between_bodies().is_some();
    let meshes = touching.then(|| Meshes::new(path, files));
    let raw = read_robot(&mut reader, document.root_element(), options, meshes);
    let Reader { findings, tally } = reader;
    tally.report(findings);
    raw
}

fn read_robot(
    reader: &mut Reader,
    node: Node,
    options: &ImportOptions,
    mut meshes: Option<Meshes>,
) -> Option<RawModel> {
    if node.tag_name().name() != "robot" {
        let help = match node.tag_name().name() {
            "mujoco" => "a MuJoCo model is read from a file that ends in `.xml` or `.mjcf`",
            "sdf" | "MujocoInput" => "convert it to URDF: of XML formats, URDF and MJCF are read",
            _ => "a URDF file is one `robot` element",
        };
        reader.findings.error(place(node), format!("{} is not a robot", quote(shown(node))), help);
        return None;
    }
    let mut raw = RawModel::empty();
    raw.lenient = true;
    reader.attributes(node, &["name", "version"]);
    raw.name = match reader.attribute(node, "name") {
        Some(name) if !name.value.trim().is_empty() => Some(Spanned::new(name.value.to_string(), name.span)),
        _ => {
            reader.tally.notice(place(node), "`robot` has no name; the model is called after the file");
            None
        }
    };
    let mut taken = Taken::default();
    if let Some(floor) = options.floor {
        floor::add(floor, &mut taken, &mut raw);
    }
    raw.pairs = options.between_bodies().map(RawPairs::new);
    for child in reader.children(node, &["link", "joint"], &IGNORED) {
        if child.tag_name().name() == "link" {
            let body = link::read(reader, child);
            if let Some(body) = &body {
                shape::all(reader, child, &body.name, &mut meshes, &mut taken, &mut raw.shapes);
            }
            push_or_note(&mut raw.bodies, body, &mut raw.incomplete);
        } else {
            push_or_note(&mut raw.joints, joint::read(reader, child, options.limits), &mut raw.incomplete);
        }
    }
    if let Some(meshes) = meshes {
        meshes.tell(reader);
    }
    if raw.bodies.is_empty() && !raw.incomplete {
        reader.findings.error(place(node), "a robot without links", "give at least one `link`");
        return None;
    }
    if options.floor.is_some() && raw.shapes.len() == 1 {
        let help = "give its links `collision`s with a box, sphere, cylinder or capsule; or leave the floor out";
        reader.findings.warning(place(node), "nothing touches the floor: no shape of this robot was read", help);
    }
    rename_ground(reader, &mut raw);
    add_base(reader, &mut raw, options.base);
    raw.gravity = options.gravity.map(RawGravity::of_options);
    Some(raw)
}

fn push_or_note<T>(list: &mut Vec<T>, item: Option<T>, incomplete: &mut bool) {
    match item {
        Some(item) => list.push(item),
        None => *incomplete = true,
    }
}

/// Renames a link called `ground`, also in the joints that refer to it.
fn rename_ground(reader: &mut Reader, raw: &mut RawModel) {
    let taken: HashSet<&str> = raw.bodies.iter().map(|b| b.name.value.as_str()).collect();
    if !taken.contains("ground") {
        return;
    }
    let new = free_name("ground_link", &taken);
    let ends = raw.joints.iter_mut().flat_map(|j| j.parent.iter_mut().chain(&mut j.child));
    let carriers = raw.shapes.iter_mut().flat_map(|s| &mut s.body);
    for end in ends.chain(carriers).filter(|end| end.value == "ground") {
        end.value.clone_from(&new);
    }
    for body in raw.bodies.iter_mut().filter(|b| b.name.value == "ground") {
        let message = format!("link `ground` is called `{new}` here, since `ground` means the fixed world");
        reader.findings.notice(body.name.span, message);
        body.name.value.clone_from(&new);
    }
}

/// `wanted`, with as many `_` appended as make it unique.
fn free_name(wanted: &str, taken: &HashSet<&str>) -> String {
    let mut name = wanted.to_string();
    while taken.contains(name.as_str()) {
        name.push('_');
    }
    name
}

/// Connects the root link to the ground by the joint that Pinocchio calls `root_joint`.
fn add_base(reader: &mut Reader, raw: &mut RawModel, base: Base) {
    let names: HashSet<&str> = raw.bodies.iter().map(|b| b.name.value.as_str()).collect();
    let children: HashSet<&str> = raw.joints.iter().filter_map(|j| Some(j.child.as_ref()?.value.as_str())).collect();
    // A joint with an unknown child has been or will be reported; the link it meant is then no root.
    let whole = !raw.incomplete && children.iter().all(|child| names.contains(child));
    let mut seen = HashSet::new();
    let roots: Vec<&RawBody> = (raw.bodies.iter())
        .filter(|b| !children.contains(b.name.value.as_str()) && seen.insert(b.name.value.as_str()))
        .collect();
    if let ([_, second, ..], true) = (roots.as_slice(), whole) {
        let message = format!(
            "{} root links ({}); a robot has one",
            roots.len(),
            list(roots.iter().map(|r| r.name.value.as_str()))
        );
        let help = "every link but one has to be the `child` of a joint: add the missing joints, or remove links that are not used";
        reader.findings.error(second.name.span, message, help);
    }
    let taken: HashSet<&str> = raw.joints.iter().map(|j| j.name.value.as_str()).collect();
    let name = free_name("root_joint", &taken);
    let kind = match base {
        Base::Fixed => &FIXED,
        Base::Floating => &FLOATING,
        Base::Planar => &PLANAR,
    };
    let mut joints = Vec::with_capacity(raw.joints.len() + roots.len());
    for (k, root) in roots.iter().enumerate() {
        let span = root.name.span;
        // Only the first one is the base. The others are an error already; they are connected to the ground so that the
        // other checks can run.
        let (name, kind) =
            if k == 0 { (name.clone(), kind) } else { (free_name(&format!("{name}_{k}"), &taken), &FIXED) };
        joints.push(RawJoint::new(Spanned::new(name, span), Some(Spanned::new(kind, span)), Some(root.name.clone())));
    }
    joints.append(&mut raw.joints);
    raw.joints = joints;
}
