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

/// Sweeps in a round.
const SWEEPS: u32 = 5;
/// Steps of Newton's method in a round.
const STEPS: u32 = 8;
/// Steps of Newton's method from the solution of a problem nearby.
const NEAR: u32 = 4;
/// Lengths of a step, each half of the last, of which the first that reduces the residual is taken.
const LENGTHS: u32 = 5;
/// Random starts of Newton's method where sweeps do not reach a solution, and full steps from each of them. Where sweeps went
/// round in circles in problems of four feet, every second to tenth start led to a solution.
const STARTS: u32 = 64;
const FAR: u32 = 24;

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

/// Work done, and the worst residual that is left.
#[derive(Clone, Copy)]
struct Progress<S> {
    worst: (usize, S),
    sweeps: u32,
    newton: u32,
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

/// The impulses of [`solve_above`] by iteration.
fn iterate<S: Real>(
    problem: &Problem<S>,
    least: &[S],
    effort: Effort,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<Certificate<S>, ContactError> {
    finite(problem)?;
    let (anchor, work) = split(work, impulses.len());
    copy(anchor, impulses);
    let zero = S::zero();
    let mut progress = Progress { worst: (0, zero), sweeps: 0, newton: 0 };
    let (tolerance, rounds) = match effort {
        Effort::Sweeps(count) => {
            return Ok(swept(problem, least, count, impulses)?);
        }
        Effort::ToTolerance { tolerance, rounds } => (tolerance.max(16.0 * S::epsilon()), rounds),
    };
    let found = by_sweeps(problem, least, (tolerance, rounds), anchor, impulses, &mut progress, work);
    let worst = progress.worst;
    let plain = Terms { problem, least, alpha: zero, anchor: &[] };
    // Friction may wedge a contact at the impulses of a sweep, and not at a solution.
    if found == Ok(true) || rounds > 0 && elsewhere(&plain, tolerance, impulses, &mut progress, work) {
        let Progress { worst, sweeps, newton } = progress;
        return Ok(Certificate { residual: worst.1, sweeps, newton });
    }
    found?;
    let (touch, residual) = worst;
    Err(ContactError::NoConvergence { touch, residual: residual.to_f64(), sweeps: progress.sweeps })
}

/// Sweeps and steps of Newton's method; whether they reach a tolerance.
fn by_sweeps<S: Real>(
    problem: &Problem<S>,
    least: &[S],
    (tolerance, rounds): (f64, u32),
    anchor: &mut [S],
    impulses: &mut [S],
    progress: &mut Progress<S>,
    work: &mut [S],
) -> Result<bool, ContactError> {
    let plain = Terms { problem, least, alpha: S::zero(), anchor: &[] };
    if approach(&plain, tolerance, PLAIN.min(rounds), impulses, progress, work)? {
        return Ok(true);
    }
    // Proximal steps: each is a problem with a larger diagonal, which is easier.
    let mut alpha = S::constant(PROXIMAL);
    copy(impulses, anchor);
    for _ in 0..rounds {
        copy(anchor, impulses);
        let terms = Terms { problem, least, alpha, anchor };
        let reached = approach(&terms, 0.1 * tolerance, PLAIN, impulses, progress, work)?;
        if progress.reaches(&plain, tolerance, impulses, work) {
            return Ok(true);
        }
        alpha = alpha * S::constant(if reached { 0.5 } else { 4.0 });
    }
    Ok(false)
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
    let terms = Terms { problem, least, alpha: S::zero(), anchor: &[] };
    for _ in 0..count {
        sweep(&terms, impulses)?;
    }
    let (_, residual) = cone::residual(&terms, impulses, |touch, row| terms.velocity(touch, row, impulses));
    Ok(Certificate { residual, sweeps: count, newton: 0 })
}

/// Rounds without proximal terms, and in each proximal step.
const PLAIN: u32 = 12;
/// First proximal term, as a part of the diagonal.
const PROXIMAL: f64 = 0.3;

/// Sweeps and Newton steps, until the residual is below a tolerance; whether it is.
fn approach<S: Real>(
    terms: &Terms<S>,
    tolerance: f64,
    rounds: u32,
    impulses: &mut [S],
    progress: &mut Progress<S>,
    work: &mut [S],
) -> Result<bool, ContactError> {
    for _ in 0..rounds {
        for _ in 0..SWEEPS {
            sweep(terms, impulses)?;
            progress.sweeps += 1;
            if progress.reaches(terms, tolerance, impulses, work) {
                return Ok(true);
            }
        }
        if improve(terms, tolerance, (STEPS, LENGTHS), impulses, progress, work) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Full steps of Newton's method from random impulses within the friction cones; whether they reach a tolerance.
fn elsewhere<S: Real>(
    terms: &Terms<S>,
    tolerance: f64,
    impulses: &mut [S],
    progress: &mut Progress<S>,
    work: &mut [S],
) -> bool {
    let problem = terms.problem;
    let largest = problem.b.iter().fold(S::zero(), |most, b| if b.abs() > most { b.abs() } else { most });
    let mut state = 1_u32;
    let mut random = || {
        // Numerical Recipes' generator, whose upper bits are good enough.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        S::constant(f64::from(state >> 8) / f64::from(1_u32 << 24))
    };
    (0..STARTS).any(|start| {
        let size = S::constant(0.25 * f64::from(1_u32 << (2 * (start % 4)))) * largest;
        for touch in problem.touches {
            let c = touch.contact;
            let normal = random() * size * cone::mass(problem, touch);
            set(impulses, c.row, normal);
            for row in c.row + 1..c.row + c.rows() {
                set(impulses, row, (random() - S::constant(0.5)) * c.friction * normal);
            }
        }
        improve(terms, tolerance, (FAR, 1), impulses, progress, work)
    })
}

/// Steps of Newton's method, until the residual is below a tolerance; whether it is. With several `lengths`, until a step does
/// not reduce it either, which is not made; with one, all are full steps. `work` has room for a square matrix and four lists.
fn improve<S: Real>(
    terms: &Terms<S>,
    tolerance: f64,
    (steps, lengths): (u32, u32),
    impulses: &mut [S],
    progress: &mut Progress<S>,
    work: &mut [S],
) -> bool {
    let (last, work) = split(work, impulses.len());
    velocities(terms, impulses, first_mut(work, impulses.len()));
    for _ in 0..steps {
        copy(last, impulses);
        let before = progress.worst;
        let mut reduced = newton::step(terms, impulses, work);
        if reduced {
            progress.newton += 1;
            for length in 0..lengths {
                if length > 0 {
                    for (p, last) in impulses.iter_mut().zip(&*last) {
                        *p = S::constant(0.5) * (*p + *last);
                    }
                }
                if progress.reaches(terms, tolerance, impulses, work) {
                    return true;
                }
                reduced = lengths == 1 || progress.worst.1 < before.1;
                if reduced {
                    break;
                }
            }
        }
        if !reduced {
            copy(impulses, last);
            progress.worst = before;
            return false;
        }
    }
    false
}

impl<S: Real> Progress<S> {
    /// Looks at the residual of impulses, whose velocities the first list of `work` has then; whether it is below a tolerance.
    fn reaches(&mut self, terms: &Terms<S>, tolerance: f64, impulses: &[S], work: &mut [S]) -> bool {
        let v = first_mut(work, impulses.len());
        velocities(terms, impulses, v);
        self.worst = cone::residual(terms, impulses, |_, row| get(v, row));
        self.worst.1.to_f64() <= tolerance
    }
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
    for (index, touch) in terms.problem.touches.iter().enumerate() {
        let row = touch.contact.row;
        let block = local::Block::of(terms, touch, impulses);
        let found =
            local::solve(&block, touch, get(terms.least, row)).map_err(|pivot| Wedge { touch: index, pivot })?;
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
