//! States carried over between models of the same bodies.

mod known;
mod random;

use mbd_codegen::model::Model;
use mbd_codegen::plan::{Plan, Rigid};
use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::transfer::{Transfer, TransferError, Transferred};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::Interpreter;

/// Reads a model.
fn model(text: &str) -> Model {
    read::model("test.toml", text, &ImportOptions::default()).unwrap_or_else(|e| panic!("{e}")).model
}

/// A model with its plan and interpreter.
struct Machine {
    model: Model,
    plan: Plan,
    interpreter: Interpreter<f64>,
}

impl Machine {
    fn new(model: Model) -> Machine {
        let plan = Plan::new(&model, 0.0);
        let interpreter = plan.default_interpreter();
        Machine { model, plan, interpreter }
    }

    fn transfer(&mut self, q: &[f64], v: &[f64], to: &mut Machine) -> Result<Transferred, TransferError> {
        let mut transfer = Transfer::new(&self.plan, &to.plan)?;
        transfer.apply(&mut self.interpreter, q, v, &mut to.interpreter)
    }

    /// Pose and velocity of a body.
    fn body(&mut self, name: &str, q: &[f64], v: &[f64]) -> FrameState<f64> {
        let mut frames = vec![FrameState::ground(); self.plan.frames.len()];
        self.interpreter.frames(q, v, &mut frames);
        frames[self.plan.frames.iter().position(|f| f.name == name).expect("a body")]
    }

    /// Momentum `[linear; angular]` about the origin of the ground, in its axes.
    fn momentum(&mut self, q: &[f64], v: &[f64]) -> [f64; 6] {
        let (mut center, mut matrix, mut bias) = (vec![0.0; 3], vec![0.0; 6 * v.len()], vec![0.0; 6]);
        self.interpreter.centroidal(q, v, &mut center, &mut matrix, &mut bias);
        let mut h: [f64; 6] =
            std::array::from_fn(|i| matrix[i * v.len()..][..v.len()].iter().zip(v).map(|(a, v)| a * v).sum());
        let [x, y, z] = [center[0], center[1], center[2]];
        h[3] += y * h[2] - z * h[1];
        h[4] += z * h[0] - x * h[2];
        h[5] += x * h[1] - y * h[0];
        h
    }
}

fn pose(frame: &FrameState<f64>) -> Rigid {
    Rigid { rot: frame.rotation, pos: frame.position }
}

/// Asserts that numbers differ by no more than `within`.
#[track_caller]
fn near(what: &str, a: &[f64], b: &[f64], within: f64) {
    assert_eq!(a.len(), b.len(), "{what}");
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() <= within, "{what}[{k}]: {a:e} and {b:e} differ by {:e}", (a - b).abs());
    }
}

/// Asserts that all bodies stand and move alike in two machines.
#[track_caller]
fn same_motion(a: (&mut Machine, &[f64], &[f64]), b: (&mut Machine, &[f64], &[f64]), within: f64) {
    let names: Vec<String> = a.0.model.bodies.iter().map(|b| b.name.clone()).collect();
    for name in names {
        let [x, y] = [a.0.body(&name, a.1, a.2), b.0.body(&name, b.1, b.2)];
        near(&format!("{name}: rotation"), x.rotation.as_flattened(), y.rotation.as_flattened(), within);
        near(&format!("{name}: position"), &x.position, &y.position, within);
        let [x, y] = [x, y].map(|f| std::array::from_fn::<f64, 6, _>(|k| f.velocity.get(k)));
        near(&format!("{name}: velocity"), &x, &y, within);
    }
}
