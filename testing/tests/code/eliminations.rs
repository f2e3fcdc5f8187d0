//! Eliminations that are chosen for speed do not cost accuracy. The errors of default programs are compared with those
//! of the articulated elimination, which eliminates one joint at a time from the tips to the base.
//!
//! Errors are measured against the interpreter with the articulated elimination on numbers of 106 bits; see `wide` for
//! details. Default programs run with fused multiply-adds and without; the larger error counts.
//!
//! Limits, for every model and each of q̇, ṗ and v̇: the median error at most 2 times, the worst error of 10,000 states
//! at most 3 times that of the articulated elimination in exact arithmetic. The test that always runs has a few hundred
//! states and compares the errors that 99 of 100 states stay below. Errors below two roundings of the largest entry are
//! not compared: there the articulated elimination may be exact by chance.
//!
//! The report, `book/src/accuracy.md`, is written by
//! `cargo test --release -p mbd-testing --test code eliminations -- --ignored --nocapture`.

use std::fmt::Write;

use crate::wide::{model, Errors, Spread, Wide, MANY, MODELS};
use mbd_codegen::generate::{trace, OutputProgram};
use mbd_codegen::model::{JointKind, Model};
use mbd_codegen::options::{EliminationStrategy, PlanOptions};
use mbd_codegen::plan::Plan;
use mbd_codegen::search::{self, Candidate, Chosen};
use mbd_codegen::symbolic::Program;
use mbd_codegen::{Arithmetic, Options, Output};
use mbd_runtime::Scalar;
use mbd_testing::chains;
use mbd_testing::random::{random_model, Distribution};
use mbd_testing::state::{random_state, State};

/// The arrays whose errors are measured.
const ARRAYS: [&str; 3] = ["q̇", "ṗ", "v̇"];

/// A kind of program: how joints are eliminated, and how operations are rewritten.
type Kind = (EliminationStrategy, Arithmetic);

const ARTICULATED: Kind = (EliminationStrategy::Single, Arithmetic::Exact);
const DEFAULT: Kind = (EliminationStrategy::Fastest, Arithmetic::Fast);

fn chosen(model: &Model, elimination: EliminationStrategy) -> Chosen {
    let options = PlanOptions { elimination, ..PlanOptions::default() };
    search::best(Plan::new(model, options.snap), options)
}

/// Errors in each array of one model's programs, for each kind.
fn measure(plans: &[Plan], kinds: &[Kind], states: u64) -> Vec<[Spread; 3]> {
    let mut all = vec![[(); 3].map(|()| [(); 2].map(|()| Errors::default())); kinds.len()];
    for output in [Output::Rates, Output::Accelerations] {
        let program = |(plan, &(_, arithmetic)): (&Plan, &Kind)| {
            trace(plan, output, &Options { arithmetic, ..Options::default() }).expect("no frames are named")
        };
        let programs: Vec<OutputProgram<Program>> = plans.iter().zip(kinds).map(program).collect();
        for seed in 0..states {
            let s = random_state(&plans[0], seed);
            let mut p = vec![0.0; plans[0].dims.nv];
            s.interpreter(&plans[0]).momenta(&s.q, &s.v, &mut p);
            let given = s.inputs_of(&programs[0].inputs, &p, &s.v);
            let right = reference(&plans[0], output, &s, &p);
            for ((errors, program), &(_, arithmetic)) in all.iter_mut().zip(&programs).zip(kinds) {
                let plain = program.program.evaluate(&given, |a, b, c| a * b + c);
                // Exact programs contain no fused multiply-adds.
                let fused = match arithmetic {
                    Arithmetic::Exact => plain.clone(),
                    Arithmetic::Fast => program.program.evaluate(&given, f64::mul_add),
                };
                let results = [fused, plain];
                for (k, results) in results.iter().enumerate() {
                    add(errors, k, output, plans[0].dims.nq, results, &right);
                }
            }
        }
    }
    let larger = |[fused, plain]: &[Errors; 2]| Spread::new(fused).larger(Spread::new(plain));
    all.iter().map(|arrays| arrays.each_ref().map(larger)).collect()
}

/// The output of a plan in one state, in double-double numbers. The computation starts from the numbers of the model,
/// so the rounding of constants that programs fold counts as an error of the programs.
fn reference(plan: &Plan, output: Output, s: &State, p: &[f64]) -> Vec<Wide> {
    let wide = |list: &[f64]| list.iter().map(|x| Wide::constant(*x)).collect::<Vec<Wide>>();
    let mut interpreter = s.interpreter_of(plan, |x, _| Wide::constant(x));
    let zeros = |n: usize| vec![Wide::zero(); n];
    let (mut v, mut qd, mut pd) = (zeros(plan.dims.nv), zeros(plan.dims.nq), zeros(plan.dims.nv));
    if output == Output::Accelerations {
        interpreter.accelerations(&wide(&s.q), &wide(&s.v), &mut v);
        return v;
    }
    interpreter.rates(&wide(&s.q), &wide(p), &mut v, &mut qd, &mut pd);
    [qd, pd].concat()
}

/// Adds the errors of one state to those of the arrays of an output.
fn add(errors: &mut [[Errors; 2]; 3], k: usize, output: Output, nq: usize, results: &[f64], right: &[Wide]) {
    if output == Output::Accelerations {
        return errors[2][k].add(results, right);
    }
    errors[0][k].add(&results[..nq], &right[..nq]);
    errors[1][k].add(&results[nq..], &right[nq..]);
}

/// All models, with names.
fn models() -> Vec<(String, Model)> {
    let mut all: Vec<(String, Model)> =
        MODELS.iter().map(|&(file, base)| (file.to_string(), model(file, base))).collect();
    all.extend(
        [3, 4, 5, 6, 7, 8, 9, 10, 12, 15, 20].map(|n| (format!("{n} revolute joints"), chains::general(n as u64, n))),
    );
    all.extend([5, 10, 20].map(|n| (format!("{n} revolute joints, planar"), chains::planar(n as u64, n))));
    all.extend(chains::ill_conditioned());
    all.extend((0..TREES).map(|seed| (format!("tree {seed}, joints of all kinds"), tree(seed))));
    all
}

/// Trees in the report.
const TREES: u64 = 16;

/// A tree with joints of all kinds.
fn tree(seed: u64) -> Model {
    random_model(seed, &Distribution { bodies: (6, 12), branching: 0.3, ..Distribution::everything(seed, 12) })
}

/// A line of text with the ratios of errors that are beyond the limits.
fn beyond(name: &str, ratios: &[Spread; 3]) -> Option<String> {
    let all = ratios.iter().zip(ARRAYS).filter(|(r, _)| !r.within_limits());
    let all: Vec<String> = all.map(|(r, array)| format!("{array} {:.2} ({:.2})", r.median, r.worst)).collect();
    (!all.is_empty()).then(|| format!("{name}: {}", all.join(", ")))
}

fn ratios(errors: &[Spread; 3], articulated: &[Spread; 3]) -> [Spread; 3] {
    std::array::from_fn(|k| errors[k].times(articulated[k]))
}

#[test]
fn default_eliminations_do_not_cost_accuracy() {
    let mut all = Vec::new();
    for (name, model) in models() {
        // Models that take a tenth of a second for each state are only in the report.
        if ["g1", "15", "20"].iter().any(|start| name.starts_with(start)) {
            continue;
        }
        let plans = [EliminationStrategy::Single, EliminationStrategy::Fastest]
            .map(|elimination| chosen(&model, elimination).plan);
        let found = |states| {
            let errors = measure(&plans, &[ARTICULATED, DEFAULT], states);
            beyond(&name, &ratios(&errors[1], &errors[0]))
        };
        // The worst hundredth of 200 states are two; who is beyond the limits with them is judged by thirty.
        all.extend(found(200).and_then(|_| found(3000)));
    }
    assert!(all.is_empty(), "{}", all.join("\n"));
}

#[test]
fn trees_have_joints_of_all_kinds() {
    let joints: Vec<JointKind> = (0..TREES).flat_map(|seed| tree(seed).joints).map(|j| j.kind).collect();
    let kinds: std::collections::HashSet<_> = joints.iter().map(std::mem::discriminant).collect();
    assert_eq!(kinds.len(), 9);
}

/// Kinds of programs in the report: besides the default, fast eliminations and fast arithmetic separately, and the
/// eliminations with the fewest operations.
const KINDS: [Kind; 5] = [
    ARTICULATED,
    DEFAULT,
    (EliminationStrategy::Fastest, Arithmetic::Exact),
    (EliminationStrategy::Single, Arithmetic::Fast),
    (EliminationStrategy::Fewest, Arithmetic::Fast),
];

const INTRODUCTION: &str = "\
# Rounding errors of the generated code

By default, generated code eliminates joints by the strategy that the cost model finds fastest, and rewrites its operations. This report shows what that
costs in accuracy. It compares the errors of the default programs, with fused multiply-adds or without, whichever are larger, with the errors of the
articulated elimination (one joint at a time, from the tips to the base) with the operations in the order of the sweeps. The numbers are ratios of these
errors: the median and the worst of 10,000 random states for each model. Errors are measured against double-double arithmetic (106 bits).

- The error of a state is the largest error in the array, relative to its largest entry, or to a tenth of the median of the largest
  entries where the array passes through zero. Errors below 2.2e-16, two roundings, count as 2.2e-16.
- The reference starts from the numbers of the model. Constants that the generator computes in advance are rounded, and these roundings count.
- Sines and cosines have the same 53 bits in all programs and in the reference. They are accurate to an ulp, and what is compared are the
  roundings after them.
- Limits: the median ratio is at most 2, the worst at most 3. The generator accepts a candidate only if its error is at most 1.6 times that of the
  articulated elimination on 64 to 256 states; `mbd count --candidates` shows the errors that it measured.
- This report is written by `cargo test --release -p mbd-testing --test code eliminations -- --ignored --nocapture`.
";

const DEFAULT_HEAD: &str = "
## Default programs

For each array: the median error of the articulated elimination, then the median and the worst error of the default program in multiples of it.

| model | q̇ | median | worst | ṗ | median | worst | v̇ | median | worst |
|---|---|---|---|---|---|---|---|---|---|
";

const CAUSES_HEAD: &str = "
## Elimination and arithmetic separately

Median and worst ratio, of the array in which they are largest. The candidates with the fewest operations are chosen on request only, and no limit
of accuracy applies to them.

| model | default | worst | fastest eliminations, exact | worst | one by one, fast | worst | fewest operations, fast | worst |
|---|---|---|---|---|---|---|---|---|
";

const REFUSED_HEAD: &str = "
## Candidates for the rates that were refused

The fastest refused candidate of each branch: its time by the cost model in multiples of the chosen candidate's, and its error ratio on the
generator's states.

| model | branch | elimination | time | error |
|---|---|---|---|---|
";

/// One line of each table of the report, and the ratios that are beyond the limits.
#[derive(Default)]
struct Lines {
    errors: String,
    causes: String,
    refused: String,
    beyond: Option<String>,
}

fn lines(name: &str, model: &Model) -> Result<Lines, std::fmt::Error> {
    let all = KINDS.map(|(elimination, _)| chosen(model, elimination));
    let refused = refusals(name, &all[1])?;
    let plans = all.map(|chosen| chosen.plan);
    let measured = measure(&plans, &KINDS, MANY);
    let ratios: Vec<[Spread; 3]> = measured.iter().map(|m| ratios(m, &measured[0])).collect();
    let mut lines = Lines { beyond: beyond(name, &ratios[1]), refused, ..Lines::default() };
    write!(lines.errors, "| {name} |")?;
    for (articulated, times) in measured[0].iter().zip(&ratios[1]) {
        write!(lines.errors, " {:.1e} | {:.2} | {:.2} |", articulated.median, times.median, times.worst)?;
    }
    write!(lines.causes, "| {name} |")?;
    for times in &ratios[1..] {
        let largest = times.iter().fold(times[0], |a, b| a.larger(*b));
        write!(lines.causes, " {:.2} | {:.2} |", largest.median, largest.worst)?;
    }
    println!("{}", lines.errors);
    Ok(lines)
}

/// Lines of all models, computed by several threads.
fn all_lines() -> Result<Vec<Lines>, std::fmt::Error> {
    const WORKERS: usize = 4;
    let models = models();
    let mut all: Vec<Result<Lines, _>> = Vec::new();
    all.resize_with(models.len(), || Ok(Lines::default()));
    std::thread::scope(|scope| {
        let mut shares: Vec<Vec<_>> = (0..WORKERS).map(|_| Vec::new()).collect();
        for (k, pair) in models.iter().zip(&mut all).enumerate() {
            shares[k % WORKERS].push(pair);
        }
        for share in shares {
            scope.spawn(|| share.into_iter().for_each(|((name, model), place)| *place = lines(name, model)));
        }
    });
    all.into_iter().collect()
}

/// Writes the report, and fails if a limit does not hold.
#[test]
#[ignore = "minutes: 10,000 states of every model"]
fn report() -> Result<(), std::fmt::Error> {
    let all = all_lines()?;
    let mut text = INTRODUCTION.to_string();
    text += DEFAULT_HEAD;
    all.iter().try_for_each(|l| writeln!(text, "{}", l.errors))?;
    text += CAUSES_HEAD;
    all.iter().try_for_each(|l| writeln!(text, "{}", l.causes))?;
    text += REFUSED_HEAD;
    text.extend(all.iter().map(|l| l.refused.as_str()));
    std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/../book/src/accuracy.md"), text).expect("the report");
    let beyond: Vec<String> = all.into_iter().filter_map(|l| l.beyond).collect();
    assert!(beyond.is_empty(), "{}", beyond.join("\n"));
    Ok(())
}

/// Lines of the report with the fastest refused candidate of each branch.
fn refusals(name: &str, Chosen { plan, candidates }: &Chosen) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    for taken in candidates.iter().filter(|c| c.taken) {
        let refused = candidates.iter().filter(|c| c.branch == taken.branch && c.refused);
        let time = |c: &Candidate| c.cost.cycles() / taken.cost.cycles();
        let Some(first) = refused.min_by(|a, b| time(a).total_cmp(&time(b))) else { continue };
        let [from, to] = taken.branch.map(|k| plan.nodes[k].name.as_str());
        let loss = first.loss.unwrap_or_default();
        writeln!(text, "| {name} | {from} to {to} | {} | {:.2} | {loss:.2} |", first.form, time(first))?;
    }
    Ok(text)
}
