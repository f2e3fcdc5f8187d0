//! `type = ".."` of joints and loops.

use super::super::source::{Findings, Spanned};
use super::super::words::{did_you_mean, quote};
use super::table::Table;
use crate::model::Words;

/// The kind that `type` names, among `all`. `special` gives the help for words in lower case that belong to none of
/// them.
pub(super) fn kind<T>(
    table: &Table,
    all: &'static [T],
    words: fn(&T) -> &Words,
    special: impl Fn(&str) -> Option<String>,
    findings: &mut Findings,
) -> Option<Spanned<&'static T>> {
    let names = || all.iter().map(|kind| words(kind).word);
    let list = || names().map(quote).collect::<Vec<_>>();
    if !table.has("type") {
        let (first, others) = (words(&all[0]).word, &list()[1..]);
        table.missing("type", &format!("`type = \"{first}\"`, or one of {}", others.join(", ")), findings);
    }
    let text = table.text("type", findings)?;
    if let Some(kind) = all.iter().find(|kind| words(kind).are_read(&text.value)) {
        return Some(Spanned::new(kind, text.span));
    }
    let lower = text.value.to_lowercase();
    let meant = all.iter().map(words).find(|words| words.mean(&lower));
    let help = meant.map(|words| format!("it is called `{}` here", words.word)).or_else(|| special(&lower));
    let otherwise = || did_you_mean(&text.value, names(), || format!("the types are {}", list().join(", ")));
    let message = format!("{}unknown type {}", table.prefix(), quote(&text.value));
    findings.error(text.span, message, help.unwrap_or_else(otherwise));
    None
}
