//! `worldbody`: the bodies, and what stands in each of them.

use super::classes::{Classes, MAIN};
use super::element::{attribute, number, Element};
use super::pose::{pose, Pose};
use super::settings::Compiler;
use crate::diag::Severity;
use crate::import::source::Spanned;
use crate::import::words::quote;
use crate::import::xml::{place, Reader};
use roxmltree::Node;

/// Something in a body, in the axes of the frame around it.
pub(super) struct Part<'d> {
    /// The element with its defaults.
    pub element: Element<'d>,
    /// The frame around it in the body.
    pub frame: Pose,
}

/// A body, or the world.
pub(super) struct Body<'d> {
    /// The element.
    pub node: Node<'d, 'd>,
    /// Its name, if it has one.
    pub name: Option<Spanned<&'d str>>,
    /// Index of the body around it; `None` for the world.
    pub parent: Option<usize>,
    /// Its frame in that of the body around it, where nothing has moved.
    pub pose: Pose,
    /// The same in the `frame` around it.
    pub own_pose: Pose,
    /// Its joints.
    pub joints: Vec<Part<'d>>,
    /// Its geoms.
    pub geoms: Vec<Part<'d>>,
    /// Its sites.
    pub sites: Vec<Part<'d>>,
    /// Its `inertial`.
    pub inertial: Option<Node<'d, 'd>>,
    /// Whether something in it was reported that may stand for bodies and is not read.
    pub unread: bool,
}

impl Body<'_> {
    /// How it is called in findings.
    pub fn shown(&self) -> String {
        match (&self.name, self.parent) {
            (Some(name), _) => format!("body {}", quote(name.value)),
            (None, Some(_)) => "a body without a name".into(),
            (None, None) => "the world".into(),
        }
    }
}

/// Elements that other programs need to look at the model, or that act on nothing.
const LOOKS: [(&str, &str); 2] = [("camera", ""), ("light", "")];

const BODY: &[&str] = &[
    "name",
    "childclass",
    "pos",
    "quat",
    "axisangle",
    "xyaxes",
    "zaxis",
    "euler",
    "mocap",
    "gravcomp",
    "sleep",
    "user",
];
const FRAME: &[&str] = &["name", "childclass", "pos", "quat", "axisangle", "xyaxes", "zaxis", "euler"];

/// What is not read, by its name.
const REFUSED: [(&str, &str); 5] = [
    ("replicate", "write out the copies, or load and save the file with MuJoCo, which does"),
    ("attach", "write out what is attached, or load and save the file with MuJoCo, which does"),
    ("composite", "its bodies are made by MuJoCo: load and save the file there"),
    ("flexcomp", "deformable bodies are not modelled: remove it"),
    ("plugin", "plugins are not run: remove it, and add its forces as wrenches of your own"),
];

/// What stands around the elements that are being read.
struct Scope<'d> {
    children: std::vec::IntoIter<Node<'d, 'd>>,
    body: usize,
    frame: Pose,
    class: usize,
}

/// All bodies, depth first; the first one is the world.
pub(super) fn bodies<'d>(
    reader: &mut Reader,
    worlds: &[Node<'d, 'd>],
    classes: &Classes<'d>,
    compiler: &Compiler,
) -> Vec<Body<'d>> {
    let Some(first) = worlds.first() else { return Vec::new() };
    let mut all = vec![body(*first, None, Pose::IDENTITY, Pose::IDENTITY)];
    let class = classes.named(reader, *first, "childclass").unwrap_or(MAIN);
    for world in worlds {
        let children = children(reader, *world).into_iter();
        let mut stack = vec![Scope { children, body: 0, frame: Pose::IDENTITY, class }];
        while let Some(scope) = stack.last_mut() {
            let Some(node) = scope.children.next() else {
                stack.pop();
                continue;
            };
            let (at, frame, class) = (scope.body, scope.frame, scope.class);
            stack.extend(child(reader, node, (at, frame, class), &mut all, classes, compiler));
        }
    }
    all
}

fn body<'d>(node: Node<'d, 'd>, parent: Option<usize>, pose: Pose, own_pose: Pose) -> Body<'d> {
    Body {
        node,
        name: attribute(node, "name").filter(|name| parent.is_some() && !name.value.trim().is_empty()),
        parent,
        pose,
        own_pose,
        joints: Vec::new(),
        geoms: Vec::new(),
        sites: Vec::new(),
        inertial: None,
        unread: false,
    }
}

fn children<'d>(reader: &mut Reader, node: Node<'d, 'd>) -> Vec<Node<'d, 'd>> {
    let used = ["body", "frame", "joint", "freejoint", "geom", "site", "inertial"];
    let refused = REFUSED.map(|(name, _)| name);
    let used: Vec<&str> = used.into_iter().chain(refused).collect();
    reader.children(node, &used, &LOOKS)
}

/// Reads a child of a body, and returns what has to be read inside of it.
fn child<'d>(
    reader: &mut Reader,
    node: Node<'d, 'd>,
    (at, frame, class): (usize, Pose, usize),
    all: &mut Vec<Body<'d>>,
    classes: &Classes<'d>,
    compiler: &Compiler,
) -> Option<Scope<'d>> {
    let tag = node.tag_name().name();
    if at == 0 && ["joint", "freejoint", "inertial"].contains(&tag) {
        let help = "put it into a `body`";
        reader.findings.error(place(node), format!("the world has no `{tag}`"), help);
        return None;
    }
    match tag {
        "body" | "frame" => {
            let class = classes.named(reader, node, "childclass").unwrap_or(class);
            reader.attributes(node, if tag == "body" { BODY } else { FRAME });
            let element = Element::plain(node);
            let whose = element.name().map_or(format!("{tag}: "), |name| format!("{tag} {}: ", quote(name.value)));
            let own = pose(reader, &element, compiler, &whose);
            let pose = frame.then(&own);
            if tag == "frame" {
                return Some(Scope { children: children(reader, node).into_iter(), body: at, frame: pose, class });
            }
            special(reader, &element, &whose);
            let k = all.len();
            all.push(body(node, Some(at), pose, own));
            return Some(Scope { children: children(reader, node).into_iter(), body: k, frame: Pose::IDENTITY, class });
        }
        "joint" => all[at].joints.push(Part { element: classes.resolve(reader, node, &["joint"], class), frame }),
        "freejoint" => all[at].joints.push(Part { element: Element::plain(node), frame }),
        "geom" => all[at].geoms.push(Part { element: classes.resolve(reader, node, &["geom"], class), frame }),
        "site" => all[at].sites.push(Part { element: classes.resolve(reader, node, &["site"], class), frame }),
        "inertial" if all[at].inertial.is_some() => {
            reader.findings.error(place(node), "second `inertial` in this `body`", "keep one of them");
        }
        "inertial" => all[at].inertial = Some(node),
        _ => {
            all[at].unread = true;
            let help = REFUSED.iter().find(|(name, _)| *name == tag).map_or("remove it", |(_, help)| help);
            reader.findings.error(place(node), format!("`{tag}` is not read"), help);
        }
    }
    None
}

/// Bodies that MuJoCo moves in ways of its own.
fn special(reader: &mut Reader, element: &Element, whose: &str) {
    if let Some(mocap) = element.attribute("mocap").filter(|word| word.value == "true") {
        let message = "a `mocap` body stands still here";
        let help = "to move it, convert the model to TOML and give its joint `motion = \"prescribed\"`";
        reader.tally.add(Severity::Warning, "mocap", mocap.span, message, help);
    }
    if let Some(share) = number(reader, element, "gravcomp", whose).filter(|x| x.value != 0.0) {
        let message = "compensation of gravity (`gravcomp`) is not modelled";
        let help = "add its forces as joint efforts or wrenches of your own";
        reader.tally.add(Severity::Warning, "gravcomp", share.span, message, help);
    }
}
