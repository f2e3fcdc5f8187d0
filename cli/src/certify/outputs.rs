//! The outputs over any scalar, as one list of numbers, and their names.

use multibody::codegen::plan::Plan;
use multibody::runtime::{Interpreter, Scalar};

use super::input::Values;
use crate::args::Quantity;

/// Names of the numbers of [`evaluate`].
pub fn names(plan: &Plan, wanted: &[Quantity]) -> Vec<String> {
    let (coordinates, velocities) = (plan.coordinate_names(), plan.velocity_names());
    let rows = || {
        plan.rows()
            .iter()
            .enumerate()
            .map(|(k, row)| format!("{}.{k}", plan.constraint_names()[row.constraint]))
            .collect()
    };
    let mut all = Vec::new();
    for what in wanted {
        let (word, list): (_, Vec<String>) = match what {
            Quantity::Momenta => ("p", velocities.clone()),
            Quantity::CoordinateRates => ("qd", coordinates.clone()),
            Quantity::MomentumRates => ("pd", velocities.clone()),
            Quantity::Accelerations => ("qdd", velocities.clone()),
            Quantity::Kinetic => ("kinetic", Vec::new()),
            Quantity::Potential => ("potential", Vec::new()),
            Quantity::MassMatrix => {
                let pairs = velocities.iter().flat_map(|a| velocities.iter().map(move |b| format!("{a},{b}")));
                ("M", pairs.collect())
            }
            Quantity::Bias => ("h", velocities.clone()),
            Quantity::InverseDynamics => ("tau", velocities.clone()),
            Quantity::Residuals => ("phi", rows()),
            Quantity::Multipliers => ("lambda", rows()),
        };
        match list.is_empty() {
            true if matches!(what, Quantity::Kinetic | Quantity::Potential) => all.push(word.to_string()),
            _ => all.extend(list.iter().map(|name| format!("{word}.{name}"))),
        }
    }
    all
}

/// The wanted outputs of a state, in the layout of the state.
pub fn evaluate<S: Scalar + core::fmt::Debug>(
    interpreter: &mut Interpreter<S>,
    state: &Values<S>,
    wanted: &[Quantity],
) -> Vec<S> {
    let Values { q, v, tau, a } = state;
    let (nq, nv) = (q.len(), v.len());
    let zeros = |n: usize| vec![S::zero(); n];
    interpreter.tau.clone_from(tau);
    let mut p = zeros(nv);
    interpreter.momenta(q, v, &mut p);
    let mut all = Vec::new();
    for what in wanted {
        match what {
            Quantity::Momenta => all.extend(&p),
            Quantity::CoordinateRates | Quantity::MomentumRates => {
                let (mut v2, mut qd, mut pd) = (zeros(nv), zeros(nq), zeros(nv));
                interpreter.rates(q, &p, &mut v2, &mut qd, &mut pd);
                all.extend(if *what == Quantity::CoordinateRates { qd } else { pd });
            }
            Quantity::Accelerations => {
                let mut acceleration = zeros(nv);
                interpreter.accelerations(q, v, &mut acceleration);
                all.extend(acceleration);
            }
            // Prescribed joints are at rest here: half of p · v, which takes no division by pivots.
            Quantity::Kinetic => {
                let twice = p.iter().zip(v).fold(S::zero(), |sum, (p, v)| sum + *p * *v);
                all.push(S::constant(0.5) * twice);
            }
            Quantity::Potential => all.push(interpreter.energy(q, &p).1),
            Quantity::MassMatrix => {
                let mut m = zeros(nv * nv);
                interpreter.mass_matrix(q, &mut m);
                all.extend(m);
            }
            Quantity::Bias => {
                let mut h = zeros(nv);
                interpreter.bias(q, v, &mut h);
                all.extend(h);
            }
            Quantity::InverseDynamics => {
                let mut force = zeros(nv);
                interpreter.inverse_dynamics(q, v, a, &mut force);
                all.extend(force);
            }
            Quantity::Residuals => {
                let (rows, entries) = (interpreter.tree().dims.rows, interpreter.tree().entry_columns().len());
                let (mut phi, mut entries) = (zeros(rows), zeros(entries));
                interpreter.residuals(q, &mut phi, &mut entries);
                all.extend(phi);
            }
            Quantity::Multipliers => {
                let mut lambda = zeros(interpreter.tree().dims.rows);
                interpreter.constraint_multipliers(q, v, &mut lambda);
                all.extend(lambda);
            }
        }
    }
    all
}
