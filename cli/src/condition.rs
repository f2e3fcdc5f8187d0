//! Digits that a state leaves to its results: the condition of the mass matrix, and coordinates too large for angles.

use multibody::codegen::plan::Plan;
use multibody::codegen::singular::{condition, SINGULAR};

/// Velocities of the largest mass matrix whose condition is computed: the time grows with the cube of their number.
pub const LARGEST: usize = 1000;

/// Relative error at which not even the first digit of a result is known.
const NO_DIGIT: f64 = 0.1;

/// What the condition of a mass matrix takes from velocities and accelerations.
pub struct Doubt {
    /// What is wrong.
    pub what: String,
    /// What to do about it.
    pub help: String,
    /// Whether the matrix is singular but for rounding: also where entries err by one rounding and not by `n`. The bound with
    /// `n` doubts a sound chain of 900 links.
    pub singular: bool,
}

/// What the mass matrix, which `matrix` writes row by row, leaves of the digits of velocities and accelerations, where that is
/// none. Large matrices are not looked at.
///
/// The numbers of a model are known to a rounding, and so are the entries of `M`: relative to the scaled matrix, an
/// error of at most `n ε` in the norm of row sums. The solution of `M v = p` then changes by `n ε κ` of its size to
/// first order, whatever the algorithm (Higham, *Accuracy and Stability of Numerical Algorithms*, 2002, section 7.1).
pub fn of_mass_matrix(plan: &Plan, matrix: impl FnOnce(&mut [f64])) -> Option<Doubt> {
    let n = plan.dims.nv;
    if n == 0 || n > LARGEST {
        return None;
    }
    let mut m = vec![0.0; n * n];
    matrix(&mut m);
    let (condition, at) = condition(&m, n);
    if n as f64 * f64::EPSILON * condition <= NO_DIGIT {
        return None;
    }
    let name = &plan.velocity_names()[at];
    let what = format!(
        "the mass matrix has condition {condition:.1e} (scaled to a unit diagonal): rounding leaves no digit of velocities \
         and accelerations; the others nearly determine `{name}`"
    );
    let help = format!("compare the masses and inertias that `{name}` moves with the others, or give it an armature");
    Some(Doubt { what, help, singular: condition > SINGULAR })
}

/// The coordinate whose neighbours among the doubles are farthest away: its name, and that distance, rad or m.
/// Components of quaternions are below one.
pub fn spacing(plan: &Plan, q: &[f64]) -> Option<(String, f64)> {
    let distances = q.iter().map(|q| q.abs() * f64::EPSILON).enumerate();
    let (at, apart) = distances.max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((plan.coordinate_names()[at].clone(), apart))
}
