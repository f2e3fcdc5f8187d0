//! Generated code equals the interpreter bit for bit on a thousand random trees.
//!
//! The test runs the emitted source text by a small evaluator (`emitted.rs`); `compiled.rs` compares compiled code with
//! the interpreter on fewer trees. Zeros may differ in sign. No other difference is allowed, and results must be
//! finite.

use std::collections::HashMap;

use crate::emitted::Emitted;
use mbd_codegen::generate::{generate_from, Arithmetic, Options, Output};
use mbd_codegen::plan::Plan;
use mbd_codegen::search;
use mbd_runtime::sweep::{Derivatives, FrameState, MomentumDerivatives};
use mbd_runtime::{Interpreter, System};
use mbd_testing::eliminations::random_plan;
use mbd_testing::random::{random_model, Distribution, Rng};
use mbd_testing::state::{parameter, random_state, State};
use mbd_testing::toml::to_toml;

/// Outputs with long code, which not every tree has.
const LONG: [Output; 4] =
    [Output::Regressor, Output::Derivatives, Output::MomentumDerivatives, Output::ParameterDerivatives];

struct Case {
    seed: u64,
    plan: Plan,
    efforts: bool,
    long: bool,
    emitted: Emitted,
}

impl Case {
    fn new(seed: u64) -> Case {
        // Most trees are small, some have up to twelve bodies.
        let size = [2, 3, 4, 5, 6, 8, 12][(seed % 7) as usize];
        let model = random_model(seed, &Distribution::everything(seed, size));
        let mut rng = Rng::new(seed, 4);
        // Only every fourth of the larger trees has the outputs with long code.
        let long = size <= 4 || seed.is_multiple_of(4);
        let options = Options {
            arithmetic: Arithmetic::Exact,
            outputs: Output::available(false).filter(|output| long || !LONG.contains(output)).collect(),
            efforts: rng.chance(0.8),
            ..Options::default()
        };
        // The search lays out every tenth tree.
        let plan = match seed % 10 {
            0 => search::plan(&model, options.searches()),
            _ => random_plan(&model, seed),
        };
        let source = generate_from(&plan, &options).unwrap_or_else(|e| panic!("seed {seed}: {e}")).source;
        Case { seed, plan, efforts: options.efforts, long, emitted: Emitted::parse(&source) }
    }

    fn inputs(&self, s: &State, p: &[f64]) -> HashMap<String, Vec<f64>> {
        let fields = [
            ("q", s.q.clone()),
            ("p", p.to_vec()),
            ("v", s.v.clone()),
            ("tau", s.tau.clone()),
            ("drive_q", s.drive[0].clone()),
            ("drive_v", s.drive[1].clone()),
            ("drive_a", s.drive[2].clone()),
            ("wrenches", s.wrenches.concat()),
            ("params", s.params.clone()),
            ("gravity", s.gravity.to_vec()),
        ];
        fields.into_iter().map(|(name, a)| (name.to_string(), a)).collect()
    }

    fn compare(&self, what: &str, emitted: &[f64], interpreted: &[f64]) {
        assert_eq!(emitted.len(), interpreted.len(), "seed {}: {what}", self.seed);
        for (k, (a, b)) in emitted.iter().zip(interpreted).enumerate() {
            let same = (a + 0.0).to_bits() == (b + 0.0).to_bits();
            let text = || to_toml(&self.plan.model);
            assert!(a.is_finite() && b.is_finite(), "seed {}: {what}[{k}] is {a} and {b}\n{}", self.seed, text());
            assert!(same, "seed {}: {what}[{k}]: emitted {a:e}, interpreted {b:e}\n{}", self.seed, text());
        }
    }

    /// Compares derivatives; the blocks of parameters column by column.
    fn compare_derivatives(&self, s: &State, p: &[f64], i: &mut Interpreter<f64>, inputs: &HashMap<String, Vec<f64>>) {
        let mut d = Derivatives::new(i.tree());
        i.derivatives(&s.q, p, &mut d);
        let emitted = self.emitted.run(Output::Derivatives.name(), inputs);
        self.compare("v beside derivatives", &emitted["v"], &d.v);
        self.compare("pd beside derivatives", &emitted["pd"], &d.pd);
        for (name, block) in [("dv_dq", &d.dv_dq), ("dv_dp", &d.dv_dp), ("dpd_dq", &d.dpd_dq), ("dpd_dp", &d.dpd_dp)] {
            self.compare(name, &emitted[name], block);
        }
        let mut at = MomentumDerivatives::new(i.tree());
        i.momentum_derivatives(&s.q, &s.v, &mut Derivatives::new(i.tree()), &mut at);
        let emitted = self.emitted.run(Output::MomentumDerivatives.name(), inputs);
        for (name, block) in [("p", &at.p), ("pd", &at.pd), ("dp_dq", &at.dp_dq), ("dp_dv", &at.dp_dv)] {
            self.compare(name, &emitted[name], block);
        }
        self.compare("dpd_dq", &emitted["dpd_dq"], &at.dpd_dq);
        self.compare("dpd_dv", &emitted["dpd_dv"], &at.dpd_dv);
        let emitted = self.emitted.run(Output::ParameterDerivatives.name(), inputs);
        let n = s.params.len();
        for k in 0..n {
            let (column, _) = parameter(&self.plan, s, i, &s.q, &d, k);
            for (name, ours) in [("dv_dparams", &column.dv), ("dpd_dparams", &column.dpd)] {
                let data: Vec<f64> = emitted[name].iter().skip(k).step_by(n).copied().collect();
                self.compare(name, &data, ours);
            }
        }
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
        let inputs = self.inputs(&s, &p);
        let run = |output: Output| self.emitted.run(output.name(), &inputs);
        self.compare("momenta", &run(Output::Momenta)["p"], &p);
        let (mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nq], vec![0.0; nv]);
        i.rates(&s.q, &p, &mut v, &mut qd, &mut pd);
        let rates = run(Output::Rates);
        self.compare("qd", &rates["qd"], &qd);
        self.compare("pd", &rates["pd"], &pd);
        let map = self.emitted.run("coordinate_rates", &inputs);
        i.coordinate_rates(&s.q, &s.v, &mut qd);
        self.compare("coordinate rates", &map["qd"], &qd);
        i.velocities(&s.q, &p, &mut v);
        self.compare("velocities", &run(Output::Velocities)["v"], &v);
        let (kinetic, potential) = i.energy(&s.q, &p);
        self.compare("energy", &run(Output::Energy)["energy"], &[kinetic, potential]);
        let mut a = vec![0.0; nv];
        i.accelerations(&s.q, &s.v, &mut a);
        self.compare("accelerations", &run(Output::Accelerations)["a"], &a);
        let mut wrenches = vec![[0.0; 6]; self.plan.joint_nodes.len()];
        i.reactions(&s.q, &s.v, &mut a, &mut wrenches);
        self.compare("reactions", &run(Output::Reactions)["reactions"], &wrenches.concat());
        let mut m = vec![0.0; nv * nv];
        i.mass_matrix(&s.q, &mut m);
        self.compare("mass matrix", &run(Output::MassMatrix)["m"], &m);
        let n = self.plan.frames.len();
        let (mut tau, mut h) = (vec![0.0; nv], vec![0.0; nv]);
        i.inverse_dynamics(&s.q, &s.v, &a, &mut tau);
        let mut given = inputs.clone();
        given.insert("a".to_string(), a.clone());
        let emitted = self.emitted.run(Output::InverseDynamics.name(), &given);
        self.compare("inverse dynamics", &emitted["tau"], &tau);
        if self.long {
            let mut y = vec![0.0; nv * i.tree().regressor_columns()];
            i.regressor(&s.q, &s.v, &a, &mut y);
            self.compare("regressor", &self.emitted.run(Output::Regressor.name(), &given)["y"], &y);
        }
        i.bias(&s.q, &s.v, &mut h);
        self.compare("bias", &run(Output::Bias)["h"], &h);
        let (mut jacobians, mut biases) = (vec![0.0; 6 * nv * n], vec![[0.0; 6]; n]);
        i.jacobians(&s.q, &mut jacobians);
        self.compare("jacobians", &run(Output::Jacobians)["jacobian"], &jacobians);
        i.bias_accelerations(&s.q, &s.v, &mut biases);
        self.compare("bias_accelerations", &run(Output::BiasAccelerations)["bias"], &biases.concat());
        let (mut center, mut matrix, mut bias) = ([0.0; 3], vec![0.0; 6 * nv], [0.0; 6]);
        i.centroidal(&s.q, &s.v, &mut center, &mut matrix, &mut bias);
        let emitted = run(Output::Centroidal);
        let ours: [(&str, &[f64]); 3] = [("center", &center), ("matrix", &matrix), ("bias", &bias)];
        for (name, ours) in ours {
            self.compare(&format!("centroidal {name}"), &emitted[name], ours);
        }
        if self.long {
            self.compare_derivatives(&s, &p, &mut i, &inputs);
        }
        let mut frames = vec![FrameState::ground(); n];
        i.frames(&s.q, &s.v, &mut frames);
        let all = |f: &dyn Fn(&FrameState<f64>) -> Vec<f64>| frames.iter().flat_map(f).collect::<Vec<f64>>();
        let emitted = run(Output::Frames);
        self.compare("rotations", &emitted["rotation"], &all(&|f| f.rotation.concat()));
        self.compare("positions", &emitted["position"], &all(&|f| f.position.to_vec()));
        self.compare("frame velocities", &emitted["velocity"], &all(&|f| [f.velocity.lin, f.velocity.ang].concat()));
    }
}

/// Checks every tree in two states.
fn batch(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let case = Case::new(seed);
        case.check(0);
        case.check(1);
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
