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
#[cfg(test)]
mod tests;

use super::Contact;
use crate::lists::{copy, first_mut, get, part, set, split};
use crate::system::Real;

pub(super) use newton::eliminate;

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
        /// Relative residual.
        tolerance: f64,
        /// Largest number of rounds of sweeps and Newton steps.
        rounds: u32,
    },
    /// A fixed number of sweeps over all contacts, whatever the residual is.
    Sweeps(u32),
}

impl Default for Effort {
    fn default() -> Self {
        Effort::ToTolerance { tolerance: 1e-11, rounds: 60 }
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
        /// The contact with the largest residual, by its place in the problem.
        touch: usize,
        /// Its relative residual.
        residual: f64,
        /// Sweeps over all contacts.
        sweeps: u32,
    },
    /// Friction wedges a contact that slides: pressing it together makes its bodies approach faster (Painlevé).
    Wedged {
        /// The contact, by its place in the problem.
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

impl core::fmt::Display for ContactError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            ContactError::NoConvergence { touch, residual, sweeps } => write!(
                f,
                "the impulses of the contacts have a relative residual of {residual:.1e} at touching contact {touch} after {sweeps} sweeps: allow more rounds, or reduce friction or mass ratios"
            ),
            ContactError::Wedged { touch, pivot } => write!(
                f,
                "friction wedges touching contact {touch} while it slides (its gap accelerates by {pivot:.1e} for a unit normal force): reduce the friction"
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
    rows * rows + 8 * rows
}

/// Steps of Newton's method from where a sweep leads.
const STEPS: u32 = 8;
/// Rounds in which the number of increments of the friction doubles.
const DOUBLINGS: u32 = 6;
/// Friction, as a multiple of its size, from which it falls.
const MOST: f64 = 4.0;
/// Sweeps with all of the friction in all rounds but the first.
const SWEEPS: u32 = 5;
/// Largest number of halvings of a step.
const HALVINGS: u32 = 5;

/// Computes the impulses of a problem; `impulses` has a number for each row, the start of the iteration and its result,
/// and `work` [`work_len`] numbers.
///
/// Contacts are solved one after the other, exactly (block Gauss–Seidel); steps of Newton's method on the projection
/// equations of Alart and Curnier (Comput. Methods Appl. Mech. Eng. 92, 1991) follow, full ones at first: steps that are
/// halved until they reduce the residual stop more often than full ones lead astray. Where these do, friction falls to its size
/// from several times that in increments, in each of which the search begins with the impulses of the last one; then it grows
/// from zero in twice as many, and so on. Where the contacts are redundant, impulses are not unique, and those that the iteration comes to first are
/// taken.
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

/// [`solve`] from impulses that solve a problem nearby. Where that does not reach the tolerance at once, the iteration starts
/// from zero.
///
/// # Errors
/// [`ContactError`].
pub(super) fn solve_near<S: Real>(
    problem: &Problem<S>,
    effort: Effort,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<Certificate<S>, ContactError> {
    fits(problem, impulses, work)?;
    finite(problem)?;
    if let Effort::ToTolerance { tolerance, .. } = effort {
        let (least, rest) = split(work, problem.b.len());
        least.fill(S::zero());
        let terms = Terms::of(problem, least);
        let mut progress = Progress { worst: (0, S::zero()), sweeps: 0, newton: 0 };
        if approach(&terms, 1, tolerance_of::<S>(tolerance), impulses, &mut progress, rest)? {
            differentiate(&terms, impulses, rest)?;
            return Ok(progress.certificate());
        }
    }
    impulses.fill(S::zero());
    solve(problem, effort, impulses, work)
}

/// A tolerance that rounding allows.
fn tolerance_of<S: Real>(asked: f64) -> f64 {
    asked.max(16.0 * S::epsilon())
}

/// A problem as the iterations see it.
#[derive(Clone, Copy)]
struct Terms<'a, S> {
    problem: &'a Problem<'a, S>,
    /// Least normal impulses, at the normal rows.
    least: &'a [S],
    /// Part of the friction that acts.
    part: S,
}

impl<'a, S: Real> Terms<'a, S> {
    /// With all of the friction.
    fn of(problem: &'a Problem<'a, S>, least: &'a [S]) -> Self {
        Terms { problem, least, part: S::one() }
    }

    /// The contacts, with the friction that acts.
    fn touches(self) -> impl Iterator<Item = Touch<S>> + 'a {
        let friction = move |c: Contact<S>| Contact { friction: self.part * c.friction, ..c };
        self.problem.touches.iter().map(move |touch| Touch { contact: friction(touch.contact), ..*touch })
    }
}

/// Work done, and the worst residual that is left.
#[derive(Clone, Copy)]
struct Progress<S> {
    worst: (usize, S),
    sweeps: u32,
    newton: u32,
}

impl<S: Real> Progress<S> {
    fn certificate(self) -> Certificate<S> {
        Certificate { residual: self.worst.1, sweeps: self.sweeps, newton: self.newton }
    }

    /// Looks at the residual of impulses, whose velocities the first list of `work` has then; whether it is below a tolerance.
    fn reaches(&mut self, terms: &Terms<S>, tolerance: f64, impulses: &[S], work: &mut [S]) -> bool {
        let v = first_mut(work, impulses.len());
        velocities(terms.problem, impulses, v);
        self.worst = cone::residual(terms, impulses, |row| get(v, row));
        self.worst.1.to_f64() <= tolerance
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
    differentiate(&Terms::of(problem, least), impulses, work)?;
    Ok(certificate)
}

/// Gives the solution its derivatives, on numbers that have any.
fn differentiate<S: Real>(terms: &Terms<S>, impulses: &mut [S], work: &mut [S]) -> Result<(), ContactError> {
    if S::zero().derivative().is_some() && !newton::differentiate(terms, impulses, work) {
        return Err(ContactError::NotFinite);
    }
    Ok(())
}

/// The impulses of [`solve_above`] by iteration.
fn iterate<S: Real>(
    problem: &Problem<S>,
    least: &[S],
    effort: Effort,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<Certificate<S>, ContactError> {
    finite(problem)?;
    let (tolerance, rounds) = match effort {
        Effort::Sweeps(count) => {
            return Ok(swept(problem, least, count, impulses)?);
        }
        Effort::ToTolerance { tolerance, rounds } => (tolerance_of::<S>(tolerance), rounds),
    };
    let plain = Terms::of(problem, least);
    let mut progress = Progress { worst: (0, S::zero()), sweeps: 0, newton: 0 };
    for round in 0..rounds {
        let increments = if (1..=DOUBLINGS).contains(&round) { 1 << round } else { 0 };
        for k in 0..increments {
            if k == 0 {
                impulses.fill(S::zero());
            }
            // In every other round, friction falls from several times its size.
            let first = if round % 2 == 1 { MOST } else { 0.0 };
            let part = S::constant(first + (1.0 - first) * (f64::from(k) / f64::from(increments)));
            approach(&Terms { part, ..plain }, 1, tolerance, impulses, &mut progress, work)?;
        }
        let sweeps = if round > 0 { SWEEPS } else { 1 };
        if approach(&plain, sweeps, tolerance, impulses, &mut progress, work)? {
            return Ok(progress.certificate());
        }
    }
    let Progress { worst, sweeps, .. } = progress;
    Err(ContactError::NoConvergence { touch: worst.0, residual: worst.1.to_f64(), sweeps })
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
    match problem.a.iter().chain(problem.b).all(|x| x.is_finite()) {
        true => Ok(()),
        false => Err(ContactError::NotFinite),
    }
}

/// The impulses after a number of sweeps.
fn swept<S: Real>(
    problem: &Problem<S>,
    least: &[S],
    count: u32,
    impulses: &mut [S],
) -> Result<Certificate<S>, Wedge<S>> {
    let terms = Terms::of(problem, least);
    for _ in 0..count {
        sweep(&terms, impulses)?;
    }
    let (_, residual) = cone::residual(&terms, impulses, |row| velocity(problem, row, impulses));
    Ok(Certificate { residual, sweeps: count, newton: 0 })
}

/// Sweeps, then steps of Newton's method until the residual is below a tolerance; whether it is. After one sweep the steps are
/// full ones, after several they are halved until they reduce the residual. `work` has room for a square matrix and five lists.
fn approach<S: Real>(
    terms: &Terms<S>,
    sweeps: u32,
    tolerance: f64,
    impulses: &mut [S],
    progress: &mut Progress<S>,
    work: &mut [S],
) -> Result<bool, ContactError> {
    let (swept, work) = split(work, impulses.len());
    let (last, work) = split(work, impulses.len());
    for _ in 0..sweeps {
        sweep(terms, impulses)?;
    }
    progress.sweeps += sweeps;
    let mut reached = progress.reaches(terms, tolerance, impulses, work);
    let before = progress.worst;
    copy(swept, impulses);
    for _ in 0..STEPS {
        let residual = progress.worst.1;
        copy(last, impulses);
        if reached || !newton::step(terms, impulses, work) {
            break;
        }
        progress.newton += 1;
        reached = progress.reaches(terms, tolerance, impulses, work);
        let mut halvings = if sweeps > 1 { HALVINGS } else { 0 };
        while halvings > 0 && !(progress.worst.1 < residual) {
            for (p, last) in impulses.iter_mut().zip(&*last) {
                *p = S::constant(0.5) * (*p + *last);
            }
            reached = progress.reaches(terms, tolerance, impulses, work);
            halvings -= 1;
        }
    }
    // Impulses that are not finite have no residual.
    if !reached && !(progress.worst.1 < before.1) {
        progress.worst = before;
        copy(impulses, swept);
    }
    Ok(reached)
}

/// A contact of a problem that friction wedges. In the precision of the problem, so that nothing is converted where nobody
/// asks for the numbers of the error.
struct Wedge<S> {
    touch: usize,
    pivot: S,
}

impl<S: Real> From<Wedge<S>> for ContactError {
    #[inline]
    fn from(Wedge { touch, pivot }: Wedge<S>) -> Self {
        ContactError::Wedged { touch, pivot: pivot.to_f64() }
    }
}

/// Solves every contact by itself, one after the other.
fn sweep<S: Real>(terms: &Terms<S>, impulses: &mut [S]) -> Result<(), Wedge<S>> {
    for (index, touch) in terms.touches().enumerate() {
        let row = touch.contact.row;
        let block = local::Block::of(terms.problem, &touch, impulses);
        let found =
            local::solve(&block, &touch, get(terms.least, row)).map_err(|pivot| Wedge { touch: index, pivot })?;
        for (k, found) in found.into_iter().enumerate().take(touch.contact.rows()) {
            set(impulses, row + k, found);
        }
    }
    Ok(())
}

/// Velocity of a row, `b + A P`.
fn velocity<S: Real>(problem: &Problem<S>, row: usize, impulses: &[S]) -> S {
    let n = problem.b.len();
    let terms = part(problem.a, row * n, n).iter().zip(impulses);
    terms.fold(get(problem.b, row), |sum, (a, p)| sum + *a * *p)
}

/// Velocities of all rows, those of [`velocity`] to the bit: `A` is symmetric, so that its rows are its columns.
fn velocities<S: Real>(problem: &Problem<S>, impulses: &[S], v: &mut [S]) {
    copy(v, problem.b);
    for (a, p) in problem.a.chunks_exact(impulses.len().max(1)).zip(impulses) {
        if *p != S::zero() || p.derivative().is_some() {
            for (v, a) in v.iter_mut().zip(a) {
                *v = *v + *a * *p;
            }
        }
    }
}

/// Change of the kinetic energy by impulses, `bᵀP + ½ PᵀA P`, J.
fn energy<S: Real>(problem: &Problem<S>, impulses: &[S]) -> S {
    let half = S::constant(0.5);
    let each = impulses.iter().enumerate().zip(problem.b);
    each.fold(S::zero(), |sum, ((row, p), b)| sum + *p * (half * (*b + velocity(problem, row, impulses))))
}
