//! Elements with the defaults that hold for them, and the values of their attributes.

use std::ops::RangeInclusive;

use crate::diag::Severity;
use crate::import::raw::RawValue;
use crate::import::source::Spanned;
use crate::import::words::{did_you_mean, list, quote};
use crate::import::xml::Reader;
use roxmltree::Node;

/// An element, and elements that state the attributes which it does not.
#[derive(Clone)]
pub(super) struct Element<'d> {
    /// The element itself.
    pub node: Node<'d, 'd>,
    /// Its defaults, those of the nearest class first.
    defaults: Vec<Node<'d, 'd>>,
}

impl<'d> Element<'d> {
    /// An element with defaults, the nearest first.
    pub fn new(node: Node<'d, 'd>, defaults: Vec<Node<'d, 'd>>) -> Self {
        Element { node, defaults }
    }

    /// An element that has no defaults.
    pub fn plain(node: Node<'d, 'd>) -> Self {
        Element { node, defaults: Vec::new() }
    }

    fn levels(&self) -> impl DoubleEndedIterator<Item = Node<'d, 'd>> + '_ {
        std::iter::once(self.node).chain(self.defaults.iter().copied())
    }

    /// An attribute: its own, or that of the nearest class.
    pub fn attribute(&self, name: &str) -> Option<Spanned<&'d str>> {
        self.levels().find_map(|node| attribute(node, name))
    }

    /// Every statement of an attribute, its own first.
    pub fn statements<'s>(&'s self, name: &'s str) -> impl DoubleEndedIterator<Item = Spanned<&'d str>> + 's {
        self.levels().filter_map(move |node| attribute(node, name))
    }

    /// Which of these attributes stands nearest.
    pub fn nearest(&self, names: &[&'static str]) -> Option<&'static str> {
        self.levels().find_map(|node| names.iter().copied().find(|name| attribute(node, name).is_some()))
    }

    /// Names and places of those attributes that stand at the element itself.
    pub fn own(&self, names: &[&'static str]) -> Vec<Spanned<&'static str>> {
        let own = names.iter().filter_map(|name| Some(Spanned::new(*name, attribute(self.node, name)?.span)));
        own.collect()
    }

    /// Name of the element, if it has one that is not blank.
    pub fn name(&self) -> Option<Spanned<&'d str>> {
        attribute(self.node, "name").filter(|name| !name.value.trim().is_empty())
    }
}

/// Value and place of an attribute of an element itself.
pub(super) fn attribute<'d>(node: Node<'d, 'd>, name: &str) -> Option<Spanned<&'d str>> {
    let a = node.attributes().find(|a| a.namespace().is_none() && a.name() == name)?;
    Some(Spanned::new(a.value(), a.range_value()))
}

/// Finite numbers under a key; `None` where there are none, or something was reported.
pub(super) fn numbers(
    reader: &mut Reader,
    element: &Element,
    name: &str,
    count: RangeInclusive<usize>,
    whose: &str,
) -> Option<Spanned<Vec<f64>>> {
    let text = element.attribute(name)?;
    parsed(reader, &text, name, count, whose)
}

/// The numbers of an attribute.
pub(super) fn parsed(
    reader: &mut Reader,
    text: &Spanned<&str>,
    name: &str,
    count: RangeInclusive<usize>,
    whose: &str,
) -> Option<Spanned<Vec<f64>>> {
    let words: Vec<&str> = text.value.split_whitespace().collect();
    if !count.contains(&words.len()) {
        let wanted = match (*count.start(), *count.end()) {
            (1, 1) => "one number".into(),
            (a, b) if a == b => format!("{a} numbers"),
            (a, b) => format!("{a} to {b} numbers"),
        };
        let message = format!("{whose}`{name}` has {} and needs {wanted}", words.len());
        reader.findings.error(text.span, message, "separate the numbers by blanks: `0 0 0.1`");
        return None;
    }
    let what = format!("{whose}`{name}`");
    let mut values = Vec::with_capacity(words.len());
    for word in words {
        match reader.parse_number(word, text.span, &what).value {
            RawValue::Const(x) => values.push(x),
            _ => return None,
        }
    }
    Some(Spanned::new(values, text.span))
}

/// Three finite numbers.
pub(super) fn vec3(reader: &mut Reader, element: &Element, name: &str, whose: &str) -> Option<Spanned<[f64; 3]>> {
    let all = numbers(reader, element, name, 3..=3, whose)?;
    Some(Spanned::new(<[f64; 3]>::try_from(all.value).ok()?, all.span))
}

/// One finite number.
pub(super) fn number(reader: &mut Reader, element: &Element, name: &str, whose: &str) -> Option<Spanned<f64>> {
    let all = numbers(reader, element, name, 1..=1, whose)?;
    Some(Spanned::new(*all.value.first()?, all.span))
}

/// One of several words; `None` where there is none, or another one was reported.
pub(super) fn choice(
    reader: &mut Reader,
    element: &Element,
    name: &str,
    words: &'static [&'static str],
    whose: &str,
) -> Option<Spanned<&'static str>> {
    let text = element.attribute(name)?;
    if let Some(word) = words.iter().find(|word| **word == text.value) {
        return Some(Spanned::new(*word, text.span));
    }
    let help =
        did_you_mean(text.value, words.iter().copied(), || format!("write one of {}", list(words.iter().copied())));
    choice_error(reader, &format!("{whose}`{name}`"), &text, &help);
    None
}

/// Reports a word that may not stand where it does.
pub(super) fn choice_error(reader: &mut Reader, what: &str, text: &Spanned<&str>, help: &str) {
    reader.findings.error(text.span, format!("{what} is {}", quote(text.value)), help);
}

/// `true` or `false`; `None` where there is neither.
pub(super) fn flag(reader: &mut Reader, element: &Element, name: &str, whose: &str) -> Option<bool> {
    choice(reader, element, name, &["false", "true"], whose).map(|word| word.value == "true")
}

/// Whether a range holds: where it says so, or says nothing and a range is stated that is not empty. MuJoCo refuses a range
/// without a statement if `autolimits` is off.
pub(super) fn limited(
    reader: &mut Reader,
    element: &Element,
    (key, range): (&str, &str),
    auto: bool,
    whose: &str,
) -> bool {
    let stated = choice(reader, element, key, &["false", "true", "auto"], whose).map(|word| word.value);
    match (stated, element.attribute(range)) {
        (Some("true"), _) => true,
        (Some("false"), _) | (_, None) => false,
        (_, Some(text)) if auto => {
            let ends: Vec<f64> = text.value.split_whitespace().map(|word| word.parse().unwrap_or(f64::NAN)).collect();
            // What is no range is reported where it is read.
            let [lower, upper] = ends[..] else { return true };
            if !lower.is_finite() || !upper.is_finite() {
                return true;
            }
            if lower > upper || (lower == upper && lower != 0.0) {
                let message = format!("{whose}`{range}` from {lower} to {upper} is no limit, because it is empty");
                let help = "write the lower end first, or remove it";
                reader.tally.add(Severity::Warning, &format!("empty {range}"), text.span, message, help);
            }
            lower < upper
        }
        (_, Some(text)) => {
            // Two zeros are none.
            if text.value.split_whitespace().any(|word| word.parse() != Ok(0.0)) {
                let message = format!("{whose}`{range}` without `{key}`, where `autolimits` is off");
                reader.findings.error(text.span, message, format!("write `{key}=\"true\"` or `{key}=\"false\"`"));
            }
            false
        }
    }
}
