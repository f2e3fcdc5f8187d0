//! Values of literal tokens. Only strings and numbers are needed, so a parser for all of Rust is not.

/// Text of a string literal as it stands in the source, `"..."` or `r#"..."#`; `None` for every other literal.
pub fn string(literal: &str) -> Option<String> {
    if let Some(raw) = literal.strip_prefix('r') {
        let inner = raw.trim_start_matches('#');
        let hashes = &raw[..raw.len() - inner.len()];
        return Some(inner.strip_prefix('"')?.strip_suffix(hashes)?.strip_suffix('"')?.to_string());
    }
    unescape(literal.strip_prefix('"')?.strip_suffix('"')?)
}

/// The compiler has checked the escapes already: `None` is never seen for a token.
fn unescape(text: &str) -> Option<String> {
    let mut out = String::with_capacity(text.len());
    let mut rest = text.chars();
    while let Some(c) = rest.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        match rest.next()? {
            'n' => out.push('\n'),
            'r' => out.push('\r'),
            't' => out.push('\t'),
            '0' => out.push('\0'),
            'x' => {
                let digits: String = rest.by_ref().take(2).collect();
                out.push(u8::from_str_radix(&digits, 16).ok()?.into());
            }
            'u' => {
                let digits: String = rest.by_ref().skip(1).take_while(|&c| c != '}').filter(|&c| c != '_').collect();
                out.push(u32::from_str_radix(&digits, 16).ok().and_then(char::from_u32)?);
            }
            // The line goes on after the blanks of the next.
            '\n' => {
                let after = rest.as_str().trim_start_matches([' ', '\n', '\r', '\t']);
                rest = after.chars();
            }
            other @ ('\\' | '"' | '\'') => out.push(other),
            _ => return None,
        }
    }
    Some(out)
}

/// Value of a decimal literal, with or without point, exponent, `_` and the suffixes `f64` and `f32`.
pub fn number(literal: &str) -> Option<f64> {
    let digits = literal.strip_suffix("f64").or_else(|| literal.strip_suffix("f32")).unwrap_or(literal);
    let digits: String = digits.chars().filter(|&c| c != '_').collect();
    let decimal = digits.chars().all(|c| c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E' | '+' | '-'));
    digits.parse().ok().filter(|_| decimal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strings() {
        let cases = [
            (r#""a/b.toml""#, Some("a/b.toml")),
            (r#""a\"b\\c\n\t\0\x41\u{e9}\u{1_F600}""#, Some("a\"b\\c\n\t\0A\u{e9}\u{1F600}")),
            ("\"one \\\n     line\"", Some("one line")),
            ("r\"a\\b\"", Some("a\\b")),
            ("r##\"a\"#b\"##", Some("a\"#b")),
            ("r\"\"", Some("")),
            ("b\"a\"", None),
            ("c\"a\"", None),
            ("'a'", None),
            ("12", None),
        ];
        for (literal, expect) in cases {
            assert_eq!(string(literal).as_deref(), expect, "{literal}");
        }
    }

    #[test]
    fn numbers() {
        for (literal, expect) in
            [("1", 1.0), ("9.81", 9.81), ("1e-6", 1e-6), ("1_000.5f64", 1000.5), ("2f32", 2.0), ("1.", 1.0)]
        {
            assert_eq!(number(literal), Some(expect), "{literal}");
        }
        for literal in ["0x10", "\"1\"", "inf", "nan", "1u8", "'1'", "infinity"] {
            assert_eq!(number(literal), None, "{literal}");
        }
    }
}
