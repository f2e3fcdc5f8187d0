//! Places in a source text and the collector of findings that every reader and the checks write to.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use crate::diag::{Diagnostic, Diagnostics, Severity};
use crate::model::Origin;

/// Byte range in the source text; `0..0` stands for the file as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

impl Span {
    /// The file as a whole: shown without line and column.
    pub const FILE: Span = Span { start: 0, end: 0 };

    /// From a byte range.
    pub fn new(start: usize, end: usize) -> Self {
        Span { start, end }
    }
}

impl From<std::ops::Range<usize>> for Span {
    fn from(r: std::ops::Range<usize>) -> Self {
        Span { start: r.start, end: r.end }
    }
}

/// A value and its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Spanned<T> {
    /// The value.
    pub value: T,
    /// Its place.
    pub span: Span,
}

impl<T> Spanned<T> {
    /// A value with its place.
    pub fn new(value: T, span: impl Into<Span>) -> Self {
        Spanned { value, span: span.into() }
    }
}

/// Turns byte offsets into lines and columns.
#[derive(Clone, Debug)]
pub struct SourceMap<'a> {
    text: Cow<'a, str>,
    /// Byte offset of the first byte of each line.
    lines: Vec<usize>,
}

impl<'a> SourceMap<'a> {
    /// Finds the starts of the lines of `text`.
    pub fn new(text: impl Into<Cow<'a, str>>) -> Self {
        let text = text.into();
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(k, _)| k + 1)).collect();
        SourceMap { text, lines }
    }

    /// Line of an offset, from 1.
    pub fn line(&self, offset: usize) -> usize {
        self.lines.partition_point(|&start| start <= offset.min(self.text.len()))
    }

    /// Line and column (in characters), both from 1. Offsets past the end or inside a character are moved back to the
    /// last character.
    pub fn position(&self, offset: usize) -> (usize, usize) {
        let mut offset = offset.min(self.text.len());
        while !self.text.is_char_boundary(offset) {
            offset -= 1;
        }
        let line = self.line(offset);
        let start = self.lines[line - 1];
        (line, self.text[start..offset].chars().count() + 1)
    }
}

/// Collects the findings about one file, and about the files that it names.
#[derive(Clone, Debug)]
pub struct Findings<'a> {
    file: Arc<str>,
    map: SourceMap<'a>,
    list: Vec<Diagnostic>,
    /// Warnings about what nothing uses, unless a variant does.
    unused: Vec<Diagnostic>,
    /// Where the offsets of spans lead, in rising order; before the first piece they are those of the file.
    pieces: Vec<Piece>,
}

/// A part of what was read that stands in another file, or further on in the same one: from this offset on.
#[derive(Clone, Debug)]
struct Piece {
    start: usize,
    /// Offset in the source.
    at: usize,
    /// The source; `None` for the first file.
    source: Option<Arc<Source>>,
}

/// A file that another one names.
#[derive(Debug)]
pub struct Source {
    file: Arc<str>,
    map: SourceMap<'static>,
}

impl Source {
    /// A file by its name in messages, and its text.
    pub fn new(file: &str, text: String) -> Arc<Source> {
        Arc::new(Source { file: file.into(), map: SourceMap::new(text) })
    }
}

impl<'a> Findings<'a> {
    /// A collector without findings; `file` is the name that the caller gave.
    pub fn new(file: &str, text: &'a str) -> Self {
        Findings {
            file: file.into(),
            map: SourceMap::new(text),
            list: Vec::new(),
            unused: Vec::new(),
            pieces: Vec::new(),
        }
    }

    /// Adds the file that this one changes: its places are those of `text` from the offset that is returned.
    pub fn add_base(&mut self, file: &str, text: String) -> usize {
        let start = self.map.text.len() + 1;
        self.pieces.push(Piece { start, at: 0, source: Some(Source::new(file, text)) });
        start
    }

    /// The source of an offset and the offset there.
    pub fn source_at(&self, offset: usize) -> (Option<Arc<Source>>, usize) {
        let before = self.pieces.partition_point(|piece| piece.start <= offset);
        match before.checked_sub(1).map(|k| &self.pieces[k]) {
            Some(piece) => (piece.source.clone(), piece.at + (offset - piece.start)),
            None => (None, offset),
        }
    }

    /// From the offset `start` on, all offsets are those of `source` from `at` on. Pieces are added in rising order;
    /// those that began further on are dropped.
    pub fn continue_with(&mut self, start: usize, (source, at): (Option<Arc<Source>>, usize)) {
        self.pieces.retain(|piece| piece.start < start);
        self.pieces.push(Piece { start, at, source });
    }

    /// A collector without findings about the same file.
    pub fn fresh(&self) -> Self {
        Findings { list: Vec::new(), unused: Vec::new(), ..self.clone() }
    }

    /// Takes over the findings about the variant `name` of the model that those of `base` are about: what is new. What
    /// the variant uses is not unused.
    pub fn take_variant(&mut self, name: &str, base: &Findings, variant: Findings) {
        let new = variant.list.into_iter().filter(|finding| !base.list.contains(finding));
        let named =
            new.map(|finding| Diagnostic { message: format!("in variant {name}: {}", finding.message), ..finding });
        self.list.extend(named);
        self.unused.retain(|finding| variant.unused.contains(finding));
    }

    /// Adds a finding.
    pub fn add(&mut self, severity: Severity, span: Span, message: impl Into<String>, help: impl Into<String>) {
        self.add_at(severity, self.origin(span), message, help);
    }

    /// Adds a finding at a place.
    fn add_at(&mut self, severity: Severity, at: Origin, message: impl Into<String>, help: impl Into<String>) {
        self.list.push(diagnostic(severity, at, message.into(), help.into()));
    }

    /// Adds an error: the file cannot be used.
    pub fn error(&mut self, span: Span, message: impl Into<String>, help: impl Into<String>) {
        self.add(Severity::Error, span, message, help);
    }

    /// Adds an error at the place of a part of the model.
    pub fn error_at(&mut self, origin: &Origin, message: impl Into<String>, help: impl Into<String>) {
        self.add_at(Severity::Error, origin.clone(), message, help);
    }

    /// Adds a warning: something is ignored or suspicious.
    pub fn warning(&mut self, span: Span, message: impl Into<String>, help: impl Into<String>) {
        self.add(Severity::Warning, span, message, help);
    }

    /// Adds a warning about something that nothing uses.
    pub fn unused(&mut self, span: Span, message: impl Into<String>, help: impl Into<String>) {
        self.unused.push(diagnostic(Severity::Warning, self.origin(span), message.into(), help.into()));
    }

    /// Adds a notice: the reader changed something.
    pub fn notice(&mut self, span: Span, message: impl Into<String>) {
        self.add(Severity::Notice, span, message, "");
    }

    /// The file, as the caller named it.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Place of the start of a span.
    pub fn origin(&self, span: Span) -> Origin {
        if span == Span::FILE {
            return Origin { file: self.file.clone(), line: 0, column: 0 };
        }
        let (file, (line, column)) = match self.source_at(span.start) {
            (Some(source), at) => (source.file.clone(), source.map.position(at)),
            (None, at) => (self.file.clone(), self.map.position(at)),
        };
        Origin { file, line, column }
    }

    /// Whether there is an error among them.
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|d| d.severity == Severity::Error)
    }

    /// All findings, in the order of the file; behind them those about the files that it names.
    pub fn finish(mut self) -> Diagnostics {
        self.list.append(&mut self.unused);
        let file = &self.file;
        let named = |d: &Diagnostic| {
            self.pieces.iter().position(|piece| piece.source.as_ref().is_some_and(|source| *source.file == *d.file))
        };
        // Many findings are about few files.
        let mut rank: HashMap<String, usize> = HashMap::new();
        for d in self.list.iter().filter(|d| *d.file != **file) {
            if !rank.contains_key(&d.file) {
                rank.insert(d.file.clone(), named(d).map_or(usize::MAX, |k| k + 1));
            }
        }
        self.list.sort_by_key(|d| (rank.get(&d.file).copied().unwrap_or(0), d.line, d.column));
        Diagnostics(self.list)
    }
}

fn diagnostic(severity: Severity, at: Origin, message: String, help: String) -> Diagnostic {
    let Origin { file, line, column } = at;
    Diagnostic { severity, file: file.to_string(), line, column, message: one_line(message), help: one_line(help) }
}

/// Escapes control characters, so that a finding is always one line.
fn one_line(text: String) -> String {
    if !text.contains(char::is_control) {
        return text;
    }
    let escape = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
    text.chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters() {
        let text = "a\nöä = 1\n";
        let map = SourceMap::new(text);
        assert_eq!(map.position(0), (1, 1));
        assert_eq!(map.position(1), (1, 2));
        assert_eq!(map.position(2), (2, 1));
        assert_eq!(map.position(3), (2, 1)); // inside ö
        assert_eq!(map.position(6), (2, 3));
        assert_eq!(map.position(text.len()), (3, 1));
        assert_eq!(map.position(1000), (3, 1));
    }

    #[test]
    fn findings_come_in_file_order() {
        let mut f = Findings::new("m.toml", "a\nb\n");
        f.warning(Span::new(2, 3), "second", "do this");
        f.error(Span::new(0, 1), "first", "do that");
        f.notice(Span::FILE, "whole\n");
        assert!(f.has_errors());
        let shown = f.finish().to_string();
        assert_eq!(
            shown,
            "m.toml: notice: whole\\n\nm.toml:1:1: error: first\n  help: do that\nm.toml:2:1: warning: second\n  help: do this"
        );
    }
}
