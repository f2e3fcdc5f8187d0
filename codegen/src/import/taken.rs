//! Names that a reader gives to what its format does not name, or names in a way that cannot stay.

use std::collections::{HashMap, HashSet};

use crate::names::identifier;

/// As many contacts as a shape other than a hull has with a plane: the corners of a box.
pub(crate) const CORNERS: usize = 8;

/// The names of one family that were given.
#[derive(Default)]
pub(crate) struct Taken {
    identifiers: HashSet<String>,
    /// The last number behind a name.
    last: HashMap<String, usize>,
}

impl Taken {
    /// The name of a shape: `wanted`, with a number where an identifier that it becomes is taken: its own, or one of its
    /// `contacts` with a plane, which are numbered.
    pub(crate) fn shape(&mut self, wanted: &str, contacts: usize) -> String {
        self.numbered(wanted, "_shape_", contacts)
    }

    /// The name of what becomes as many numbered contacts: `wanted`, with `separator` and a number where an identifier that
    /// it becomes is taken.
    pub(crate) fn numbered(&mut self, wanted: &str, separator: &str, contacts: usize) -> String {
        let identifiers = |name: &str| {
            let own = identifier(name);
            (1..=contacts).map(|k| format!("{own}_{k}")).chain([own.clone()]).collect()
        };
        self.free(wanted, separator, identifiers)
    }

    /// A name that becomes one identifier: `wanted`, with `separator` and a number where that is taken.
    pub(crate) fn name(&mut self, wanted: &str, separator: &str) -> String {
        self.free(wanted, separator, |name| vec![identifier(name)])
    }

    fn free(&mut self, wanted: &str, separator: &str, identifiers: impl Fn(&str) -> Vec<String>) -> String {
        let mut name = wanted.to_string();
        let mut all = identifiers(&name);
        while all.iter().any(|one| self.identifiers.contains(one)) {
            let last = self.last.entry(wanted.to_string()).or_insert(1);
            *last += 1;
            name = format!("{wanted}{separator}{last}");
            all = identifiers(&name);
        }
        self.identifiers.extend(all);
        name
    }
}
