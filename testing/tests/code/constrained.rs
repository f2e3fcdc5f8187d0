//! Generated code of mechanisms with loops and couplings equals the interpreter bit for bit.
//!
//! As in `bitwise.rs`, an evaluator runs the emitted source text. Derivatives with respect to parameters are compared with
//! those of the interpreter on dual numbers.

use std::collections::HashMap;

use crate::emitted::Emitted;
use mbd_codegen::generate::{generate, generate_from, Arithmetic, Options, Output};
use mbd_codegen::model::{Gravity, Value};
use mbd_codegen::plan::Plan;
use mbd_codegen::search;
use mbd_codegen::{GenerateError, RolledCode};
use mbd_runtime::sweep::{ParameterDerivatives, Sweeps};
use mbd_runtime::{Accelerated, Constrained, Differentiable, Dual, Interpreter, Scalar};
use mbd_testing::assert_same_bits;
use mbd_testing::closed::{random_loops, LoopKnobs};
use mbd_testing::eliminations::random_plan;
use mbd_testing::random::Rng;
use mbd_testing::state::State;

type Inputs<'a> = HashMap<&'static str, &'a [f64]>;

struct Case {
    seed: u64,
    plan: Plan,
    state: State,
    p: Vec<f64>,
    emitted: Emitted,
    derivatives: bool,
    /// The rows that act, if not all do.
    acts: Option<Vec<bool>>,
}

/// How code is told which rows act.
#[derive(Clone, Copy, PartialEq)]
enum Rows {
    /// All act.
    All,
    /// It is made for a choice of rows.
    Made,
    /// By numbers.
    Input,
}

impl Case {
    fn new(seed: u64, rows: Rows) -> Option<Case> {
        let system = random_loops(seed, &LoopKnobs::everything(seed, [3, 4, 6, 8][seed as usize % 4]));
        let mut rng = Rng::new(seed, 8);
        let derivatives = rows == Rows::All && seed.is_multiple_of(4);
        let mut outputs = vec![
            Output::Rates,
            Output::Momenta,
            Output::Energy,
            Output::Velocities,
            Output::Accelerations,
            Output::Reactions,
        ];
        outputs.extend(Output::available(true).filter(|output| !output.spec().available(false)));
        if derivatives {
            outputs.extend([Output::Derivatives, Output::ParameterDerivatives]);
        }
        let mut options =
            Options { arithmetic: Arithmetic::Exact, outputs, efforts: rng.chance(0.7), ..Options::default() };
        options.plan.rolled = RolledCode::Never;
        // The search lays out every fifth mechanism.
        let plan = match seed % 5 {
            0 => search::plan(&system.model, options.searches()),
            _ => random_plan(&system.model, seed),
        };
        system.state.interpreter(&plan).check_rank(&system.state.q).ok()?;
        let mut state = system.state;
        let acts = (rows != Rows::All).then(|| random_rows(&plan, &mut rng));
        let of_rows = match (rows, &acts) {
            (Rows::Made, Some(acts)) => plan.acting(acts),
            (Rows::Input, Some(acts)) => {
                state.acts = acts.iter().map(|acts| f64::from(u8::from(*acts))).collect();
                plan.masked()
            }
            _ => plan.clone(),
        };
        let source = generate_from(&of_rows, &options).unwrap_or_else(|e| panic!("seed {seed}: {e}")).source;
        if !options.efforts {
            state.tau.fill(0.0);
        }
        let p = (0..plan.dims.nv).map(|_| rng.around(2.0)).collect();
        Some(Case { seed, plan, state, p, emitted: Emitted::parse(&source), derivatives, acts })
    }

    fn compare(&self, what: &str, emitted: &[f64], interpreted: &[f64]) {
        assert_same_bits(&format!("seed {}", self.seed), what, &self.plan.model, emitted, interpreted);
    }

    fn check(&self) {
        let s = &self.state;
        let inputs = s.inputs(&self.p, &[]);
        let run = |output: Output| self.emitted.run(output.name(), &inputs);
        let mut i = match &self.acts {
            None => s.interpreter(&self.plan),
            Some(acts) => s.interpreter_acting(&self.plan, acts),
        };
        let (nq, nv) = (self.plan.dims.nq, self.plan.dims.nv);
        let (mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nq], vec![0.0; nv]);
        i.rates(&s.q, &self.p, &mut v, &mut qd, &mut pd);
        let rates = run(Output::Rates);
        self.compare("qd", &rates["qd"], &qd);
        self.compare("pd", &rates["pd"], &pd);
        self.compare("velocities", &run(Output::Velocities)["v"], &v);
        i.momenta(&s.q, &s.v, &mut v);
        self.compare("momenta", &run(Output::Momenta)["p"], &v);
        let (kinetic, potential) = i.energy(&s.q, &self.p);
        self.compare("energy", &run(Output::Energy)["energy"], &[kinetic, potential]);
        i.generalized_accelerations(&s.q, &s.v, &mut v);
        self.compare("accelerations", &run(Output::Accelerations)["a"], &v);
        let mut wrenches = vec![[0.0; 6]; self.plan.joint_nodes.len()];
        i.reactions(&s.q, &s.v, &mut v, &mut wrenches);
        self.compare("reactions", &run(Output::Reactions)["reactions"], &wrenches.concat());
        let (mut rows, mut entries) = (i.zero_rows(), i.zero_entries());
        i.constraint_residuals(&s.q, &mut rows, &mut entries);
        let closure = run(Output::ConstraintResiduals);
        self.compare("residual", &closure["residual"], &rows);
        self.compare("jacobian", &closure["jacobian"], &entries);
        let mut freed = self.p.clone();
        i.project_momenta(0.0, &s.q, &mut freed, &mut v, &mut rows);
        let projected = run(Output::ProjectMomenta);
        self.compare("projected v", &projected["v"], &v);
        self.compare("freed", &projected["freed"], &freed);
        self.compare("sigma", &projected["sigma"], &rows);
        let mut pivots = i.zero_rows();
        i.position_correction(&s.q, &mut rows, &mut v, &mut pivots);
        let correction = run(Output::PositionCorrection);
        self.compare("residual of the correction", &correction["residual"], &rows);
        self.compare("dq", &correction["dq"], &v);
        self.compare("pivots", &correction["pivots"], &pivots);
        i.multipliers(0.0, &s.q, &s.v, &mut rows);
        self.compare("lambda", &run(Output::Multipliers)["lambda"], &rows);
        if self.derivatives {
            self.compare_derivatives(&inputs);
        }
    }

    /// The mechanism on dual numbers.
    fn dual(&self, params: &[Dual<f64>]) -> Interpreter<Dual<f64>> {
        let s = &self.state;
        let gravity = match self.plan.model.gravity {
            Gravity::Input => s.gravity.map(Dual::constant),
            Gravity::Constant(g) => g.map(|v| match v {
                Value::Const(x) => Dual::constant(x),
                Value::Param(k) => params[k],
            }),
        };
        let mut i = Interpreter::new(self.plan.tree(params), gravity);
        let fixed = |x: &[f64]| x.iter().map(|x| Dual::constant(*x)).collect::<Vec<Dual<f64>>>();
        i.tau = fixed(&s.tau);
        [i.drive_q, i.drive_v, i.drive_a] = s.drive.each_ref().map(|x| fixed(x));
        i.wrenches = s.wrenches.iter().map(|w| w.map(Dual::constant)).collect();
        i
    }

    /// Velocities and momentum rates on dual numbers.
    fn along(&self, q: &[Dual<f64>], p: &[Dual<f64>], params: &[Dual<f64>]) -> [Vec<Dual<f64>>; 2] {
        let mut i = self.dual(params);
        let zeros = |n| vec![Dual::zero(); n];
        let (mut v, mut qd, mut pd) = (zeros(q.len()), zeros(q.len()), zeros(p.len()));
        v.truncate(p.len());
        i.rates(q, p, &mut v, &mut qd, &mut pd);
        [v, pd]
    }

    /// Derivatives of velocities and momentum rates along a change of parameters that leaves the rows alone, by the sweeps.
    fn by_solution(&self, v: &[f64], params: &[Dual<f64>]) -> [Vec<f64>; 2] {
        let (given, fixed) = (self.dual(params), params.iter().map(|x| Dual::constant(x.re)).collect::<Vec<_>>());
        let [varied, unvaried] = [given, self.dual(&fixed)];
        let mut column = ParameterDerivatives::new(varied.tree());
        let [of_varied, of_unvaried] = [&varied, &unvaried].map(|i| Sweeps { tree: i.tree(), trace: &() });
        let state = (&self.state.q[..], &self.p[..], v);
        let i = self.state.interpreter(&self.plan);
        column.compute_with_rows((&of_varied, varied.gravity), &of_unvaried, state, &i.inputs());
        [column.dv, column.dpd]
    }

    fn compare_derivatives(&self, inputs: &Inputs) {
        let s = &self.state;
        let fixed = |x: &[f64]| x.iter().map(|x| Dual::constant(*x)).collect::<Vec<Dual<f64>>>();
        let moving = |x: &[f64], way: &[f64]| x.iter().zip(way).map(|(x, d)| Dual::new(*x, *d)).collect::<Vec<_>>();
        let unit = |n: usize, k: usize| (0..n).map(|j| f64::from(u8::from(j == k))).collect::<Vec<f64>>();
        let (q, p) = (fixed(&s.q), fixed(&self.p));
        let np = s.params.len();
        let given = self.emitted.run(Output::Derivatives.name(), inputs);
        let mut i = s.interpreter(&self.plan);
        let mut d = i.zero_derivatives();
        i.rate_derivatives(0.0, &s.q, &self.p, &mut d);
        self.compare("v beside derivatives", &given["v"], &d.v);
        self.compare("pd beside derivatives", &given["pd"], &d.pd);
        self.compare("dv_dq", &given["dv_dq"], &d.dv_dq.concat());
        self.compare("dv_dp", &given["dv_dp"], &d.dv_dp.concat());
        self.compare("dpd_dq", &given["dpd_dq"], &d.dpd_dq.concat());
        self.compare("dpd_dp", &given["dpd_dp"], &d.dpd_dp.concat());
        let du = |x: &[Dual<f64>]| x.iter().map(|x| x.du).collect::<Vec<f64>>();
        let given = self.emitted.run(Output::ParameterDerivatives.name(), inputs);
        let v = self.along(&q, &p, &fixed(&s.params))[0].iter().map(|x| x.re).collect::<Vec<_>>();
        for k in 0..np {
            let varied = moving(&s.params, &unit(np, k));
            let along = self.along(&q, &p, &varied).map(|x| du(&x));
            let expected = match self.plan.changes_rows(k) {
                true => along.clone(),
                false => self.by_solution(&v, &varied),
            };
            for ((name, expected), along) in ["dv_dparams", "dpd_dparams"].into_iter().zip(&expected).zip(&along) {
                let column: Vec<f64> = given[name].iter().skip(k).step_by(np).copied().collect();
                self.compare(name, &column, expected);
                // The rates on dual numbers are another algorithm. They round otherwise, where a mechanism is nearly singular most.
                let largest = along.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
                for (a, b) in expected.iter().zip(along) {
                    assert!((a - b).abs() <= 1e-8 * largest, "seed {}: {name}: {expected:?}, {along:?}", self.seed);
                }
            }
        }
    }
}

/// Rows that act: of some constraints none, of others the first and some of the rest, as of contacts.
fn random_rows(plan: &Plan, rng: &mut Rng) -> Vec<bool> {
    let mut acts = vec![true; plan.dims.rows];
    for constraint in &plan.constraints {
        let any = rng.chance(0.6);
        for k in 0..constraint.slots.len() {
            acts[constraint.first + k] = any && (k == 0 || rng.chance(0.6));
        }
    }
    acts
}

/// Checks mechanisms. No code can be generated for a mechanism that has a freedom without inertia after its tree was
/// made planar; such mechanisms are left out.
fn batch(seeds: std::ops::Range<u64>, rows: Rows) {
    let mut left_out = 0;
    for seed in seeds.clone() {
        match Case::new(seed, rows) {
            Some(case) => case.check(),
            None => left_out += 1,
        }
    }
    assert!(left_out <= seeds.count() / 10, "{left_out} left out");
}

// There are two tests so that they run on two cores.

#[test]
fn mechanisms_0_to_24() {
    batch(0..25, Rows::All);
}

#[test]
fn mechanisms_25_to_49() {
    batch(25..50, Rows::All);
}

#[test]
fn code_of_some_rows() {
    batch(0..60, Rows::Made);
}

#[test]
fn code_of_rows_that_act_by_numbers() {
    batch(0..60, Rows::Input);
}

/// Code of a mechanism with constraints has the outputs for constraints, by default and with all outputs; code of a
/// tree has none of them.
#[test]
fn outputs_follow_the_model() {
    let closed = random_loops(1, &LoopKnobs::plain()).model;
    let open = mbd_codegen::model::Model { constraints: Vec::new(), ..closed.clone() };
    let traits = |model, outputs| {
        let options = Options { outputs, ..Options::default() };
        generate(model, &options).map(|g| g.source.contains("::Constrained for Model"))
    };
    assert_eq!(traits(&closed, Output::DEFAULT.to_vec()), Ok(true));
    assert_eq!(traits(&closed, Output::available(false).collect()), Ok(true));
    assert_eq!(traits(&closed, vec![Output::Rates]), Ok(false));
    assert_eq!(traits(&open, Output::available(false).collect()), Ok(false));
    let (output, model) = (Output::ProjectMomenta, open.name.clone());
    assert_eq!(traits(&open, vec![output]), Err(GenerateError::OutputNeedsConstraints { output, model }));
    let (output, model) = (Output::MomentumDerivatives, closed.name.clone());
    assert_eq!(traits(&closed, vec![output]), Err(GenerateError::OutputLacksConstraints { output, model }));
}
