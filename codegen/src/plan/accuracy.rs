//! What a form costs in accuracy, measured on a few states: a form that loses is not chosen.
//!
//! A program is run twice: on doubles, and with every operation rounded to 42 bits. What separates the two is the rounding
//! error of the program in units of 2⁻⁴², which conditioning makes large or small just as it does in units of 2⁻⁵³; no
//! wider numbers are needed. States and rounding are the same on every machine, and so is the choice.
//!
//! Programs are judged as the sweeps make them. What [`Arithmetic::Fast`](crate::options::Arithmetic::Fast) does to them afterwards changes the error little,
//! whatever the form, and takes longer than all the rest.

use std::ops::{Add, Div, Mul, Neg, Range, Sub};

use mbd_runtime::tree::Source;
use mbd_runtime::Scalar;

use super::forms::options;
use super::Plan;
use crate::model::JointKind;
use crate::options::Group;
use crate::symbolic::Program;
use crate::trace::{trace, InputArray};

/// States that errors are measured on: few for long programs, in which roundings average out.
const STATES: std::ops::RangeInclusive<usize> = 64..=1024;

/// Operations in all states together, beyond which there are fewer states.
const WORK: usize = 2_000_000;

/// The largest [`Judge::loss`] of a form that is chosen. Over many states the median error is to stay below 2 times that
/// of the articulated form, the worst below 3 times; rewriting for speed costs about a tenth, and what is measured on a few
/// hundred states is known to a tenth.
pub const LIMIT: f64 = 1.45;

/// One state in so many is counted among the worst.
const RARE: usize = 16;

/// What the worst errors may grow by, in multiples of what the middle ones may.
const WORST: f64 = 1.5;

/// Bits that an operation keeps.
const BITS: u32 = 42;

/// Those of a double.
const ALL: u32 = f64::MANTISSA_DIGITS;

/// Errors below two roundings of the largest result are not compared.
const FLOOR: f64 = 2.0 / (1_u64 << BITS) as f64;

/// States that are run at once.
const LANES: usize = 8;

/// Doubles of which each operation keeps some bits. Constants, inputs, sines and cosines are not rounded.
#[derive(Clone, Copy)]
struct Lanes<const BITS: u32>([f64; LANES]);

/// To nearest, by Veltkamp's splitting.
#[inline]
fn rounded<const BITS: u32>(x: f64) -> f64 {
    let t = x * ((1_u64 << (ALL - BITS)) + 1) as f64;
    if BITS < ALL {
        t - (t - x)
    } else {
        x
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl<const BITS: u32> $trait for Lanes<BITS> {
            type Output = Self;
            #[inline]
            fn $name(self, other: Self) -> Self {
                Lanes(std::array::from_fn(|k| rounded::<BITS>($trait::$name(self.0[k], other.0[k]))))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl<const BITS: u32> Neg for Lanes<BITS> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Lanes(self.0.map(|x| -x))
    }
}

impl<const BITS: u32> Scalar for Lanes<BITS> {
    fn constant(x: f64) -> Self {
        Lanes([x; LANES])
    }
    fn sin_cos(self) -> (Self, Self) {
        let both = self.0.map(Scalar::sin_cos);
        (Lanes(both.map(|(s, _)| s)), Lanes(both.map(|(_, c)| c)))
    }
    fn sqrt(self) -> Self {
        Lanes(self.0.map(|x| rounded::<BITS>(Scalar::sqrt(x))))
    }
}

/// Results of a program.
fn run<const BITS: u32>(program: &Program, inputs: &[[f64; LANES]]) -> Vec<[f64; LANES]> {
    let inputs: Vec<Lanes<BITS>> = inputs.iter().map(|x| Lanes(*x)).collect();
    program.evaluate(&inputs, |a, b, c| a * b + c).into_iter().map(|x| x.0).collect()
}

/// Inputs of a program in some states, and its results there.
struct Sample {
    inputs: Vec<[f64; LANES]>,
    results: Vec<[f64; LANES]>,
}

/// Measures the programs of forms against the articulated form.
pub struct Judge {
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

impl Judge {
    /// A judge of one output of other forms of a plan with joints one by one: the rates, or the accelerations. Parameters
    /// have their default values.
    pub fn new(plan: &Plan, group: Group) -> Judge {
        let mut judge = Judge { parts: Vec::new(), samples: Vec::new(), articulated: Vec::new() };
        let plan = &turned(plan);
        let [Ok(momenta), Ok(single)] = [Group::Momenta, group].map(|group| trace(plan, group, &options(group))) else {
            return judge;
        };
        let n = single.program.outputs.len();
        judge.parts = if group == Group::Rates { vec![0..plan.dims.nq, plan.dims.nq..n] } else { vec![0..n; 1] };
        let states = (WORK / single.program.steps.len().max(1)).clamp(*STATES.start(), *STATES.end());
        for k in 0..states / LANES {
            let mut states: [State; LANES] = std::array::from_fn(|lane| State::new(plan, (k * LANES + lane) as u64));
            let p = run::<ALL>(&momenta.program, &inputs(&states, &momenta.inputs));
            for (lane, state) in states.iter_mut().enumerate() {
                state.p = p.iter().map(|p| p[lane]).collect();
            }
            let inputs = inputs(&states, &single.inputs);
            judge.samples.push(Sample { results: run::<ALL>(&single.program, &inputs), inputs });
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
            let results = run::<BITS>(program, &sample.inputs);
            for (errors, part) in all.iter_mut().zip(&self.parts) {
                let (results, reference) = (&results[part.clone()], &sample.results[part.clone()]);
                errors.extend((0..LANES).filter_map(|lane| error(results, reference, lane)));
            }
        }
        all.into_iter().map(Errors::new).collect()
    }
}

/// The plan with frames that all turn.
fn turned(plan: &Plan) -> Plan {
    let mut plan = plan.clone();
    plan.nodes.iter_mut().for_each(|node| node.unturned = false);
    plan
}

/// Largest error of some results in one state, relative to the largest of them; nothing where there is no result.
fn error(results: &[[f64; LANES]], reference: &[[f64; LANES]], lane: usize) -> Option<f64> {
    let (mut size, mut off) = (f64::MIN_POSITIVE, 0.0_f64);
    for (r, x) in results.iter().zip(reference) {
        // A value that is none must not vanish in a maximum.
        let d = if r[lane].is_finite() { (r[lane] - x[lane]).abs() } else { f64::INFINITY };
        (size, off) = (size.max(x[lane].abs()), off.max(d));
    }
    // A quarter of a rounding stands for exact results, which have no logarithm.
    reference.iter().all(|x| x[lane].is_finite()).then(|| (off / size).max(FLOOR / 8.0))
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
                JointKind::Slider { .. } => {
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
    fn input(&self, array: &InputArray) -> Vec<f64> {
        match array.name.as_str() {
            "q" => self.q.clone(),
            "v" => self.v.clone(),
            "p" => self.p.clone(),
            "self.drive_q" => self.drive_q.clone(),
            "self.params" => self.params.clone(),
            "self.drive_v" => random(self.seed, 3, array.len, 1.5),
            "self.gravity" => random(self.seed, 4, array.len, 9.0),
            _ => random(self.seed, 5, array.len, 3.0),
        }
    }
}

/// Inputs of a program in their order, in some states.
fn inputs(states: &[State; LANES], arrays: &[InputArray]) -> Vec<[f64; LANES]> {
    let lanes = states.each_ref().map(|state| arrays.iter().flat_map(|a| state.input(a)).collect::<Vec<f64>>());
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
