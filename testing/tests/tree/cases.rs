//! Random trees of everything in a random state, with their motion.

use mbd_codegen::plan::Plan;
use mbd_runtime::spatial::{cross, Motion};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::{Dual, Interpreter, System};
use mbd_testing::eliminations::random_plan;
use mbd_testing::newton;
use mbd_testing::random::{random_model, Distribution};
use mbd_testing::state::{random_state, State};

pub type D = Dual<f64>;

pub const TREES: u64 = 1000;

/// Tolerance relative to the largest entry involved. Rounding of one sweep is about 1e-15; the remaining factor is the
/// condition of the mass matrices of these trees (light tips on heavy bases, rotors of 0.01 beside bodies of 2 kg).
pub const TOLERANCE: f64 = 3e-11;

pub struct Case {
    pub seed: u64,
    pub plan: Plan,
    pub s: State,
    pub i: Interpreter<f64>,
    pub qd: Vec<f64>,
    pub p: Vec<f64>,
    pub pd: Vec<f64>,
    pub a: Vec<f64>,
}

impl Case {
    pub fn new(seed: u64) -> Case {
        let plan = random_plan(&random_model(seed, &Distribution::everything(seed, 8)), seed);
        let s = random_state(&plan, seed);
        Case::of(seed, plan, s)
    }

    pub fn of(seed: u64, plan: Plan, s: State) -> Case {
        let (nq, nv) = (plan.dims.nq, plan.dims.nv);
        let mut i = s.interpreter(&plan);
        let (mut qd, mut p, mut pd, mut a, mut v) =
            (vec![0.0; nq], vec![0.0; nv], vec![0.0; nv], vec![0.0; nv], vec![0.0; nv]);
        i.momenta(&s.q, &s.v, &mut p);
        i.accelerations(&s.q, &s.v, &mut a);
        i.rates(&s.q, &p, &mut v, &mut qd, &mut pd);
        i.coordinate_rates(&s.q, &s.v, &mut qd);
        Case { seed, plan, s, i, qd, p, pd, a }
    }

    pub fn dual(&self) -> (Interpreter<D>, Vec<D>) {
        let q = self.s.q.iter().zip(&self.qd).map(|(x, dx)| Dual::new(*x, *dx));
        (self.s.interpreter_of(&self.plan, Dual::new), q.collect())
    }

    pub fn dual_v(&self) -> Vec<D> {
        self.s.v.iter().zip(&self.a).map(|(x, dx)| Dual::new(*x, *dx)).collect()
    }

    pub fn dual_p(&self) -> Vec<D> {
        self.p.iter().zip(&self.pd).map(|(x, dx)| Dual::new(*x, *dx)).collect()
    }

    /// Frames of the bodies, with their derivatives along the motion.
    pub fn bodies(&self) -> Vec<FrameState<D>> {
        let (mut i, q) = self.dual();
        let mut frames = vec![FrameState::ground(); self.plan.frames.len()];
        i.frames(&q, &self.dual_v(), &mut frames);
        newton::body_frames(&self.plan).into_iter().map(|k| frames[k]).collect()
    }

    /// Frames of the bodies for given velocities of state and drives, without derivatives.
    pub fn bodies_at(&mut self, v: &[f64], drive: &[f64]) -> Vec<FrameState<f64>> {
        self.i.drive_v.copy_from_slice(drive);
        let mut frames = vec![FrameState::ground(); self.plan.frames.len()];
        self.i.frames(&self.s.q, v, &mut frames);
        self.i.drive_v.copy_from_slice(&self.s.drive[1]);
        newton::body_frames(&self.plan).into_iter().map(|k| frames[k]).collect()
    }

    pub fn near(&self, what: &str, a: &[f64], b: &[f64], scale: f64) -> f64 {
        self.near_within(what, a, b, scale, TOLERANCE)
    }

    pub fn near_within(&self, what: &str, a: &[f64], b: &[f64], scale: f64, tolerance: f64) -> f64 {
        assert_eq!(a.len(), b.len());
        let size = a.iter().chain(b).fold(scale.max(1e-6), |m, x| m.max(x.abs()));
        let worst = a.iter().zip(b).fold(0.0_f64, |m, (a, b)| if m.is_nan() { m } else { f64::max(m, (a - b).abs()) });
        let finite = a.iter().chain(b).all(|x| x.is_finite());
        let text = || mbd_testing::toml::to_toml(&self.plan.model);
        assert!(finite && worst <= tolerance * size, "seed {}: {what}: {a:?}\n{b:?}\n{}", self.seed, text());
        worst / size
    }
}

pub fn largest(list: &[f64]) -> f64 {
    list.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Runs a check on all trees and shows the largest error.
pub fn all(what: &str, check: impl Fn(&mut Case) -> f64) {
    let mut worst = (0.0, 0);
    for seed in 0..TREES {
        let error = check(&mut Case::new(seed));
        if error >= worst.0 {
            worst = (error, seed);
        }
    }
    println!("{what}: largest error {:.1e}, seed {}", worst.0, worst.1);
}

pub fn re(m: &Motion<D>) -> Motion<f64> {
    Motion { lin: m.lin.map(|x| x.re), ang: m.ang.map(|x| x.re) }
}

/// A vector of a frame in ground axes.
pub fn turn(at: &FrameState<D>, x: [f64; 3]) -> [f64; 3] {
    at.rotation.map(|row| (0..3).map(|k| row[k].re * x[k]).sum())
}

/// A vector of the ground in the axes of a frame.
pub fn turn_back(at: &FrameState<D>, x: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| (0..3).map(|i| at.rotation[i][k].re * x[i]).sum())
}

/// Force on every body that its joints must supply for the motion, and moment about the origin of the ground, in ground
/// axes.
pub fn needed(c: &Case, bodies: &[FrameState<D>]) -> Vec<[[f64; 3]; 2]> {
    let (model, params) = (&c.plan.model, &c.s.params);
    let mut needed = Vec::new();
    for (k, at) in bodies.iter().enumerate() {
        let [p, l] = newton::momentum(model, params, k, at);
        let (m, centre) = newton::mass_centre(model, params, k, at);
        let weight = c.s.gravity.map(|g| m.re * g);
        let moment = cross(centre.map(|x| x.re), weight);
        let mut f: [f64; 3] = std::array::from_fn(|i| p[i].du - weight[i]);
        let mut n: [f64; 3] = std::array::from_fn(|i| l[i].du - moment[i]);
        for (wrench, given) in model.wrenches.iter().zip(&c.s.wrenches).filter(|(w, _)| w.body == k) {
            let (mut force, mut couple) = ([given[0], given[1], given[2]], [given[3], given[4], given[5]]);
            if wrench.axes == mbd_codegen::model::WrenchAxes::Body {
                (force, couple) = (turn(at, force), turn(at, couple));
            }
            let arm = cross(at.position.map(|x| x.re), force);
            f = std::array::from_fn(|i| f[i] - force[i]);
            n = std::array::from_fn(|i| n[i] - couple[i] - arm[i]);
        }
        needed.push([f, n]);
    }
    needed
}
