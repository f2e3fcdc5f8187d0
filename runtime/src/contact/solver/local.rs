//! One contact by itself, exactly.

use super::{cone, Terms, Touch};
use crate::integrate::root::root;
use crate::system::Real;

/// Points of the circle of directions between which roots are bracketed.
const SECTORS: usize = 32;
/// Part of the largest diagonal entry below which a row cannot move.
const IDLE: f64 = 1e-13;

/// The inverse inertia of a contact and its velocities without its own impulse.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block<S> {
    /// `A` of its rows; zero where it has only one.
    pub w: [[S; 3]; 3],
    /// Velocities without its own impulse.
    pub q: [S; 3],
}

impl<S: Real> Block<S> {
    /// The block of a contact, all other impulses being given.
    pub fn of(terms: &Terms<S>, touch: &Touch<S>, impulses: &[S]) -> Self {
        let (problem, row, rows) = (terms.problem, touch.contact.row, touch.contact.rows());
        let (n, zero) = (problem.b.len(), S::zero());
        let mut block = Block { w: [[zero; 3]; 3], q: [zero; 3] };
        for i in 0..rows {
            let mut own = zero;
            for j in 0..rows {
                block.w[i][j] = problem.a[(row + i) * n + row + j];
                if i == j && terms.alpha > zero {
                    block.w[i][j] = block.w[i][j] + terms.proximal(touch);
                }
                own = own + block.w[i][j] * impulses[row + j];
            }
            block.q[i] = terms.velocity(touch, row + i, impulses) - own;
        }
        block
    }

    /// Velocities with the impulse `p`.
    pub fn velocity(&self, p: [S; 3]) -> [S; 3] {
        core::array::from_fn(|i| self.q[i] + self.w[i][0] * p[0] + self.w[i][1] * p[1] + self.w[i][2] * p[2])
    }

    /// The tangential impulse that takes the tangential velocity `u` away.
    pub fn stop(&self, u: [S; 2]) -> [S; 2] {
        let [[xx, xy], [_, yy]] = [[self.w[1][1], self.w[1][2]], [self.w[2][1], self.w[2][2]]];
        let zero = S::zero();
        let least = S::constant(IDLE) * if xx > yy { xx } else { yy };
        // A direction that cannot move has no impulse.
        if !(xx > least) {
            return [zero, if yy > zero { -(u[1] / yy) } else { zero }];
        }
        let left = yy - xy / xx * xy;
        let y = if left > least { -((u[1] - xy / xx * u[0]) / left) } else { zero };
        [-((u[0] + xy * y) / xx), y]
    }
}

/// The impulse `[normal, tangential, tangential]` of a contact, with a normal one not below `least`.
///
/// # Errors
/// The pivot of a contact that slides in a given direction, if friction wedges it.
pub(super) fn solve<S: Real>(block: &Block<S>, touch: &Touch<S>, least: S) -> Result<[S; 3], S> {
    let zero = S::zero();
    let c = touch.contact;
    let (w, friction) = (&block.w, c.friction);
    if !c.tangents || !(friction > zero) {
        let normal = if w[0][0] > zero { -(block.q[0] / w[0][0]) } else { zero };
        return Ok([if normal > least { normal } else { least }, zero, zero]);
    }
    if let Some([x, y]) = touch.slip {
        let pivot = w[0][0] - friction * (w[0][1] * x + w[0][2] * y);
        let normal = if pivot > zero {
            -(block.q[0] / pivot)
        } else if block.q[0] >= zero {
            zero
        } else {
            return Err(pivot);
        };
        let normal = if normal > least { normal } else { least };
        return Ok([normal, -(friction * normal * x), -(friction * normal * y)]);
    }
    Ok(parted(block, friction, least)
        .or_else(|| stuck(block, friction, least))
        .unwrap_or_else(|| slid(block, friction, least)))
}

/// The bodies part, with the least normal impulse.
fn parted<S: Real>(block: &Block<S>, friction: S, least: S) -> Option<[S; 3]> {
    let zero = S::zero();
    if !(least > zero) {
        return (block.q[0] >= zero).then_some([zero; 3]);
    }
    let [_, x, y] = block.velocity([least, zero, zero]);
    let radius = friction * least;
    let [px, py] = block.stop([x, y]);
    let tangential = if px * px + py * py <= radius * radius {
        Some([px, py])
    } else {
        // With a given normal impulse, friction is that of a plane problem.
        let along = |[a, b]: [S; 2]| {
            let p = [least, -(radius * a), -(radius * b)];
            let [_, vx, vy] = block.velocity(p);
            (a * vy - b * vx, a * vx + b * vy)
        };
        direction(along).map(|[a, b]| [-(radius * a), -(radius * b)])
    };
    let [px, py] = tangential?;
    let p = [least, px, py];
    (block.velocity(p)[0] >= zero).then_some(p)
}

/// The bodies stay together and stick.
fn stuck<S: Real>(block: &Block<S>, friction: S, least: S) -> Option<[S; 3]> {
    let w = &block.w;
    // The tangential impulse for a unit normal one, and for the velocities at hand.
    let [rx, ry] = block.stop([w[1][0], w[2][0]]);
    let [sx, sy] = block.stop([block.q[1], block.q[2]]);
    let pivot = w[0][0] + w[0][1] * rx + w[0][2] * ry;
    let q = block.q[0] + w[0][1] * sx + w[0][2] * sy;
    if !(pivot > S::zero()) {
        return None;
    }
    let n = -(q / pivot);
    let [x, y] = [sx + rx * n, sy + ry * n];
    let bound = friction * n;
    (n >= least && bound >= S::zero() && x * x + y * y <= bound * bound).then_some([n, x, y])
}

/// The bodies stay together and slide: the direction is a root on the circle.
fn slid<S: Real>(block: &Block<S>, friction: S, least: S) -> [S; 3] {
    let (w, q) = (&block.w, &block.q);
    let zero = S::zero();
    let pivot = |[a, b]: [S; 2]| w[0][0] - friction * (w[0][1] * a + w[0][2] * b);
    let impulse = |n: S, [a, b]: [S; 2]| [n, -(friction * n * a), -(friction * n * b)];
    // The velocity times the pivot, which has no poles.
    let along = |t: [S; 2]| {
        let (pivot, [a, b]) = (pivot(t), t);
        let u: [S; 2] = core::array::from_fn(|i| {
            let w = w[i + 1];
            q[i + 1] * pivot - q[0] * (w[0] - friction * (w[1] * a + w[2] * b))
        });
        (a * u[1] - b * u[0], if pivot > zero { (a * u[0] + b * u[1]) / pivot } else { -S::one() })
    };
    let normal = |t: [S; 2]| Some(-(q[0] / pivot(t))).filter(|n| *n > zero);
    match direction(along).and_then(|t| Some((t, normal(t)?))) {
        Some((t, n)) => impulse(if n > least { n } else { least }, t),
        // No direction holds: the nearest impulse on the cone keeps the iteration going.
        None => {
            let n = if w[0][0] > zero { -(q[0] / w[0][0]) } else { zero };
            let [x, y] = block.stop([q[1], q[2]]);
            let [x, y] = cone::disc([x, y], friction * n);
            [n, x, y]
        }
    }
}

/// The direction of the circle along which a velocity points outwards: `of` gives the velocity's components across and
/// along a direction. Of several, the one with the largest component along it.
pub(super) fn direction<S: Real>(of: impl Fn([S; 2]) -> (S, S)) -> Option<[S; 2]> {
    let zero = S::zero();
    // No start on an axis, where plane problems have their roots.
    let turn = core::f64::consts::TAU / SECTORS as f64;
    let point = |x: f64| {
        let (s, c) = S::constant(x).sin_cos();
        [c, s]
    };
    let mut best: Option<(S, [S; 2])> = None;
    let mut before = (0.1, of(point(0.1)));
    for k in 1..=SECTORS {
        let angle = 0.1 + turn * k as f64;
        let here = (angle, of(point(angle)));
        let crosses = (before.1 .0 <= zero) != (here.1 .0 <= zero);
        if crosses {
            if let Some((along, found)) = refine(&of, &point, (before.0, before.1 .0), (here.0, here.1 .0)) {
                if best.is_none_or(|(most, _)| along > most) {
                    best = Some((along, found));
                }
            }
        }
        before = here;
    }
    best.map(|(_, found)| found)
}

/// A root of the component across between two angles, if the velocity points outwards there.
fn refine<S: Real>(
    of: &impl Fn([S; 2]) -> (S, S),
    point: &impl Fn(f64) -> [S; 2],
    (a, at_a): (f64, S),
    (b, at_b): (f64, S),
) -> Option<(S, [S; 2])> {
    let zero = S::zero();
    let falls = at_a > zero;
    let signed = |x: S| if falls { x } else { -x };
    let c = S::constant;
    let angle = root((c(a), signed(at_a)), (c(b), signed(at_b)), S::epsilon(), |x| {
        let across = signed(of(point(x.to_f64())).0);
        (across, across <= zero)
    });
    let found = point(angle.to_f64());
    let (_, along) = of(found);
    (along > zero).then_some((along, found))
}
