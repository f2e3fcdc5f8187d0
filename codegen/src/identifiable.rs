//! Base parameters: the combinations of dynamic parameters that a motion can identify.
//!
//! The regressor is evaluated at random motions. A column that depends on those before it has no effect of its own: its
//! parameter only adds to theirs (M. Gautier, *Numerical calculation of the base inertial parameters of robots*,
//! Journal of Robotic Systems 8(4), 1991).

use std::fmt;

use crate::plan::Plan;
use crate::sample::State;

/// Part of a column, relative to its length, below which what the columns before it leave of it counts as rounding. The
/// regressor is accurate to 1e-13 or so; the smallest effects of real parameters are above 1e-6.
const NEGLIGIBLE: f64 = 1e-9;

/// A base parameter: a parameter that can be identified, with all others whose effect is the same.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseParameter {
    /// Number of the parameter, in the order of [`Plan::parameter_names`].
    pub parameter: usize,
    /// What adds to it: numbers of parameters, and their factors.
    pub others: Vec<(usize, f64)>,
}

/// The parameters of a mechanism, sorted by what a motion tells about them. Its `Display` names the base parameters,
/// one to a line, with factors of six decimals.
#[derive(Clone, Debug, PartialEq)]
pub struct Identifiable {
    /// Names of all dynamic parameters, [`Plan::parameter_names`].
    pub names: Vec<String>,
    /// The base parameters; as many as the rank of the regressor.
    pub base: Vec<BaseParameter>,
    /// Parameters without effect on any joint force.
    pub without_effect: Vec<usize>,
}

/// Finds the base parameters of a mechanism by the rank of its regressor at random motions: coordinates, velocities and
/// accelerations of all joints, with the default run-time parameters.
///
/// Parameters of inner bodies are preferred to those of outer ones, and inertias to first moments and masses.
pub fn identifiable(plan: &Plan) -> Identifiable {
    let names = plan.parameter_names();
    let columns = sampled(plan, names.len());
    let mut space = Space::default();
    let mut without_effect = Vec::new();
    for parameter in order(names.len(), plan.joint_nodes.len()) {
        match columns[parameter].iter().all(|x| *x == 0.0) {
            true => without_effect.push(parameter),
            false => space.add(parameter, &columns[parameter]),
        }
    }
    without_effect.sort_unstable();
    let mut base = space.base;
    base.sort_by_key(|b| b.parameter);
    Identifiable { names, base, without_effect }
}

/// Damping and dry friction first; then body by body inertias, first moments, mass.
fn order(n: usize, bodies: usize) -> impl Iterator<Item = usize> {
    let inertial = 10 * bodies;
    (inertial..n).chain((0..bodies).flat_map(|body| [4, 5, 7, 6, 8, 9, 1, 2, 3, 0].map(|k| 10 * body + k)))
}

/// Columns of the regressor at random motions, one motion below the other.
fn sampled(plan: &Plan, n: usize) -> Vec<Vec<f64>> {
    let nv = plan.dims.nv;
    let mut columns = vec![Vec::new(); n];
    let motions = 8 + 2 * n / nv.max(1);
    let mut interpreter = plan.interpreter(&plan.default_params());
    let mut y = vec![0.0; nv * n];
    for seed in 0..motions as u64 {
        let state = State::new(plan, seed);
        state.set_inputs(plan, &mut interpreter, false);
        interpreter.regressor(&state.q, &state.v, &state.input("a", nv), &mut y);
        for (k, column) in columns.iter_mut().enumerate() {
            column.extend((0..nv).map(|row| y[row * n + k]));
        }
    }
    // What is only rounding beside the largest column is no effect.
    let largest = columns.iter().map(|column| norm(column)).fold(0.0, f64::max);
    for column in columns.iter_mut().filter(|column| norm(column) < 1e-12 * largest) {
        column.fill(0.0);
    }
    columns
}

/// Independent columns, orthonormal by Gram and Schmidt.
#[derive(Default)]
struct Space {
    directions: Vec<Vec<f64>>,
    /// Of every independent column its components along the directions, the last one its own.
    triangle: Vec<Vec<f64>>,
    base: Vec<BaseParameter>,
}

impl Space {
    /// Adds a column as a new base parameter, or to those on which it depends.
    fn add(&mut self, parameter: usize, column: &[f64]) {
        let length = norm(column);
        let mut rest: Vec<f64> = column.to_vec();
        let mut along = vec![0.0; self.directions.len()];
        // Twice: the second time takes away what rounding has left of the first.
        for _ in 0..2 {
            for (direction, along) in self.directions.iter().zip(&mut along) {
                let part: f64 = rest.iter().zip(direction).map(|(x, d)| x * d).sum();
                rest.iter_mut().zip(direction).for_each(|(x, d)| *x -= part * d);
                *along += part;
            }
        }
        let own = norm(&rest);
        if own > NEGLIGIBLE * length {
            self.directions.push(rest.into_iter().map(|x| x / own).collect());
            along.push(own);
            self.triangle.push(along);
            self.base.push(BaseParameter { parameter, others: Vec::new() });
            return;
        }
        // Back substitution: the column as a sum of independent ones.
        for k in (0..along.len()).rev() {
            let factor = along[k] / self.triangle[k][k];
            along.iter_mut().zip(&self.triangle[k]).for_each(|(x, r)| *x -= factor * r);
            // Relative to the lengths of the columns: smaller factors are rounding.
            if (factor * norm(&self.triangle[k])).abs() > NEGLIGIBLE * length {
                self.base[k].others.push((parameter, tidy(factor)));
            }
        }
    }
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// A factor without the rounding of the last digits.
fn tidy(x: f64) -> f64 {
    let rounded = (x * 1e9).round() / 1e9;
    if (rounded - x).abs() < 1e-10 {
        rounded
    } else {
        x
    }
}

impl fmt::Display for Identifiable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for BaseParameter { parameter, others } in &self.base {
            write!(f, "{}", self.names[*parameter])?;
            for (other, factor) in others {
                let sign = if *factor < 0.0 { '-' } else { '+' };
                match (factor.abs() * 1e6).round() / 1e6 {
                    1.0 => write!(f, " {sign} {}", self.names[*other])?,
                    size => write!(f, " {sign} {size} {}", self.names[*other])?,
                }
            }
            writeln!(f)?;
        }
        Ok(())
    }
}
