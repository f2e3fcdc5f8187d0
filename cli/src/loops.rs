//! Closes the loops and couplings of a model from its start, and reports on them.

use std::path::Path;

use multibody::codegen::jit::Compiled;
use multibody::codegen::model::{ConstraintKind, Model};
use multibody::codegen::plan::Plan;
use multibody::runtime::constrained::{close, complete, Closed, Closing, ConstraintError};
use multibody::runtime::system::Row;
use multibody::runtime::{Constrained, Interpreter, System};

use super::output::note;
use super::{source, Failure, Outcome};

/// Residual below which a loop counts as closed, m or rad.
const OPEN: f64 = 1e-9;

/// The state of a model whose loops have been closed.
pub struct Assembly {
    /// Coordinates.
    pub q: Vec<f64>,
    /// Iterations, residual and rank of the closing.
    pub closed: Closed,
    /// Largest change of a coordinate from the start, m or rad.
    pub moved: f64,
    /// Every loop and coupling.
    pub bonds: Vec<Bond>,
    /// Mobility: number of velocities that can be chosen.
    pub mobility: usize,
}

/// A loop or coupling and its rows at the closed coordinates.
pub struct Bond {
    /// Name.
    pub name: String,
    /// Number of rows.
    pub rows: usize,
    /// Number of independent rows.
    pub rank: usize,
}

impl Assembly {
    /// Number of rows of all constraints.
    pub fn rows(&self) -> usize {
        self.bonds.iter().map(|b| b.rows).sum()
    }

    /// Number of independent rows of all constraints.
    pub fn rank(&self) -> usize {
        self.bonds.iter().map(|b| b.rank).sum()
    }

    /// A summary in one line: iterations, residual, rank and mobility.
    pub fn summary(&self) -> String {
        let Closed { iterations, residual, .. } = self.closed;
        let (rows, rank) = (self.rows(), self.rank());
        let iterations = match iterations {
            0 => "as it starts".to_string(),
            1 => "in 1 iteration".to_string(),
            n => format!("in {n} iterations"),
        };
        let moved = match self.moved > 1e-9 {
            true => format!(", coordinates moved by up to {:.1e}", self.moved),
            false => String::new(),
        };
        format!(
            "closed {iterations}{moved}, residual {residual:.1e}; {rows} rows, {rank} independent, mobility {}",
            self.mobility
        )
    }
}

/// Closes the loops from given coordinates, and counts the independent rows there.
///
/// # Errors
/// Loops that do not close are reported with their lines in the file at `path`.
pub fn assemble(path: &Path, plan: &Plan, interpreter: &mut Interpreter<f64>, start: &[f64]) -> Outcome<Assembly> {
    interpreter.check_rank(start).map_err(|e| source::rank_failure(&e))?;
    let held = plan.held();
    let mut q = start.to_vec();
    let closing = Closing::holding(&held);
    let closed = match close(interpreter, &mut q, &closing) {
        Ok(closed) => closed,
        Err(error) => {
            let free = close(interpreter, &mut start.to_vec(), &Closing::default()).is_ok();
            return Err(does_not_close(path, plan, interpreter, &q, error, free));
        }
    };
    let (mut residual, mut dq, mut pivots) =
        (interpreter.zero_rows(), interpreter.zero_momenta(), interpreter.zero_rows());
    interpreter.position_correction(&q, &mut residual, &mut dq, &mut pivots);
    let rows = interpreter.rows();
    let bonds: Vec<Bond> = (0..plan.model.constraints.len())
        .map(|k| {
            let own = || rows.iter().zip(&pivots).filter(move |(row, _)| row.constraint == k);
            let rank = own().filter(|(_, pivot)| **pivot != 0.0).count();
            Bond { name: plan.model.constraints[k].name.clone(), rows: own().count(), rank }
        })
        .collect();
    let mobility = plan.dims.nv - bonds.iter().map(|b| b.rank).sum::<usize>();
    let moved = q.iter().zip(start).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    Ok(Assembly { q, closed, moved, bonds, mobility })
}

/// Velocities that satisfy the constraints. Those of `held` joints stay and the others follow from them; where that is
/// impossible, or no joint is held, the nearest velocities in the metric of the mass matrix. `stated` says that the
/// velocities are given by the user, so that a change is reported.
pub fn velocities(
    plan: &Plan,
    interpreter: &mut Interpreter<f64>,
    q: &[f64],
    v: &[f64],
    stated: bool,
) -> Outcome<Vec<f64>> {
    let (held, q, mut v) = (plan.held(), q.to_vec(), v.to_vec());
    if held.iter().any(|h| *h) {
        match complete(interpreter, 0.0, &q, &mut v, &held, 1e-9) {
            Ok(_) => return Ok(v),
            Err(error) if stated => {
                let at = named(plan, &error).map_or(String::new(), |name| format!(" at {name}"));
                let help = "lower them, hold other joints in the model, or leave a singular position";
                return Err(Failure::new(format!("--v: held velocities cannot be kept{at}: {error}"), help));
            }
            Err(_) => {}
        }
    }
    let (mut p, mut sigma) = (interpreter.zero_momenta(), interpreter.zero_rows());
    interpreter.momenta(&q, &v.clone(), &mut p);
    interpreter.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
    Ok(v)
}

/// Reports the loops that stay open, those with the largest residuals first.
fn does_not_close(
    path: &Path,
    plan: &Plan,
    interpreter: &mut Interpreter<f64>,
    q: &[f64],
    error: ConstraintError,
    free: bool,
) -> Failure {
    let ConstraintError::NotClosed { rank, rows, iterations, .. } = error else {
        let what = format!("{}: the loops do not close: {error}", path.display());
        return Failure::new(what, "look for very large numbers in the model and its start");
    };
    let (mut residual, mut entries) = (interpreter.zero_rows(), interpreter.zero_entries());
    interpreter.constraint_residuals(&q.to_vec(), &mut residual, &mut entries);
    let mut open: Vec<(usize, f64, usize)> = Vec::new();
    for k in 0..plan.model.constraints.len() {
        let own = interpreter.rows().iter().enumerate().filter(|(_, row)| row.constraint == k);
        let worst = own.enumerate().map(|(at, (i, _))| (residual[i].abs(), at)).max_by(|a, b| a.0.total_cmp(&b.0));
        open.extend(worst.filter(|w| w.0 > OPEN).map(|(size, at)| (k, size, at)));
    }
    open.sort_by(|a, b| b.1.total_cmp(&a.1));
    let couplings =
        open.iter().all(|(k, ..)| matches!(plan.model.constraints[*k].kind, ConstraintKind::Coupling { .. }));
    let help = match (free, couplings) {
        (true, _) => "with no joint `held` all is met: hold others, or give these another `start`",
        (_, true) => "couplings of the same joints have to agree: change an offset or a ratio, or leave one out",
        _ => "look at lengths and frames; if they can meet, give joints a `start` nearer to where they do",
    };
    for (k, size, at) in open {
        let constraint = &plan.model.constraints[k];
        let verb = match constraint.kind {
            ConstraintKind::Loop { .. } => "does not close",
            ConstraintKind::Coupling { .. } => "cannot be met",
        };
        let (place, word, name, unit) =
            (&constraint.origin, constraint.word(), &constraint.name, unit(&plan.model, k, at));
        note(format_args!(
            "{place}: error: {word} `{name}` {verb}: what is left is {size:.3e} {unit} after {iterations} iterations (rank \
             {rank} of {rows} rows)"
        ));
    }
    note(format_args!("  help: {help}"));
    Failure::Shown
}

/// Unit of the residual of row `at` of a constraint.
fn unit(model: &Model, k: usize, at: usize) -> &'static str {
    match &model.constraints[k].kind {
        ConstraintKind::Loop { kind, .. } => kind.spec().rows[at].symbol(),
        ConstraintKind::Coupling { terms, .. } => {
            let mut units = terms.iter().map(|(j, _)| model.joints[*j].kind.spec().coordinates[0].unit.symbol());
            let first = units.next().unwrap_or_default();
            if units.all(|unit| unit == first) {
                first
            } else {
                "(rad and m)"
            }
        }
    }
}

/// Notes and warnings: redundant rows, loop by loop, and the mobility.
pub fn tell(path: &Path, plan: &Plan, assembly: &Assembly) {
    for (k, bond) in assembly.bonds.iter().enumerate().filter(|(_, b)| b.rank < b.rows) {
        let Bond { name, rows, rank } = bond;
        let follow = match rows - rank {
            1 => "1 follows".to_string(),
            n => format!("{n} follow"),
        };
        let counted = if *rows == 1 { "1 row".to_string() } else { format!("{rows} rows") };
        let (place, word) = (&plan.model.constraints[k].origin, plan.model.constraints[k].word());
        note(format_args!("{place}: note: {word} `{name}`: {counted}, rank {rank}: {follow} from the rest"));
    }
    if assembly.mobility == 0 && plan.dims.nv > 0 {
        note(format_args!(
            "{}: warning: nothing can move: the loops leave no mobility to {} velocities ({} independent rows)\n  help: leave \
             a loop out, or replace it by one of fewer rows, if it was meant to move",
            path.display(),
            plan.dims.nv,
            assembly.rank()
        ));
    }
}

/// Name of the constraint of an error, for its message.
pub fn named(plan: &Plan, error: &ConstraintError) -> Option<String> {
    let k = match *error {
        ConstraintError::NotClosed { constraint, .. }
        | ConstraintError::Incompatible { constraint, .. }
        | ConstraintError::RankLoss { constraint, .. }
        | ConstraintError::Energy { constraint, .. } => constraint,
        _ => return None,
    };
    title(plan, k)
}

/// Kind and name of constraint `k`.
pub fn title(plan: &Plan, k: usize) -> Option<String> {
    let constraint = plan.model.constraints.get(k)?;
    Some(format!("{} `{}`", constraint.word(), constraint.name))
}

/// Description of the loops and couplings that a state violates by more than 1e-6.
pub fn violated(plan: &Plan, mechanism: &mut Compiled, q: &[f64], v: &[f64]) -> Vec<String> {
    const MOST: f64 = 1e-6;
    if plan.dims.rows == 0 {
        return Vec::new();
    }
    let q = q.to_vec();
    let (mut residual, mut entries) = (mechanism.zero_rows(), mechanism.zero_entries());
    let (mut p, mut allowed, mut sigma) = (mechanism.zero_momenta(), mechanism.zero_momenta(), mechanism.zero_rows());
    mechanism.momenta(&q, v, &mut p);
    mechanism.project_momenta(0.0, &q, &mut p, &mut allowed, &mut sigma);
    mechanism.constraint_residuals(&q, &mut residual, &mut entries);
    let mut worst = vec![[0.0_f64; 2]; plan.model.constraints.len()];
    let columns = mechanism.entry_columns();
    for (row, residual) in mechanism.rows().iter().zip(&residual) {
        let own = row.first..row.first + row.len;
        // Rates of the residuals, minus those that the row prescribes, which are the rates of `allowed`.
        let rate: f64 = own.map(|e| entries[e] * (v[columns[e]] - allowed[columns[e]])).sum();
        let [open, fast] = &mut worst[row.constraint];
        (*open, *fast) = (open.max(residual.abs()), fast.max(rate.abs()));
    }
    let scale = v.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
    let mut out = Vec::new();
    for (k, [open, fast]) in worst.into_iter().enumerate() {
        let (word, name) = (plan.model.constraints[k].word(), &plan.model.constraints[k].name);
        if open > MOST {
            out.push(format!("`q` leaves {word} `{name}` open by {open:.1e}; nothing closes it here"));
        }
        if fast > MOST * scale {
            out.push(format!(
                "`v` breaks {word} `{name}` by {fast:.1e}; `qd`, `pd` and `kinetic` are those of the nearest velocities it \
                 allows"
            ));
        }
    }
    out
}

/// Largest residual of the positions, m or rad.
pub fn largest(rows: &[Row], residual: &[f64]) -> f64 {
    let holonomic = rows.iter().zip(residual).filter(|(row, _)| row.holonomic);
    holonomic.fold(0.0, |m, (_, x)| if x.abs() <= m { m } else { x.abs() })
}
