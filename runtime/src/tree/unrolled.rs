//! Expressions that are compiled apart for each value of a number, which is a constant in them: entries of vectors and
//! matrices are then found without computing their places.

/// Evaluates an expression with the number and, if it is asked for, the column of every freedom of a joint, in order or, with `rev`, in the
/// reverse order. It is compiled apart for the commonest kinds of joints, which have one freedom whose column is a
/// constant.
macro_rules! each_freedom {
    ($kind:expr, |$k:ident| $result:expr) => {
        match $kind {
            $crate::tree::Kind::Revolute | $crate::tree::Kind::Prismatic => {
                let $k = 0;
                $result
            }
            kind => {
                for $k in 0..kind.nv() {
                    $result
                }
            }
        }
    };
    ($kind:expr, |$k:ident, $axis:ident| $result:expr) => {
        each_freedom!(@ $kind, (0..), |$k, $axis| $result)
    };
    ($kind:expr, rev, |$k:ident, $axis:ident| $result:expr) => {
        each_freedom!(@ $kind, (0..).rev, |$k, $axis| $result)
    };
    (@ $kind:expr, (0..) $(.$rev:ident)?, |$k:ident, $axis:ident| $result:expr) => {
        match $kind {
            $crate::tree::Kind::Revolute => {
                let ($k, $axis) = (0, $crate::tree::Kind::Revolute.axis(0));
                $result
            }
            $crate::tree::Kind::Prismatic => {
                let ($k, $axis) = (0, $crate::tree::Kind::Prismatic.axis(0));
                $result
            }
            kind => {
                for $k in (0..kind.nv())$(.$rev())? {
                    let $axis = kind.axis($k);
                    $result
                }
            }
        }
    };
}
pub(crate) use each_freedom;

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
