//! Parsers of argument values.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use multibody::codegen::words;
use multibody::codegen::Output;
use multibody::runtime::catalogue;
use multibody::runtime::constrained::Stabilisation;

use super::generate::{OutputList, DEFAULT_RUNTIME};

/// Parser of an option whose values the library lists.
macro_rules! choice {
    ($choice:ty) => {
        $crate::args::values::one_of(<$choice>::ALL.map(|c| (c, c.name(), c.meaning())))
    };
}

pub(super) use choice;

/// Parses a finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    let x: f64 = text.trim().parse().map_err(|_| format!("`{text}` is not a number"))?;
    if x.is_finite() {
        Ok(x)
    } else {
        Err("the number must be finite".to_string())
    }
}

/// Parses a positive number.
pub fn positive(text: &str) -> Result<f64, String> {
    let x = finite(text)?;
    if x > 0.0 {
        Ok(x)
    } else {
        Err("the number must be positive".to_string())
    }
}

/// Parses a number that is not negative.
pub fn not_negative(text: &str) -> Result<f64, String> {
    let x = finite(text)?;
    if x >= 0.0 {
        Ok(x)
    } else {
        Err("the number must not be negative".to_string())
    }
}

/// Parses a whole number from 1 on.
pub fn whole(text: &str) -> Result<u64, String> {
    match text.trim().parse::<u64>() {
        Ok(n) if n > 0 => Ok(n),
        _ => Err("the number must be whole and positive".to_string()),
    }
}

/// Parses the name of a method.
pub fn methods() -> PossibleValuesParser {
    PossibleValuesParser::new(catalogue::entries().map(|e| PossibleValue::new(e.name).help(e.title)))
}

/// Parses one of several values, each given with its word and its meaning.
pub fn one_of<T: Copy + Send + Sync + 'static>(
    choices: impl IntoIterator<Item = (T, &'static str, &'static str)>,
) -> impl TypedValueParser<Value = T> {
    let choices: Vec<_> = choices.into_iter().collect();
    let words = choices.iter().map(|&(_, word, meaning)| PossibleValue::new(word).help(meaning));
    // The parser accepts words of the list only.
    PossibleValuesParser::new(words)
        .map(move |given| choices.iter().find(|(_, word, _)| *word == given).expect("a word of the list").0)
}

/// How loops are kept closed: by the value of `--hold`, and its help.
pub const HOLD: [(Stabilisation, &str, &str); 5] = [
    (Stabilisation::None, "none", "Not at all: multipliers accumulate in the momenta, positions drift"),
    (
        Stabilisation::Momenta,
        "momenta",
        "Momenta are projected after every step; positions drift by the error of the method",
    ),
    (
        Stabilisation::Mass,
        "mass",
        "Positions are corrected after every step too, by the displacement that is least in the metric of the mass matrix",
    ),
    (Stabilisation::Gradient, "gradient", "The same, by displacements of least norm"),
    (Stabilisation::Partition, "partition", "The same, by displacements of dependent coordinates alone"),
];

/// Parses a small angle, rad. Snapping by more than some degrees would change the mechanism.
pub fn snap(text: &str) -> Result<f64, String> {
    let x = finite(text)?;
    if (0.0..=0.1).contains(&x) {
        Ok(x)
    } else {
        Err("the angle must lie between 0 and 0.1 rad".to_string())
    }
}

/// Parses three numbers separated by commas.
pub fn vector(text: &str) -> Result<[f64; 3], String> {
    let numbers = text.split(',').map(finite).collect::<Result<Vec<f64>, String>>()?;
    numbers.try_into().map_err(|n: Vec<f64>| format!("{} number(s) where x,y,z are expected", n.len()))
}

/// An output by its name, or all of them.
pub fn outputs(text: &str) -> Result<OutputList, String> {
    if text == "all" {
        return Ok(OutputList(Output::available(false).collect()));
    }
    let names = || Output::ALL.iter().map(|output| output.name()).chain(["all"]);
    let unknown = || words::did_you_mean(text, names(), || format!("outputs are {}", words::list(names())));
    Output::from_name(text).map(|g| OutputList(vec![g])).ok_or_else(unknown)
}

/// Parses a path of Rust, such as `::multibody::runtime`.
pub fn rust_path(text: &str) -> Result<String, String> {
    let word = |w: &str| {
        w.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && w.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    match text.trim_start_matches("::").split("::").all(word) {
        true => Ok(text.to_string()),
        false => Err(format!("not a path of Rust such as `{DEFAULT_RUNTIME}`")),
    }
}

/// Parses a name that is valid for a type.
pub fn type_name(text: &str) -> Result<String, String> {
    let word = text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if word && text.starts_with(|c: char| c.is_ascii_uppercase()) && text != "Self" {
        Ok(text.to_string())
    } else {
        Err("a type is named with letters, digits and `_`, an upper-case letter first".to_string())
    }
}
