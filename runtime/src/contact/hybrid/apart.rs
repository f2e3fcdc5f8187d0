//! Contacts that cannot have closed, by how far the joints have moved: what need not be looked at.

use super::watch::TURN;
use super::Hybrid;
use crate::contact::travel::{next_ways, travels};
use crate::contact::{Mode, Touching, WithContacts};
use crate::integrate::Stepper;
use crate::lists::{copy, get, set};
use crate::system::Real;
use crate::Scalar;

/// Number of steps over which travel is summed up at most before it is compared with the reserves; part of the number that
/// these last, for rounding.
const MOST_STEPS: f64 = 1000.0;
const ALMOST: f64 = 0.999;
/// How often gaps are looked at in a step, at least.
const LOOKS: f64 = 4.0;
/// Numbers of steps among which [`Hybrid::mind_near`] chooses.
const HORIZONS: [f64; 7] = [1.0, 2.0, 4.0, 8.0, 16.0, 64.0, 256.0];

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// The gaps of the left end, which is where the next step starts, are what the joints may use up.
    pub(super) fn refill(&mut self, system: &WithContacts<Y>) {
        for (k, (reserve, left)) in self.reserve.as_mut().iter_mut().zip(self.left.as_ref()).enumerate() {
            if system.minds(k) {
                *reserve = left.first;
            }
        }
        self.gone.as_mut().fill(Y::Scalar::zero());
        self.allowed.as_mut().fill(Y::Scalar::zero());
        self.known = true;
    }

    /// Takes the travel of the last step off the reserves.
    pub(super) fn use_up(&mut self) {
        for (reserve, travel) in self.reserve.as_mut().iter_mut().zip(self.travel.as_ref()) {
            *reserve = *reserve - *travel;
        }
    }

    /// Whether no contact, or none of those that are not minded, can have closed within the last step, nor since its gap was
    /// looked at, by the travel of the step.
    fn has_reserves(&self, system: &WithContacts<Y>, all: bool) -> bool {
        let mut left = self.reserve.as_ref().iter().zip(self.travel.as_ref()).enumerate();
        left.all(|(k, (reserve, travel))| self.ignores(k) || !all && system.minds(k) || *reserve > *travel)
    }

    /// Whether no contact can have closed within the last step, nor since the gaps were looked at. All contacts are open
    /// then. The travel of the step is taken off the reserves, then or later. `near`: the gaps had to be looked at in the step
    /// before.
    pub(super) fn stays_apart(&mut self, system: &mut WithContacts<Y>, near: bool) -> bool {
        if !system.is_open() {
            self.travel.as_mut().fill(Y::Scalar::constant(f64::INFINITY));
            return false;
        }
        if !near {
            if self.coasts(system) {
                return true;
            }
            self.settle_travel(system);
        }
        // Sizes of coordinates are known from `settle_travel`, or after the first pass.
        let mut sizes = self.slides && near;
        // Where displacements alone tell that gaps have to be looked at, rates at the end are not asked for.
        let apart = [[true, false], [true, true]].into_iter().skip(usize::from(!near)).all(|rates| {
            let [moved, size] = self.solver.travel(system, rates, core::mem::take(&mut sizes));
            travels(system.system().reaches(), moved.as_ref(), size.as_ref(), self.travel.as_mut());
            self.has_reserves(system, true)
        });
        if apart {
            self.allow_more(system);
        }
        apart
    }

    /// Whether the joints have not moved by more than is allowed since the reserves were known, with the last step.
    fn coasts(&mut self, system: &mut WithContacts<Y>) -> bool {
        let [moved, _] = self.solver.travel(system, [true, true], false);
        let (gone, moved) = (self.gone.as_mut(), moved.as_mut());
        // No loop ends early, so that they become vector instructions.
        let mut within = true;
        for ((gone, moved), most) in gone.iter().zip(moved.iter_mut()).zip(self.allowed.as_ref()) {
            *moved = *gone + *moved;
            within &= *moved <= *most;
        }
        if within {
            copy(gone, moved);
        }
        within
    }

    /// Takes what has not been taken yet off the reserves: the travel before the last step.
    fn settle_travel(&mut self, system: &mut WithContacts<Y>) {
        // Coordinates were no larger than they are now and by how far they have moved.
        let [_, size] = self.solver.travel(system, [false, false], self.slides);
        travels(system.system().reaches(), self.gone.as_ref(), size.as_ref(), self.travel.as_mut());
        self.use_up();
        self.gone.as_mut().fill(Y::Scalar::zero());
    }

    /// After a step in which no contact can have closed: how far the joints may move in all, that step included, before the
    /// reserves are compared again. These last for some steps like this one, in which joints that rest begin to move. Sizes of
    /// coordinates have been asked for.
    fn allow_more(&mut self, system: &mut WithContacts<Y>) {
        let (zero, one) = (Y::Scalar::zero(), Y::Scalar::one());
        let [moved, size] = self.solver.travel(system, [true, true], false);
        copy(self.gone.as_mut(), moved.as_ref());
        next_ways(self.gone.as_ref(), self.allowed.as_mut());
        travels(system.system().reaches(), self.allowed.as_ref(), size.as_ref(), self.travel.as_mut());
        let each = self.reserve.as_ref().iter().zip(self.travel.as_ref()).zip(self.ignored.as_ref());
        let minded = each.filter(|(_, ignored)| !**ignored).map(|((reserve, travel), _)| *reserve / *travel);
        let mut steps = minded.fold(Y::Scalar::constant(MOST_STEPS), |least, x| if x >= least { least } else { x });
        if self.slides && steps > one {
            // Arms become longer, too: in `n` times the way, a gap changes by `n²` times as much at most.
            steps = steps.sqrt();
        }
        let steps = if steps > one { Y::Scalar::constant(ALMOST) * steps } else { zero };
        self.allowed.as_mut().iter_mut().for_each(|allowed| *allowed = steps * *allowed);
    }

    /// The travel of the last step with the velocities that were found at its end, after [`WithContacts::look`] there. While
    /// contacts are closed, it is asked for only where it can save looks at the others.
    pub(super) fn travel_with_end(&mut self, system: &mut WithContacts<Y>) {
        if !(system.is_open() || system.has_many()) {
            return;
        }
        let (two, h) = (Y::Scalar::constant(2.0), self.solver.last_step().1);
        let [moved, size] = self.solver.travel(system, [true, false], self.slides);
        for (x, v) in moved.as_mut().iter_mut().zip(system.at.v.as_ref()) {
            let way = (two * h * *v).abs();
            *x = if way <= *x { *x } else { way };
        }
        travels(system.system().reaches(), moved.as_ref(), size.as_ref(), self.travel.as_mut());
    }

    /// Looks again at the end of the last step, in `self.q` and `self.p`, where a contact that is not minded may have closed in
    /// it: at all of them, of which those are minded from now on that may be near. Returns whether that was so.
    pub(super) fn look_for_others(&mut self, system: &mut WithContacts<Y>) -> bool {
        if system.minds_all() || self.has_reserves(system, false) {
            return false;
        }
        let (t, h) = self.solver.last_step();
        system.glance_at_all(t + h, &self.q, &self.p);
        self.fill_all(system);
        self.mind_near(system);
        // Loads are those of the contacts that are closed, which are minded before and after.
        self.watch(system, true);
        true
    }

    /// After a look at all contacts, their gaps are the reserves.
    pub(super) fn fill_all(&mut self, system: &WithContacts<Y>) {
        for (k, reserve) in self.reserve.as_mut().iter_mut().enumerate() {
            *reserve = system.gap(k);
        }
    }

    /// Where all reserves are new, minds the contacts that touch or may close in some steps like the last one. In how many, is
    /// chosen so that gaps are computed least often.
    pub(super) fn mind_near(&mut self, system: &mut WithContacts<Y>) {
        if !system.has_many() {
            return;
        }
        let (reserve, travel, touching) = (self.reserve.as_ref(), self.travel.as_ref(), self.rules.touching);
        let near = |steps: f64, k: usize| {
            let reserve = get(reserve, k);
            !(reserve.to_f64() > touching && reserve > Y::Scalar::constant(steps) * get(travel, k))
        };
        // All are minded in none of these numbers of steps.
        let mut least = (reserve.len() as f64, f64::INFINITY);
        for steps in HORIZONS {
            let count = (0..reserve.len()).filter(|k| near(steps, *k)).count();
            let cost = count as f64 + reserve.len() as f64 / (LOOKS * steps);
            if cost < least.0 {
                least = (cost, steps);
            }
        }
        system.mind(|k| least.1 == f64::INFINITY || near(least.1, k));
    }

    /// Whether a contact is open and cannot have closed in the last step by its gap at the end, is not minded, or is ignored.
    pub(super) fn is_far(&self, system: &WithContacts<Y>, k: usize) -> bool {
        let (end, travel) = (self.end.as_ref().get(k), self.travel.as_ref().get(k));
        let apart = || end.zip(travel).is_some_and(|(end, travel)| end.first > *travel);
        system.mode(k) == Mode::Open && (self.ignores(k) || !system.minds(k) || apart())
    }

    /// Minds only the contacts that are not far in the last step, or those again that were minded before.
    pub(super) fn mind_searched(&mut self, system: &mut WithContacts<Y>, only: bool) {
        if !cfg!(feature = "hulls") {
            // With few corners, it is not worth its code.
            return;
        }
        if only {
            for k in 0..self.count(system) {
                let near = !self.is_far(system, k);
                set(self.near.as_mut(), k, near);
            }
        }
        system.exchange_minded(&mut self.near);
    }

    /// How far bodies whose contacts may have changed in the last step turn in it, in units of the angle within which
    /// functions are searched; `None` where no contact can have changed.
    pub(super) fn turn_of_near(&self, system: &WithContacts<Y>, h: Y::Scalar) -> Option<f64> {
        let all_open = system.is_open();
        let mut most: Option<f64> = None;
        for (k, (a, b)) in self.left.as_ref().iter().zip(self.end.as_ref()).enumerate() {
            if self.is_far(system, k) {
                continue;
            }
            let turn = h.to_f64().abs() * a.turning.to_f64().max(b.turning.to_f64()) / TURN;
            if !(all_open && turn < 1.0 && a.apart(b, h)) {
                most = Some(most.map_or(turn, |most| most.max(turn)));
            }
        }
        most
    }
}

impl<Y: Touching> WithContacts<Y> {
    /// Largest angular velocity between the bodies of contact `k` that the velocities allow, rad/s, after
    /// [`WithContacts::look`].
    pub(super) fn turning(&self, k: usize) -> Y::Scalar {
        let v = self.at.v.as_ref();
        let reaches = self.system().reaches();
        let row = reaches.iter().skip(reaches.partition_point(|reach| reach.contact < k));
        let row = row.take_while(|reach| reach.contact == k);
        row.fold(Y::Scalar::zero(), |sum, reach| sum + reach.turn * get(v, reach.velocity).abs())
    }
}
