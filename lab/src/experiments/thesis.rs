//! Numbers printed in the thesis, for comparison with our own.

/// Table 7.1: step (s), end error in acceleration and in Hamiltonian form, mean truncation error of the coordinates in
/// both.
pub const FIXED: [(f64, [f64; 2], [f64; 2]); 5] = [
    (1e-2, [2.8e-3, 1.2e-3], [1.6e-6, 9.7e-7]),
    (5e-3, [1.9e-4, 5.4e-5], [4.3e-8, 3.9e-8]),
    (1e-3, [4.5e-8, 1.2e-8], [1.4e-11, 1.3e-11]),
    (5e-4, [1.1e-9, 3.8e-10], [4.4e-13, 4.2e-13]),
    (1e-4, [3.8e-11, 2.9e-11], [1.4e-16, 1.3e-16]),
];

/// In the text of table 7.1: mean truncation error of the velocities and of the momenta with steps of 1 ms.
pub const SECOND_HALF: [f64; 2] = [1.1e-9, 4.5e-12];

/// Table 7.2 of ODE45: tolerance, end error, evaluations of the accelerations and of Hamilton's equations.
pub const ODE45: [(f64, f64, [u64; 2]); 6] = [
    (1e-4, 1e-2, [313, 206]),
    (1e-5, 4e-4, [457, 320]),
    (1e-6, 1e-5, [661, 434]),
    (1e-9, 4e-9, [2545, 1646]),
    (1e-12, 2e-11, [10135, 6560]),
    (1e-13, 2e-11, [16063, 10400]),
];

/// Table 7.2 of ODE15S: tolerance, evaluations.
pub const ODE15S: [(f64, [u64; 2]); 4] =
    [(1e-3, [336, 235]), (1e-6, [682, 460]), (1e-9, [1542, 998]), (1e-12, [7916, 4815])];

/// Table 7.3: control of all errors, then of the coordinates' alone; mean truncation error, mean end error,
/// evaluations.
pub const CONTROL: [([f64; 2], [f64; 2], [u64; 2]); 2] =
    [([4.2e-9, 4.4e-8], [1.4e-5, 2.0e-5], [1578, 1177]), ([4.7e-8, 4.7e-8], [4.8e-5, 2.1e-5], [1164, 1159])];

/// Table 7.4: how often each number of the state had the largest error, accelerations, then Hamilton.
pub const WINS: [[u64; 6]; 2] = [[0, 0, 0, 10, 31, 44], [1, 13, 56, 5, 10, 0]];

/// Figures 7.9 to 7.13: number, what it shows, range of the vertical axis.
pub const AXES: [(&str, &str, [f64; 2]); 5] = [
    ("7.9", "coordinates, rad", [-10.0, 4.0]),
    ("7.10", "velocities, rad/s", [-60.0, 20.0]),
    ("7.11", "momenta, kg m²/s", [-3.5, 0.0]),
    ("7.12", "errors of the loop, m", [-0.5e-8, 3e-8]),
    ("7.13", "error of the energy, J", [-1e-7, 8e-8]),
];

/// Section 7.2, a chain of 100 links, open: evaluations for one second, seconds for one of them, for all.
pub const CHAIN100: (u64, f64, f64) = (5379, 8.5e-5, 0.46);

/// Section 7.2, a chain of 20 links: seconds for one evaluation, with alternating axes and planar.
pub const CHAIN20: [f64; 2] = [2.4e-5, 1.75e-5];

/// Table 7.5: seconds of the simulation and of 100000 calls; in total, until the joint fails, of the change.
pub const BREAKING: [[f64; 2]; 3] = [[0.64, 5.40], [0.39, 5.23], [0.00, 0.04]];
