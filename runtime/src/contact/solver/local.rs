//! One contact by itself, exactly.

use super::{cone, Terms, Touch};
use crate::lists::get;
use crate::system::Real;

/// Points of the circle of directions between which roots are bracketed.
const SECTORS: usize = 32;
/// The first of them: not on an axis, where plane problems have their roots. Cosine and sine of 0.1 rad.
const FIRST: [f64; 2] = [0.995_004_165_278_025_8, 0.099_833_416_646_828_15];
/// Cosine and sine of the angle of a sector, 2π/32, and the tangent of its half.
const SECTOR: [f64; 2] = [0.980_785_280_403_230_4, 0.195_090_322_016_128_28];
const HALF_SECTOR: f64 = 0.098_491_403_357_164_25;
/// Largest number of steps to a root within a sector: more than halving takes.
const NEWTON: u32 = 120;
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
        for (i, (w, q)) in block.w.iter_mut().zip(&mut block.q).enumerate().take(rows) {
            let mut own = zero;
            for (j, w) in w.iter_mut().enumerate().take(rows) {
                *w = get(problem.a, (row + i) * n + row + j);
                if i == j && terms.alpha > zero {
                    *w = *w + terms.proximal(touch);
                }
                own = own + *w * get(impulses, row + j);
            }
            *q = terms.velocity(touch, row + i, impulses) - own;
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
        let flow = Flow::of_friction(block, least, radius);
        direction(&flow, |t| Some(flow.along(t))).map(|t| t.map(|t| -(radius * t)))
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
    let flow = Flow::new(|i| q[i] * w[0][0] - q[0] * w[i][0], |i, j| friction * (q[0] * w[i][j] - q[i] * w[0][j]));
    let along = |t: [S; 2]| (pivot(t) > zero).then(|| flow.along(t) / pivot(t));
    let normal = |t: [S; 2]| Some(-(q[0] / pivot(t))).filter(|n| *n > zero);
    match direction(&flow, along).and_then(|t| Some((t, normal(t)?))) {
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

/// A tangential velocity for each direction `[a, b]` of the friction: `at + turn·[a, b]`, without derivatives. Steps of
/// Newton's method refine what comes of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flow<S> {
    at: [S; 2],
    turn: [[S; 2]; 2],
}

impl<S: Real> Flow<S> {
    fn new(at: impl Fn(usize) -> S, turn: impl Fn(usize, usize) -> S) -> Self {
        let value = |x: S| S::constant(x.to_f64());
        Flow { at: [1, 2].map(|i| value(at(i))), turn: [1, 2].map(|i| [1, 2].map(|j| value(turn(i, j)))) }
    }

    /// Under a given normal impulse, with friction of the size `radius` against each direction.
    pub fn of_friction(Block { w, q }: &Block<S>, normal: S, radius: S) -> Self {
        Flow::new(|i| q[i] + w[i][0] * normal, |i, j| -(radius * w[i][j]))
    }

    /// The velocity for a vector of some `size`, times this size.
    fn velocity(&self, [a, b]: [S; 2], size: S) -> [S; 2] {
        core::array::from_fn(|i| self.at[i] * size + self.turn[i][0] * a + self.turn[i][1] * b)
    }

    /// Its component across the vector.
    fn across(&self, t: [S; 2], size: S) -> S {
        let [x, y] = self.velocity(t, size);
        t[0] * y - t[1] * x
    }

    /// The component along a unit vector.
    pub fn along(&self, t: [S; 2]) -> S {
        let [x, y] = self.velocity(t, S::one());
        t[0] * x + t[1] * y
    }
}

/// The direction of the circle along which a velocity points outwards; `along` gives its component there, or none where
/// the direction is not possible. Of several, the one with the largest component.
pub(super) fn direction<S: Real>(flow: &Flow<S>, along: impl Fn([S; 2]) -> Option<S>) -> Option<[S; 2]> {
    let (zero, one) = (S::zero(), S::one());
    let [c, s] = SECTOR.map(S::constant);
    let mut best: Option<(S, [S; 2])> = None;
    let first = FIRST.map(S::constant);
    let mut before = (first, flow.across(first, one));
    for _ in 0..SECTORS {
        let [a, b] = before.0;
        let here = [a * c - b * s, a * s + b * c];
        let here = (here, flow.across(here, one));
        if (before.1 <= zero) != (here.1 <= zero) {
            let found = refine(flow, before);
            if let Some(along) = along(found).filter(|along| *along > zero) {
                if best.is_none_or(|(most, _)| along > most) {
                    best = Some((along, found));
                }
            }
        }
        before = here;
    }
    best.map(|(_, found)| found)
}

/// A root of the component across within a sector, whose first direction comes with the component there: Newton's method,
/// and halving where it leaves the part of the sector with the change of sign. Directions are rational in the tangent `x`
/// of half their angle from the first one.
fn refine<S: Real>(flow: &Flow<S>, ([a, b], at_start): ([S; 2], S)) -> [S; 2] {
    let (zero, one, two) = (S::zero(), S::one(), S::constant(2.0));
    let falls = at_start > zero;
    let turned = |c: S, s: S| [a * c - b * s, a * s + b * c];
    let (mut low, mut high) = (zero, S::constant(HALF_SECTOR));
    let mut x = S::constant(0.5) * high;
    for _ in 0..NEWTON {
        let (c, s, size) = (one - x * x, two * x, one + x * x);
        let (t, dt, dsize) = (turned(c, s), turned(-s, two), s);
        let (v, dv) = (flow.velocity(t, size), flow.velocity(dt, dsize));
        let across = t[0] * v[1] - t[1] * v[0];
        let slope = dt[0] * v[1] - dt[1] * v[0] + t[0] * dv[1] - t[1] * dv[0];
        if (across > zero) == falls {
            low = x;
        } else {
            high = x;
        }
        let newton = x - across / slope;
        let next = if newton > low && newton < high { newton } else { S::constant(0.5) * (low + high) };
        let change = (next - x).abs();
        x = next;
        if !(change > S::constant(S::epsilon())) {
            break;
        }
    }
    let [x, y] = turned(one - x * x, two * x);
    let size = (x * x + y * y).sqrt();
    [x / size, y / size]
}
