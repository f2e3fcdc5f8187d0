//! Motions of prescribed joints as functions of time.

use std::sync::Arc;

use super::memory::Number;
use super::Compiled;

/// A motion of all prescribed joints, in the order of the inputs `drive_q` and `drive_v`.
///
/// Only positions and rates are asked for: the rates of the state do not depend on prescribed accelerations, because
/// momenta are what is integrated.
pub trait Drives<S>: core::fmt::Debug + Send + Sync {
    /// Writes positions (rad, m, unit quaternions) and rates (rad/s, m/s) at time `t` (s). The rates must be those of the
    /// positions.
    fn at(&self, t: S, q: &mut [S], v: &mut [S]);
}

/// Positions and rates at equal distances of time, and cubic polynomials between them: the error of positions is of
/// fourth order in the distance, and rates are those of the positions exactly. For joints whose rates are those of
/// their coordinates, which excludes quaternions.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledDrives {
    step: f64,
    joints: usize,
    q: Vec<f64>,
    v: Vec<f64>,
}

impl SampledDrives {
    /// Samples every `step` s from time zero on, `joints` numbers each; outside of them the first and the last polynomial
    /// go on. `None` unless there are as many rates as positions, two samples at least, and a step greater than zero.
    pub fn new(step: f64, joints: usize, q: &[f64], v: &[f64]) -> Option<Self> {
        let sound =
            joints > 0 && q.len() == v.len() && q.len().is_multiple_of(joints) && q.len() >= 2 * joints && step > 0.0;
        sound.then(|| SampledDrives { step, joints, q: q.to_vec(), v: v.to_vec() })
    }
}

impl Drives<f64> for SampledDrives {
    fn at(&self, t: f64, q: &mut [f64], v: &mut [f64]) {
        let (n, h) = (self.joints, self.step);
        let last = self.q.len() / n - 2;
        // A conversion of a float saturates.
        let k = ((t / h) as usize).min(last);
        let s = t / h - k as f64;
        let (here, there) = (k * n..(k + 1) * n, (k + 1) * n..(k + 2) * n);
        let ends = self.q[here.clone()].iter().zip(&self.q[there.clone()]);
        let rates = self.v[here].iter().zip(&self.v[there]);
        for ((to, rate), ((q0, q1), (v0, v1))) in q.iter_mut().zip(v).zip(ends.zip(rates)) {
            // q0 + h v0 s + b s² + c s³ with the position and the rate of the other end.
            let (d0, d1) = (q1 - q0 - h * v0, h * (v1 - v0));
            let (b, c) = (3.0 * d0 - d1, d1 - 2.0 * d0);
            *to = q0 + s * (h * v0 + s * (b + s * c));
            *rate = v0 + s * (2.0 * b + 3.0 * s * c) / h;
        }
    }
}

impl<S: Number> Compiled<S> {
    /// Moves the prescribed joints: the inputs `drive_q` and `drive_v` follow time wherever a trait's function is given one.
    /// `None` leaves them as they are. Functions without a time use those of the last one, or of [`Compiled::drive_to`].
    pub fn set_drives(&mut self, drives: Option<Arc<dyn Drives<S>>>) {
        self.drives = drives;
    }

    /// Sets the prescribed joints to where they are at time `t` (s), if they move.
    #[inline]
    pub fn drive_to(&mut self, t: S) {
        if let Some(drives) = &self.drives {
            drives.at(t, &mut self.interpreter.drive_q, &mut self.interpreter.drive_v);
        }
    }

    /// Whether prescribed joints follow time.
    pub(super) fn is_driven(&self) -> bool {
        self.drives.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::{Drives, SampledDrives};

    /// A cubic motion is given exactly, with its rate, at samples, between them and beyond.
    #[test]
    fn cubic_motions_are_exact() {
        let q = |t: f64| [1.0 + 2.0 * t - t * t + 0.5 * t * t * t, 3.0 - t];
        let v = |t: f64| [2.0 - 2.0 * t + 1.5 * t * t, -1.0];
        let samples =
            |f: &dyn Fn(f64) -> [f64; 2]| -> Vec<f64> { (0..5).flat_map(|k| f(0.25 * f64::from(k))).collect() };
        let drives = SampledDrives::new(0.25, 2, &samples(&q), &samples(&v)).unwrap();
        let (mut at, mut rate) = ([0.0; 2], [0.0; 2]);
        for t in [0.0, 0.1, 0.25, 0.6, 1.0, 1.1] {
            drives.at(t, &mut at, &mut rate);
            for k in 0..2 {
                assert!((at[k] - q(t)[k]).abs() < 1e-14 && (rate[k] - v(t)[k]).abs() < 1e-13, "{t}");
            }
        }
    }

    #[test]
    fn samples_that_do_not_fit_are_refused() {
        for (step, joints, q, v) in [(0.1, 2, 4, 2), (0.1, 2, 2, 2), (0.1, 2, 5, 5), (0.0, 2, 4, 4), (0.1, 0, 0, 0)] {
            assert_eq!(SampledDrives::new(step, joints, &vec![0.0; q], &vec![0.0; v]), None);
        }
    }
}
