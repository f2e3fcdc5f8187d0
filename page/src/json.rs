//! Texts for JavaScript.

use std::fmt::Write as _;

/// A text in quotes.
pub fn text(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c < ' ' => drop(write!(out, "\\u{:04x}", c as u32)),
            c => out.push(c),
        }
    }
    out + "\""
}

/// A number; what is none is `null`.
pub fn number(x: f64) -> String {
    match x.is_finite() {
        true => format!("{x:?}"),
        false => "null".into(),
    }
}

/// A list of what is JSON already.
pub fn list(items: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", items.into_iter().collect::<Vec<_>>().join(","))
}

/// A list of numbers.
pub fn numbers(items: impl IntoIterator<Item = f64>) -> String {
    list(items.into_iter().map(number))
}

/// An object of what is JSON already.
pub fn object(entries: &[(&str, String)]) -> String {
    let entries = entries.iter().map(|(key, value)| format!("{}:{value}", text(key)));
    format!("{{{}}}", entries.collect::<Vec<_>>().join(","))
}
