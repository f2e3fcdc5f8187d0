//! `include`: files whose content stands in place of the element.

use std::borrow::Cow;
use std::collections::HashSet;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use super::element::attribute;
use crate::import::source::{Findings, Source, Span};
use crate::import::words::quote;
use crate::import::xml::{place, syntax_error};
use crate::import::{text, ReadFile};
use roxmltree::{Document, Node};

/// Levels of files that include each other.
const DEEPEST: usize = 50;

/// Length of a text with all that it includes, bytes.
const LONGEST: usize = 256 << 20;

/// A text that is copied, and where it stands.
struct Text<'t> {
    text: &'t str,
    source: Option<Arc<Source>>,
    /// Place in its source of the byte `from` of `text`.
    at: usize,
    from: usize,
}

struct Expansion<'e, 'f, 'a> {
    findings: &'e mut Findings<'a>,
    files: ReadFile<'f>,
    folder: PathBuf,
    included: HashSet<PathBuf>,
    out: String,
}

/// The text with all files that it includes; what is found in them is told with their names. `None` where one of them
/// cannot be read.
pub(super) fn expand<'t>(text: &'t str, findings: &mut Findings, files: ReadFile) -> Option<Cow<'t, str>> {
    if !text.contains("<include") {
        return Some(Cow::Borrowed(text));
    }
    // The text of a base stands behind blanks.
    let from = text.len() - text.trim_start().len();
    let (source, at) = findings.source_at(from);
    let file = findings.origin(Span::new(from, from + 1)).file;
    let file = Path::new(&*file);
    let mut expansion = Expansion {
        findings,
        files,
        folder: file.parent().unwrap_or(Path::new("")).to_path_buf(),
        included: HashSet::from([plain(file)]),
        out: String::with_capacity(text.len()),
    };
    // What is wrong with the text itself is told by the caller, who reads it again.
    let Ok(document) = Document::parse(text) else { return Some(Cow::Borrowed(text)) };
    let whole = Text { text, source, at, from };
    let fine = expansion.copy(&whole, &document, 0..text.len(), 0);
    fine.then_some(Cow::Owned(expansion.out))
}

/// A path without detours, by which files are told apart.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if plain.file_name().is_some() => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain
}

impl Expansion<'_, '_, '_> {
    /// Copies a range of a text, with what it includes.
    fn copy(&mut self, text: &Text, document: &Document, range: std::ops::Range<usize>, depth: usize) -> bool {
        let includes: Vec<Node> = (document.descendants())
            .filter(|n| n.is_element() && n.tag_name().name() == "include" && n.parent_element().is_some())
            .collect();
        let (mut cursor, mut fine) = (range.start, true);
        for node in includes {
            // An include inside an include was replaced with it.
            if node.range().start < cursor {
                continue;
            }
            self.piece(text, cursor..node.range().start);
            cursor = node.range().end;
            self.begin(text, node.range().start);
            fine &= self.include(node, node.range().start, depth);
        }
        self.piece(text, cursor..range.end);
        fine
    }

    /// Makes the places from here on those of a text from this byte on.
    fn begin(&mut self, text: &Text, byte: usize) {
        let at = text.at + byte.saturating_sub(text.from);
        self.findings.continue_with(self.out.len(), (text.source.clone(), at));
    }

    fn piece(&mut self, text: &Text, range: std::ops::Range<usize>) {
        // Blanks before the text have no places.
        if range.end > text.from {
            self.out.push_str(&text.text[range.start..range.start.max(text.from)]);
            let start = range.start.max(text.from);
            self.begin(text, start);
            self.out.push_str(&text.text[start..range.end]);
        } else {
            self.out.push_str(&text.text[range]);
        }
    }

    /// Puts the content of the file that `node`, at a byte of its text, names in its place.
    fn include(&mut self, node: Node, start: usize, depth: usize) -> bool {
        let here = self.out.len();
        let moved = |span: Span| Span::new(here + span.start - start, here + span.end - start);
        let Some(name) = attribute(node, "file").filter(|name| !name.value.trim().is_empty()) else {
            let message = "`include` names no file";
            self.findings.error(moved(place(node)), message, "write `<include file=\"...\"/>`");
            return false;
        };
        let (span, shown) = (moved(name.span), quote(name.value));
        let mut refuse = |message: String, help: &str| {
            self.findings.error(span, message, help);
            false
        };
        let relative = Path::new(name.value);
        if relative.is_absolute() || relative.has_root() {
            return refuse(format!("cannot include {shown}"), "write its path relative to the main file");
        }
        let path = self.folder.join(relative);
        if depth == DEEPEST {
            return refuse(format!("files include each other over more than {DEEPEST} levels"), "include fewer files");
        }
        if !self.included.insert(plain(&path)) {
            return refuse(format!("{shown} is included a second time"), "a file is included once");
        }
        let text = match text(self.files, &path) {
            Ok(text) => text,
            Err(error) => {
                let help = "the path is relative to the folder of the main file";
                return refuse(format!("cannot include {shown}: {error}"), help);
            }
        };
        if self.out.len() + text.len() > LONGEST {
            return refuse(format!("with {shown} the text is too long"), "include fewer files");
        }
        let source = Source::new(&path.to_string_lossy(), text.clone());
        let whole = Text { text: &text, source: Some(source), at: 0, from: 0 };
        let document = match Document::parse(&text) {
            Ok(document) => document,
            Err(error) => {
                let (span, message, help) = syntax_error(&error, &text, "mujocoinclude");
                self.begin(&whole, 0);
                let end = here + text.len();
                self.findings.error(Span::new((here + span.start).min(end), end + 1), message, help);
                return false;
            }
        };
        let root = document.root_element();
        let range = root.first_child().zip(root.last_child()).map_or(0..0, |(a, b)| a.range().start..b.range().end);
        self.copy(&whole, &document, range, depth + 1)
    }
}
