//! Reads attributes and numbers with their places from XML. Nothing here is specific to robots.

use super::tally::Tally;
use crate::diag::Severity;
use crate::import::raw::{RawNumber, RawValue, RawVec3};
use crate::import::source::{Findings, Span, Spanned};
use crate::import::words::{did_you_mean, quote};
use roxmltree::{Error, Node};
use std::borrow::Cow;

/// Findings that are collected while reading.
pub(crate) struct Reader<'f, 'a> {
    /// Findings, one by one.
    pub findings: &'f mut Findings<'a>,
    /// Findings that are counted by kind.
    pub tally: Tally,
}

/// A text whose declaration does not stand first, as it has to: with blanks in its place, so that all places stay.
pub(crate) fn without_late_declaration<'t>(text: &'t str, findings: &mut Findings) -> Cow<'t, str> {
    let start = text.len() - text.trim_start().len();
    let (true, Some(length)) = (start > 0 && text[start..].starts_with("<?xml "), text[start..].find("?>")) else {
        return Cow::Borrowed(text);
    };
    let end = start + length + 2;
    let message = "the XML declaration does not stand at the start of the file";
    findings.warning(
        Span::new(start, end),
        message,
        "remove the blank lines before it: other programs refuse the file",
    );
    let blanks: String = text[start..end].bytes().map(|b| if b == b'\n' { '\n' } else { ' ' }).collect();
    Cow::Owned(format!("{}{blanks}{}", &text[..start], &text[end..]))
}

/// Place of the opening `<name` of an element.
pub(crate) fn place(node: Node) -> Span {
    let start = node.range().start;
    Span::new(start, start + 1 + node.tag_name().name().len())
}

/// Name of an element in messages, with its prefix, if it has one.
pub(crate) fn shown<'a>(node: Node<'a, '_>) -> &'a str {
    let text = &node.document().input_text()[node.range()];
    let end = text.char_indices().skip(1).find(|(_, c)| c.is_whitespace() || matches!(c, '/' | '>'));
    text.get(1..end.map_or(text.len(), |(k, _)| k)).unwrap_or("")
}

/// Whether the name of `node` is one of this file's own: in no namespace, or in the one the root element has.
pub(crate) fn is_own(node: Node) -> bool {
    let space = node.tag_name().namespace();
    space.is_none() || space == node.document().root_element().tag_name().namespace()
}

impl Reader<'_, '_> {
    /// Sorts the child elements of `node`: those named in `used` are returned in file order, those in `ignored` are
    /// counted with the message that stands there, if there is one, all others are warned about, as is text between
    /// them.
    pub fn children<'x, 'i>(
        &mut self,
        node: Node<'x, 'i>,
        used: &[&str],
        ignored: &[(&str, &str)],
    ) -> Vec<Node<'x, 'i>> {
        let mut found = Vec::new();
        for child in node.children() {
            if child.is_text() {
                self.stray_text(node, child);
            }
            if !child.is_element() {
                continue;
            }
            let name = child.tag_name().name();
            if !is_own(child) {
                self.foreign(node, child);
            } else if used.contains(&name) {
                found.push(child);
            } else if let Some((_, message)) = ignored.iter().find(|(known, _)| *known == name) {
                if !message.is_empty() {
                    self.tally.notice(place(child), message);
                }
            } else {
                self.unknown_element(node, child, used.iter().copied().chain(ignored.iter().map(|i| i.0)));
            }
        }
        found
    }

    /// The child elements of `node`, at most one of each name in `used`, in the order of `used`; a second one is an
    /// error.
    pub fn single_children<'x, 'i, const N: usize>(
        &mut self,
        node: Node<'x, 'i>,
        used: [&str; N],
        ignored: &[(&str, &str)],
    ) -> [Option<Node<'x, 'i>>; N] {
        let mut slots = [None; N];
        for child in self.children(node, &used, ignored) {
            let Some(k) = used.iter().position(|name| *name == child.tag_name().name()) else { continue };
            if slots[k].is_some() {
                let message = format!("second `{}` in this `{}`", used[k], node.tag_name().name());
                self.findings.error(place(child), message, "keep one of them");
            } else {
                slots[k] = Some(child);
            }
        }
        slots
    }

    fn stray_text(&mut self, parent: Node, text: Node) {
        let content = text.text().unwrap_or("");
        let lead = content.len() - content.trim_start().len();
        if lead < content.len() {
            let start = text.range().start + lead;
            let name = parent.tag_name().name();
            let message = format!("text inside `{name}` is not used");
            let help = format!("give values as attributes of `{name}`, or make the text a comment");
            self.tally.add(Severity::Warning, &message.clone(), Span::new(start, start + 1), message, help);
        }
    }

    fn foreign(&mut self, parent: Node, child: Node) {
        let name = shown(child);
        if child.tag_name().namespace().is_some_and(|space| space.contains("xacro")) {
            let message = format!("{} is a macro instruction that is not expanded", quote(name));
            self.tally.add(Severity::Error, "xacro", place(child), message, XACRO);
        } else {
            self.unknown_element(parent, child, []);
        }
    }

    fn unknown_element<'s>(&mut self, parent: Node, child: Node, known: impl IntoIterator<Item = &'s str>) {
        let (name, parent) = (shown(child), parent.tag_name().name());
        let message = format!("unknown element {} in `{parent}` is not used", quote(name));
        let help = did_you_mean(name, known, || REMOVE.into());
        self.tally.add(Severity::Warning, &format!("<{parent}><{name}>"), place(child), message, help);
    }

    /// Checks an element that holds nothing but the attributes `known`.
    pub fn leaf(&mut self, node: Node, known: &[&str]) {
        self.attributes(node, known);
        self.children(node, &[], &[]);
    }

    /// Warns about every attribute of `node` that is not one of `known`.
    pub fn attributes(&mut self, node: Node, known: &[&str]) {
        for a in node.attributes() {
            if a.namespace().is_none() && known.contains(&a.name()) {
                continue;
            }
            let (name, element) = (a.name(), node.tag_name().name());
            let message = format!("unknown attribute {} of `{element}` is not used", quote(name));
            let help = did_you_mean(name, known.iter().copied(), || REMOVE.into());
            self.tally.add(Severity::Warning, &format!("<{element} {name}>"), a.range().into(), message, help);
        }
    }

    /// Value and place of an attribute.
    pub fn attribute<'x>(&self, node: Node<'x, '_>, name: &str) -> Option<Spanned<&'x str>> {
        let a = node.attributes().find(|a| a.namespace().is_none() && a.name() == name)?;
        Some(Spanned::new(a.value(), a.range_value()))
    }

    /// Value and place of an attribute that has to be there and not be blank; `whose` begins the message.
    pub fn required<'x>(&mut self, node: Node<'x, '_>, name: &str, whose: &str) -> Option<Spanned<&'x str>> {
        let element = node.tag_name().name();
        let help = format!("write `<{element} {name}=\"...\">`");
        match self.attribute(node, name) {
            Some(value) if value.value.trim().is_empty() => {
                self.findings.error(value.span, format!("{whose}attribute `{name}` of `{element}` is empty"), help);
                None
            }
            None => {
                self.findings.error(place(node), format!("{whose}`{element}` has no attribute `{name}`"), help);
                None
            }
            found => found,
        }
    }

    /// A finite number; `None` where the attribute is absent.
    pub fn number(&mut self, node: Node, name: &str, whose: &str) -> Option<RawNumber> {
        let text = self.attribute(node, name)?;
        let what = format!("{whose}`{name}` of `{}`", node.tag_name().name());
        Some(self.parse_number(text.value, text.span, &what))
    }

    /// Three finite numbers, separated by blanks; `None` where the attribute is absent.
    pub fn vec3(&mut self, node: Node, name: &str, whose: &str) -> Option<RawVec3> {
        let text = self.attribute(node, name)?;
        let what = format!("{whose}`{name}` of `{}`", node.tag_name().name());
        let words: Vec<&str> = text.value.split_whitespace().collect();
        let Ok(words) = <[&str; 3]>::try_from(words.as_slice()) else {
            let help = match () {
                _ if is_macro(text.value) => XACRO,
                _ if text.value.contains([',', ';']) => "separate the numbers by blanks: `0 0 0.1`",
                _ => "give three numbers separated by blanks: `0 0 0.1`",
            };
            let message = match words.len() {
                0 => format!("{what} is empty: three numbers are expected"),
                _ => format!("{what} is {}: three numbers are expected", quote(text.value)),
            };
            self.findings.error(text.span, message, help);
            let invalid = Spanned::new(RawValue::Invalid, text.span);
            return Some(Spanned::new([invalid.clone(), invalid.clone(), invalid], text.span));
        };
        Some(Spanned::new(words.map(|word| self.parse_number(word, text.span, &what)), text.span))
    }

    /// A finite number, as `what` in findings.
    pub fn parse_number(&mut self, text: &str, span: Span, what: &str) -> RawNumber {
        let word = text.trim();
        let (message, help) = match word.parse::<f64>() {
            Ok(x) if x.is_finite() => return Spanned::new(RawValue::Const(x), span),
            // Also numbers such as 1e999, which are read as infinity.
            Ok(_) => (format!("{what} is {}: not a finite number", quote(word)), "give a finite number"),
            Err(_) if word.is_empty() => {
                (format!("{what} is empty: a number is expected"), "give a number, or remove it")
            }
            Err(_) => {
                let help = match () {
                    _ if is_macro(word) => XACRO,
                    _ if word.contains(',') => "write a point, not a comma, before the decimals",
                    _ => "write a number such as `0.5` or `1e-3`, in SI units and without the unit",
                };
                (format!("{what} is {}: not a number", quote(word)), help)
            }
        };
        self.findings.error(span, message, help);
        Spanned::new(RawValue::Invalid, span)
    }
}

fn is_macro(text: &str) -> bool {
    text.contains("${") || text.contains("$(")
}

const REMOVE: &str = "remove it if the motion does not depend on it";
const XACRO: &str = "this looks like a xacro file: expand it with `xacro` and read the result";

/// What is wrong with the XML of a file whose outermost element is called `root`, where, and what to do.
pub(crate) fn syntax_error(error: &Error, text: &str, root: &str) -> (Span, String, String) {
    let p = error.pos();
    let at = offset(text, p.row as usize, p.col as usize);
    let here = Span::new(at, at + 1);
    let end = Span::new(text.trim_end().len(), text.len() + 1);
    let (span, message, help) = match error {
        Error::UnexpectedCloseTag(open, close, _) => (
            here,
            format!("{} where {} is expected", quote(&format!("</{close}>")), quote(&format!("</{open}>"))),
            format!("close {} first, or remove {}", quote(open), quote(&format!("</{close}>"))),
        ),
        Error::UnclosedRootNode | Error::UnexpectedEndOfStream => {
            (end, "the file ends inside an element".into(), "close every element; is the file complete?".into())
        }
        Error::NoRootNode => (Span::FILE, format!("there is no `{root}` in this file"), "is the file complete?".into()),
        Error::DtdDetected => {
            let at = text.find("<!DOCTYPE").unwrap_or(0);
            let help = "remove `<!DOCTYPE ...>` and write out the entities it defines";
            (Span::new(at, at + 1), "document types and their entities are not read".into(), help.into())
        }
        Error::UnknownNamespace(prefix, _) => (
            here,
            format!("prefix {} is not declared", quote(&format!("{prefix}:"))),
            format!("declare it with `xmlns:...` in `{root}`; if this is a xacro file, expand it with `xacro`"),
        ),
        Error::DuplicatedAttribute(name, _) => {
            (here, format!("second attribute {}", quote(name)), "keep one of them".into())
        }
        Error::InvalidAttributeValue(_) | Error::InvalidChar(b'"' | b'\'', b'<', _) => (
            here,
            "`<` inside an attribute".into(),
            "is a closing quote missing before it? otherwise write `&lt;`".into(),
        ),
        Error::UnknownEntityReference(name, _) => {
            (here, format!("unknown entity {}", quote(&format!("&{name};"))), "write `&amp;` for a plain `&`".into())
        }
        Error::MalformedEntityReference(_) => {
            (here, "`&` begins no entity".into(), "write `&amp;` for a plain `&`".into())
        }
        Error::InvalidComment(_) => {
            (here, "`--` inside a comment".into(), "remove it; comments cannot be nested".into())
        }
        other => {
            let said = other.to_string();
            let said = said.strip_suffix(&format!(" at {p}")).unwrap_or(&said);
            (here, format!("not XML: {said}"), "mend the XML at this place".into())
        }
    };
    (span, message, help)
}

/// Byte offset of a row and a column in characters, both from 1.
fn offset(text: &str, row: usize, column: usize) -> usize {
    let start = text.match_indices('\n').map(|(k, _)| k + 1).nth(row.wrapping_sub(2));
    let start = if row < 2 { 0 } else { start.unwrap_or(text.len()) };
    text[start..].char_indices().nth(column.saturating_sub(1)).map_or(text.len(), |(k, _)| start + k)
}
