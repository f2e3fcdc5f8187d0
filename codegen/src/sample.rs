//! Random states in which plans are tried out. They are the same on every machine.

use mbd_runtime::tree::Source;
use mbd_runtime::{Interpreter, Scalar};

use crate::model::{Coordinate, Gravity, Unit};
use crate::plan::Plan;

/// A random state. Momenta belong to the velocities once they are set.
pub struct State {
    /// Coordinates; quaternions are of unit length.
    pub q: Vec<f64>,
    /// Velocities.
    pub v: Vec<f64>,
    /// Momenta.
    pub p: Vec<f64>,
    drive_q: Vec<f64>,
    params: Vec<f64>,
    seed: u64,
}

impl State {
    /// The state of a seed: angles up to 3 rad, displacements of prismatic joints up to 0.6 m and of joints with several
    /// coordinates up to 3 m, velocities up to 1.5; no momenta yet.
    pub fn new(plan: &Plan, seed: u64) -> State {
        let d = plan.dims;
        let (mut q, mut drive_q) = (random(seed, 0, d.nq, 3.0), random(seed, 1, d.drive_q, 3.0));
        for slot in &plan.slots {
            let (list, at) = match slot.at {
                Some(Source::State { q: at, .. }) => (&mut q, at),
                Some(Source::Drive { q: at, .. }) => (&mut drive_q, at),
                None => continue,
            };
            let spec = plan.model.joints[slot.joint].kind.spec();
            if matches!(spec.coordinates, [Coordinate { unit: Unit::Metre, .. }]) {
                list[at] *= 0.2;
            }
            let Some(at) = spec.quaternion().map(|first| at + first) else { continue };
            let norm = list[at..at + 4].iter().map(|x| x * x).sum::<f64>();
            list[at..at + 4].iter_mut().for_each(|x| *x /= Scalar::sqrt(norm));
        }
        State { q, v: random(seed, 2, d.nv, 1.5), p: Vec::new(), drive_q, params: plan.default_params(), seed }
    }

    /// One of the arrays that a program is called with.
    pub fn input(&self, name: &str, len: usize) -> Vec<f64> {
        match name {
            "q" => self.q.clone(),
            "v" => self.v.clone(),
            "p" => self.p.clone(),
            "drive_q" => self.drive_q.clone(),
            "params" => self.params.clone(),
            "drive_v" => random(self.seed, 3, len, 1.5),
            "gravity" => random(self.seed, 4, len, 9.0),
            "a" => random(self.seed, 6, len, 3.0),
            _ => random(self.seed, 5, len, 3.0),
        }
    }

    /// Sets everything that is given to an interpreter beside the state, with joint forces or without.
    pub fn set_inputs<S: Scalar>(&self, plan: &Plan, interpreter: &mut Interpreter<S>, efforts: bool) {
        let d = plan.dims;
        let input = |name: &str, len: usize| self.input(name, len).into_iter().map(S::constant).collect::<Vec<S>>();
        if efforts {
            interpreter.tau = input("tau", d.nv);
        }
        interpreter.drive_q = input("drive_q", d.drive_q);
        interpreter.drive_v = input("drive_v", d.drive_v);
        interpreter.drive_a = input("drive_a", d.drive_v);
        let wrenches = input("wrenches", 6 * d.wrenches);
        interpreter.wrenches = wrenches.chunks_exact(6).map(|w| std::array::from_fn(|k| w[k])).collect();
        let gravity = match plan.model.gravity {
            Gravity::Input => self.input("gravity", 3),
            Gravity::Constant(_) => plan.gravity(&self.params).to_vec(),
        };
        interpreter.gravity = std::array::from_fn(|k| S::constant(gravity[k]));
    }
}

/// Uniformly distributed numbers in `[-size, size)`, by SplitMix64.
fn random(seed: u64, stream: u64, n: usize, size: f64) -> Vec<f64> {
    let mut state = (seed << 8 | stream).wrapping_mul(0xd1b5_4a32_d192_ed03);
    let next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let unit = ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64;
        size * (2.0 * unit - 1.0)
    };
    std::iter::repeat_with(next).take(n).collect()
}
