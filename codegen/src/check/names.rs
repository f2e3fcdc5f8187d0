//! Names: usable, unique, and unique still as identifiers.

use std::collections::HashMap;

use crate::import::raw::RawModel;
use crate::import::source::{Findings, Spanned};
use crate::import::words::{did_you_mean, list, quote};
use crate::names::{identifier, rust_name};

/// Name of the fixed world.
const GROUND: &str = "ground";

/// Name of the model: as stated, or from the file.
pub(super) fn model_name(raw: &RawModel, findings: &mut Findings) -> String {
    let Some(name) = &raw.name else {
        let stem = std::path::Path::new(findings.file())
            .file_stem()
            .map_or(String::new(), |s| s.to_string_lossy().into_owned());
        return if usable(&stem) { rust_name(&stem) } else { "model".into() };
    };
    let fixed = if usable(&name.value) { rust_name(&name.value) } else { "model".into() };
    if fixed != name.value {
        if raw.lenient || usable(&name.value) && !name.value.is_ascii() {
            findings.notice(
                name.span,
                format!("model {} is called {} in generated code", quote(&name.value), quote(&fixed)),
            );
        } else {
            let message = format!("the model cannot be called {}", quote(&name.value));
            let help = format!("use letters, digits and `_`, and no Rust keyword: {}", quote(&fixed));
            findings.error(name.span, message, help);
        }
    }
    fixed
}

/// Names stand in comments of the generated code, too: nothing that ends a line or turns the direction of writing.
fn usable(name: &str) -> bool {
    let hidden =
        |c: char| c.is_control() || ('\u{2028}'..='\u{202e}').contains(&c) || ('\u{2066}'..='\u{2069}').contains(&c);
    name.chars().any(char::is_alphanumeric) && !name.contains(hidden)
}

/// What the end of a loop is named after.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// A body, `None` for the ground.
    Body(Option<usize>),
    /// A named frame, by index.
    Frame(usize),
}

/// Where the bodies are.
pub(super) struct Names<'r> {
    raw: &'r RawModel,
    bodies: HashMap<&'r str, usize>,
    joints: HashMap<&'r str, usize>,
    frames: HashMap<&'r str, usize>,
}

impl<'r> Names<'r> {
    /// Indexes all names and reports those that cannot stay.
    pub(super) fn collect(raw: &'r RawModel, findings: &mut Findings) -> Self {
        let bodies = raw.bodies.iter().map(|b| ("body", &b.name));
        let frames = raw.frames.iter().map(|f| ("frame", &f.name));
        unique(bodies.chain(frames), findings);
        unique(raw.joints.iter().map(|j| ("joint", &j.name)), findings);
        unique(raw.params.iter().map(|p| ("parameter", &p.name)), findings);
        unique(raw.wrenches.iter().map(|w| ("wrench", w.name.as_ref().unwrap_or(&w.body))), findings);
        let contacts = raw.contacts.iter().map(|c| ("contact", &c.name));
        unique(raw.constraints.iter().map(|c| (c.kind(), c.name())).chain(contacts), findings);
        unique(raw.variants.iter().map(|v| ("variant", &v.name)), findings);
        unique(raw.shapes.iter().map(|s| ("shape", &s.name)), findings);
        let mut names = Names { raw, bodies: HashMap::new(), joints: HashMap::new(), frames: HashMap::new() };
        for (k, b) in raw.bodies.iter().enumerate() {
            names.bodies.entry(&b.name.value).or_insert(k);
        }
        for (k, j) in raw.joints.iter().enumerate() {
            names.joints.entry(&j.name.value).or_insert(k);
        }
        for (k, f) in raw.frames.iter().enumerate() {
            names.frames.entry(&f.name.value).or_insert(k);
        }
        names
    }

    /// Whether a body is the one its name stands for (a second one of that name is reported, and one called like the
    /// ground).
    pub(super) fn is_first(&self, body: usize) -> bool {
        let name = self.raw.bodies[body].name.value.as_str();
        name != GROUND && self.bodies.get(name) == Some(&body)
    }

    /// Whether something can be fixed to what is called so: a body or the ground.
    pub(super) fn is_known(&self, name: &str) -> bool {
        name == GROUND || self.bodies.contains_key(name)
    }

    /// The body called so, `Some(None)` for the ground; `None` if there is none. `role` (empty, or with a space behind)
    /// and `what` as in ``joint `elbow`: parent `upper_am` is not a body``.
    pub(super) fn body(
        &self,
        name: &Spanned<String>,
        role: &str,
        what: &str,
        findings: &mut Findings,
    ) -> Option<Option<usize>> {
        if name.value == GROUND {
            return Some(None);
        }
        let found = self.bodies.get(name.value.as_str()).copied();
        // A body that had to be left out may be the one that is missed.
        if found.is_none() && !self.raw.incomplete {
            let firsts = (0..self.raw.bodies.len()).filter(|&b| self.is_first(b));
            let all: Vec<&str> = firsts.map(|b| self.raw.bodies[b].name.value.as_str()).collect();
            let help = did_you_mean(&name.value, all.iter().copied().chain([GROUND]), || match all.len() {
                0 => "the model has no bodies yet: add one".into(),
                1 => format!("the only body is {}", list(all.iter().copied())),
                _ => format!("the bodies are {}", list(all.iter().copied())),
            });
            findings.error(name.span, format!("{what}: {role}{} is not a body", quote(&name.value)), help);
        }
        found.map(Some)
    }

    /// Where a constraint acts: on a body, a frame or the ground.
    pub(super) fn end(&self, name: &Spanned<String>, what: &str, findings: &mut Findings) -> Option<End> {
        let key = name.value.as_str();
        if key == GROUND {
            return Some(End::Body(None));
        }
        let body = self.bodies.get(key).map(|b| End::Body(Some(*b)));
        let found = body.or_else(|| self.frames.get(key).map(|f| End::Frame(*f)));
        if found.is_none() && !self.raw.incomplete {
            let bodies = || self.raw.bodies.iter().map(|b| b.name.value.as_str());
            let all = || bodies().chain(self.raw.frames.iter().map(|f| f.name.value.as_str()));
            let help = did_you_mean(key, all().chain([GROUND]), || format!("bodies and frames are {}", list(all())));
            findings.error(name.span, format!("{what}: {} is neither a body nor a frame", quote(key)), help);
        }
        found
    }

    /// The joint called so; `role` and `what` as for bodies.
    pub(super) fn joint(
        &self,
        name: &Spanned<String>,
        role: &str,
        what: &str,
        findings: &mut Findings,
    ) -> Option<usize> {
        let found = self.joints.get(name.value.as_str()).copied();
        if found.is_none() && !self.raw.incomplete {
            let all = || self.raw.joints.iter().map(|j| j.name.value.as_str());
            let help = did_you_mean(&name.value, all(), || format!("the joints are {}", list(all())));
            findings.error(name.span, format!("{what}: {role}{} is not a joint", quote(&name.value)), help);
        }
        found
    }
}

/// Reports names of one family that are unusable, taken, or become the identifier of another.
fn unique<'r>(names: impl Iterator<Item = (&'r str, &'r Spanned<String>)>, findings: &mut Findings) {
    let mut exact: HashMap<&str, (&str, usize)> = HashMap::new();
    let mut folded: HashMap<String, &str> = HashMap::new();
    for (kind, name) in names {
        let shown = quote(&name.value);
        if name.value == GROUND && (kind == "body" || kind == "frame") {
            let message = format!("a {kind} cannot be called `{GROUND}`, which is the fixed world");
            findings.error(
                name.span,
                message,
                "give it another name; to hang something on the fixed world use `ground` as its parent",
            );
            continue;
        }
        if !usable(&name.value) {
            let message = format!("a {kind} cannot be called {shown}");
            findings.error(
                name.span,
                message,
                "give it a name with at least one letter or digit, and no control characters",
            );
            continue;
        }
        let line = findings.origin(name.span).line;
        if let Some((other, at)) = exact.insert(&name.value, (kind, line)) {
            let help = match (kind, other) {
                ("wrench", _) => "give each wrench on the same body a `name` of its own",
                ("frame", "body") => "every body is a frame of its own name already: choose another name",
                _ => "rename one of them",
            };
            let message = match kind == other {
                true => format!("{kind} {shown} is defined twice, first in line {at}"),
                false => format!("{kind} {shown} has the name of the {other} in line {at}"),
            };
            findings.error(name.span, message, help);
        } else if let Some(other) = folded.insert(identifier(&name.value), &name.value) {
            let message = format!("{kind} {shown} and {} become the same identifier in generated code", quote(other));
            findings.error(
                name.span,
                message,
                "rename one of them: only letters and digits tell names apart, and case does not",
            );
        }
    }
}
