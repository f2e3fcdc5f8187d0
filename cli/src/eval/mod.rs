//! `mbd eval`: evaluates states. `book/src/eval-json.md` describes input and output.
//!
//! Machine code gives the same numbers as the interpreter, which evaluates about a thousand states in the time that making
//! the code takes.

mod input;
mod outer;

use std::collections::BTreeSet;
use std::io::Write;
use std::time::Instant;

use clap::ValueEnum;
use multibody::codegen::jit::Compiled;
use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::codegen::{Arithmetic, Options, Output};
use multibody::runtime::{Constrained, System};
use serde::Serialize;

use super::args::{EvalArgs, Quantity};
use super::output::{mentioned, note, write_result};
use super::{condition, loops, source, Failure, Outcome};
use input::{Inputs, State};
use outer::Outer;

/// The results of one state; outputs that were not requested are left out.
#[derive(Default, Serialize)]
struct Results {
    #[serde(skip_serializing_if = "Option::is_none")]
    p: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    qd: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pd: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    qdd: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    kinetic: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    potential: Option<f64>,
    #[serde(rename = "M", skip_serializing_if = "Option::is_none")]
    m: Option<Vec<Vec<f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    h: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tau: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    phi: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lambda: Option<Vec<f64>>,
}

impl Results {
    /// The first output that is not finite.
    fn not_finite(&self) -> Option<&'static str> {
        let bad = |list: &Option<Vec<f64>>| list.iter().flatten().any(|x| !x.is_finite());
        let bad_number = |x: Option<f64>| x.is_some_and(|x| !x.is_finite());
        let checks = [
            ("p", bad(&self.p)),
            ("qd", bad(&self.qd)),
            ("pd", bad(&self.pd)),
            ("qdd", bad(&self.qdd)),
            ("kinetic", bad_number(self.kinetic)),
            ("potential", bad_number(self.potential)),
            ("h", bad(&self.h)),
            ("tau", bad(&self.tau)),
            ("phi", bad(&self.phi)),
            ("lambda", bad(&self.lambda)),
            ("M", self.m.iter().flatten().flatten().any(|x| !x.is_finite())),
        ];
        checks.into_iter().find(|(_, bad)| *bad).map(|(key, _)| key)
    }
}

/// Runs `mbd eval`.
pub fn run(args: &EvalArgs, out: &mut dyn Write) -> Outcome {
    let plan = source::plan(&args.model, PlanOptions { snap: args.snap, ..PlanOptions::default() })?;
    let outer = Outer::new(&plan, args.layout);
    let (name, text) = source::json(&args.input)?;
    let inputs = input::read(&text, &plan, &outer).map_err(|findings| {
        for (place, what, help) in findings {
            note(format_args!("{name}{place}: error: {what}\n  help: {help}"));
        }
        Failure::Shown
    })?;
    for (place, what, help) in &inputs.warnings {
        note(format_args!("{name}{place}: warning: {what}\n  help: {help}"));
    }
    let wanted = match args.outputs.is_empty() {
        true => Quantity::value_variants(),
        false => &args.outputs[..],
    };
    let mut mechanism = mechanism(&plan, &inputs, wanted, args.interpreted)?;
    let text = evaluate(&plan, &outer, &mut mechanism, &inputs, wanted).map_err(|(state, failure)| match failure {
        Failure::Message(what, help) => Failure::new(format!("{name}: states[{state}]: {what}"), help),
        other => other,
    })?;
    write_result(args.output.as_deref(), &text, out)
}

/// The model with the parameters of the file, computed by machine code in exact arithmetic if there are enough states,
/// else by the interpreter. For many states it says which on standard error.
fn mechanism(plan: &Plan, inputs: &Inputs, wanted: &[Quantity], interpreted: bool) -> Outcome<Compiled> {
    let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    let mut mechanism = Compiled::from_plan(plan.clone(), options)
        .map_err(|e| Failure::new(e.to_string(), "evaluate with --interpreted"))?;
    mechanism.set_parameters(&inputs.params);
    let (states, enough) = (inputs.states.len(), Compiled::<f64>::WORTHWHILE as usize);
    if interpreted || states < enough {
        // A few states are interpreted without a word, as the help says.
        if states >= enough {
            note(format_args!("states: {states}, evaluated by the interpreter (--interpreted)"));
        }
        return Ok(mechanism.interpreted());
    }
    let clock = Instant::now();
    let outputs = outputs(wanted, plan.dims.rows > 0);
    let failed = |output: &Output| mechanism.prepare(*output).is_err();
    let left = mentioned("making machine code", || outputs.iter().copied().filter(failed).collect::<Vec<_>>());
    let names: Vec<&str> = left.iter().map(|output| output.name()).collect();
    let but = match names.is_empty() {
        true => String::new(),
        false => format!("; too large for it, and interpreted: {}", names.join(", ")),
    };
    note(format_args!(
        "states: {states}, evaluated by machine code (exact arithmetic: the interpreter's numbers), made in {:.0} ms{but}",
        1e3 * clock.elapsed().as_secs_f64()
    ));
    Ok(mechanism)
}

/// The outputs of which the requested quantities are computed.
fn outputs(wanted: &[Quantity], constrained: bool) -> BTreeSet<Output> {
    let of = |quantity: &Quantity| match quantity {
        Quantity::Momenta => Output::Momenta,
        Quantity::CoordinateRates | Quantity::MomentumRates => Output::Rates,
        Quantity::Accelerations => Output::Accelerations,
        Quantity::Kinetic | Quantity::Potential => Output::Energy,
        Quantity::MassMatrix => Output::MassMatrix,
        Quantity::Bias | Quantity::InverseDynamics => Output::InverseDynamics,
        Quantity::Residuals => Output::ConstraintResiduals,
        Quantity::Multipliers => Output::Multipliers,
    };
    let loops = |output: &Output| matches!(output, Output::ConstraintResiduals | Output::Multipliers);
    wanted.iter().map(of).filter(|output| constrained || !loops(output)).collect()
}

/// The JSON of all results, one state a line; or the first state without results, with the reason.
fn evaluate(
    plan: &Plan,
    outer: &Outer,
    mechanism: &mut Compiled,
    inputs: &Inputs,
    wanted: &[Quantity],
) -> Result<String, (usize, Failure)> {
    // Without inertia, only outputs that do not solve for velocities or accelerations exist.
    let unsolved = |w: &Quantity| {
        matches!(w, Quantity::Momenta | Quantity::MassMatrix | Quantity::Bias | Quantity::InverseDynamics)
    };
    let needs_rank = !wanted.iter().all(unsolved);
    let mut lines = Vec::new();
    for (k, state) in inputs.states.iter().enumerate() {
        state.apply(mechanism.inputs());
        if needs_rank {
            mechanism.inputs().check_rank(&state.q).map_err(|e| (k, source::rank_failure(&e)))?;
            if let Some(doubt) = condition::of_mass_matrix(plan, |m| mechanism.mass_matrix(&state.q, m)) {
                note(format_args!("states[{k}]: warning: {}\n  help: {}", doubt.what, doubt.help));
            }
        }
        for open in loops::violated(plan, mechanism, &state.q, &state.v) {
            note(format_args!("states[{k}]: warning: {open}"));
        }
        let results = results(plan, outer, mechanism, state, wanted);
        if let Some(key) = results.not_finite() {
            let what = format!("the result `{key}` is not finite");
            return Err((k, Failure::new(what, "look for very large numbers in the input")));
        }
        // Finite numbers and fixed keys can always be serialised.
        lines.push(serde_json::to_string(&results).unwrap_or_default());
    }
    Ok(format!("{{\"states\": [\n{}\n]}}\n", lines.join(",\n")))
}

fn results(plan: &Plan, outer: &Outer, mechanism: &mut Compiled, state: &State, wanted: &[Quantity]) -> Results {
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let (q, v) = (&state.q, &state.v);
    let has = |what: Quantity| wanted.contains(&what);
    let mut out = Results::default();
    let mut p = vec![0.0; nv];
    mechanism.momenta(q, v, &mut p);
    if has(Quantity::CoordinateRates) || has(Quantity::MomentumRates) {
        let (mut qd, mut pd) = (vec![0.0; nq], vec![0.0; nv]);
        mechanism.rates_at(0.0, q, &p, &mut qd, &mut pd);
        out.qd = has(Quantity::CoordinateRates).then(|| outer.coordinate_rates(q, &qd));
        out.pd = has(Quantity::MomentumRates).then(|| outer.derivative(q, v, &p, &pd));
    }
    if has(Quantity::Accelerations) {
        let mut a = vec![0.0; nv];
        mechanism.accelerations(q, v, &mut a);
        out.qdd = Some(outer.derivative(q, v, v, &a));
    }
    if has(Quantity::Kinetic) || has(Quantity::Potential) {
        let (kinetic, potential) = mechanism.energy(q, &p);
        out.kinetic = has(Quantity::Kinetic).then_some(kinetic);
        out.potential = has(Quantity::Potential).then_some(potential);
    }
    if has(Quantity::MassMatrix) {
        let mut m = vec![0.0; nv * nv];
        mechanism.mass_matrix(q, &mut m);
        out.m = Some(outer.matrix(q, &m));
    }
    for (what, a, to) in
        [(Quantity::Bias, &vec![0.0; nv], &mut out.h), (Quantity::InverseDynamics, &state.a, &mut out.tau)]
    {
        if has(what) {
            let mut tau = vec![0.0; nv];
            mechanism.inverse_dynamics(q, v, &outer.derivative_from(q, v, v, a), &mut tau);
            *to = Some(outer.velocities(q, &tau));
        }
    }
    if plan.dims.rows > 0 {
        let (mut phi, mut entries) = (mechanism.zero_rows(), mechanism.zero_entries());
        mechanism.constraint_residuals(q, &mut phi, &mut entries);
        out.phi = has(Quantity::Residuals).then_some(phi);
        out.lambda = has(Quantity::Multipliers).then(|| {
            let mut lambda = mechanism.zero_rows();
            mechanism.multipliers(0.0, q, v, &mut lambda);
            lambda
        });
    }
    out.p = has(Quantity::Momenta).then(|| outer.velocities(q, &p));
    out
}
