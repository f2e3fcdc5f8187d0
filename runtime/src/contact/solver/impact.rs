//! Impacts: compression, expansion, and the limit that no energy is gained.

use super::local::Block;
use super::{
    energy, finite, fits, routh, solve_above, solve_soon, swept, velocity, Certificate, ContactError, Effort, Problem,
    Terms,
};
use crate::contact::RestitutionLaw;
use crate::lists::{copy, get, largest, part_mut, set, split};
use crate::system::Real;

/// In which order the contacts of an impact act.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImpactOrder {
    /// All at once.
    #[default]
    Simultaneous,
    /// The one whose bodies approach fastest, then the next, until none approach: Newton's cradle.
    Sequential,
}

/// Rules of impacts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ImpactOptions {
    /// Work for the impulses.
    pub effort: Effort,
    /// Order of the contacts.
    pub order: ImpactOrder,
}

/// An impact.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Impact<S> {
    /// How well the impulses of compression satisfy the laws of contact; of restitution, where several contacts take part.
    pub certificate: Certificate<S>,
    /// Change of the kinetic energy, J: negative, or a rounding error, except with Newton's law.
    pub energy: S,
    /// Part of the expansion that was allowed, where all of it would have gained energy.
    pub limited: Option<S>,
    /// Collisions of single contacts one after the other; 1 where all act at once.
    pub rounds: u32,
}

/// Largest number of collisions one after the other, for each contact.
const COLLISIONS: u32 = 10_000;

/// Computes the impulses of an impact, one number for each row, for contacts whose bodies touch; `problem.b` has the
/// velocities before it, `work` [`work_len`](super::work_len) numbers.
///
/// - Without restitution: [`solve`](super::solve). The kinetic energy falls by the work of friction, and by that of the compression.
/// - One contact with restitution: Routh's process (Keller, J. Appl. Mech. 53, 1986): the impulse grows from zero, friction
///   is that of the velocities of the moment, and the law says where it ends.
/// - Several contacts at once: the impulses of compression; then those of expansion, with normal ones not below the
///   coefficient times those of compression, on top. If that would gain energy, the largest part of the expansion that
///   does not is taken. Laws of Poisson and Stronge are the same here.
/// - Newton's law: velocities after the impact are asked to reach `−e` times those before it. It may gain energy with
///   friction, which the result tells.
///
/// # Errors
/// [`ContactError`].
pub fn impact<S: Real>(
    problem: &Problem<S>,
    options: &ImpactOptions,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<Impact<S>, ContactError> {
    fits(problem, impulses, work)?;
    finite(problem)?;
    impulses.fill(S::zero());
    let mut result = Impact::none();
    if options.order == ImpactOrder::Sequential {
        result.rounds = sequential(problem, options.effort, impulses)?;
    } else if let (true, [touch]) = (expands(problem), problem.touches) {
        let block = Block::of(&alone(problem), touch, impulses);
        let found = routh::collide(&block, &touch.contact)?;
        copy(impulses, &found);
    } else {
        let solve = |problem: &Problem<S>, least: &[S], impulses: &mut [S], work: &mut [S]| {
            solve_above(problem, least, options.effort, impulses, work)
        };
        simultaneous(problem, solve, impulses, work, &mut result)?;
    }
    judged(problem, impulses, result)
}

/// [`impact`] from impulses that solve a problem nearby: without restitution and all at once, the search begins there. One
/// contact alone is solved exactly, wherever the search begins.
///
/// # Errors
/// As of [`impact`].
pub(in crate::contact) fn impact_near<S: Real>(
    problem: &Problem<S>,
    options: &ImpactOptions,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<Impact<S>, ContactError> {
    if problem.touches.len() < 2 || bounces(problem) || options.order == ImpactOrder::Sequential {
        return impact(problem, options, impulses, work);
    }
    let certificate = solve_soon(problem, options.effort, impulses, work)?;
    judged(problem, impulses, Impact { certificate, ..Impact::none() })
}

/// [`impact`] of all contacts at once by a fixed number of sweeps. A single contact with restitution has the impulses of
/// several: of compression, then of expansion.
///
/// # Errors
/// [`ContactError::Lengths`], [`ContactError::NotFinite`], [`ContactError::Wedged`].
pub(in crate::contact) fn impact_by_sweeps<S: Real>(
    problem: &Problem<S>,
    count: u32,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<Impact<S>, ContactError> {
    fits(problem, impulses, work)?;
    finite(problem)?;
    impulses.fill(S::zero());
    let mut result = Impact::none();
    let solve =
        |problem: &Problem<S>, least: &[S], impulses: &mut [S], _: &mut [S]| swept(problem, least, count, impulses);
    simultaneous(problem, solve, impulses, work, &mut result)?;
    judged(problem, impulses, result)
}

impl<S: Real> Impact<S> {
    /// Without impulses.
    fn none() -> Self {
        let zero = S::zero();
        let certificate = Certificate { residual: zero, sweeps: 0, newton: 0 };
        Impact { certificate, energy: zero, limited: None, rounds: 1 }
    }
}

/// Whether any contact has restitution.
fn bounces<S: Real>(problem: &Problem<S>) -> bool {
    problem.touches.iter().any(|touch| touch.contact.restitution > S::zero())
}

/// Whether restitution is an impulse of expansion, and not a velocity that is asked for.
fn expands<S: Real>(problem: &Problem<S>) -> bool {
    bounces(problem) && problem.touches.iter().all(|touch| touch.contact.law != RestitutionLaw::Newton)
}

/// The result with its energy.
fn judged<S: Real>(problem: &Problem<S>, impulses: &[S], result: Impact<S>) -> Result<Impact<S>, ContactError> {
    if !impulses.iter().all(|p| p.is_finite()) {
        return Err(ContactError::NotFinite);
    }
    Ok(Impact { energy: energy(problem, impulses), ..result })
}

/// All contacts at once; `solve(problem, least, impulses, work)` finds impulses with normal ones not below the least.
fn simultaneous<S: Real, E>(
    problem: &Problem<S>,
    solve: impl Fn(&Problem<S>, &[S], &mut [S], &mut [S]) -> Result<Certificate<S>, E>,
    impulses: &mut [S],
    work: &mut [S],
    result: &mut Impact<S>,
) -> Result<(), E> {
    let rows = problem.b.len();
    let zero = S::zero();
    if expands(problem) {
        (result.certificate, result.limited) = expand(problem, solve, impulses, work)?;
        return Ok(());
    }
    let (asked, work) = split(work, rows);
    let (least, work) = split(work, rows);
    copy(asked, problem.b);
    least.fill(zero);
    for touch in problem.touches {
        let row = touch.contact.row;
        let before = get(problem.b, row);
        if touch.contact.restitution > zero && before < zero {
            set(asked, row, before + touch.contact.restitution * before);
        }
    }
    result.certificate = solve(&Problem { b: asked, ..*problem }, least, impulses, work)?;
    Ok(())
}

/// A problem without limits.
fn alone<'a, S: Real>(problem: &'a Problem<'a, S>) -> Terms<'a, S> {
    Terms { problem, least: &[], alpha: S::zero(), anchor: &[] }
}

/// Compression and expansion of several contacts at once.
fn expand<S: Real, E>(
    problem: &Problem<S>,
    solve: impl Fn(&Problem<S>, &[S], &mut [S], &mut [S]) -> Result<Certificate<S>, E>,
    impulses: &mut [S],
    work: &mut [S],
) -> Result<(Certificate<S>, Option<S>), E> {
    let rows = problem.b.len();
    let (zero, one) = (S::zero(), S::one());
    let (after, work) = split(work, rows);
    let (least, work) = split(work, rows);
    let (expansion, work) = split(work, rows);
    least.fill(zero);
    let first = solve(problem, least, impulses, work)?;
    for (row, v) in after.iter_mut().enumerate() {
        *v = velocity(problem, row, impulses);
    }
    for touch in problem.touches {
        let row = touch.contact.row;
        set(least, row, touch.contact.restitution * get(impulses, row));
    }
    copy(expansion, least);
    let second = solve(&Problem { b: after, ..*problem }, least, expansion, work)?;
    let certificate = Certificate {
        residual: if second.residual > first.residual { second.residual } else { first.residual },
        sweeps: first.sweeps + second.sweeps,
        newton: first.newton + second.newton,
    };
    // ΔT(s) = c₀ + c₁ s + c₂ s² for a part s of the expansion, with c₀ ≤ 0 and c₂ ≥ 0.
    let compressed = energy(problem, impulses);
    let linear = expansion.iter().zip(&*after).fold(zero, |sum, (p, v)| sum + *p * *v);
    let square = energy(&Problem { b: after, ..*problem }, expansion) - linear;
    let mut limited = None;
    if compressed + linear + square > zero {
        let c0 = if compressed < zero { compressed } else { zero };
        let root = (linear * linear - S::constant(4.0) * square * c0).sqrt();
        let part = if linear > zero {
            -(S::constant(2.0) * c0) / (linear + root)
        } else if square > zero {
            (root - linear) / (S::constant(2.0) * square)
        } else {
            one
        };
        limited = Some(if part < one { part } else { one });
    }
    let part = limited.unwrap_or(one);
    for (p, expansion) in impulses.iter_mut().zip(&*expansion) {
        *p = *p + part * *expansion;
    }
    Ok((certificate, limited))
}

/// Single contacts one after the other, the fastest first; gives the number of collisions.
fn sequential<S: Real>(problem: &Problem<S>, effort: Effort, impulses: &mut [S]) -> Result<u32, ContactError> {
    let zero = S::zero();
    let fastest = largest(problem.b);
    let slow = S::constant(match effort {
        Effort::ToTolerance { tolerance, .. } => tolerance,
        Effort::Sweeps(_) => 0.0,
    }) * fastest;
    let most = COLLISIONS.saturating_mul(problem.touches.len() as u32);
    for collisions in 0..most {
        let mut next = (slow, None);
        for (place, touch) in problem.touches.iter().enumerate() {
            let approach = -velocity(problem, touch.contact.row, impulses);
            if approach > next.0 {
                next = (approach, Some((place, touch)));
            }
        }
        let Some((place, touch)) = next.1 else { return Ok(collisions) };
        let (row, rows) = (touch.contact.row, touch.contact.rows());
        let mut block = Block::of(&alone(problem), touch, impulses);
        let own: [S; 3] = core::array::from_fn(|k| if k < rows { get(impulses, row + k) } else { zero });
        block.q = block.velocity(own);
        let found = routh::collide(&block, &touch.contact).map_err(|error| error.at(|_| place))?;
        for (p, more) in part_mut(impulses, row, rows).iter_mut().zip(found) {
            *p = *p + more;
        }
    }
    Err(ContactError::NoEnd { collisions: most })
}
