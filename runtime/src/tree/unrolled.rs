//! Expressions that are compiled apart for each value of a number, which is a constant in them: entries of vectors and
//! matrices are then found without computing their places.

/// Evaluates an expression with column `k` of a joint matrix. It is compiled apart for the commonest kinds of joints,
/// whose column is a constant then.
macro_rules! for_freedom {
    ($kind:expr, $k:expr, |$axis:ident| $result:expr) => {
        match $kind {
            $crate::tree::Kind::Revolute => {
                let $axis = $crate::tree::Kind::Revolute.axis($k);
                $result
            }
            $crate::tree::Kind::Prismatic => {
                let $axis = $crate::tree::Kind::Prismatic.axis($k);
                $result
            }
            kind => {
                let $axis = kind.axis($k);
                $result
            }
        }
    };
}
pub(crate) use for_freedom;

/// Evaluates an expression with the number of a component, 0–5. It is compiled once for every number, which is a constant
/// then.
macro_rules! for_component {
    ($k:expr, |$known:ident| $result:expr) => {
        match $k {
            0 => for_component!(@ 0, $known, $result),
            1 => for_component!(@ 1, $known, $result),
            2 => for_component!(@ 2, $known, $result),
            3 => for_component!(@ 3, $known, $result),
            4 => for_component!(@ 4, $known, $result),
            _ => for_component!(@ 5, $known, $result),
        }
    };
    (@ $number:literal, $known:ident, $result:expr) => {{
        let $known = $number;
        $result
    }};
}
pub(crate) use for_component;
