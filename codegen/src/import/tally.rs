//! Findings that occur dozens of times in real robots: one line for each kind, at the first place, with their number.

use crate::diag::Severity;
use crate::import::source::{Findings, Span};
use std::collections::HashMap;

/// Findings grouped by kind, in the order of their first places.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    groups: Vec<Group>,
    index: HashMap<String, usize>,
}

#[derive(Debug)]
struct Group {
    severity: Severity,
    first: Span,
    count: usize,
    message: String,
    help: String,
}

impl Tally {
    /// Counts a finding of kind `key`; only the first of a kind keeps its message, help and place.
    pub fn add(
        &mut self,
        severity: Severity,
        key: &str,
        span: Span,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        match self.index.get(key) {
            Some(&k) => self.groups[k].count += 1,
            None => {
                self.index.insert(key.to_string(), self.groups.len());
                self.groups.push(Group { severity, first: span, count: 1, message: message.into(), help: help.into() });
            }
        }
    }

    /// Counts a finding whose message is its kind.
    pub fn notice(&mut self, span: Span, message: &str) {
        self.add(Severity::Notice, message, span, message, "");
    }

    /// Writes one finding per kind.
    pub fn report(self, findings: &mut Findings) {
        for g in self.groups {
            let message = match g.count {
                1 => g.message,
                n => format!("{} ({n} times, first here)", g.message),
            };
            findings.add(g.severity, g.first, message, g.help);
        }
    }
}
