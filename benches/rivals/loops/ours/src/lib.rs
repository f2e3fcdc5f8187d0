//! `extern "C"` doors to every mechanism: `NAME_accelerations(q, v, tau, a)`, `NAME_rates(q, p, tau, qd, pd)`,
//! `NAME_momenta(q, v, p)`, `NAME_state(seed, q, v)` with a random state that meets the constraints, and `NAME_about(...)` with
//! the order of coordinates and the counts.
#![allow(missing_docs)]

use mbd_runtime::constrained::{close, Closing};
use mbd_runtime::{Conjugate, Constrained};

/// Numbers from -1 to 1 (xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// A state that meets the constraints: off the start by up to `far` (rad, m), velocities of up to 1 before they are projected.
/// Residual of the positions.
fn state<Y>(system: &mut Y, start: &[f64], far: f64, seed: u64, q: &mut Y::Coordinates, v: &mut Y::Momenta) -> f64
where
    Y: Constrained<Scalar = f64> + Conjugate,
{
    let mut random = Random(0x9E37_79B9_7F4A_7C15 ^ (seed + 1).wrapping_mul(0xBF58_476D_1CE4_E5B9));
    let groups: Vec<(usize, usize)> = system.lie_joints().iter().map(|g| (g.q, g.kind.sizes().0)).collect();
    loop {
        for (q, start) in q.as_mut().iter_mut().zip(start) {
            *q = start + far * random.next();
        }
        // The quaternion stands at the end of a group.
        for (at, len) in &groups {
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
        // Twice: round-off of the first projection goes with its multipliers.
        for _ in 0..2 {
            system.project_momenta(0.0, q, &mut p, v, &mut sigma);
        }
        return closed.residual;
    }
}

include!(concat!(env!("OUT_DIR"), "/mechanisms.rs"));
