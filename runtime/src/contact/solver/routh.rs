//! The collision of a single contact as a process in the normal impulse (Routh 1905; Keller, J. Appl. Mech. 53, 1986).
//!
//! While the normal impulse `π` grows, `dv/dπ = W (n + f)`, where friction `f = −µ t̂` is against the slip `v_t` of the
//! moment, or holds it at zero if the cone allows that. Compression ends where `v_n` has come to zero, expansion where the
//! law of restitution says. Where the direction of slip is constant, as it is in a plane, the process is a sequence of
//! straight pieces. Where it turns, its angle `φ` and the speed of slip `s` are integrated over `τ` with `dπ = s dτ`:
//! `dφ/dτ` is then finite where the slip comes to rest, which `s` approaches like an exponential function.

use super::local::{self, Block, Flow};
use super::{ContactError, Touch};
use crate::contact::{Contact, RestitutionLaw};
use crate::integrate::{Direction, Dop853, Events, Outcome, Solver, Step, Tolerances, Watch};
use crate::lists::largest;
use crate::system::{LieJoint, Real, System};

/// Part of the inverse inertia below which the direction of slip counts as constant.
const STRAIGHT: f64 = 1e-13;
/// Derivative of the rate at which the direction of slip turns, below which it is rounding.
const TURNS: f64 = 1e-9;
/// Part of the first speed at which slip has come to rest.
const STILL: f64 = 1e-15;
/// Error allowed in a step of a turning slip, with velocities and inverse inertia of size one.
const TOLERANCE: f64 = 1e-13;
/// Length in `τ` after which a process has no end.
const ENDLESS: f64 = 1e6;
/// Largest number of pieces.
const PIECES: u32 = 64;

/// The impulse of a collision, `[normal, tangential, tangential]`; `block.q` are the velocities before it.
///
/// # Errors
/// [`ContactError::Wedged`] where compression has no end, [`ContactError::NotFinite`].
pub(super) fn collide<S: Real>(block: &Block<S>, contact: &Contact<S>) -> Result<[S; 3], ContactError> {
    let (zero, one) = (S::zero(), S::one());
    let e = contact.restitution;
    let touch = Touch { contact: *contact, slip: None };
    let wedged = |pivot: S| ContactError::Wedged { touch: 0, pivot: pivot.to_f64() };
    if !(e > zero) || contact.law == RestitutionLaw::Newton {
        let [n, x, y] = block.q;
        let asked = Block { q: [if n < zero { n + e * n } else { n }, x, y], ..*block };
        return local::solve(&asked, &touch, zero).map_err(wedged);
    }
    if !(block.q[0] < zero) {
        return Ok([zero; 3]);
    }
    if !contact.tangents || !(contact.friction > zero) {
        return Ok([-((one + e) * block.q[0] / block.w[0][0]), zero, zero]);
    }
    let size = largest(&block.q);
    let unit = block.w[0][0];
    let mut process = Process {
        w: block.w.map(|row| row.map(|w| w / unit)),
        friction: contact.friction,
        v: block.q.map(|v| v / size),
        p: [zero; 3],
        work: zero,
    };
    process.go(End::Compressed)?;
    let (compression, work) = (process.p[0], process.work);
    match contact.law {
        RestitutionLaw::Stronge => process.go(End::Work(work - e * e * work))?,
        _ => process.go(End::Impulse((one + e) * compression))?,
    }
    Ok(process.p.map(|p| p * size / unit))
}

/// Where a part of the process ends.
#[derive(Clone, Copy, Debug)]
enum End<S> {
    /// The normal velocity has come to zero.
    Compressed,
    /// The normal impulse has a value.
    Impulse(S),
    /// The work of the normal impulse has a value.
    Work(S),
}

impl<S: Real> End<S> {
    /// A function of normal velocity, impulse and work that rises to zero at the end.
    fn left(&self, v: S, impulse: S, work: S) -> S {
        match self {
            End::Compressed => v,
            End::Impulse(end) => impulse - *end,
            End::Work(end) => work - *end,
        }
    }
}

/// A collision, with velocities and inverse inertia of size one.
struct Process<S> {
    w: [[S; 3]; 3],
    friction: S,
    v: [S; 3],
    p: [S; 3],
    /// Work of the normal impulse, `∫ v_n dπ`.
    work: S,
}

/// Force for each unit of the normal impulse where the bodies slip in a direction.
fn sliding_force<S: Real>(friction: S, [x, y]: [S; 2]) -> [S; 3] {
    [S::one(), -(friction * x), -(friction * y)]
}

/// Rate of the velocities, with the inverse inertia `w`, under a force for each unit of the normal impulse.
fn rate<S: Real>(w: &[[S; 3]; 3], force: [S; 3]) -> [S; 3] {
    w.map(|w| w[0] * force[0] + w[1] * force[1] + w[2] * force[2])
}

impl<S: Real> Process<S> {
    /// Goes on to an end.
    fn go(&mut self, end: End<S>) -> Result<(), ContactError> {
        for _ in 0..PIECES {
            if !(end.left(self.v[0], self.p[0], self.work) < S::zero()) {
                return Ok(());
            }
            let slides = self.slip()?;
            let force = match slides {
                Some(slip) => sliding_force(self.friction, slip),
                None => self.hold(),
            };
            let rate = self.rate(force);
            let across = slides.map_or(S::zero(), |[x, y]| x * rate[2] - y * rate[1]);
            if across.derivative().is_some_and(|d| !(d.abs() <= TURNS)) {
                return Err(ContactError::NoDerivative);
            }
            if across.to_f64().abs() > STRAIGHT.max(8.0 * S::epsilon()) && self.moves() {
                self.turn(end)?;
            } else {
                self.straight(end, force, rate, slides)?;
            }
        }
        Err(ContactError::NotFinite)
    }

    /// Whether the bodies slip.
    fn moves(&self) -> bool {
        (self.v[1] * self.v[1] + self.v[2] * self.v[2]) > S::zero()
    }

    /// Rate of the velocities under a force for each unit of the normal impulse.
    fn rate(&self, force: [S; 3]) -> [S; 3] {
        rate(&self.w, force)
    }

    /// Direction of slip: of the motion, or of the motion that begins where the cone cannot hold it.
    fn slip(&self) -> Result<Option<[S; 2]>, ContactError> {
        let [_, x, y] = self.v;
        let speed = (x * x + y * y).sqrt();
        if speed > S::zero() {
            return Ok(Some([x / speed, y / speed]));
        }
        let [_, x, y] = self.hold();
        if x * x + y * y <= self.friction * self.friction {
            return Ok(None);
        }
        let friction = self.friction;
        let block = Block { w: self.w, q: [S::zero(); 3] };
        let flow = Flow::of_friction(&block, S::one(), friction);
        let Some(found) = local::direction(&flow, |t| Some(flow.along(t))) else { return Ok(None) };
        // The search gives the direction without a derivative, which it has not in a plane.
        let [a, b] = found;
        let [_, x, y] = self.rate([S::one(), -(friction * a), -(friction * b)]);
        match (a * y - b * x).derivative().is_some_and(|d| !(d.abs() <= TURNS)) {
            true => Err(ContactError::NoDerivative),
            false => Ok(Some([a, b])),
        }
    }

    /// The force that keeps the bodies from slipping, for each unit of the normal impulse.
    fn hold(&self) -> [S; 3] {
        let block = Block { w: self.w, q: [S::zero(); 3] };
        let [x, y] = block.stop([self.w[1][0], self.w[2][0]]);
        [S::one(), x, y]
    }

    /// A straight piece, to the end or to where slip comes to rest.
    fn straight(
        &mut self,
        end: End<S>,
        force: [S; 3],
        rate: [S; 3],
        slides: Option<[S; 2]>,
    ) -> Result<(), ContactError> {
        let zero = S::zero();
        let two = S::constant(2.0);
        let to_end = match end {
            End::Compressed if rate[0] > zero => Some(-(self.v[0] / rate[0])),
            End::Compressed => None,
            End::Impulse(end) => Some(end - self.p[0]),
            End::Work(end) => {
                let left = two * (end - self.work);
                let square = self.v[0] * self.v[0] + rate[0] * left;
                (square >= zero).then(|| left / (self.v[0] + square.sqrt())).filter(|length| *length > zero)
            }
        };
        let slowing = slides.map_or(zero, |[x, y]| -(x * rate[1] + y * rate[2]));
        let speed = (self.v[1] * self.v[1] + self.v[2] * self.v[2]).sqrt();
        let to_rest = (slowing > zero && speed > zero).then(|| speed / slowing);
        let (length, rests) = match (to_end, to_rest) {
            (Some(end), Some(rest)) if rest < end => (rest, true),
            (Some(end), _) => (end, false),
            (None, Some(rest)) => (rest, true),
            (None, None) => return Err(ContactError::Wedged { touch: 0, pivot: rate[0].to_f64() }),
        };
        self.work = self.work + length * (self.v[0] + S::constant(0.5) * rate[0] * length);
        for k in 0..3 {
            self.v[k] = self.v[k] + rate[k] * length;
            self.p[k] = self.p[k] + force[k] * length;
        }
        if rests {
            (self.v[1], self.v[2]) = (zero, zero);
        } else {
            self.land(end);
        }
        Ok(())
    }

    /// Sets what the end says exactly.
    fn land(&mut self, end: End<S>) {
        match end {
            End::Compressed => self.v[0] = S::zero(),
            End::Impulse(end) => self.p[0] = end,
            End::Work(end) => self.work = end,
        }
    }

    /// A piece in which the direction of slip turns, to the end or to where slip comes to rest.
    fn turn(&mut self, end: End<S>) -> Result<(), ContactError> {
        let zero = S::zero();
        if zero.derivative().is_some() {
            return Err(ContactError::NoDerivative);
        }
        let [_, x, y] = self.v;
        let speed = (x * x + y * y).sqrt();
        let mut keller = Keller { w: self.w, friction: self.friction, start: [x / speed, y / speed] };
        let start = [speed, zero, self.v[0], self.p[0], self.p[1], self.p[2], self.work];
        let tolerances = Tolerances::new(TOLERANCE.max(8.0 * S::epsilon()));
        let still = S::constant(STILL) * speed;
        let method = Dop853::new(&keller);
        let not_finite = |_| ContactError::NotFinite;
        let mut solver = Solver::new(&mut keller, method, Step::Adaptive(tolerances), zero, &start, &[zero; 7])
            .map_err(not_finite)?;
        solver.limits.steps = 100_000;
        let outcome =
            solver.run_events(&mut keller, S::constant(ENDLESS), &mut Ends { end, still }).map_err(not_finite)?;
        let (mut y, mut none) = (start, [zero; 7]);
        solver.state(&keller, &mut y, &mut none);
        let [s, phi, v, impulse, px, py, work] = y;
        let t = keller.direction(phi);
        (self.v, self.p, self.work) = ([v, s * t[0], s * t[1]], [impulse, px, py], work);
        match outcome {
            Outcome::Event { index: 0, .. } => self.land(end),
            Outcome::Event { .. } => (self.v[1], self.v[2]) = (zero, zero),
            Outcome::End => return Err(ContactError::Wedged { touch: 0, pivot: v.to_f64() }),
        }
        Ok(())
    }
}

/// A turning slip over `τ`: speed of slip, angle from the first direction, normal velocity, impulses, work.
struct Keller<S> {
    w: [[S; 3]; 3],
    friction: S,
    start: [S; 2],
}

impl<S: Real> Keller<S> {
    fn direction(&self, angle: S) -> [S; 2] {
        let ((s, c), [x, y]) = (angle.sin_cos(), self.start);
        [c * x - s * y, s * x + c * y]
    }
}

impl<S: Real> System for Keller<S> {
    type Scalar = S;
    type Coordinates = [S; 7];
    type Momenta = [S; 7];

    fn neutral(&self) -> [S; 7] {
        [S::zero(); 7]
    }

    fn zero_momenta(&self) -> [S; 7] {
        [S::zero(); 7]
    }

    fn lie_joints(&self) -> &[LieJoint] {
        &[]
    }

    fn rates_at(&mut self, _: S, y: &[S; 7], _: &[S; 7], yd: &mut [S; 7], none: &mut [S; 7]) {
        let [s, angle, v, ..] = *y;
        let [a, b] = self.direction(angle);
        let force = sliding_force(self.friction, [a, b]);
        let rate = rate(&self.w, force);
        let (along, across) = (a * rate[1] + b * rate[2], a * rate[2] - b * rate[1]);
        *yd = [s * along, across, s * rate[0], s, s * force[1], s * force[2], s * v];
        *none = [S::zero(); 7];
    }

    fn coordinate_rates(&self, _: &[S; 7], v: &[S; 7], yd: &mut [S; 7]) {
        *yd = *v;
    }
}

/// The ends of a turning slip.
struct Ends<S> {
    end: End<S>,
    still: S,
}

impl<S: Real> Events<Keller<S>, 2> for Ends<S> {
    fn watches(&self) -> [Watch; 2] {
        [Direction::Rising, Direction::Falling].map(|direction| Watch { direction, terminal: true })
    }

    fn values(&mut self, _: &mut Keller<S>, _: S, y: &[S; 7], _: &[S; 7]) -> [S; 2] {
        let [s, _, v, impulse, _, _, work] = *y;
        [self.end.left(v, impulse, work), s - self.still]
    }
}
