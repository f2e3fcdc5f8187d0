//! A TOML table that reports what is missing, unknown or of the wrong type.

use ::toml::de::{DeString, DeTable, DeValue};

use super::super::source::{Findings, Span, Spanned};
use super::super::words::{did_you_mean, list, quote};

/// A table, its place, and its name in messages (empty for the document itself).
pub(super) struct Table<'t> {
    table: &'t DeTable<'t>,
    pub(super) span: Span,
    pub(super) what: String,
}

/// Name of a value in a message.
pub(super) fn type_name(value: &DeValue) -> &'static str {
    match value {
        DeValue::String(_) => "text",
        DeValue::Integer(_) | DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

impl<'t> Table<'t> {
    pub(super) fn new(table: &'t DeTable<'t>, span: Span, what: String) -> Self {
        Table { table, span, what }
    }

    /// `what: ` in front of a message.
    pub(super) fn prefix(&self) -> String {
        if self.what.is_empty() {
            String::new()
        } else {
            format!("{}: ", self.what)
        }
    }

    pub(super) fn entries(
        &self,
    ) -> impl Iterator<Item = (Spanned<&'t DeString<'t>>, &'t ::toml::Spanned<DeValue<'t>>)> {
        self.table.iter().map(|(k, v)| (Spanned::new(k.get_ref(), k.span()), v))
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    pub(super) fn get(&self, key: &str) -> Option<(Span, &'t DeValue<'t>)> {
        self.table.get(key).map(|v| (v.span().into(), v.get_ref()))
    }

    /// Place of a key.
    pub(super) fn key_span(&self, key: &str) -> Span {
        self.table.get_key_value(key).map_or(self.span, |(k, _)| k.span().into())
    }

    /// Reports every key that is not in `keys` and says whether there was none; `kind` as in "a joint".
    pub(super) fn reject_unknown(&self, keys: &[&str], kind: &str, findings: &mut Findings) -> bool {
        let mut all_known = true;
        for (key, _) in self.entries() {
            if !keys.contains(&key.value.as_ref()) {
                let message = format!("{}unknown key {}", self.prefix(), quote(key.value));
                let help = did_you_mean(key.value, keys.iter().copied(), || {
                    format!("the keys of {kind} are {}", keys.iter().map(|k| quote(k)).collect::<Vec<_>>().join(", "))
                });
                findings.error(key.span, message, help);
                all_known = false;
            }
        }
        all_known
    }

    /// Reports a missing key.
    pub(super) fn missing(&self, key: &str, example: &str, findings: &mut Findings) {
        findings.error(self.span, format!("{}`{key}` is missing", self.prefix()), format!("add {example}"));
    }

    /// Reports a value of the wrong type.
    pub(super) fn wrong_type(&self, key: &str, wanted: &str, example: &str, findings: &mut Findings) {
        if let Some((span, value)) = self.get(key) {
            let message = format!("{}`{key}` must be {wanted}, not {}", self.prefix(), type_name(value));
            findings.error(span, message, format!("write {example}"));
        }
    }

    /// Text, if the key exists and is text.
    pub(super) fn text(&self, key: &str, findings: &mut Findings) -> Option<Spanned<String>> {
        match self.get(key)? {
            (span, DeValue::String(s)) => Some(Spanned::new(s.to_string(), span)),
            _ => {
                self.wrong_type(key, "text", &format!("`{key} = \"...\"`"), findings);
                None
            }
        }
    }

    /// Text that is required.
    pub(super) fn required_text(&self, key: &str, findings: &mut Findings) -> Option<Spanned<String>> {
        if !self.has(key) {
            self.missing(key, &format!("`{key} = \"...\"`"), findings);
        }
        self.text(key, findings)
    }

    /// Text that is one of `words`: its index.
    pub(super) fn choice(&self, key: &str, words: &[&str], findings: &mut Findings) -> Option<Spanned<usize>> {
        let text = self.text(key, findings)?;
        let found = words.iter().position(|w| *w == text.value);
        if found.is_none() {
            let help = did_you_mean(&text.value, words.iter().copied(), || format!("it can be {}", list_or(words)));
            findings.error(text.span, format!("{}`{key}` cannot be {}", self.prefix(), quote(&text.value)), help);
        }
        found.map(|k| Spanned::new(k, text.span))
    }

    /// A list of texts, if the key exists and is one; `example` is what to write.
    pub(super) fn texts(
        &self,
        key: &str,
        example: &str,
        findings: &mut Findings,
    ) -> Option<Spanned<Vec<Spanned<String>>>> {
        let (span, value) = self.get(key)?;
        let DeValue::Array(items) = value else {
            self.wrong_type(key, "a list of names", example, findings);
            return None;
        };
        let mut texts = Vec::new();
        for (k, item) in items.iter().enumerate() {
            if let DeValue::String(s) = item.get_ref() {
                texts.push(Spanned::new(s.to_string(), item.span()));
            } else {
                let what = format!("item {} is {}", k + 1, type_name(item.get_ref()));
                let message = format!("{}`{key}` must be a list of names, but {what}", self.prefix());
                findings.error(item.span().into(), message, format!("write {example}"));
            }
        }
        (texts.len() == items.len()).then(|| Spanned::new(texts, span))
    }

    /// A boolean, if the key exists and is one.
    pub(super) fn flag(&self, key: &str, findings: &mut Findings) -> Option<Spanned<bool>> {
        match self.get(key)? {
            (span, DeValue::Boolean(yes)) => Some(Spanned::new(*yes, span)),
            _ => {
                self.wrong_type(key, "true or false", &format!("`{key} = true`, without quotes"), findings);
                None
            }
        }
    }

    /// A table under a key.
    pub(super) fn table(&self, key: &str, findings: &mut Findings) -> Option<Table<'t>> {
        match self.get(key)? {
            (span, DeValue::Table(t)) => Some(Table::new(t, span, format!("{}`{key}`", self.prefix()))),
            _ => {
                self.wrong_type(key, "a table", &format!("`{key} = {{ ... }}`"), findings);
                None
            }
        }
    }

    /// The tables of `[[key]]`, each named by its `name`, or else counted.
    pub(super) fn tables(&self, key: &str, findings: &mut Findings) -> Vec<Table<'t>> {
        let help = format!("write `[[{key}]]`, with double brackets, in front of each");
        let items = match self.get(key) {
            None => return Vec::new(),
            Some((_, DeValue::Array(items))) => items,
            Some((span, value)) => {
                let message = format!("`{key}` must be a list of tables, not {}", type_name(value));
                findings.error(span, message, help);
                return Vec::new();
            }
        };
        let mut tables = Vec::new();
        for (k, item) in items.iter().enumerate() {
            if let DeValue::Table(t) = item.get_ref() {
                let what = match t.get("name").map(|n| n.get_ref()) {
                    Some(DeValue::String(name)) => format!("{key} {}", quote(name)),
                    _ => format!("{key} {}", k + 1),
                };
                tables.push(Table::new(t, item.span().into(), what));
            } else {
                let message =
                    format!("`{key}` must be a list of tables, but item {} is {}", k + 1, type_name(item.get_ref()));
                findings.error(item.span().into(), message, help.clone());
            }
        }
        tables
    }

    /// The entry under a key, unchanged.
    pub(super) fn raw(&self, key: &str) -> Option<&'t ::toml::Spanned<DeValue<'t>>> {
        self.table.get(key)
    }
}

fn list_or(words: &[&str]) -> String {
    list(words.iter().copied()).replace(" and ", " or ")
}
