//! Sets of modes of contacts for which code is generated.

use mbd_runtime::contact::Mode;

use crate::error::GenerateError;
use crate::model::{ConstraintKind, Model};
use crate::output::Output;

/// Largest number of sets of modes that all get functions of their own.
pub const MOST_SETS: usize = 32;

/// The outputs that have functions of their own for each set of modes: those that every step of an integration calls
/// several times.
pub const OF_EACH_SET: [Output; 3] = [Output::Rates, Output::ProjectMomenta, Output::Multipliers];

/// The modes of contacts for which code is made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ModeChoice {
    /// One function for all modes: every row is computed, and numbers say which act.
    Masked,
    /// Functions that are put together from pieces, of limbs in their modes and of the trunk for each sequence of limbs
    /// that touch; needs the feature `factored`.
    #[cfg(feature = "factored")]
    Factored,
    /// Beside it, functions for some sets of modes, each of which has one mode for each contact of the model.
    Listed(Vec<Vec<Mode>>),
    /// Beside it, functions for all sets of modes, of which there are at most [`MOST_SETS`].
    All,
}

impl ModeChoice {
    /// The sets of modes that get functions of their own, each of them once.
    ///
    /// # Errors
    /// A model without contacts, a set with another number of modes than the model has contacts, too many sets.
    pub fn sets(&self, model: &Model) -> Result<Vec<Vec<Mode>>, GenerateError> {
        if model.contacts.is_empty() {
            return Err(GenerateError::ModesNeedContacts { model: model.name.clone() });
        }
        match self {
            ModeChoice::Masked => Ok(Vec::new()),
            #[cfg(feature = "factored")]
            ModeChoice::Factored => Ok(Vec::new()),
            ModeChoice::Listed(sets) => {
                let mut distinct: Vec<Vec<Mode>> = Vec::new();
                for set in sets {
                    if set.len() != model.contacts.len() {
                        let (contacts, modes) = (model.contacts.len(), set.len());
                        return Err(GenerateError::NumberOfModes { contacts, modes });
                    }
                    if !distinct.contains(set) {
                        distinct.push(set.clone());
                    }
                }
                Ok(distinct)
            }
            ModeChoice::All => all(model),
        }
    }
}

/// The modes that a contact can have.
pub(crate) fn modes_of(kind: &ConstraintKind, friction: f64) -> &'static [Mode] {
    match kind {
        ConstraintKind::Loop { .. } if friction > 0.0 => &[Mode::Open, Mode::Slide, Mode::Stick],
        _ => &[Mode::Open, Mode::Slide],
    }
}

/// All sets of modes; those with fewer closed contacts in front.
fn all(model: &Model) -> Result<Vec<Vec<Mode>>, GenerateError> {
    let each: Vec<&[Mode]> = model.contacts.iter().map(|c| modes_of(&c.kind, c.friction)).collect();
    let count = each.iter().try_fold(1_usize, |n, modes| n.checked_mul(modes.len())).unwrap_or(usize::MAX);
    if count > MOST_SETS {
        return Err(GenerateError::TooManyModes { sets: count, most: MOST_SETS });
    }
    let mut sets = vec![Vec::new()];
    for modes in each {
        sets = sets.iter().flat_map(|set: &Vec<Mode>| modes.iter().map(|m| [&set[..], &[*m]].concat())).collect();
    }
    sets.sort_by_key(|set| set.iter().filter(|mode| **mode != Mode::Open).count());
    Ok(sets)
}

/// Word of a mode in files and messages.
pub fn word(mode: Mode) -> &'static str {
    match mode {
        Mode::Open => "open",
        Mode::Slide => "slide",
        Mode::Stick => "stick",
    }
}

/// A set of modes as it is written: `open stick`.
pub fn words(set: &[Mode]) -> String {
    set.iter().map(|mode| word(*mode)).collect::<Vec<_>>().join(" ")
}

/// Reads sets of modes: a set on each line, a word (`open`, `slide`, `stick`) for each contact in the order of the
/// model. What follows `#` is a comment.
///
/// # Errors
/// All lines that cannot be read: number of the line, from 1, and what is wrong with it.
pub fn parse(text: &str, model: &Model) -> Result<Vec<Vec<Mode>>, Vec<(usize, String)>> {
    let (mut sets, mut errors) = (Vec::new(), Vec::new());
    for (k, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        let words: Vec<&str> = line.split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        let mode = |w: &&str| [Mode::Open, Mode::Slide, Mode::Stick].into_iter().find(|mode| word(*mode) == *w);
        let set: Vec<Mode> = words.iter().filter_map(mode).collect();
        if set.len() != words.len() {
            let unknown = words.iter().find(|w| mode(w).is_none()).copied().unwrap_or_default();
            errors.push((k + 1, format!("`{unknown}` is no mode of a contact: they are `open`, `slide` and `stick`")));
        } else if set.len() != model.contacts.len() {
            let (given, contacts) = (set.len(), model.contacts.len());
            errors
                .push((k + 1, format!("`{}` has {contacts} contacts, and the modes of {given} are given", model.name)));
        } else {
            sets.push(set);
        }
    }
    if errors.is_empty() {
        Ok(sets)
    } else {
        Err(errors)
    }
}

/// The text of a file of sets of modes that a motion has visited, the one it was in longest in front. `visits` has the
/// time that it spent in each, s.
pub fn text(model: &Model, visits: &[(Vec<Mode>, f64)]) -> String {
    let all: f64 = visits.iter().map(|(_, time)| time).sum();
    let names: Vec<&str> = model.contacts.iter().map(|c| c.name.as_str()).collect();
    let mut sorted: Vec<&(Vec<Mode>, f64)> = visits.iter().collect();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut out = format!("# Sets of modes of the contacts of `{}` that a motion has visited.\n", model.name);
    out += &format!("# Contacts: {}\n", names.join(", "));
    for (set, time) in sorted {
        let share = if all > 0.0 { 100.0 * time / all } else { 0.0 };
        out += &format!("{} # {share:.2} % of the time\n", words(set));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::{self, ImportOptions};

    fn scene() -> Model {
        let text = include_str!("../../models/contacts/quadruped.toml");
        read::model("quadruped.toml", text, &ImportOptions::default()).expect("a model").model
    }

    #[test]
    fn what_is_written_is_read() {
        let model = scene();
        let n = model.contacts.len();
        let mut sets = vec![vec![Mode::Open; n], vec![Mode::Stick; n]];
        sets[1][0] = Mode::Slide;
        let visits: Vec<(Vec<Mode>, f64)> = sets.iter().cloned().zip([1.0, 3.0]).collect();
        let written = text(&model, &visits);
        assert!(written.contains("# 75.00 % of the time"), "{written}");
        sets.reverse();
        assert_eq!(parse(&written, &model), Ok(sets));
    }

    #[test]
    fn all_wrong_lines_are_told() {
        let model = scene();
        let errors = parse("open\n\nopen stuck # no\n", &model).expect_err("two errors");
        assert_eq!(errors.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [1, 3]);
        assert!(errors[1].1.contains("`stuck`"), "{errors:?}");
    }

    #[test]
    fn all_sets_of_a_quadruped_are_too_many() {
        let model = scene();
        assert!(matches!(ModeChoice::All.sets(&model), Err(GenerateError::TooManyModes { .. })));
        let chain = include_str!("../../models/contacts/chain_on_floor.toml");
        let chain = read::model("chain.toml", chain, &ImportOptions::default()).expect("a model").model;
        let error = ModeChoice::All.sets(&chain).expect_err("more than 2^64").to_string();
        assert!(error.contains("more sets of modes than can be counted"), "{error}");
        let hopper = include_str!("../../models/contacts/hopper.toml");
        let hopper = read::model("hopper.toml", hopper, &ImportOptions::default()).expect("a model").model;
        let sets = ModeChoice::All.sets(&hopper).expect("few");
        assert!(sets[0].iter().all(|m| *m == Mode::Open) && sets.len() > 1, "{sets:?}");
        let short = ModeChoice::Listed(vec![vec![Mode::Open; hopper.contacts.len() + 1]]);
        assert!(matches!(short.sets(&hopper), Err(GenerateError::NumberOfModes { .. })));
    }
}
