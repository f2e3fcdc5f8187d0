//! temporary
use super::constant::{ratio, Constant};
#[derive(Clone, Copy, Debug)]
pub struct Tableau<const S: usize> {
    pub name: &'static str,
    pub order: u32,
    pub c: [Constant; S],
    pub a: [[Constant; S]; S],
    pub b: [Constant; S],
    pub error: &'static [[Constant; S]],
    pub error_order: u32,
    pub fsal: bool,
    pub dense: Option<&'static Dense>,
}
#[derive(Clone, Copy, Debug)]
pub struct Dense {
    pub order: u32,
    pub c: &'static [Constant],
    pub a: &'static [&'static [Constant]],
    pub weights: &'static [&'static [Constant]],
}
const O: Constant = Constant::ZERO;
const HALF: Constant = ratio(1, 2);
pub const EULER: Tableau<1> = Tableau {
    name: "Euler",
    order: 1,
    c: [O],
    a: [[O]],
    b: [ratio(1, 1)],
    error: &[],
    error_order: 0,
    fsal: false,
    dense: None,
};
pub const MIDPOINT: Tableau<2> = Tableau {
    name: "midpoint",
    order: 2,
    c: [O, HALF],
    a: [[O, O], [HALF, O]],
    b: [O, ratio(1, 1)],
    error: &[],
    error_order: 0,
    fsal: false,
    dense: None,
};
pub const RK4: Tableau<4> = Tableau {
    name: "RK4",
    order: 4,
    c: [O, HALF, HALF, ratio(1, 1)],
    a: [[O; 4], [HALF, O, O, O], [O, HALF, O, O], [O, O, ratio(1, 1), O]],
    b: [ratio(1, 6), ratio(1, 3), ratio(1, 3), ratio(1, 6)],
    error: &[],
    error_order: 0,
    fsal: false,
    dense: None,
};
