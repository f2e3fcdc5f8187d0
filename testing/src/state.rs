//! Random states and inputs of a plan.

use std::collections::HashMap;

use mbd_codegen::generate::InputArray;
use mbd_codegen::model::{JointKind, Unit};
use mbd_codegen::plan::Plan;
use mbd_runtime::contact::Reducible;
use mbd_runtime::sweep::{Derivatives, ParameterDerivatives, Sweeps};
use mbd_runtime::tree::Source;
use mbd_runtime::{Dual, Interpreter, Scalar};

use crate::random::Rng;

/// A state and all inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Coordinates; quaternions have unit length.
    pub q: Vec<f64>,
    /// Velocities.
    pub v: Vec<f64>,
    /// Joint forces.
    pub tau: Vec<f64>,
    /// Prescribed positions, rates, accelerations.
    pub drive: [Vec<f64>; 3],
    /// External wrenches.
    pub wrenches: Vec<[f64; 6]>,
    /// Gravity: the model's, or a random one where it is an input.
    pub gravity: [f64; 3],
    /// Parameters, within ten per cent of their defaults.
    pub params: Vec<f64>,
    /// 1 for each row that acts, 0 for one that does not, in plans whose rows act by numbers; 1 everywhere at first.
    pub acts: Vec<f64>,
}

/// A random state of a plan.
pub fn random_state(plan: &Plan, seed: u64) -> State {
    let mut rng = Rng::new(seed, 3);
    let d = plan.dims;
    let mut positions = [vec![0.0; d.nq], vec![0.0; d.drive_q]];
    for slot in &plan.slots {
        let kind = plan.model.joints[slot.joint].kind;
        let (list, at) = match slot.at {
            Some(Source::State { q, .. }) => (0, q),
            Some(Source::Drive { q, .. }) => (1, q),
            None => continue,
        };
        coordinates(&mut rng, kind, &mut positions[list][at..at + kind.nq()]);
    }
    let [q, drive_q] = positions;
    let params: Vec<f64> = plan.params().iter().map(|p| p.default * rng.range(0.9, 1.1)).collect();
    let gravity = match plan.model.gravity {
        mbd_codegen::model::Gravity::Input => std::array::from_fn(|_| rng.around(9.0)),
        _ => plan.gravity(&params),
    };
    let mut list = |n: usize, size: f64| (0..n).map(|_| rng.around(size)).collect::<Vec<f64>>();
    State {
        v: list(d.nv, 1.5),
        tau: list(d.nv, 3.0),
        drive: [drive_q, list(d.drive_v, 1.5), list(d.drive_v, 3.0)],
        wrenches: (0..d.wrenches).map(|_| std::array::from_fn(|k| list(6, 4.0)[k])).collect(),
        gravity,
        params,
        acts: vec![1.0; d.rows],
        q,
    }
}

fn coordinates(rng: &mut Rng, kind: JointKind, q: &mut [f64]) {
    let spec = kind.spec();
    for (coordinate, x) in spec.coordinates.iter().zip(&mut *q) {
        *x = if coordinate.unit == Unit::Radian { rng.around(3.0) } else { rng.around(0.6) };
    }
    let Some(unit) = spec.quaternion() else { return };
    let quaternion = &mut q[unit..];
    loop {
        quaternion.fill_with(|| rng.around(1.0));
        let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm > 0.2 {
            quaternion.iter_mut().for_each(|x| *x /= norm);
            return;
        }
    }
}

impl State {
    /// All inputs of generated functions by name, flat, with the given momenta and accelerations.
    pub fn inputs<'a>(&'a self, p: &'a [f64], a: &'a [f64]) -> HashMap<&'static str, &'a [f64]> {
        let [drive_q, drive_v, drive_a] = &self.drive;
        HashMap::from([
            ("q", &self.q[..]),
            ("p", p),
            ("v", &self.v),
            ("a", a),
            ("tau", &self.tau),
            ("drive_q", drive_q),
            ("drive_v", drive_v),
            ("drive_a", drive_a),
            ("wrenches", self.wrenches.as_flattened()),
            ("params", &self.params),
            ("gravity", &self.gravity),
            ("acts", &self.acts),
        ])
    }

    /// The inputs of a program in order. Inputs that the options leave out are empty.
    pub fn inputs_of(&self, arrays: &[InputArray], p: &[f64], a: &[f64]) -> Vec<f64> {
        let given = self.inputs(p, a);
        arrays.iter().flat_map(|array| &given[array.name][..array.len()]).copied().collect()
    }

    /// An interpreter of the plan with this state's inputs.
    pub fn interpreter(&self, plan: &Plan) -> Interpreter<f64> {
        self.interpreter_of(plan, |x, _| x)
    }

    /// The interpreter in which only some rows act, with this state's inputs; one entry of `acts` for each row.
    pub fn interpreter_acting(&self, plan: &Plan, acts: &[bool]) -> Interpreter<f64> {
        let mut full = self.interpreter(plan);
        let mut reduced = full.acting(acts);
        Reducible::swap_inputs(&mut reduced, &mut full);
        reduced
    }

    /// The same interpreter over any scalar. `lift` makes a scalar of a number and its rate of change; only prescribed
    /// positions and rates have a rate that is not zero.
    pub fn interpreter_of<S: Scalar>(&self, plan: &Plan, lift: impl Fn(f64, f64) -> S) -> Interpreter<S> {
        let all = |list: &[f64]| list.iter().map(|x| lift(*x, 0.0)).collect::<Vec<S>>();
        let mut i = Interpreter::new(plan.tree(&all(&self.params)), self.gravity.map(|x| lift(x, 0.0)));
        let both = |x: &[f64], dx: &[f64]| x.iter().zip(dx).map(|(x, dx)| lift(*x, *dx)).collect::<Vec<S>>();
        i.tau = all(&self.tau);
        i.drive_q = both(&self.drive[0], &drive_rates(plan, &self.drive[0], &self.drive[1]));
        i.drive_v = both(&self.drive[1], &self.drive[2]);
        i.drive_a = all(&self.drive[2]);
        i.wrenches = self.wrenches.iter().map(|w| w.map(|x| lift(x, 0.0))).collect();
        i
    }
}

/// Derivatives of the rates with respect to parameter `k`, computed by the sweeps at the state to which `at` belongs;
/// and the interpreter over dual numbers in which this parameter has the derivative one.
pub fn parameter<S: Scalar>(
    plan: &Plan,
    s: &State,
    i: &Interpreter<S>,
    q: &[S],
    at: &Derivatives<S>,
    k: usize,
) -> (ParameterDerivatives<S>, Interpreter<Dual<S>>) {
    use mbd_codegen::model::{Gravity, Value};
    let one = |j: usize| if j == k { S::one() } else { S::zero() };
    let varied: Vec<Dual<S>> = s.params.iter().enumerate().map(|(j, x)| Dual::new(S::constant(*x), one(j))).collect();
    let gravity = match plan.model.gravity {
        Gravity::Constant(g) => g.map(|x| match x {
            Value::Const(x) => Dual::constant(x),
            Value::Param(k) => varied[k],
        }),
        Gravity::Input => s.gravity.map(Dual::constant),
    };
    let mut varied = Interpreter::new(plan.tree(&varied), gravity);
    let given = s.interpreter_of(plan, |x, _| Dual::constant(x));
    (varied.tau, varied.wrenches) = (given.tau, given.wrenches);
    (varied.drive_q, varied.drive_v, varied.drive_a) = (given.drive_q, given.drive_v, given.drive_a);
    let mut column = ParameterDerivatives::new(varied.tree());
    let sweeps = Sweeps { tree: varied.tree(), trace: &() };
    column.compute(&sweeps, gravity, q, &i.inputs(), at);
    (column, varied)
}

/// Rates of the prescribed coordinates for given prescribed velocities, joint by joint.
pub fn drive_rates(plan: &Plan, q: &[f64], v: &[f64]) -> Vec<f64> {
    use mbd_runtime::spatial::{quaternion_matrix, quaternion_rate};
    let mut qd = vec![0.0; q.len()];
    for slot in &plan.slots {
        let Some(Source::Drive { q: at, v: vat }) = slot.at else { continue };
        let kind = plan.model.joints[slot.joint].kind;
        let (q, v, qd) = (&q[at..at + kind.nq()], &v[vat..vat + kind.nv()], &mut qd[at..at + kind.nq()]);
        match kind {
            JointKind::Planar { .. } => {
                let (s, c) = q[2].sin_cos();
                qd.copy_from_slice(&[c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]]);
            }
            JointKind::Spherical => {
                qd.copy_from_slice(&quaternion_rate([q[0], q[1], q[2], q[3]], [v[0], v[1], v[2]]));
            }
            JointKind::Floating => {
                let turn = [q[3], q[4], q[5], q[6]];
                for (x, row) in qd.iter_mut().zip(quaternion_matrix(turn)) {
                    *x = row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
                }
                qd[3..].copy_from_slice(&quaternion_rate(turn, [v[3], v[4], v[5]]));
            }
            _ => qd.copy_from_slice(v),
        }
    }
    qd
}
