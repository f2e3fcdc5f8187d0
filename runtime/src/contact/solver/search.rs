//! The search for impulses: sweeps over all contacts, steps of Newton's method, proximal steps, and random starts.

use super::{cone, finite, local, newton, velocities, Certificate, ContactError, Effort, Problem, Terms};
use crate::lists::{copy, first_mut, get, largest, set, split};
use crate::system::Real;

/// Sweeps in a round.
const SWEEPS: u32 = 5;
/// Steps of Newton's method in a round.
pub(super) const STEPS: u32 = 8;
/// Steps of Newton's method from the solution of a problem nearby.
pub(super) const NEAR: u32 = 4;
/// Lengths of a step, each half of the last, of which the first that reduces the residual is taken.
pub(super) const LENGTHS: u32 = 5;
/// Residual that is accepted where no search reaches the tolerance, as a multiple of it. Corners of a body whose gaps differ by
/// rounding errors slide at an impact that holds them, by as little: to be found exactly, that is too little.
const SLACK: f64 = 100.0;
/// Random starts of Newton's method where sweeps do not reach a solution, and full steps from each of them: where sweeps go
/// round in circles, many starts lead to one.
const STARTS: u32 = 64;
const FAR: u32 = 24;

/// Work done, and the worst residual that is left.
#[derive(Clone, Copy)]
pub(super) struct Progress<S> {
    pub worst: (usize, S),
    pub sweeps: u32,
    pub newton: u32,
}

/// The impulses of [`solve_above`](super::solve_above) by iteration.
pub(super) fn iterate<S: Real>(
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
    let plain = Terms { problem, least, alpha: zero, anchor: &[] };
    // Friction may wedge a contact at the impulses of a sweep, and not at a solution.
    let mut solved = found == Ok(true);
    if !solved && rounds > 1 {
        let after_sweeps = found.is_ok().then_some(progress.worst);
        solved = elsewhere(&plain, tolerance, (after_sweeps, anchor), impulses, &mut progress, work)
            || progress.worst.1.to_f64() <= SLACK * tolerance;
    }
    let Progress { worst: (touch, residual), sweeps, newton } = progress;
    if solved {
        return Ok(Certificate { residual, sweeps, newton });
    }
    found?;
    Err(ContactError::NoConvergence { touch, residual: residual.to_f64(), sweeps })
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

/// The impulses after a number of sweeps.
pub(super) fn swept<S: Real>(
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

/// Full steps of Newton's method from random impulses within the friction cones; whether they reach a tolerance. Where they do
/// not, the impulses are those with the least residual: those before, if their residual is given, or the best that a start has
/// come to.
fn elsewhere<S: Real>(
    terms: &Terms<S>,
    tolerance: f64,
    (before, best): (Option<(usize, S)>, &mut [S]),
    impulses: &mut [S],
    progress: &mut Progress<S>,
    work: &mut [S],
) -> bool {
    let problem = terms.problem;
    let largest = largest(problem.b);
    let mut state = 1_u32;
    let mut random = || {
        // Numerical Recipes' generator, whose upper bits are good enough.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        S::constant(f64::from(state >> 8) / f64::from(1_u32 << 24))
    };
    let mut least = before.filter(|worst| worst.1.is_finite());
    copy(best, impulses);
    let found = (0..STARTS).any(|start| {
        let size = S::constant(0.25 * f64::from(1_u32 << (2 * (start % 4)))) * largest;
        for touch in problem.touches {
            let c = touch.contact;
            let normal = random() * size * cone::mass(problem, touch);
            set(impulses, c.row, normal);
            for row in c.row + 1..c.row + c.rows() {
                set(impulses, row, (random() - S::constant(0.5)) * c.friction * normal);
            }
        }
        velocities(terms, impulses, first_mut(work, impulses.len()));
        let found = improve(terms, tolerance, (FAR, 1), impulses, progress, work);
        let worst = progress.worst;
        if worst.1.is_finite() && least.is_none_or(|least| worst.1 < least.1) {
            least = Some(worst);
            copy(best, impulses);
        }
        found
    });
    copy(impulses, best);
    progress.worst = least.unwrap_or(progress.worst);
    found
}

/// Steps of Newton's method, until the residual is below a tolerance; whether it is. With several `lengths`, until a step does
/// not reduce it either, which is not made; with one, all are full steps. `work` begins with the velocities of the impulses, as
/// [`Progress::reaches`] leaves them, and has room for a square matrix and five lists.
pub(super) fn improve<S: Real>(
    terms: &Terms<S>,
    tolerance: f64,
    (steps, lengths): (u32, u32),
    impulses: &mut [S],
    progress: &mut Progress<S>,
    work: &mut [S],
) -> bool {
    let (last, work) = split(work, impulses.len());
    copy(first_mut(work, impulses.len()), last);
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
    pub(super) fn reaches(&mut self, terms: &Terms<S>, tolerance: f64, impulses: &[S], work: &mut [S]) -> bool {
        let v = first_mut(work, impulses.len());
        velocities(terms, impulses, v);
        self.worst = cone::residual(terms, impulses, |_, row| get(v, row));
        self.worst.1.to_f64() <= tolerance
    }
}

/// A contact of a problem that friction wedges. In the precision of the problem, so that nothing is converted where nobody
/// asks for the numbers of the error.
pub(super) struct Wedge<S> {
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
pub(super) fn sweep<S: Real>(terms: &Terms<S>, impulses: &mut [S]) -> Result<(), Wedge<S>> {
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
