//! What a form costs in accuracy, measured on a few states: a form that loses is not chosen.
//!
//! Programs are run on doubles, and compared with the interpreter on double-double numbers. It starts from the numbers of
//! the model: a constant that a program folds is rounded, and forms differ in what becomes of that. States and numbers are
//! the same on every machine, and so is the choice.
//!
//! Programs are judged as the sweeps make them. What [`Arithmetic::Fast`](crate::options::Arithmetic::Fast) does to them afterwards changes the error little,
//! whatever the form, and takes longer than all the rest.

use std::ops::{Add, Div, Mul, Neg, Range, Sub};

use mbd_runtime::tree::Source;
use mbd_runtime::{Interpreter, Scalar};

use super::forms::options;
use super::Plan;
use crate::model::{Gravity, JointKind};
use crate::options::Output;
use crate::symbolic::Program;
use crate::trace::{trace, InputArray};
use crate::wide::Wide;

/// States that errors are measured on: few for large trees, in which roundings average out.
const STATES: std::ops::RangeInclusive<usize> = 64..=256;

/// Nodes in all states together, beyond which there are fewer states.
const WORK: usize = 1600;

/// The largest [`ErrorEstimator::loss`] of a form that is chosen. Over many states the median error is to stay below 2 times that
/// of the articulated form, the worst below 3 times; rewriting for speed costs about a tenth, and what is measured on a few
/// hundred states is known to a tenth.
pub const LIMIT: f64 = 1.6;

/// One state in so many is counted among the worst.
const RARE: usize = 16;

/// What the worst errors may grow by, in multiples of what the middle ones may.
const WORST: f64 = 1.5;

/// Errors below two roundings of the largest result are not compared.
const FLOOR: f64 = f64::EPSILON;

/// States that are run at once.
const LANES: usize = 8;

/// Doubles.
#[derive(Clone, Copy)]
struct Lanes([f64; LANES]);

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl $trait for Lanes {
            type Output = Self;
            #[inline]
            fn $name(self, other: Self) -> Self {
                Lanes(std::array::from_fn(|k| $trait::$name(self.0[k], other.0[k])))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl Neg for Lanes {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Lanes(self.0.map(|x| -x))
    }
}

impl Scalar for Lanes {
    fn constant(x: f64) -> Self {
        Lanes([x; LANES])
    }
    fn sin_cos(self) -> (Self, Self) {
        let both = self.0.map(Scalar::sin_cos);
        (Lanes(both.map(|(s, _)| s)), Lanes(both.map(|(_, c)| c)))
    }
    fn sqrt(self) -> Self {
        Lanes(self.0.map(Scalar::sqrt))
    }
    fn reciprocal_above(self, floor: Self) -> Self {
        Lanes(std::array::from_fn(|k| self.0[k].reciprocal_above(floor.0[k])))
    }
}

/// Results of a program.
fn run(program: &Program, inputs: &[[f64; LANES]]) -> Vec<[f64; LANES]> {
    let inputs: Vec<Lanes> = inputs.iter().map(|x| Lanes(*x)).collect();
    program.evaluate(&inputs, |a, b, c| a * b + c).into_iter().map(|x| x.0).collect()
}

/// Inputs of a program in some states, and what is right there, lane by lane.
struct Sample {
    inputs: Vec<[f64; LANES]>,
    right: [Vec<Wide>; LANES],
}

/// Measures the programs of forms against the articulated form.
pub struct ErrorEstimator {
    /// Results that are measured by their largest: `q̇` and `ṗ`, or accelerations.
    parts: Vec<Range<usize>>,
    samples: Vec<Sample>,
    /// Errors of the articulated form, part by part.
    articulated: Vec<Errors>,
}

/// Errors in many states: the geometric mean, the median, and the geometric mean of the worst.
#[derive(Clone, Copy)]
struct Errors([f64; 3]);

impl Errors {
    fn new(mut errors: Vec<f64>) -> Errors {
        errors.sort_by(f64::total_cmp);
        let mean = |e: &[f64]| (e.iter().map(|x| x.ln()).sum::<f64>() / e.len().max(1) as f64).exp();
        let (n, worst) = (errors.len(), &errors[errors.len() - errors.len() / RARE..]);
        let middle = errors.get(n / 2).copied().unwrap_or(1.0);
        Errors([mean(&errors), middle, mean(worst)].map(|x| x.max(FLOOR)))
    }

    /// In multiples of others.
    fn times(self, others: Errors) -> f64 {
        let [mean, median, worst]: [f64; 3] = std::array::from_fn(|k| self.0[k] / others.0[k]);
        mean.max(median).max(worst / WORST)
    }
}

impl ErrorEstimator {
    /// A judge of one output of other forms of a plan with joints one by one: the rates, or the accelerations. Parameters
    /// have their default values.
    pub fn new(plan: &Plan, group: Output) -> ErrorEstimator {
        let mut judge = ErrorEstimator { parts: Vec::new(), samples: Vec::new(), articulated: Vec::new() };
        let plan = &turned(plan);
        let [Ok(momenta), Ok(single)] = [Output::Momenta, group].map(|group| trace(plan, group, &options(group)))
        else {
            return judge;
        };
        let n = single.program.outputs.len();
        judge.parts = if group == Output::Rates { vec![0..plan.dims.nq, plan.dims.nq..n] } else { vec![0..n; 1] };
        let states = (WORK / plan.nodes.len().max(1)).clamp(*STATES.start(), *STATES.end());
        let params: Vec<Wide> = plan.default_params().into_iter().map(Wide::constant).collect();
        let mut interpreter = Interpreter::new(plan.tree(&params), [Wide::zero(); 3]);
        for k in 0..states / LANES {
            let mut states: [State; LANES] = std::array::from_fn(|lane| State::new(plan, (k * LANES + lane) as u64));
            let p = run(&momenta.program, &inputs(&states, &momenta.inputs));
            for (lane, state) in states.iter_mut().enumerate() {
                state.p = p.iter().map(|p| p[lane]).collect();
            }
            let right = states.each_ref().map(|state| state.right(plan, group, &mut interpreter));
            judge.samples.push(Sample { inputs: inputs(&states, &single.inputs), right });
        }
        judge.articulated = judge.errors(&single.program);
        judge
    }

    /// The error of a program of the same output, in multiples of that of the articulated form: of the part that loses most,
    /// in the mean, the median or the worst states.
    pub fn loss(&self, program: &Program) -> f64 {
        let losses = self.errors(program).into_iter().zip(&self.articulated).map(|(e, a)| e.times(*a));
        losses.fold(0.0, f64::max)
    }

    /// Errors of the parts.
    fn errors(&self, program: &Program) -> Vec<Errors> {
        let mut all = vec![Vec::new(); self.parts.len()];
        for sample in &self.samples {
            let results = run(program, &sample.inputs);
            for (errors, part) in all.iter_mut().zip(&self.parts) {
                let lanes = sample.right.iter().enumerate();
                errors.extend(lanes.filter_map(|(k, right)| error(&results[part.clone()], k, &right[part.clone()])));
            }
        }
        all.into_iter().map(Errors::new).collect()
    }
}

/// The plan with frames that all turn.
fn turned(plan: &Plan) -> Plan {
    let mut plan = plan.clone();
    plan.nodes.iter_mut().for_each(|node| node.elimination.non_rotating = false);
    plan
}

/// Largest error of some results in one state, relative to the largest of them; nothing where there is no result.
fn error(results: &[[f64; LANES]], lane: usize, right: &[Wide]) -> Option<f64> {
    let (mut size, mut off) = (f64::MIN_POSITIVE, 0.0_f64);
    for (r, x) in results.iter().zip(right) {
        // A value that is none must not vanish in a maximum.
        let d = if r[lane].is_finite() { (x.0 - r[lane]).hi().abs() } else { f64::INFINITY };
        (size, off) = (size.max(x.0.hi().abs()), off.max(d));
    }
    // A quarter of a rounding stands for exact results, which have no logarithm.
    right.iter().all(|x| x.0.hi().is_finite()).then(|| (off / size).max(FLOOR / 8.0))
}

/// A random state.
struct State {
    q: Vec<f64>,
    v: Vec<f64>,
    p: Vec<f64>,
    drive_q: Vec<f64>,
    params: Vec<f64>,
    seed: u64,
}

impl State {
    fn new(plan: &Plan, seed: u64) -> State {
        let d = plan.dims;
        let (mut q, mut drive_q) = (random(seed, 0, d.nq, 3.0), random(seed, 1, d.drive_q, 3.0));
        for slot in &plan.slots {
            let (list, at) = match slot.at {
                Some(Source::State { q: at, .. }) => (&mut q, at),
                Some(Source::Drive { q: at, .. }) => (&mut drive_q, at),
                None => continue,
            };
            let at = match plan.model.joints[slot.joint].kind {
                JointKind::Spherical => at,
                JointKind::Floating => at + 3,
                JointKind::Prismatic { .. } => {
                    list[at] *= 0.2;
                    continue;
                }
                _ => continue,
            };
            let norm = list[at..at + 4].iter().map(|x| x * x).sum::<f64>();
            list[at..at + 4].iter_mut().for_each(|x| *x /= Scalar::sqrt(norm));
        }
        State { q, v: random(seed, 2, d.nv, 1.5), p: Vec::new(), drive_q, params: plan.default_params(), seed }
    }

    /// One of the arrays that a program is called with.
    fn input(&self, name: &str, len: usize) -> Vec<f64> {
        match name {
            "q" => self.q.clone(),
            "v" => self.v.clone(),
            "p" => self.p.clone(),
            "self.drive_q" => self.drive_q.clone(),
            "self.params" => self.params.clone(),
            "self.drive_v" => random(self.seed, 3, len, 1.5),
            "self.gravity" => random(self.seed, 4, len, 9.0),
            _ => random(self.seed, 5, len, 3.0),
        }
    }

    /// The output that programs should give.
    fn right(&self, plan: &Plan, group: Output, interpreter: &mut Interpreter<Wide>) -> Vec<Wide> {
        let d = plan.dims;
        let wide = |x: Vec<f64>| x.into_iter().map(Wide::constant).collect::<Vec<Wide>>();
        let input = |name: &str, len: usize| wide(self.input(name, len));
        let inputs = &mut *interpreter;
        if options(group).efforts {
            inputs.tau = input("self.tau", d.nv);
        }
        inputs.drive_q = input("self.drive_q", d.drive_q);
        inputs.drive_v = input("self.drive_v", d.drive_v);
        inputs.drive_a = input("self.drive_a", d.drive_v);
        let wrenches = input("self.wrenches", 6 * d.wrenches);
        inputs.wrenches = wrenches.chunks_exact(6).map(|w| std::array::from_fn(|k| w[k])).collect();
        let gravity = match plan.model.gravity {
            Gravity::Input => self.input("self.gravity", 3),
            Gravity::Constant(_) => plan.gravity(&self.params).to_vec(),
        };
        inputs.gravity = std::array::from_fn(|k| Wide::constant(gravity[k]));
        let zeros = |n: usize| vec![Wide::zero(); n];
        let (mut v, mut qd, mut pd) = (zeros(d.nv), zeros(d.nq), zeros(d.nv));
        if group == Output::Accelerations {
            interpreter.accelerations(&wide(self.q.clone()), &wide(self.v.clone()), &mut v);
            return v;
        }
        interpreter.rates(&wide(self.q.clone()), &wide(self.p.clone()), &mut v, &mut qd, &mut pd);
        [qd, pd].concat()
    }
}

/// Inputs of a program in their order, in some states.
fn inputs(states: &[State; LANES], arrays: &[InputArray]) -> Vec<[f64; LANES]> {
    let lanes =
        states.each_ref().map(|state| arrays.iter().flat_map(|a| state.input(&a.name, a.len)).collect::<Vec<f64>>());
    (0..lanes[0].len()).map(|k| std::array::from_fn(|lane| lanes[lane][k])).collect()
}

/// Numbers evenly from `[-size, size)`: splitmix64.
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
