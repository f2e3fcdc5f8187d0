//! `extern "C"` functions for every mechanism: `NAME_accelerations(q, v, tau, a)`, `NAME_rates(q, p, tau, qd, pd)`,
//! `NAME_momenta(q, v, p)`, `NAME_state(seed, q, v)` for a random state that satisfies the constraints, and
//! `NAME_about(...)` for the order of coordinates and the numbers of operations.
#![allow(missing_docs)]

use mbd_runtime::constrained::{close, Closing};
use mbd_runtime::{Conjugate, Constrained};

/// Random numbers from -1 to 1 (xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Makes a random state that satisfies the constraints. Before it is closed, coordinates differ from the start by up to
/// `far` (rad, m), and velocities are up to 1 before their projection. Returns the residual of the positions.
fn state<Y>(system: &mut Y, start: &[f64], far: f64, seed: u64, q: &mut Y::Coordinates, v: &mut Y::Momenta) -> f64
where
    Y: Constrained<Scalar = f64> + Conjugate,
{
    let mut random = Random(0x9E37_79B9_7F4A_7C15 ^ (seed + 1).wrapping_mul(0xBF58_476D_1CE4_E5B9));
    let joints: Vec<(usize, usize)> = system.lie_joints().iter().map(|j| (j.q, j.kind.sizes().0)).collect();
    loop {
        for (q, start) in q.as_mut().iter_mut().zip(start) {
            *q = start + far * random.next();
        }
        // The quaternion is at the end of the joint's coordinates.
        for (at, len) in &joints {
            let quaternion = &mut q.as_mut()[at + len - 4..at + len];
            let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
            quaternion.iter_mut().for_each(|x| *x /= norm);
        }
        let mut closing = Closing::default();
        closing.tolerance = 1e-13;
        let Ok(closed) = close(system, q, &closing) else { continue };
        let (mut p, mut sigma) = (system.zero_momenta(), system.zero_rows());
        v.as_mut().iter_mut().for_each(|v| *v = random.next());
        system.conjugate_momenta(q, v, &mut p);
        // The second projection removes the round-off of the first one, which is proportional to its multipliers.
        for _ in 0..2 {
            system.project_momenta(0.0, q, &mut p, v, &mut sigma);
        }
        return closed.residual;
    }
}

include!(concat!(env!("OUT_DIR"), "/mechanisms.rs"));
