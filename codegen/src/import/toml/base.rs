//! `[base]`: a description as changes and additions of another one, of a robot in URDF above all.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::table::Table;
use super::Named;
use crate::import::raw::{RawBody, RawJoint, RawModel, RawMotion};
use crate::import::source::{Findings, Span, Spanned};
use crate::import::words::{closest, list, quote};
use crate::import::{mjcf, text, urdf, Base, ImportOptions, XmlFormat};

pub(super) const KEYS: &[&str] = &["file", "root", "limits"];

/// Bodies and joints that are changed where they are named again, by their indices.
#[derive(Default)]
pub(super) struct Known {
    /// Bodies.
    pub bodies: HashMap<String, usize>,
    /// Joints.
    pub joints: HashMap<String, usize>,
    /// Numbers of the bodies and joints of the base, which stand before those that are added; none where a part of the base
    /// was left out, so that it cannot be told which names it has.
    counts: [usize; 2],
}

impl Known {
    /// Those of a model.
    pub fn of(raw: &RawModel) -> Known {
        let bodies = raw.bodies.iter().enumerate().map(|(k, body)| (body.name.value.clone(), k));
        let joints = raw.joints.iter().enumerate().map(|(k, joint)| (joint.name.value.clone(), k));
        let counts = if raw.incomplete { [0; 2] } else { [raw.bodies.len(), raw.joints.len()] };
        Known { bodies: bodies.collect(), joints: joints.collect(), counts }
    }

    /// Reports a joint that is not described as a new one where the base has none of its name; whether it did.
    pub fn lacks_joint(&self, name: &Spanned<String>, raw: &RawModel, findings: &mut Findings) -> bool {
        let of_base = &raw.joints[..self.counts[1]];
        if of_base.is_empty() || raw.joints.iter().any(|joint| joint.name.value == name.value) {
            return false;
        }
        let names = of_base.iter().map(|joint| joint.name.value.as_str()).collect();
        let message = format!("joint {}: no joint of the base has this name", quote(&name.value));
        let help = meant(&name.value, names, "joints", "a new joint needs `type` and `child`");
        findings.error(name.span, message, help);
        true
    }

    /// Reports bodies that no joint carries where the base has none of their names.
    pub fn lacks_bodies(&self, raw: &mut RawModel, findings: &mut Findings) {
        let (of_base, added) = raw.bodies.split_at(self.counts[0]);
        if of_base.is_empty() || raw.incomplete {
            return;
        }
        let children = raw.joints.iter().filter_map(|joint| joint.child.as_ref());
        let carried: HashSet<&str> = children.map(|child| child.value.as_str()).collect();
        for body in added.iter().filter(|body| !carried.contains(body.name.value.as_str())) {
            let name = &body.name;
            let names = of_base.iter().map(|body| body.name.value.as_str()).collect();
            let message = format!("body {}: no body of the base has this name", quote(&name.value));
            let help = meant(&name.value, names, "bodies", "a new body needs a joint whose `child` it is");
            findings.error(name.span, message, help);
            // That it has no joint is not reported again.
            raw.incomplete = true;
        }
    }
}

/// What to do about a name that is none of those of the base.
fn meant(name: &str, names: Vec<&str>, kind: &str, otherwise: &str) -> String {
    match closest(name, names.iter().copied()) {
        Some(meant) => format!("did you mean {}? {otherwise}", quote(meant)),
        None => format!("the {kind} of the base are {}; {otherwise}", list(names)),
    }
}

/// Reads the model that is changed. Its places stand behind those of the text that names it.
pub(super) fn read(table: &Table, options: &ImportOptions, findings: &mut Findings, named: &Named) -> Option<RawModel> {
    let files = named.files;
    table.reject_unknown(KEYS, "a base", findings);
    let mut root = table.choice("root", &Base::ALL.map(Base::name), findings).map(|choice| Base::ALL[choice.value]);
    let mut limits = table.flag("limits", findings).is_some_and(|flag| flag.value);
    let name = table.required_text("file", findings)?;
    let path = named.folder.join(&name.value);
    let text = match text(files, &path) {
        Ok(text) => text,
        Err(error) => {
            let message = format!("cannot read the base {}: {error}", quote(&name.value));
            findings.error(name.span, message, super::PATH);
            return None;
        }
    };
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let is_toml = extension.as_deref() == Some("toml");
    let is_mjcf = match extension.as_deref() {
        Some("xml") => XmlFormat::of(&text) == Some(XmlFormat::Mjcf),
        other => other == Some("mjcf"),
    };
    let refuse = |key: &str, formats: &str, instead: &str, findings: &mut Findings| {
        let message = format!("{}`{key}` is for {formats}", table.prefix());
        findings.error(table.key_span(key), message, format!("remove it: {instead} in {}", quote(&name.value)));
    };
    if (is_toml || is_mjcf) && root.is_some_and(|root| root != Base::default()) {
        let joints = if is_toml { "the joints to `ground`" } else { "the joints of the bodies" };
        refuse("root", "URDF files", &format!("{joints} say how the model is attached"), findings);
        root = None;
    }
    if is_toml && limits {
        refuse("limits", "URDF and MJCF files", "the `limits` of joints are stops already", findings);
        limits = false;
    }
    // What the caller states goes first.
    let base = if options.base == Base::default() { root.unwrap_or_default() } else { options.base };
    let options = ImportOptions { base, gravity: None, limits: limits || options.limits, ..*options };
    let placed = |text: &str, findings: &mut Findings| {
        let start = findings.add_base(&path.to_string_lossy(), text.to_string());
        format!("{}{}", " ".repeat(start), without_start(text))
    };
    match extension.as_deref() {
        _ if is_mjcf => mjcf::read(&placed(&text, findings), &options, findings, files),
        Some("urdf" | "xml") => urdf::read(&placed(&text, findings), &options, findings, (&path, files)),
        Some("toml") => {
            super::refuse_options(&options, findings);
            let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
            let named = Named { files, folder, is_base: true };
            super::document(&placed(&text, findings), &options, findings, &named)
        }
        _ => {
            let help = "name a `.urdf`, `.xml` or `.toml` file";
            findings.error(name.span, format!("cannot read the base {}", quote(&name.value)), help);
            None
        }
    }
}

/// A text with blanks in place of what may stand at the very start of a file only: a mark of the byte order, an XML
/// declaration.
fn without_start(text: &str) -> String {
    let marked = text.len() - text.trim_start_matches('\u{feff}').len();
    let declared = text[marked..].starts_with("<?xml ").then(|| text[marked..].find("?>")).flatten();
    let end = marked + declared.map_or(0, |length| length + 2);
    let blanks = text[..end].bytes().map(|b| if b == b'\n' { '\n' } else { ' ' });
    blanks.chain(text[end..].chars()).collect()
}

/// Replaces what is stated anew.
fn replace<T>(old: &mut Option<T>, new: Option<T>) {
    if new.is_some() {
        *old = new;
    }
}

/// Changes a body.
pub(super) fn change_body(old: &mut RawBody, new: RawBody) {
    old.name.span = new.name.span;
    replace(&mut old.mass, new.mass);
    replace(&mut old.com, new.com);
    // New moments are in axes of their own.
    if new.inertia.is_some() {
        (old.inertia, old.inertia_axes) = (new.inertia, new.inertia_axes);
    } else {
        replace(&mut old.inertia_axes, new.inertia_axes);
    }
}

/// Changes a joint.
pub(super) fn change_joint(old: &mut RawJoint, new: RawJoint) {
    let RawJoint {
        name, kind, parent, child, placement, axis, axis2, pitch, damping, stiffness, rest, armature, ..
    } = new;
    old.name.span = if name.span == Span::FILE { old.name.span } else { name.span };
    replace(&mut old.kind, kind);
    replace(&mut old.parent, parent);
    replace(&mut old.child, child);
    replace(&mut old.placement.xyz, placement.xyz);
    replace(&mut old.placement.rotation, placement.rotation);
    replace(&mut old.axis, axis);
    replace(&mut old.axis2, axis2);
    replace(&mut old.pitch, pitch);
    replace(&mut old.damping, damping);
    replace(&mut old.stiffness, stiffness);
    replace(&mut old.rest, rest);
    replace(&mut old.armature, armature);
    old.unbounded |= new.unbounded;
    if let RawMotion::Prescribed(_) = new.motion {
        old.motion = new.motion;
    }
    replace(&mut old.mimic, new.mimic);
    replace(&mut old.start, new.start);
    replace(&mut old.start_velocity, new.start_velocity);
    replace(&mut old.held, new.held);
    replace(&mut old.limits, new.limits);
    replace(&mut old.limit_restitution, new.limit_restitution);
    replace(&mut old.range, new.range);
    replace(&mut old.max_velocity, new.max_velocity);
    replace(&mut old.max_effort, new.max_effort);
}
