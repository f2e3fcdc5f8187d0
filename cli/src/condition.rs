//! Digits that a state leaves to its results: the condition of the mass matrix, and coordinates too large for angles.

use multibody::codegen::plan::Plan;

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

/// Condition of the mass matrix `M` (`n × n`, row by row) in the norm of row sums, after scaling rows and columns so
/// that the diagonal is one: units and sizes of the coordinates do not matter then, and no scaling of rows and columns
/// has a condition more than `n` times smaller (van der Sluis, Numer. Math. 14, 1969). Infinite where rounding has left
/// the matrix indefinite. The index is that of the velocity with the least pivot.
fn condition(m: &[f64], n: usize) -> (f64, usize) {
    let root: Vec<f64> = (0..n).map(|i| m[i * n + i].sqrt()).collect();
    let mut l: Vec<f64> = (0..n * n).map(|at| m[at] / (root[at / n] * root[at % n])).collect();
    let largest_sum = |a: &[f64]| a.chunks(n).map(|row| row.iter().map(|x| x.abs()).sum()).fold(0.0_f64, f64::max);
    let norm = largest_sum(&l);
    // Cholesky's factor in place of the lower triangle.
    let mut least = (f64::INFINITY, 0);
    for j in 0..n {
        for i in j..n {
            let sum: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
            l[i * n + j] -= sum;
        }
        let pivot = l[j * n + j];
        if pivot.is_nan() || pivot < least.0 {
            least = (pivot, j);
        }
        if pivot.is_nan() || pivot <= 0.0 {
            return (f64::INFINITY, j);
        }
        (j..n).for_each(|i| l[i * n + j] /= pivot.sqrt());
    }
    // The inverse, column by column.
    let mut inverse = vec![0.0; n * n];
    for (k, x) in inverse.chunks_mut(n).enumerate() {
        x[k] = 1.0;
        for i in 0..n {
            let sum: f64 = (0..i).map(|j| l[i * n + j] * x[j]).sum();
            x[i] = (x[i] - sum) / l[i * n + i];
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|j| l[j * n + i] * x[j]).sum();
            x[i] = (x[i] - sum) / l[i * n + i];
        }
    }
    (norm * largest_sum(&inverse), least.1)
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
    Some(Doubt { what, help, singular: f64::EPSILON * condition > NO_DIGIT })
}

/// The coordinate whose neighbours among the doubles are farthest away: its name, and that distance, rad or m.
/// Components of quaternions are below one.
pub fn spacing(plan: &Plan, q: &[f64]) -> Option<(String, f64)> {
    let distances = q.iter().map(|q| q.abs() * f64::EPSILON).enumerate();
    let (at, apart) = distances.max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((plan.coordinate_names()[at].clone(), apart))
}
