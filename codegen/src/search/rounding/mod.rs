//! Rounding errors of eliminations, measured on a few states. An elimination that loses too much accuracy is not
//! chosen.
//!
//! Programs are run on doubles and compared with the interpreter on double-double numbers. The interpreter starts from
//! the numbers of the model: constants that a program computes in advance are rounded, and eliminations differ in the
//! effect of these roundings. States and numbers are the same on every machine, and so is the choice.
//!
//! Programs are measured before they are rewritten for [`Arithmetic::Fast`](crate::options::Arithmetic::Fast). The
//! rewriting changes the error little with every elimination, and it would take longer than everything else.

mod lanes;

use std::ops::{Range, RangeInclusive};

use mbd_runtime::{Interpreter, Scalar};

use self::lanes::{run, LANES};
use super::evaluation::options;
use super::wide::Wide;
use crate::output::{InputArray, Output};
use crate::plan::Plan;
use crate::sample::State;
use crate::symbolic::Program;
use crate::trace::trace;

/// Number of states in which errors are measured. Large trees need few, because their roundings average out.
const STATES: RangeInclusive<usize> = 64..=256;

/// Nodes in all states together, beyond which there are fewer states.
const WORK: usize = 1600;

/// The largest [`ErrorEstimator::loss`] of an elimination that is chosen. Over many states the median error is to stay
/// below 2 times that of one joint at a time, the worst below 3 times; rewriting for speed costs about a tenth, and the
/// measurement on a few hundred states has an error of a tenth.
pub const LIMIT: f64 = 1.6;

/// One state in this number counts among the worst.
const RARE: usize = 16;

/// Allowed growth of the worst errors relative to that of the median errors.
const WORST: f64 = 1.5;

/// Errors below two roundings of the largest result are not compared.
const FLOOR: f64 = f64::EPSILON;

/// Inputs of a program in some states, and the exact results there, lane by lane.
struct Sample {
    inputs: Vec<[f64; LANES]>,
    exact: [Vec<Wide>; LANES],
}

/// Measures rounding errors of programs against those of one joint at a time.
pub struct ErrorEstimator {
    /// Arrays whose errors are relative to their largest entries: `q̇` and `ṗ`, or accelerations.
    parts: Vec<Range<usize>>,
    samples: Vec<Sample>,
    /// Errors of one joint at a time, part by part.
    articulated: Vec<Errors>,
}

/// Errors in many states: the geometric mean, the median, and the geometric mean of the worst.
#[derive(Clone, Copy)]
struct Errors([f64; 3]);

impl Errors {
    fn new(mut errors: Vec<f64>) -> Errors {
        errors.sort_by(f64::total_cmp);
        let mean = |e: &[f64]| libm::exp(e.iter().map(|x| libm::log(*x)).sum::<f64>() / e.len().max(1) as f64);
        let (n, worst) = (errors.len(), &errors[errors.len() - errors.len() / RARE..]);
        let middle = errors.get(n / 2).copied().unwrap_or(1.0);
        Errors([mean(&errors), middle, mean(worst)].map(|x| x.max(FLOOR)))
    }

    /// Ratios to other errors.
    fn times(self, others: Errors) -> f64 {
        let [mean, median, worst]: [f64; 3] = std::array::from_fn(|k| self.0[k] / others.0[k]);
        mean.max(median).max(worst / WORST)
    }
}

impl ErrorEstimator {
    /// An estimator for programs of one output (the rates, or the accelerations) of `plan`, which has one joint at a
    /// time. Parameters have their default values.
    pub fn new(plan: &Plan, output: Output) -> ErrorEstimator {
        let mut estimator = ErrorEstimator { parts: Vec::new(), samples: Vec::new(), articulated: Vec::new() };
        let plan = &rotating(plan);
        let [Ok(momenta), Ok(single)] = [Output::Momenta, output].map(|output| trace(plan, output, &options(output)))
        else {
            return estimator;
        };
        let n = single.program.outputs.len();
        estimator.parts = if output == Output::Rates { vec![0..plan.dims.nq, plan.dims.nq..n] } else { vec![0..n; 1] };
        let states = (WORK / plan.nodes.len().max(1)).clamp(*STATES.start(), *STATES.end());
        let params: Vec<Wide> = plan.default_params().into_iter().map(Wide::constant).collect();
        let mut interpreter = Interpreter::new(plan.tree(&params), [Wide::zero(); 3]);
        for k in 0..states / LANES {
            let mut states: [State; LANES] = std::array::from_fn(|lane| State::new(plan, (k * LANES + lane) as u64));
            let p = run(&momenta.program, &inputs(&states, &momenta.inputs));
            for (lane, state) in states.iter_mut().enumerate() {
                state.p = p.iter().map(|p| p[lane]).collect();
            }
            let exact = states.each_ref().map(|state| exact(plan, output, state, &mut interpreter));
            estimator.samples.push(Sample { inputs: inputs(&states, &single.inputs), exact });
        }
        estimator.articulated = estimator.errors(&single.program);
        estimator
    }

    /// The error of a program of the same output, in multiples of that of one joint at a time: of the part that loses
    /// most, in the mean, the median or the worst states.
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
                let lanes = sample.exact.iter().enumerate();
                errors.extend(lanes.filter_map(|(k, exact)| error(&results[part.clone()], k, &exact[part.clone()])));
            }
        }
        all.into_iter().map(Errors::new).collect()
    }
}

/// The plan with frames that all rotate with their joints.
fn rotating(plan: &Plan) -> Plan {
    let mut plan = plan.clone();
    plan.nodes.iter_mut().for_each(|node| node.elimination.non_rotating = false);
    plan
}

/// Largest error of some results in one state, relative to the largest of them; nothing where there is no result.
fn error(results: &[[f64; LANES]], lane: usize, exact: &[Wide]) -> Option<f64> {
    let (mut size, mut off) = (f64::MIN_POSITIVE, 0.0_f64);
    for (r, x) in results.iter().zip(exact) {
        // A result that is not a number must not be lost in a maximum.
        let d = if r[lane].is_finite() { (x.0 - r[lane]).hi().abs() } else { f64::INFINITY };
        (size, off) = (size.max(x.0.hi().abs()), off.max(d));
    }
    // Exact results, whose error has no logarithm, count as a quarter of a rounding.
    exact.iter().all(|x| x.0.hi().is_finite()).then(|| (off / size).max(FLOOR / 8.0))
}

/// The results that programs should give, in double-double numbers.
fn exact(plan: &Plan, output: Output, state: &State, interpreter: &mut Interpreter<Wide>) -> Vec<Wide> {
    let d = plan.dims;
    state.set_inputs(plan, interpreter, options(output).efforts);
    let wide = |x: &[f64]| x.iter().map(|x| Wide::constant(*x)).collect::<Vec<Wide>>();
    let zeros = |n: usize| vec![Wide::zero(); n];
    let (mut v, mut qd, mut pd) = (zeros(d.nv), zeros(d.nq), zeros(d.nv));
    if output == Output::Accelerations {
        interpreter.accelerations(&wide(&state.q), &wide(&state.v), &mut v);
        return v;
    }
    interpreter.rates(&wide(&state.q), &wide(&state.p), &mut v, &mut qd, &mut pd);
    [qd, pd].concat()
}

/// Inputs of a program in their order, in some states.
fn inputs(states: &[State; LANES], arrays: &[InputArray]) -> Vec<[f64; LANES]> {
    let lanes =
        states.each_ref().map(|state| arrays.iter().flat_map(|a| state.input(a.name, a.len())).collect::<Vec<f64>>());
    (0..lanes[0].len()).map(|k| std::array::from_fn(|lane| lanes[lane][k])).collect()
}
