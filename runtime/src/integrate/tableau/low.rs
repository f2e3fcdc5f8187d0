//! Methods of low order with rational coefficients.

use super::Tableau;
use crate::constant::{list, lower};

/// Euler's method.
pub static EULER: Tableau<1> = Tableau {
    name: "Euler",
    order: 1,
    c: list("0"),
    a: lower([""]),
    b: list("1"),
    error: &[],
    error_order: 0,
    share: 1.0,
    fsal: false,
    dense: None,
};

/// The explicit midpoint rule.
pub static MIDPOINT: Tableau<2> = Tableau {
    name: "midpoint",
    order: 2,
    c: list("0 1/2"),
    a: lower(["", "1/2"]),
    b: list("0 1"),
    error: &[],
    error_order: 0,
    share: 1.0,
    fsal: false,
    dense: None,
};

/// Kutta's classical method.
pub static RK4: Tableau<4> = Tableau {
    name: "Runge-Kutta 4",
    order: 4,
    c: list("0 1/2 1/2 1"),
    a: lower(["", "1/2", "0 1/2", "0 0 1"]),
    b: list("1/6 1/3 1/3 1/6"),
    error: &[],
    error_order: 0,
    share: 1.0,
    fsal: false,
    dense: None,
};

/// Fehlberg 4(5), carried on with the formula of order 5 (local extrapolation).
///
/// E. Fehlberg, Low-order classical Runge-Kutta formulas with stepsize control, NASA TR R-315 (1969), formula 2.
pub static RKF45: Tableau<6> = Tableau {
    name: "Runge-Kutta-Fehlberg 5(4)",
    order: 5,
    c: list("0 1/4 3/8 12/13 1 1/2"),
    a: lower([
        "",
        "1/4",
        "3/32 9/32",
        "1932/2197 -7200/2197 7296/2197",
        "439/216 -8 3680/513 -845/4104",
        "-8/27 2 -3544/2565 1859/4104 -11/40",
    ]),
    b: list("16/135 0 6656/12825 28561/56430 -9/50 2/55"),
    error: &[list("1/360 0 -128/4275 -2197/75240 1/50 2/55")],
    error_order: 4,
    share: 1.0,
    fsal: false,
    dense: None,
};

/// Cash and Karp 5(4).
///
/// J. R. Cash, A. H. Karp, A variable order Runge-Kutta method for initial value problems with rapidly varying
/// right-hand sides, ACM Transactions on Mathematical Software 16 (1990).
pub static CASH_KARP: Tableau<6> = Tableau {
    name: "Cash-Karp 5(4)",
    order: 5,
    c: list("0 1/5 3/10 3/5 1 7/8"),
    a: lower([
        "",
        "1/5",
        "3/40 9/40",
        "3/10 -9/10 6/5",
        "-11/54 5/2 -70/27 35/27",
        "1631/55296 175/512 575/13824 44275/110592 253/4096",
    ]),
    b: list("37/378 0 250/621 125/594 0 512/1771"),
    error: &[list("-277/64512 0 6925/370944 -6925/202752 -277/14336 277/7084")],
    error_order: 4,
    share: 1.0,
    fsal: false,
    dense: None,
};

/// Dormand and Prince 5(4), the pair of MATLAB's `ode45`; the estimate is that of the formula of order 4.
///
/// J. R. Dormand, P. J. Prince, A family of embedded Runge-Kutta formulae, Journal of Computational and Applied
/// Mathematics 6 (1980).
pub static DORMAND_PRINCE: Tableau<7> = Tableau {
    name: "Dormand-Prince 5(4)",
    order: 5,
    c: list("0 1/5 3/10 4/5 8/9 1 1"),
    a: lower([
        "",
        "1/5",
        "3/40 9/40",
        "44/45 -56/15 32/9",
        "19372/6561 -25360/2187 64448/6561 -212/729",
        "9017/3168 -355/33 46732/5247 49/176 -5103/18656",
        "35/384 0 500/1113 125/192 -2187/6784 11/84",
    ]),
    b: list("35/384 0 500/1113 125/192 -2187/6784 11/84 0"),
    error: &[list("71/57600 0 -71/16695 71/1920 -17253/339200 22/525 -1/40")],
    error_order: 4,
    share: 1.0,
    fsal: true,
    dense: None,
};
