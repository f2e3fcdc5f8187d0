//! Impulses and forces of contacts: complementarity on friction cones, dense.
//!
//! With the inverse inertia `A = Φ M⁻¹Φᵀ` of the contacts' rows and their velocities `b` without impulses, the impulses `P`
//! and velocities `v = b + A P` satisfy at every contact
//!
//! - `0 ≤ P_n ⊥ v_n ≥ 0`: bodies are pressed together, or part;
//! - `|P_t| ≤ µ P_n`, and where the bodies slide, `P_t = −µ P_n v_t / |v_t|` (Coulomb's law on the exact cone).
//!
//! The same problem holds at three levels: impulses and velocities of an impact, forces and accelerations of closed
//! contacts, impulses and velocities of a time step.

mod cone;
mod impact;
mod local;
mod newton;
mod routh;
mod search;
#[cfg(test)]
mod tests;

use super::Contact;
use crate::lists::{copy, get, part, set, split};
use crate::system::Real;

pub(super) use newton::{factor, solve_factored};
use search::{improve, iterate, sweep, swept, Progress, LENGTHS, NEAR, STEPS};

pub use impact::{impact, Impact, ImpactOptions, ImpactOrder};
pub(super) use impact::{impact_by_sweeps, impact_near};

/// A contact of a problem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch<S> {
    /// The contact, with its row in the problem.
    pub contact: Contact<S>,
    /// Direction of slip, a unit vector, of a contact that slides already: its friction is `−µ P_n t̂`, whatever the
    /// tangential velocity is.
    pub slip: Option<[S; 2]>,
}

/// Contacts, the inverse inertia of their rows, and the velocities of these without impulses.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a, S> {
    /// `A`, symmetric and positive semidefinite, row by row; 1/kg (1/(kg m²) for rotations).
    pub a: &'a [S],
    /// `b`, m/s (rad/s): velocities before an impact. At the level of accelerations m/s² (rad/s²).
    pub b: &'a [S],
    /// The contacts.
    pub touches: &'a [Touch<S>],
}

/// Work for the impulses of contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Effort {
    /// Until the relative residual is below a tolerance.
    ToTolerance {
        /// Relative residual. Where no search reaches it, one a hundred times as large will do; the certificate tells it.
        tolerance: f64,
        /// Largest number of rounds of sweeps and Newton steps.
        rounds: u32,
    },
    /// A fixed number of sweeps over all contacts, whatever the residual is.
    Sweeps(u32),
}

/// Relative residual of impulses and forces, unless another is asked for.
const TOLERANCE: f64 = 1e-11;

impl Default for Effort {
    fn default() -> Self {
        Effort::ToTolerance { tolerance: TOLERANCE, rounds: 60 }
    }
}

impl Effort {
    /// A single round to the default tolerance, without random starts.
    pub(super) const fn brief() -> Self {
        Effort::ToTolerance { tolerance: TOLERANCE, rounds: 1 }
    }
}

/// How well impulses satisfy the laws of contact, and the work that it took.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Certificate<S> {
    /// Largest `|min(P_n, m v_n)|` and `|P_t − proj(P_t − m v_t)|` of a contact, with the mass `m` that it moves and the
    /// projection onto the disc of radius `µ P_n`, relative to the largest impulse.
    pub residual: S,
    /// Sweeps over all contacts.
    pub sweeps: u32,
    /// Steps of Newton's method.
    pub newton: u32,
}

/// Reason why no impulses or forces of contacts were found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ContactError {
    /// The iteration did not reach the tolerance.
    NoConvergence {
        /// The contact with the largest residual, by its place in the problem; by its number in the mechanism where a
        /// [`HybridError`](super::HybridError) has this error.
        touch: usize,
        /// Its relative residual.
        residual: f64,
        /// Sweeps over all contacts.
        sweeps: u32,
    },
    /// Friction wedges a contact that slides: pressing it together makes its bodies approach faster (Painlevé).
    Wedged {
        /// The contact, by its place in the problem; by its number in the mechanism where a
        /// [`HybridError`](super::HybridError) has this error.
        touch: usize,
        /// Acceleration of the gap for a unit normal force, zero or negative, 1/kg.
        pivot: f64,
    },
    /// Contacts that collide one after the other did not come to an end.
    NoEnd {
        /// Collisions.
        collisions: u32,
    },
    /// The impulses of a collision whose slip turns are solutions of differential equations, whose derivatives are not
    /// computed. Numbers with derivatives only.
    NoDerivative,
    /// A velocity or an inertia is not finite.
    NotFinite,
    /// A list of a problem, its impulses or its memory is shorter or longer than the number of rows asks for.
    Lengths,
}

impl ContactError {
    /// The same error with another number for its contact, of which `number` is told the present one.
    pub(in crate::contact) fn at(self, number: impl FnOnce(usize) -> usize) -> Self {
        match self {
            ContactError::NoConvergence { touch, residual, sweeps } => {
                ContactError::NoConvergence { touch: number(touch), residual, sweeps }
            }
            ContactError::Wedged { touch, pivot } => ContactError::Wedged { touch: number(touch), pivot },
            other => other,
        }
    }
}

impl core::fmt::Display for ContactError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            ContactError::NoConvergence { touch, residual, sweeps } => write!(
                f,
                "the impulses of the contacts have a relative residual of {residual:.1e} at contact {touch} after {sweeps} sweeps: allow more rounds, or reduce friction or mass ratios"
            ),
            ContactError::Wedged { touch, pivot } => write!(
                f,
                "friction wedges contact {touch} while it slides (its gap accelerates by {pivot:.1e} for a unit normal force): reduce the friction"
            ),
            ContactError::NoEnd { collisions } => write!(
                f,
                "contacts that collide one after the other did not come to an end in {collisions} collisions: solve them simultaneously"
            ),
            ContactError::NoDerivative => {
                write!(f, "the slip of a collision with restitution and friction turns: derivatives of its impulse are not computed")
            }
            ContactError::Lengths => {
                write!(f, "a list of a contact problem has not the length that its number of rows asks for")
            }
            ContactError::NotFinite => write!(f, "a velocity or an inertia of a contact is not finite"),
        }
    }
}

impl core::error::Error for ContactError {}

/// Room that [`solve`] and [`impact`] need for a problem with some number of rows.
pub const fn work_len(rows: usize) -> usize {
    rows * rows + 9 * rows
}

/// Computes the impulses of a problem; `impulses` has a number for each row, the start of the iteration and its result,
/// and `work` [`work_len`] numbers.
///
/// Contacts are solved one after the other, exactly (block Gauss–Seidel); steps of Newton's method on the projection
/// equations of Alart and Curnier (Comput. Methods Appl. Mech. Eng. 92, 1991) follow where this is slow. Where the
/// contacts are redundant, impulses are not unique, and those that the iteration comes to first are taken.
///
/// # Errors
/// [`ContactError`].
pub fn solve<S: Real>(
    problem: &Problem<S>,
    effort: Effort,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<Certificate<S>, ContactError> {
    fits(problem, impulses, work)?;
    let rows = problem.b.len();
    let (least, work) = split(work, rows);
    least.fill(S::zero());
    solve_above(problem, least, effort, impulses, work)
}

/// [`solve`] from impulses that solve a problem nearby: where these or steps of Newton's method reach the tolerance, no
/// sweep is made. Elsewhere, the iteration starts from zero.
///
/// A contact that friction wedges is found by sweeps only, so that it must have been looked for before.
///
/// # Errors
/// [`ContactError`].
pub(super) fn solve_near<S: Real>(
    problem: &Problem<S>,
    effort: Effort,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<Certificate<S>, ContactError> {
    let near = |terms: &Terms<S>, tolerance, impulses: &mut [S], progress: &mut Progress<S>, work: &mut [S]| {
        Ok(progress.reaches(terms, tolerance, impulses, work)
            || improve(terms, tolerance, (NEAR, LENGTHS), impulses, progress, work))
    };
    solve_first(problem, near, effort, impulses, work)
}

/// [`solve`] from impulses that may solve a problem nearby, for time steps: full steps of Newton's method after a sweep find
/// the impulses of nineteen in twenty problems in which contacts of a step before come and go, where steps that have to reduce
/// the residual find half. Elsewhere, the iteration starts from zero.
///
/// # Errors
/// [`ContactError`].
pub(super) fn solve_soon<S: Real>(
    problem: &Problem<S>,
    effort: Effort,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<Certificate<S>, ContactError> {
    let soon = |terms: &Terms<S>, tolerance, impulses: &mut [S], progress: &mut Progress<S>, work: &mut [S]| {
        for restart in [false, true] {
            if restart {
                impulses.fill(S::zero());
            }
            sweep(terms, impulses)?;
            progress.sweeps += 1;
            if progress.reaches(terms, tolerance, impulses, work)
                || improve(terms, tolerance, (STEPS, 1), impulses, progress, work)
            {
                return Ok(true);
            }
        }
        Ok(false)
    };
    solve_first(problem, soon, effort, impulses, work)
}

/// [`solve`] by `first(terms, tolerance, impulses, progress, work)`, where this returns that it reaches the tolerance.
fn solve_first<S: Real>(
    problem: &Problem<S>,
    first: impl Fn(&Terms<S>, f64, &mut [S], &mut Progress<S>, &mut [S]) -> Result<bool, ContactError>,
    effort: Effort,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<Certificate<S>, ContactError> {
    fits(problem, impulses, work)?;
    finite(problem)?;
    if let Effort::ToTolerance { tolerance, .. } = effort {
        let (least, rest) = split(work, problem.b.len());
        least.fill(S::zero());
        let terms = Terms { problem, least, alpha: S::zero(), anchor: &[] };
        let mut progress = Progress { worst: (0, S::zero()), sweeps: 0, newton: 0 };
        if first(&terms, tolerance.max(16.0 * S::epsilon()), impulses, &mut progress, rest)? {
            let Progress { worst, sweeps, newton } = progress;
            differentiate(&terms, impulses, rest)?;
            return Ok(Certificate { residual: worst.1, sweeps, newton });
        }
    }
    impulses.fill(S::zero());
    solve(problem, effort, impulses, work)
}

/// A problem as the iterations see it.
#[derive(Clone, Copy)]
struct Terms<'a, S> {
    problem: &'a Problem<'a, S>,
    /// Least normal impulses, at the normal rows.
    least: &'a [S],
    /// Proximal term: velocities are `b + A P + α m⁻¹ (P − P₀)` with the mass `m` of each contact.
    alpha: S,
    /// `P₀`.
    anchor: &'a [S],
}

impl<S: Real> Terms<'_, S> {
    /// Added to the diagonal of a contact's rows.
    fn proximal(&self, touch: &Touch<S>) -> S {
        self.alpha * cone::most(self.problem, touch)
    }

    /// Velocity of a row of a contact.
    fn velocity(&self, touch: &Touch<S>, row: usize, impulses: &[S]) -> S {
        let v = velocity(self.problem, row, impulses);
        if self.alpha > S::zero() {
            v + self.proximal(touch) * (get(impulses, row) - get(self.anchor, row))
        } else {
            v
        }
    }
}

/// [`solve`] with normal impulses not below `least`.
///
/// On numbers with derivatives, the iteration stops where the values are found, before the derivatives are. These follow
/// from steps of Newton's method at the solution, in which only derivatives are left to change: the theorem of implicit
/// functions on the rows that act.
fn solve_above<S: Real>(
    problem: &Problem<S>,
    least: &[S],
    effort: Effort,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<Certificate<S>, ContactError> {
    let certificate = iterate(problem, least, effort, impulses, work)?;
    differentiate(&Terms { problem, least, alpha: S::zero(), anchor: &[] }, impulses, work)?;
    Ok(certificate)
}

/// Gives the solution its derivatives, on numbers that have any.
fn differentiate<S: Real>(terms: &Terms<S>, impulses: &mut [S], work: &mut [S]) -> Result<(), ContactError> {
    if S::zero().derivative().is_some() && !newton::differentiate(terms, impulses, work) {
        return Err(ContactError::NotFinite);
    }
    Ok(())
}

/// Tells of lists of other lengths than the number of rows asks for, and of contacts beyond it.
fn fits<S: Real>(problem: &Problem<S>, impulses: &[S], work: &[S]) -> Result<(), ContactError> {
    let rows = problem.b.len();
    let inside = |touch: &Touch<S>| touch.contact.row.checked_add(touch.contact.rows()).is_some_and(|end| end <= rows);
    let lists = problem.a.len() == rows * rows && impulses.len() == rows && work.len() >= work_len(rows);
    match lists && problem.touches.iter().all(inside) {
        true => Ok(()),
        false => Err(ContactError::Lengths),
    }
}

/// Tells of numbers that are not finite.
fn finite<S: Real>(problem: &Problem<S>) -> Result<(), ContactError> {
    // Without an early end, which would keep the compiler from looking at several numbers at once.
    let all = |list: &[S]| list.iter().fold(true, |all, x| all & x.is_finite());
    match all(problem.a) & all(problem.b) {
        true => Ok(()),
        false => Err(ContactError::NotFinite),
    }
}

/// Velocity of a row, `b + A P`.
fn velocity<S: Real>(problem: &Problem<S>, row: usize, impulses: &[S]) -> S {
    let n = problem.b.len();
    let terms = part(problem.a, row * n, n).iter().zip(impulses);
    terms.fold(get(problem.b, row), |sum, (a, p)| sum + *a * *p)
}

/// Velocities of all rows, those of [`Terms::velocity`] to the bit: `A` is symmetric, so that its rows are its columns.
fn velocities<S: Real>(terms: &Terms<S>, impulses: &[S], v: &mut [S]) {
    let problem = terms.problem;
    copy(v, problem.b);
    for (a, p) in problem.a.chunks_exact(impulses.len().max(1)).zip(impulses) {
        if *p != S::zero() || p.derivative().is_some() {
            for (v, a) in v.iter_mut().zip(a) {
                *v = *v + *a * *p;
            }
        }
    }
    if terms.alpha > S::zero() {
        for touch in problem.touches {
            for row in touch.contact.row..touch.contact.row + touch.contact.rows() {
                let more = terms.proximal(touch) * (get(impulses, row) - get(terms.anchor, row));
                set(v, row, get(v, row) + more);
            }
        }
    }
}

/// Change of the kinetic energy by impulses, `bᵀP + ½ PᵀA P`, J.
pub(super) fn energy<S: Real>(problem: &Problem<S>, impulses: &[S]) -> S {
    let half = S::constant(0.5);
    let each = impulses.iter().enumerate().zip(problem.b);
    each.fold(S::zero(), |sum, ((row, p), b)| sum + *p * (half * (*b + velocity(problem, row, impulses))))
}
