//! Double-double numbers as a scalar, the reference of rounding errors.

/// A double-double number of 106 bits, whose sines and cosines are those of programs on doubles. They are the same with
/// every elimination, so that only the roundings after them are compared.
pub type Wide = mbd_runtime::wide::Wide<true>;
