//! Names of what the sweeps store, for the listener: the letters of `notation` in ASCII, a prime as `p`, and the entry.
//! Entries of spatial vectors are `x`, `y`, `z` of the linear and `rx`, `ry`, `rz` of the angular part; entries of
//! inertias are pairs of them. Numbers have no names: on them nothing is left of these calls.

use super::Trace;
use crate::spatial::{ArticulatedInertia, Force, Motion, Vec3};
use crate::Scalar;

const LINEAR: [&str; 3] = ["x", "y", "z"];
const ANGULAR: [&str; 3] = ["rx", "ry", "rz"];
const LINEAR_PAIRS: [&str; 6] = ["xx", "xy", "xz", "yy", "yz", "zz"];
const ANGULAR_PAIRS: [&str; 6] = ["rx_rx", "rx_ry", "rx_rz", "ry_ry", "ry_rz", "rz_rz"];
const MIXED_PAIRS: [[&str; 3]; 3] = [["rx_x", "rx_y", "rx_z"], ["ry_x", "ry_y", "ry_z"], ["rz_x", "rz_y", "rz_z"]];

fn entries<S: Scalar, T: Trace, const N: usize>(
    trace: &T,
    letter: &'static str,
    names: [&'static str; N],
    values: &[S; N],
) {
    // Compilers that prefer small code leave a loop over nothing.
    if T::LISTENS {
        for (name, value) in names.into_iter().zip(values) {
            trace.name(*value, letter, name);
        }
    }
}

/// A vector of three.
pub fn vector<S: Scalar>(trace: &impl Trace, letter: &'static str, v: &Vec3<S>) {
    entries(trace, letter, LINEAR, v);
}

/// A force, momentum or column of an inertia.
pub fn force<S: Scalar>(trace: &impl Trace, letter: &'static str, f: &Force<S>) {
    entries(trace, letter, LINEAR, &f.lin);
    entries(trace, letter, ANGULAR, &f.ang);
}

/// A velocity or acceleration.
pub fn motion<S: Scalar>(trace: &impl Trace, letter: &'static str, m: &Motion<S>) {
    entries(trace, letter, LINEAR, &m.lin);
    entries(trace, letter, ANGULAR, &m.ang);
}

/// An inertia.
pub fn inertia<S: Scalar>(trace: &impl Trace, letter: &'static str, m: &ArticulatedInertia<S>) {
    entries(trace, letter, LINEAR_PAIRS, &m.a);
    for k in 0..3 {
        entries(trace, letter, MIXED_PAIRS[k], &m.h[k]);
    }
    entries(trace, letter, ANGULAR_PAIRS, &m.j);
}
