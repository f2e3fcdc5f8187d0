//! The cases of the conformance suite, which every evaluator of programs runs: machine code at run time, C,
//! WebAssembly. All give the bits of the program run operation by operation. Other tests hold programs in exact
//! arithmetic to the bits of the interpreter, and those in fast arithmetic to its accuracy. In fast arithmetic products and
//! sums are rounded once where the processor can do that, and twice elsewhere ([`Case::runs`], [`Case::fused_runs`]).

use mbd_codegen::code::{compile, Code};
use mbd_codegen::generate::{chosen_frames, sizes, InputArray};
use mbd_codegen::options::{EliminationStrategy, PlanOptions};
use mbd_codegen::plan::Plan;
use mbd_codegen::{search, Arithmetic, Options, Output, Precision, RolledCode};
use mbd_runtime::trig::{sincos_f32, sincos_f64};

use crate::branches::{centipede, NUMBERS};
use crate::chains::{general, planar};
use crate::closed::{random_loops, LoopKnobs};
use crate::fused::{Fused, Number};
use crate::random::{random_model, Distribution, Rng};
use crate::state::{random_state, State};

/// A mechanism in a state, and options, in exact arithmetic unless they are made [`fast`](Case::fast).
#[derive(Clone, Debug)]
pub struct Case {
    /// What messages call it; also a valid identifier.
    pub name: String,
    /// The mechanism.
    pub plan: Plan,
    /// Options, whose outputs do not count.
    pub options: Options,
    /// State and inputs.
    pub state: State,
    /// Whether derivatives are compared too, which are as large as all other outputs together.
    pub derivatives: bool,
}

/// An output of a case, with its inputs and the results that every evaluator must give.
#[derive(Clone, Debug)]
pub struct Run {
    /// The output.
    pub output: Output,
    /// Its input arrays: arguments, then fields.
    pub inputs: Vec<InputArray>,
    /// Their entries, one array after the other.
    pub given: Vec<f64>,
    /// Lengths of the results.
    pub lengths: Vec<usize>,
    /// Entries of the results, one array after the other. Those of single precision are widened.
    pub expected: Vec<f64>,
    /// Whether the program has loops.
    pub rolled: bool,
}

impl Run {
    /// The entries of every input array.
    pub fn arrays(&self) -> Vec<&[f64]> {
        let mut rest = &self.given[..];
        self.inputs.iter().map(|array| rest.split_off(..array.len()).expect("as many entries as inputs")).collect()
    }

    /// Asserts that an evaluator gave the bits expected; signs of zeros and of NaN do not count.
    ///
    /// # Panics
    /// It gave others.
    pub fn check(&self, whose: &str, found: &[f64]) {
        assert_eq!(found.len(), self.expected.len(), "{whose}: {:?}", self.output);
        for (k, (a, b)) in found.iter().zip(&self.expected).enumerate() {
            let same = a == b || (a.is_nan() && b.is_nan());
            assert!(same, "{whose}: {:?}[{k}] is {a:e}, by the program {b:e}", self.output);
        }
    }
}

impl Case {
    fn new(name: String, plan: Plan, options: Options, state: State) -> Case {
        Case { name, plan, options, state, derivatives: false }
    }

    /// The same in single precision.
    #[must_use]
    pub fn single(self) -> Case {
        let options = Options { precision: Precision::F32, ..self.options };
        Case { name: format!("{}_f32", self.name), options, derivatives: false, ..self }
    }

    /// The same in fast arithmetic.
    #[must_use]
    pub fn fast(self) -> Case {
        let options = Options { arithmetic: Arithmetic::Fast, ..self.options };
        Case { name: format!("{}_fast", self.name), options, ..self }
    }

    /// Its outputs with what they must give. Products are rounded before they are added.
    ///
    /// # Panics
    /// If the generator refuses an output.
    pub fn runs(&self) -> Vec<Run> {
        match self.options.precision {
            Precision::F64 => self.runs_in::<f64>(),
            Precision::F32 => self.runs_in::<f32>(),
        }
    }

    /// The same where `a · b + c` of fast arithmetic is rounded once, in sines and cosines, too.
    ///
    /// # Panics
    /// If the generator refuses an output.
    pub fn fused_runs(&self) -> Vec<Run> {
        match (self.options.arithmetic, self.options.precision) {
            (Arithmetic::Exact, _) => self.runs(),
            (Arithmetic::Fast, Precision::F64) => self.runs_in::<Fused<f64>>(),
            (Arithmetic::Fast, Precision::F32) => self.runs_in::<Fused<f32>>(),
        }
    }

    fn runs_in<S: Number>(&self) -> Vec<Run> {
        let available = Output::available(!self.plan.constraints.is_empty());
        let wanted = available.filter(|output| self.derivatives || !output.name().contains("derivatives"));
        let (p, a) = (self.state.v.iter().map(|x| 0.7 * x - 0.1).collect::<Vec<_>>(), vec![0.3; self.state.v.len()]);
        let run = |output| {
            let program = compile(&self.plan, output, &self.options).unwrap_or_else(|e| panic!("{}: {e}", self.name));
            let given: Vec<S> = self.state.inputs_of(&program.inputs, &p, &a).into_iter().map(S::constant).collect();
            let expected = evaluate(&program.program, &given);
            let frames = chosen_frames(&self.plan, &self.options).expect("all frames").len();
            let sizes = sizes(&self.plan, &self.options, frames);
            Run {
                output,
                lengths: program.spec.results.iter().map(|array| array.len(&sizes)).collect(),
                given: given.iter().map(|x| x.widened()).collect(),
                expected: expected.iter().map(|x| x.widened()).collect(),
                rolled: matches!(program.program, Code::Rolled(_)),
                inputs: program.inputs,
            }
        };
        wanted.map(run).collect()
    }
}

/// Results of a program, operation by operation.
pub fn evaluate<S: Number>(code: &Code, given: &[S]) -> Vec<S> {
    match code {
        Code::Straight(program) => program.evaluate(given, S::fma),
        Code::Rolled(program) => program.evaluate(given, S::fma),
    }
}

/// Options in exact arithmetic.
pub fn exact(elimination: EliminationStrategy, rolled: RolledCode) -> Options {
    let plan = PlanOptions { elimination, rolled, ..PlanOptions::default() };
    Options { arithmetic: Arithmetic::Exact, plan, ..Options::default() }
}

/// A random tree of up to six bodies with everything that models can have.
pub fn tree(seed: u64) -> Case {
    let model = random_model(seed, &Distribution::everything(seed, 6));
    let strategies = [EliminationStrategy::Single, EliminationStrategy::Fewest, EliminationStrategy::Fastest];
    let options = exact(strategies[(seed % 3) as usize], RolledCode::Never);
    let plan = search::plan(&model, options.plan);
    let state = random_state(&plan, seed);
    Case::new(format!("tree{seed}"), plan, options, state)
}

/// A random mechanism with loops.
pub fn closed(seed: u64) -> Case {
    let system = random_loops(seed, &LoopKnobs::everything(seed, 5));
    let options = exact(EliminationStrategy::Single, RolledCode::Never);
    let plan = search::plan(&system.model, options.plan);
    Case::new(format!("closed{seed}"), plan, options, system.state)
}

/// A random chain, whose programs are rolled wherever links repeat.
pub fn chain(seed: u64) -> Case {
    let n = 6 + (seed % 7) as usize;
    let model = match seed % 4 {
        3 => centipede(seed, 4 + n % 2, 2, NUMBERS[seed as usize / 4 % 4]),
        1 => planar(seed, n),
        _ => general(seed, n),
    };
    let options = exact(EliminationStrategy::Single, RolledCode::Always);
    let plan = search::plan(&model, options.plan);
    let state = random_state(&plan, seed);
    Case::new(format!("chain{seed}"), plan, options, state)
}

/// A case at positions beyond the range in which sines have a short way: large ones, infinite ones, NaN.
pub fn far(mut case: Case) -> Case {
    let far = [3e6, -7.5e11, 1e300, f64::INFINITY, f64::NAN];
    for (k, x) in case.state.q.iter_mut().enumerate() {
        *x *= far[k % if k % 3 == 0 { 3 } else { 5 }];
    }
    Case { name: format!("{}_far", case.name), ..case }
}

/// Cases of the first seeds: every eighth with derivatives, every fourth also in single precision, every eighth also at
/// far positions, in both precisions.
pub fn sampled(case: fn(u64) -> Case, seeds: u64) -> Vec<Case> {
    let of_seed = |seed: u64| {
        let case = case(seed);
        let mut all = vec![Case { derivatives: seed.is_multiple_of(8), ..case.clone() }];
        if seed % 4 == 1 {
            all.push(case.clone().single());
        }
        if seed % 8 == 2 {
            all.extend([far(case.clone()), far(case).single()]);
        }
        all
    };
    (0..seeds).flat_map(of_seed).collect()
}

/// Cases in fast arithmetic: those of each kind whose programs take little time to rewrite.
pub fn fast() -> Vec<Case> {
    let all = [tree(5), tree(17), tree(20).single(), far(tree(21)), closed(12), chain(7)];
    all.map(Case::fast).to_vec()
}

/// Angles on which sines are compared, rad: zeros, infinite ones, NaN, the ends of ranges, random ones over all
/// exponents, next to multiples of a quarter turn, and around the end of the range that has a short way. Those for single
/// precision are numbers of single precision.
pub fn angles(precision: Precision) -> Vec<f64> {
    use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};
    let mut rng = Rng::new(1, 1);
    let mut angles =
        vec![0.0, -0.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, f64::MAX, f64::MIN_POSITIVE, 1e6, 1600.0];
    let (least, most) = match precision {
        Precision::F64 => (-1080.0, 1024.0),
        Precision::F32 => (-155.0, 128.0),
    };
    for _ in 0..4000 {
        let size = rng.range(least, most).exp2();
        angles.extend([size * rng.around(1.0), (size * FRAC_2_PI).round() * FRAC_PI_2]);
    }
    angles.extend((0..3000).map(|k| f64::from(k) * FRAC_PI_2));
    angles.extend((0..2000).map(|_| rng.around(2e6)));
    match precision {
        Precision::F64 => angles,
        Precision::F32 => angles.into_iter().map(|x| f64::from(x as f32)).collect(),
    }
}

/// Sine and cosine by the runtime; those of single precision are widened.
pub fn sine_and_cosine(precision: Precision, angle: f64) -> [f64; 2] {
    match precision {
        Precision::F64 => sincos_f64(angle).into(),
        Precision::F32 => <[f32; 2]>::from(sincos_f32(angle as f32)).map(f64::from),
    }
}
