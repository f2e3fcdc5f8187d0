//! `[base]`: a description as changes and additions of another one, of a robot in URDF above all.

use std::collections::HashMap;
use std::path::Path;

use super::table::Table;
use super::Named;
use crate::import::raw::{RawBody, RawJoint, RawModel, RawMotion};
use crate::import::source::{Findings, Span};
use crate::import::words::quote;
use crate::import::{mjcf, text, urdf, Base, ImportOptions, XmlFormat};

pub(super) const KEYS: &[&str] = &["file", "root", "limits"];

/// Bodies and joints that are changed where they are named again, by their indices.
#[derive(Default)]
pub(super) struct Known {
    /// Bodies.
    pub bodies: HashMap<String, usize>,
    /// Joints.
    pub joints: HashMap<String, usize>,
}

impl Known {
    /// Those of a model.
    pub fn of(raw: &RawModel) -> Known {
        let bodies = raw.bodies.iter().enumerate().map(|(k, body)| (body.name.value.clone(), k));
        let joints = raw.joints.iter().enumerate().map(|(k, joint)| (joint.name.value.clone(), k));
        Known { bodies: bodies.collect(), joints: joints.collect() }
    }
}

/// Reads the model that is changed. Its places stand behind those of the text that names it.
pub(super) fn read(table: &Table, options: &ImportOptions, findings: &mut Findings, named: &Named) -> Option<RawModel> {
    let files = named.files;
    table.reject_unknown(KEYS, "a base", findings);
    let root = table.choice("root", &Base::ALL.map(Base::name), findings).map(|choice| Base::ALL[choice.value]);
    let limits = table.flag("limits", findings).is_some_and(|flag| flag.value);
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
    // What the caller states goes first.
    let base = if options.base == Base::default() { root.unwrap_or_default() } else { options.base };
    let options = ImportOptions { base, gravity: None, limits: limits || options.limits, ..*options };
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let placed = |text: &str, findings: &mut Findings| {
        let start = findings.add_base(&path.to_string_lossy(), text.to_string());
        format!("{}{}", " ".repeat(start), without_start(text))
    };
    match extension.as_deref() {
        Some("mjcf") => mjcf::read(&placed(&text, findings), &options, findings, files),
        Some("xml") if XmlFormat::of(&text) == Some(XmlFormat::Mjcf) => {
            mjcf::read(&placed(&text, findings), &options, findings, files)
        }
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
