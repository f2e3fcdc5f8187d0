//! Names of a model as identifiers of Rust.

/// Words that cannot be identifiers in any edition of Rust up to 2024.
const KEYWORDS: &[&str] = &[
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do", "dyn", "else",
    "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop", "macro", "match", "mod",
    "move", "mut", "override", "priv", "pub", "ref", "return", "Self", "self", "static", "struct", "super", "trait",
    "true", "try", "type", "typeof", "union", "unsafe", "unsized", "use", "virtual", "where", "while", "yield",
];

/// A name of a model as a Rust identifier, its case kept: letters and digits that are not ASCII are spelled by their
/// code points (`连杆` is `u8fde_u6746`), anything else but ASCII letters and digits turns into `_`, a leading digit gets a
/// `_` in front, a keyword one behind.
pub fn rust_name(name: &str) -> String {
    let mut out = ascii(name);
    if out.is_empty() || out.starts_with(|c: char| c.is_ascii_digit()) {
        out.insert(0, '_');
    }
    if KEYWORDS.contains(&out.as_str()) || out == "_" {
        out.push('_');
    }
    out
}

/// A name as a snake-case identifier, spelled like that of [`rust_name`].
pub fn identifier(name: &str) -> String {
    let mut out = ascii(name).to_ascii_lowercase();
    if !out.starts_with(|c: char| c.is_ascii_alphabetic()) {
        out.insert_str(0, "b_");
    }
    out
}

/// Name of a type for the name of a model: `DoublePendulum` for `double_pendulum`.
pub fn camel_case(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
    let camel: String = words.map(|w| w[..1].to_ascii_uppercase() + &w[1..]).collect();
    match camel.starts_with(|c: char| c.is_ascii_alphabetic()) && camel != "Self" {
        true => camel,
        false => format!("Model{camel}"),
    }
}

/// ASCII letters, digits and `_` for a name in any script. Tools that read C know no other letters.
fn ascii(name: &str) -> String {
    let mut out = String::new();
    let mut spelled = false;
    for c in name.chars() {
        let spell = !c.is_ascii() && c.is_alphanumeric();
        if (spell || spelled && c.is_ascii_alphanumeric()) && !out.is_empty() && !out.ends_with('_') {
            out.push('_');
        }
        match c {
            c if spell => out += &format!("u{:04x}", u32::from(c)),
            c if c.is_ascii_alphanumeric() => out.push(c),
            _ => out.push('_'),
        }
        spelled = spell;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_script_becomes_identifiers() {
        for (name, expected) in [
            ("Upper-Arm 2", "upper_arm_2"),
            ("连杆", "u8fde_u6746"),
            ("连杆1", "u8fde_u6746_1"),
            ("bras_é", "bras_u00e9"),
            ("Träger", "tr_u00e4_ger"),
            ("1st", "b_1st"),
        ] {
            assert_eq!(identifier(name), expected);
        }
        assert_eq!(rust_name("连杆"), "u8fde_u6746");
        assert_eq!(rust_name("type"), "type_");
        assert_eq!(rust_name("2nd arm"), "_2nd_arm");
    }
}
