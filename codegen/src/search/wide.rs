//! Double-double numbers as a scalar: what rounding errors are measured against.

/// A double-double number, 106 bits, with the sines and cosines of programs on doubles: they are inputs of the algebra, the
/// same under every elimination, and what is compared are the roundings after them.
pub type Wide = mbd_runtime::wide::Wide<true>;
