//! temporary
use crate::Scalar;
#[derive(Clone, Copy, Debug)]
pub struct Constant {
    hi: f64,
    lo: f64,
}
pub const fn ratio(n: i64, d: i64) -> Constant {
    Constant { hi: n as f64 / d as f64, lo: 0.0 }
}
pub const fn decimal(_: &str) -> Constant {
    ratio(0, 1)
}
impl Constant {
    pub const ZERO: Constant = ratio(0, 1);
    pub fn get<S: Scalar>(self) -> S {
        S::constant(self.hi) + S::constant(self.lo)
    }
}
