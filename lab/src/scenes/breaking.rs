//! The chain of thesis 7.4 that breaks in two while it falls.

use multibody::codegen::diag::Diagnostics;
use multibody::codegen::model::{JointKind, Placement};
use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::codegen::read::{self, ImportOptions};
use multibody::codegen::search;
use multibody::codegen::transfer::{Transfer, TransferError, Transferred};
use multibody::runtime::integrate::{Solver, Step, Stepper};
use multibody::runtime::sweep::FrameState;
use multibody::runtime::{Conjugate, Interpreter, Real, StepError, System};

use super::experiments;
use super::text::{FRICTION, GRAVITY, MASS};

/// Length of a link, m.
pub use super::text::LENGTH;

/// Time at which the joint breaks, s.
pub const BREAK: f64 = 1.8;
/// End of the thesis's simulation, s, and its step.
pub const END: f64 = 3.0;
/// The thesis's step, s.
pub const STEP: f64 = 1e-3;
/// Links of the thesis's chain, and the link whose joint breaks, from 1.
pub const LINKS: usize = 100;
/// The link whose joint breaks, from 1.
pub const LINK: usize = 41;

/// A planar chain, and the same bodies after the joint of one of them has been broken: the rest hangs on the ground,
/// and what the body carries moves freely in the plane.
pub struct Breaking {
    /// The chain before the break.
    pub whole: Plan,
    /// The two chains after it. The first joint of the free one is planar: its position in the plane and its angle.
    pub broken: Plan,
    /// Index of the joint that breaks.
    at: usize,
    /// Frames of the links in both plans.
    frames: [Vec<usize>; 2],
    /// Moment of inertia of a link about its centre of mass, kg m².
    inertia: f64,
}

/// A state.
#[derive(Clone, Debug)]
pub struct State<S> {
    /// Time, s.
    pub t: f64,
    /// The number of steps that led here.
    pub steps: u64,
    /// Coordinates: rad; of the planar joint m, m, rad.
    pub q: Vec<S>,
    /// Conjugate momenta.
    pub p: Vec<S>,
}

/// What the links of one part have together; the ground's axes and origin.
#[derive(Clone, Copy, Debug, Default)]
pub struct Part {
    /// Kinetic and potential energy, J.
    pub energy: [f64; 2],
    /// Linear momentum along x and y, kg m/s, and angular momentum about the origin, kg m²/s.
    pub momentum: [f64; 3],
    /// Centre of mass, m.
    pub center: [f64; 2],
    /// Mass, kg.
    pub mass: f64,
}

impl Part {
    /// Kinetic and potential energy together, J.
    pub fn total(&self) -> f64 {
        self.energy[0] + self.energy[1]
    }

    /// Angular momentum about the centre of mass, kg m²/s.
    pub fn spin(&self) -> f64 {
        let ([x, y], [px, py, about]) = (self.center, self.momentum);
        about - (x * py - y * px)
    }
}

/// Reason why a state was not carried through the break.
#[derive(Clone, Debug)]
pub enum Failed {
    /// Of the integration.
    Step(StepError),
    /// Of the break.
    Transfer(TransferError),
}

impl std::fmt::Display for Failed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Failed::Step(e) => write!(f, "{e}"),
            Failed::Transfer(e) => write!(f, "{e}"),
        }
    }
}

impl Breaking {
    /// The chain of the thesis.
    ///
    /// # Errors
    /// None but those of a defect of the program.
    pub fn thesis() -> Result<Breaking, Diagnostics> {
        Breaking::new(LINKS, LINK, FRICTION)
    }

    /// A chain of `links` links, with a friction of `damping` N m s/rad in every joint, of which the joint of link
    /// `link` (from 1) breaks.
    ///
    /// # Errors
    /// A number that a model cannot have.
    ///
    /// # Panics
    /// If the chain has no such link.
    pub fn new(links: usize, link: usize, damping: f64) -> Result<Breaking, Diagnostics> {
        Breaking::with_inertia(links, link, damping, MASS * LENGTH * LENGTH / 12.0)
    }

    /// The same with another moment of inertia of a link about its centre of mass, kg m².
    ///
    /// # Errors
    /// A number that a model cannot have.
    ///
    /// # Panics
    /// If the chain has no such link.
    pub fn with_inertia(links: usize, link: usize, damping: f64, inertia: f64) -> Result<Breaking, Diagnostics> {
        assert!((1..=links).contains(&link), "no link {link}");
        let text = experiments::breaking(links, damping, inertia);
        let model = read::model("breaking.toml", &text, &ImportOptions::default())?.model;
        let planar = JointKind::Planar { normal: [0.0, 0.0, 1.0] };
        let broken = model.rejoined(&format!("link{link}"), None, planar, Placement::IDENTITY);
        let broken = broken.unwrap_or_else(|e| panic!("{e}"));
        let [whole, broken] = [&model, &broken].map(|model| search::plan(model, PlanOptions::default()));
        let frames = [&whole, &broken].map(|plan| {
            let link = |k: usize| plan.frames.iter().position(|f| f.name == format!("link{k}"));
            (1..=links).filter_map(link).collect()
        });
        Ok(Breaking { whole, broken, at: link - 1, frames, inertia })
    }

    /// Velocities of the planar joint after the break.
    pub fn planar(&self) -> std::ops::Range<usize> {
        self.at..self.at + 3
    }

    /// The transfer through the break.
    ///
    /// # Errors
    /// None but those of a defect of the program.
    pub fn transfer(&self) -> Result<Transfer, TransferError> {
        Transfer::new(&self.whole, &self.broken)
    }

    /// Coordinates and velocities after the break by the kinematics of this chain alone, for any numbers. [`Transfer`]
    /// finds the same for doubles, the angle but for whole turns.
    pub fn carried<S: Real>(&self, whole: &mut Interpreter<S>, q: &[S], v: &[S]) -> (Vec<S>, Vec<S>) {
        let body = self.links(false, whole, q, v)[self.at];
        let angle = q[..=self.at].iter().fold(S::zero(), |sum, q| sum + *q);
        let place = [body.position[0], body.position[1], angle];
        let rate = [0, 1, 5].map(|k| body.velocity.get(k));
        let through = |old: &[S], new: &[S]| [&old[..self.at], new, &old[self.at + 1..]].concat();
        (through(q, &place), through(v, &rate))
    }

    /// Poses and velocities of the links, before or after the break.
    pub fn links<S: Real>(
        &self,
        after: bool,
        interpreter: &mut Interpreter<S>,
        q: &[S],
        v: &[S],
    ) -> Vec<FrameState<S>> {
        let mut all = vec![FrameState::ground(); interpreter.tree().frames.len()];
        interpreter.frames(q, v, &mut all);
        self.frames[usize::from(after)].iter().map(|&f| all[f]).collect()
    }

    /// The links before the one whose joint breaks, and the others, before or after the break.
    pub fn parts(&self, after: bool, interpreter: &mut Interpreter<f64>, state: &State<f64>) -> [Part; 2] {
        let mut v = interpreter.zero_momenta();
        interpreter.velocities(&state.q, &state.p, &mut v);
        let links = self.links(after, interpreter, &state.q, &v);
        let mut parts = [Part::default(); 2];
        let (mass, across) = (MASS, self.inertia);
        for (k, link) in links.iter().enumerate() {
            let part = &mut parts[usize::from(k >= self.at)];
            let [vx, vy, w] = [0, 1, 5].map(|c| link.velocity.get(c));
            let half = 0.5 * LENGTH;
            let ([cos, sin], vy) = ([link.rotation[0][0], link.rotation[1][0]], vy + w * half);
            let (ux, uy) = (cos * vx - sin * vy, sin * vx + cos * vy);
            let (x, y) = (link.position[0] + cos * half, link.position[1] + sin * half);
            part.energy[0] += 0.5 * (mass * (ux * ux + uy * uy) + across * w * w);
            part.energy[1] -= mass * GRAVITY[1] * y;
            part.momentum[0] += mass * ux;
            part.momentum[1] += mass * uy;
            part.momentum[2] += mass * (x * uy - y * ux) + across * w;
            part.center[0] += mass * x;
            part.center[1] += mass * y;
            part.mass += mass;
        }
        for part in &mut parts {
            part.center = part.center.map(|x| x / part.mass);
        }
        parts
    }

    /// Runs the chain from rest through the break at `times[0]` s to `times[1]` s, with a method that `method` makes.
    /// `carry` takes coordinates and velocities over. `seen` is called at the start, after every step, and on both sides
    /// of the break, with `true` after it.
    ///
    /// # Errors
    /// [`Failed`].
    pub fn run<S: Real, M: Stepper<Interpreter<S>>>(
        &self,
        times: [f64; 2],
        step: Step,
        method: impl Fn(&Interpreter<S>) -> M,
        mut carry: impl FnMut(&mut Interpreter<S>, &[S], &[S], &mut Interpreter<S>) -> Result<[Vec<S>; 2], TransferError>,
        mut seen: impl FnMut(bool, &mut Interpreter<S>, &State<S>),
    ) -> Result<State<S>, Failed> {
        let mut old: Interpreter<S> = self.whole.default_interpreter();
        let mut new: Interpreter<S> = self.broken.default_interpreter();
        let q = self.whole.start().into_iter().map(S::constant).collect();
        let mut state = State { t: 0.0, steps: 0, q, p: old.zero_momenta() };
        seen(false, &mut old, &state);
        advance(&mut old, &mut state, times[0], step, &method, |i, state| seen(false, i, state))?;
        let mut v = old.zero_momenta();
        old.velocities(&state.q, &state.p, &mut v);
        let [q, v] = carry(&mut old, &state.q, &v, &mut new).map_err(Failed::Transfer)?;
        let mut p = new.zero_momenta();
        new.conjugate_momenta(&q, &v, &mut p);
        state = State { q, p, ..state };
        seen(true, &mut new, &state);
        advance(&mut new, &mut state, times[1], step, &method, |i, state| seen(true, i, state))?;
        Ok(state)
    }

    /// [`Breaking::run`] with doubles and [`Transfer`]; returns what the transfer says too.
    ///
    /// # Errors
    /// [`Failed`].
    pub fn doubles<M: Stepper<Interpreter<f64>>>(
        &self,
        times: [f64; 2],
        step: Step,
        method: impl Fn(&Interpreter<f64>) -> M,
        seen: impl FnMut(bool, &mut Interpreter<f64>, &State<f64>),
    ) -> Result<(State<f64>, Option<Transferred>), Failed> {
        let mut transfer = self.transfer().map_err(Failed::Transfer)?;
        let mut done = None;
        let carry = |old: &mut Interpreter<f64>, q: &[f64], v: &[f64], new: &mut Interpreter<f64>| {
            let state = transfer.apply(old, q, v, new)?;
            let out = [state.q.clone(), state.v.clone()];
            done = Some(state);
            Ok(out)
        };
        let end = self.run(times, step, method, carry, seen)?;
        Ok((end, done))
    }

    /// [`Breaking::run`] with any numbers and the kinematics of this chain.
    ///
    /// # Errors
    /// [`Failed`].
    pub fn precise<S: Real, M: Stepper<Interpreter<S>>>(
        &self,
        times: [f64; 2],
        step: Step,
        method: impl Fn(&Interpreter<S>) -> M,
    ) -> Result<State<S>, Failed> {
        let carry = |old: &mut Interpreter<S>, q: &[S], v: &[S], _: &mut Interpreter<S>| {
            let (q, v) = self.carried(old, q, v);
            Ok([q, v])
        };
        self.run(times, step, method, carry, |_, _, _| ())
    }

    /// Farthest distance of a joint from its place in another state after the break, m.
    pub fn apart<S: Real>(&self, a: &[f64], b: &[S]) -> f64 {
        let mut doubles: Interpreter<f64> = self.broken.default_interpreter();
        let mut others: Interpreter<S> = self.broken.default_interpreter();
        let (rest, still) = (doubles.zero_momenta(), others.zero_momenta());
        let a = self.links(true, &mut doubles, a, &rest);
        let b = self.links(true, &mut others, b, &still);
        let pairs = a.iter().zip(&b);
        let off = pairs.flat_map(|(a, b)| (0..3).map(|k| (S::constant(a.position[k]) - b.position[k]).to_f64().abs()));
        // What is not a number is not near.
        off.fold(0.0, |most, x| if x.is_nan() || x > most { x } else { most })
    }
}

/// Advances a state to a time.
fn advance<S: Real, M: Stepper<Interpreter<S>>>(
    system: &mut Interpreter<S>,
    state: &mut State<S>,
    end: f64,
    step: Step,
    method: &impl Fn(&Interpreter<S>) -> M,
    mut seen: impl FnMut(&mut Interpreter<S>, &State<S>),
) -> Result<(), Failed> {
    let first = S::constant(state.t);
    let method = method(system);
    let mut solver = Solver::new(system, method, step, first, &state.q, &state.p).map_err(Failed::Step)?;
    let end = S::constant(end);
    while solver.time() < end {
        solver.advance(system, end).map_err(Failed::Step)?;
        solver.state(system, &mut state.q, &mut state.p);
        state.t = solver.time().to_f64();
        state.steps += 1;
        seen(system, state);
    }
    Ok(())
}
