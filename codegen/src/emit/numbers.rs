//! Number literals.

use crate::options::Precision;

/// A constant without sign: the shortest decimal that reads back as the same number.
pub fn literal(x: f64, precision: Precision) -> String {
    match precision {
        Precision::F64 => format!("{x:?}"),
        Precision::F32 => format!("{:?}", x as f32),
    }
}

/// A constant with its sign; zeros have none.
pub fn signed(x: f64, precision: Precision) -> String {
    let sign = if x < 0.0 { "-" } else { "" };
    format!("{sign}{}", literal(x.abs(), precision))
}

/// The sign of something that may be negative.
pub fn minus(negative: bool) -> &'static str {
    if negative {
        "-"
    } else {
        ""
    }
}
