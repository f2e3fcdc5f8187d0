//! Names, texts and numbers as C.

use crate::emit::numbers::signed;
use crate::options::Precision;

/// What the names of a file start with: functions and types in lower case, macros in upper case.
pub struct Prefix {
    /// `double_pendulum`
    pub lower: String,
    /// `DOUBLE_PENDULUM`
    pub upper: String,
}

impl Prefix {
    /// That of a type of Rust: `DoublePendulum` becomes `double_pendulum`.
    pub fn new(type_name: &str) -> Prefix {
        let mut lower = String::new();
        let letters: Vec<char> = type_name.chars().collect();
        for (k, c) in letters.iter().enumerate() {
            let before = k.checked_sub(1).map(|k| letters[k]);
            let starts_word = c.is_ascii_uppercase()
                && before.is_some_and(|b| {
                    let next_is_lower = letters.get(k + 1).is_some_and(char::is_ascii_lowercase);
                    b.is_ascii_lowercase() || b.is_ascii_digit() || (b.is_ascii_uppercase() && next_is_lower)
                });
            if starts_word {
                lower.push('_');
            }
            lower.push(c.to_ascii_lowercase());
        }
        Prefix { upper: lower.to_ascii_uppercase(), lower }
    }
}

/// A text inside a comment: nothing in it ends the comment, or looks as if it did.
pub fn comment(text: &str) -> String {
    text.replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?").replace('\\', "/")
}

/// A text as a string literal.
pub fn quoted(text: &str) -> String {
    let escaped = text.chars().map(|c| match c {
        // Two question marks may start a trigraph.
        '"' | '\\' | '?' => format!("\\{c}"),
        c if c.is_control() => c.to_string().bytes().map(|byte| format!("\\{byte:03o}")).collect(),
        c => c.to_string(),
    });
    format!("\"{}\"", escaped.collect::<String>())
}

/// The type of numbers.
pub fn number(precision: Precision) -> &'static str {
    match precision {
        Precision::F64 => "double",
        Precision::F32 => "float",
    }
}

/// A constant with its sign.
pub fn literal(x: f64, precision: Precision) -> String {
    let suffix = match precision {
        Precision::F64 => "",
        Precision::F32 => "f",
    };
    signed(x, precision) + suffix
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn type_names_become_snake_case() {
        for (name, prefix) in [
            ("Ur5", "ur5"),
            ("DoublePendulum", "double_pendulum"),
            ("Chain10Planar", "chain10_planar"),
            ("URDFArm", "urdf_arm"),
            ("Arm_2", "arm_2"),
        ] {
            assert_eq!(Prefix::new(name).lower, prefix);
        }
    }

    #[test]
    fn texts_stay_inside_comments_and_strings() {
        assert_eq!(comment("a*/b/*c??/\\"), "a* /b/ *c? ?//");
        assert_eq!(quoted("a\"b\\c\n??="), "\"a\\\"b\\\\c\\012\\?\\?=\"");
    }
}
