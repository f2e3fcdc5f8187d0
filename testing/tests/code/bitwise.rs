//! Generated code equals the interpreter bit for bit on a thousand random trees: the rates on all of them, every other
//! output on half of them.
//!
//! The test runs the emitted source text by a small evaluator (`emitted.rs`); `testing/compiled` compares compiled code with
//! the interpreter on fewer trees. Zeros may differ in sign. No other difference is allowed, and results must be
//! finite.

use std::collections::{BTreeMap, HashMap};

use crate::emitted::Emitted;
use mbd_codegen::generate::{generate_from, Arithmetic, Options, Output};
use mbd_codegen::plan::Plan;
use mbd_codegen::search;
use mbd_runtime::sweep::{Derivatives, FrameState, ParameterDerivatives};
use mbd_runtime::{Interpreter, MomentumDerivatives, System};
use mbd_testing::assert_same_bits;
use mbd_testing::eliminations::random_plan;
use mbd_testing::random::{random_model, Distribution, Rng};
use mbd_testing::state::{parameter, random_state, State};
use mbd_testing::toml::to_toml;

type Inputs<'a> = HashMap<&'static str, &'a [f64]>;

/// Outputs with long code, which not every tree has.
const LONG: [Output; 4] =
    [Output::Regressor, Output::Derivatives, Output::MomentumDerivatives, Output::ParameterDerivatives];

struct Case {
    seed: u64,
    plan: Plan,
    efforts: bool,
    outputs: Vec<Output>,
    emitted: Emitted,
}

impl Case {
    fn new(seed: u64) -> Case {
        // Most trees are small, some have up to twelve bodies.
        let size = [2, 3, 4, 5, 6, 8, 12][(seed % 7) as usize];
        let model = random_model(seed, &Distribution::everything(seed, size));
        let mut rng = Rng::new(seed, 4);
        // Rates and momenta always, the other outputs on every second tree in turn, long ones on few of the larger trees:
        // most of the time goes into reading the text.
        let long = size <= 4 || seed.is_multiple_of(4);
        let outputs = Output::available(false).enumerate().filter(|(n, output)| {
            let in_turn = (*n as u64 + seed / 7).is_multiple_of(2) && (long || !LONG.contains(output));
            in_turn || [Output::Rates, Output::Momenta].contains(output)
        });
        let outputs: Vec<Output> = outputs.map(|(_, output)| output).collect();
        let options = Options {
            arithmetic: Arithmetic::Exact,
            outputs: outputs.clone(),
            efforts: rng.chance(0.8),
            ..Options::default()
        };
        // The search lays out every tenth tree.
        let plan = match seed % 10 {
            0 => search::plan(&model, options.searches()),
            _ => random_plan(&model, seed),
        };
        let source = generate_from(&plan, &options).unwrap_or_else(|e| panic!("seed {seed}: {e}")).source;
        Case { seed, plan, efforts: options.efforts, outputs, emitted: Emitted::parse(&source) }
    }

    fn compare(&self, what: &str, emitted: &[f64], interpreted: &[f64]) {
        assert_same_bits(&format!("seed {}", self.seed), what, &self.plan.model, emitted, interpreted);
    }

    /// Compares all results of an output, if the tree has it.
    fn output(&self, output: Output, inputs: &Inputs, interpreted: &[&[f64]]) {
        if self.outputs.contains(&output) {
            let emitted = self.emitted.run(output.name(), inputs);
            let arrays = output.spec().results;
            assert_eq!(arrays.len(), interpreted.len());
            for (array, interpreted) in arrays.iter().zip(interpreted) {
                self.compare(&format!("{} {}", output.name(), array.name), &emitted[array.name], interpreted);
            }
        }
    }

    /// Compares derivatives.
    fn derivatives(&self, s: &State, p: &[f64], i: &mut Interpreter<f64>, inputs: &Inputs) {
        let mut d = Derivatives::new(i.tree());
        i.derivatives(&s.q, p, &mut d);
        self.output(Output::Derivatives, inputs, &[&d.v, &d.pd, &d.dv_dq, &d.dv_dp, &d.dpd_dq, &d.dpd_dp]);
        let mut at = MomentumDerivatives::new(i.tree());
        i.momentum_derivatives(&s.q, &s.v, &mut Derivatives::new(i.tree()), &mut at);
        let blocks: [&[f64]; 6] = [&at.p, &at.pd, &at.dp_dq, &at.dp_dv, &at.dpd_dq, &at.dpd_dv];
        self.output(Output::MomentumDerivatives, inputs, &blocks);
        let columns: Vec<_> = (0..s.params.len()).map(|k| parameter(&self.plan, s, i, &s.q, &d, k).0).collect();
        let rows = |of: fn(&ParameterDerivatives<f64>) -> &Vec<f64>| -> Vec<f64> {
            (0..self.plan.dims.nv).flat_map(|row| columns.iter().map(move |column| of(column)[row])).collect()
        };
        self.output(Output::ParameterDerivatives, inputs, &[&rows(|c| &c.dv), &rows(|c| &c.dpd)]);
    }

    fn check(&self, state: u64) {
        let mut s = random_state(&self.plan, 10 * self.seed + state);
        if !self.efforts {
            s.tau.fill(0.0);
        }
        let (nq, nv) = (self.plan.dims.nq, self.plan.dims.nv);
        let mut i = s.interpreter(&self.plan);
        i.check_rank(&s.q).unwrap_or_else(|e| panic!("seed {}: {e}\n{}", self.seed, to_toml(&self.plan.model)));
        let mut p = vec![0.0; nv];
        i.momenta(&s.q, &s.v, &mut p);
        let mut a = vec![0.0; nv];
        i.accelerations(&s.q, &s.v, &mut a);
        let inputs = &s.inputs(&p, &a);
        self.output(Output::Momenta, inputs, &[&p]);
        self.output(Output::Accelerations, inputs, &[&a]);
        let (mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nq], vec![0.0; nv]);
        i.rates(&s.q, &p, &mut v, &mut qd, &mut pd);
        self.output(Output::Rates, inputs, &[&qd, &pd]);
        i.coordinate_rates(&s.q, &s.v, &mut qd);
        self.compare("coordinate rates", &self.emitted.run("coordinate_rates", inputs)["qd"], &qd);
        i.velocities(&s.q, &p, &mut v);
        self.output(Output::Velocities, inputs, &[&v]);
        let (kinetic, potential) = i.energy(&s.q, &p);
        self.output(Output::Energy, inputs, &[&[kinetic, potential]]);
        let mut wrenches = vec![[0.0; 6]; self.plan.joint_nodes.len()];
        i.reactions(&s.q, &s.v, &mut a.clone(), &mut wrenches);
        self.output(Output::Reactions, inputs, &[wrenches.as_flattened()]);
        let mut m = vec![0.0; nv * nv];
        i.mass_matrix(&s.q, &mut m);
        self.output(Output::MassMatrix, inputs, &[&m]);
        let (mut tau, mut h) = (vec![0.0; nv], vec![0.0; nv]);
        i.inverse_dynamics(&s.q, &s.v, &a, &mut tau);
        self.output(Output::InverseDynamics, inputs, &[&tau]);
        i.bias(&s.q, &s.v, &mut h);
        self.output(Output::Bias, inputs, &[&h]);
        let mut y = vec![0.0; nv * i.tree().regressor_columns()];
        i.regressor(&s.q, &s.v, &a, &mut y);
        self.output(Output::Regressor, inputs, &[&y]);
        let n = self.plan.frames.len();
        let (mut jacobians, mut biases) = (vec![0.0; 6 * nv * n], vec![[0.0; 6]; n]);
        i.jacobians(&s.q, &mut jacobians);
        self.output(Output::Jacobians, inputs, &[&jacobians]);
        i.bias_accelerations(&s.q, &s.v, &mut biases);
        self.output(Output::BiasAccelerations, inputs, &[biases.as_flattened()]);
        let (mut center, mut matrix, mut bias) = ([0.0; 3], vec![0.0; 6 * nv], [0.0; 6]);
        i.centroidal(&s.q, &s.v, &mut center, &mut matrix, &mut bias);
        self.output(Output::Centroidal, inputs, &[&center, &matrix, &bias]);
        if LONG.iter().any(|output| self.outputs.contains(output)) {
            self.derivatives(&s, &p, &mut i, inputs);
        }
        let mut frames = vec![FrameState::ground(); n];
        i.frames(&s.q, &s.v, &mut frames);
        let all = |f: &dyn Fn(&FrameState<f64>) -> Vec<f64>| frames.iter().flat_map(f).collect::<Vec<f64>>();
        let [rotations, positions] = [all(&|f| f.rotation.concat()), all(&|f| f.position.to_vec())];
        let velocities = all(&|f| [f.velocity.lin, f.velocity.ang].concat());
        self.output(Output::Frames, inputs, &[&rotations, &positions, &velocities]);
    }
}

/// Checks every tree in two states.
fn batch(seeds: std::ops::Range<u64>) {
    let mut trees: BTreeMap<&str, usize> = BTreeMap::new();
    for seed in seeds {
        let case = Case::new(seed);
        case.check(0);
        case.check(1);
        case.outputs.iter().for_each(|output| *trees.entry(output.name()).or_default() += 1);
    }
    for output in Output::available(false) {
        let met = trees.get(output.name()).copied().unwrap_or_default();
        assert!(met >= 50, "{} is compared on {met} trees only", output.name());
    }
}

// There are four tests so that they run on several cores.

#[test]
fn trees_0_to_249() {
    batch(0..250);
}

#[test]
fn trees_250_to_499() {
    batch(250..500);
}

#[test]
fn trees_500_to_749() {
    batch(500..750);
}

#[test]
fn trees_750_to_999() {
    batch(750..1000);
}
