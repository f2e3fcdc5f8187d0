//! The TOML model format (book/src/model-format.md). Here: the document and its top level.

mod base;
mod constraints;
mod contacts;
mod entries;
#[cfg(feature = "height_fields")]
mod heights;
mod kinds;
mod numbers;
mod schema;
mod table;
mod variants;
mod write;

use std::path::{Path, PathBuf};

use ::toml::de::{DeTable, DeValue, Error};

use self::base::Known;
pub use self::schema::schema;
use self::table::Table;
pub use self::write::write;
use super::raw::{RawGravity, RawJoint, RawModel, RawParam};
use super::source::{Findings, Span, Spanned};
use super::words::quote;
use super::{Base, ImportOptions, ReadFile};

const KEYS: &[&str] = &[
    "name", "base", "checks", "gravity", "params", "body", "joint", "frame", "wrench", "loop", "coupling", "shape",
    "contact", "contacts", "variant",
];

/// Reads a model without checking the mechanism; `None` where the text is no TOML, or the `[base]` that it names cannot be
/// read. Without one, the options have to be the defaults; gravity replaces that of the file.
pub fn read(text: &str, options: &ImportOptions, findings: &mut Findings, files: ReadFile) -> Option<RawModel> {
    let folder = Path::new(findings.file()).parent().unwrap_or(Path::new("")).to_path_buf();
    let mut raw = document(text, options, findings, &Named { files, folder, is_base: false })?;
    if let Some(g) = options.gravity {
        raw.gravity = Some(override_gravity(g, findings));
    }
    Some(raw)
}

/// The files that a text names.
struct Named<'f> {
    files: ReadFile<'f>,
    /// Where their paths start.
    folder: PathBuf,
    /// Whether the text is a base, which has none itself.
    is_base: bool,
}

/// What to do about a file that cannot be read.
const PATH: &str = "the path is relative to the folder of this file";

impl Named<'_> {
    /// The path of a file and what it contains; that it cannot be read is reported, as of `what`.
    fn read(&self, file: &Spanned<String>, what: &str, findings: &mut Findings) -> Option<(PathBuf, Vec<u8>)> {
        let path = self.folder.join(&file.value);
        match (self.files)(&path) {
            Ok(bytes) => Some((path, bytes)),
            Err(error) => {
                let message = format!("{what}{}: it cannot be read: {error}", quote(&file.value));
                findings.error(file.span, message, PATH);
                None
            }
        }
    }
}

/// Reports options that a model without `[base]` states itself.
fn refuse_options(options: &ImportOptions, findings: &mut Findings) {
    if options.base != Base::default() {
        let help = "leave the option out; in the file the joints to `ground` say how the model is attached";
        findings.error(Span::FILE, "a TOML model states its own base", help);
    }
    if options.limits || options.floor.is_some() || options.self_contact.is_some() {
        let help = "leave these options out; in the file, `limits`, `[[shape]]` and `[[contact]]` describe them";
        findings.error(Span::FILE, "a TOML model states its own limits and contacts", help);
    }
}

fn override_gravity(g: [f64; 3], findings: &mut Findings) -> RawGravity {
    if g.iter().any(|x| !x.is_finite()) {
        findings.error(Span::FILE, "the option for gravity is not finite", "give three finite numbers in m/s²");
    }
    RawGravity::of_options(g)
}

/// Reads a text, and the files that it names.
fn document(text: &str, options: &ImportOptions, findings: &mut Findings, named: &Named) -> Option<RawModel> {
    let document = match DeTable::parse(text) {
        Ok(document) => document,
        Err(error) => {
            syntax_error(text, &error, findings);
            return None;
        }
    };
    let top = Table::new(document.get_ref(), Span::FILE, String::new());
    top.reject_unknown(KEYS, "a model", findings);
    let mut raw = match (top.table("base", findings), named.is_base) {
        (Some(table), false) => base::read(&table, options, findings, named)?,
        (Some(table), true) => {
            let help =
                "name the file that it changes as the base, or convert it: `mbd convert FILE.toml -o WHOLE.toml`";
            findings.error(table.span, "the base of a model has a `[base]` itself", help);
            return None;
        }
        (None, true) => RawModel::empty(),
        (None, false) => {
            refuse_options(options, findings);
            RawModel::empty()
        }
    };
    let mut known = Known::of(&raw);
    raw.name = top.text("name", findings).or(raw.name);
    if let Some(checks) = top.choice("checks", &["strict", "lenient"], findings) {
        raw.lenient = checks.value == 1;
    }
    let stated = top.get("gravity").and_then(|(span, value)| gravity(&top, span, value, findings));
    raw.gravity = stated.or(raw.gravity);
    if let Some(table) = top.table("params", findings) {
        params(&table, &mut raw, findings);
    }
    parts(&top, named, &[], &mut known, &mut raw, findings);
    contacts::surfaces(&top, &mut raw, findings);
    variants::all(&top, named, &mut raw, findings);
    Some(raw)
}

/// All that stands in lists: bodies, joints and what refers to them. `joints` are known besides those in the table, and
/// what is `known` of the model is changed.
fn parts(
    top: &Table,
    named: &Named,
    joints: &[RawJoint],
    known: &mut Known,
    raw: &mut RawModel,
    findings: &mut Findings,
) {
    for table in top.tables("body", findings) {
        entries::body(table, known, raw, findings);
    }
    for table in top.tables("joint", findings) {
        entries::joint(table, known, raw, findings);
    }
    known.lacks_bodies(raw, findings);
    for table in top.tables("frame", findings) {
        entries::frame(table, raw, findings);
    }
    for table in top.tables("wrench", findings) {
        entries::wrench(table, raw, findings);
    }
    constraints::all(top, joints, raw, findings);
    contacts::all(top, named, raw, findings);
}

fn gravity(top: &Table, span: Span, value: &DeValue, findings: &mut Findings) -> Option<RawGravity> {
    match value {
        DeValue::String(s) if s == "input" => Some(RawGravity::Input),
        DeValue::String(s) => {
            let message = format!("`gravity` cannot be {}", quote(s));
            findings.error(
                span,
                message,
                "write `gravity = [0, 0, -9.81]`, or `gravity = \"input\"` to give it with every call",
            );
            None
        }
        _ => top.vec3("gravity", numbers::Unit::Plain, findings).map(RawGravity::Constant),
    }
}

fn params(table: &Table, raw: &mut RawModel, findings: &mut Findings) {
    // The map is sorted by name; parameters keep the order of the file.
    let mut entries: Vec<_> = table.entries().collect();
    entries.sort_by_key(|(name, _)| name.span.start);
    for (name, value) in entries {
        let what = format!("parameter {}", quote(name.value));
        let default = numbers::default_value(value, &what, findings);
        match raw.params.iter_mut().find(|param| param.name.value == *name.value) {
            Some(of_base) => of_base.default = default,
            None => raw.params.push(RawParam { name: Spanned::new(name.value.to_string(), name.span), default }),
        }
    }
}

/// One finding from an error of the TOML parser.
fn syntax_error(text: &str, error: &Error, findings: &mut Findings) {
    let span = error.span().unwrap_or(0..0);
    // An error at the very first byte is one with a place, too.
    let place = Span::new(span.start, span.end.max(1));
    let culprit = quote(text.get(span).unwrap_or("").lines().next().unwrap_or(""));
    let comma = text.get(..place.start).is_some_and(|before| before.ends_with(|c: char| c.is_ascii_digit()))
        && text.get(place.start..).is_some_and(|rest| rest.starts_with(','));
    let (message, help) = match error.message() {
        _ if text.trim_start_matches(['\u{feff}', ' ', '\n', '\r', '\t']).starts_with('<') => {
            ("this is XML, not TOML".into(), "if it is a robot description, name the file `.urdf`")
        }
        _ if comma => ("a comma inside a number".into(), "write the decimals after a point, as in `1.5`"),
        m if m.starts_with("duplicate key") => (
            format!("key {culprit} is given twice"),
            "keep one; the lists of bodies, joints, frames, wrenches and loops have double brackets, like `[[body]]`",
        ),
        m if m.starts_with("string values must be quoted") => (
            format!("{culprit} is neither a number nor quoted text"),
            "put text in double quotes; numbers stand without unit",
        ),
        m => (
            format!("not valid TOML: {m}"),
            "entries are `key = value`, one on a line; text stands in double quotes, lists in `[ ]`, tables in `{ }`",
        ),
    };
    findings.error(place, message, help);
}
