//! Contacts that cannot have closed, by how far the joints have moved: what need not be looked at.

use super::watch::TURN;
use super::Hybrid;
use crate::contact::{Mode, Reach, Touching, WithContacts};
use crate::integrate::Stepper;
use crate::lists::get;
use crate::system::Real;
use crate::Scalar;

impl<Y, M> Hybrid<Y, M>
where
    Y: Touching,
    M: Stepper<WithContacts<Y>>,
{
    /// The gaps of the left end, which is where the next step starts, are what the joints may use up.
    pub(super) fn refill(&mut self) {
        for (reserve, left) in self.reserve.as_mut().iter_mut().zip(self.left.as_ref()) {
            *reserve = left.first;
        }
        self.known = true;
    }

    /// Whether no contact can have closed within the last step, nor since the gaps were looked at. All contacts are open
    /// then. Takes the travel of the step off the reserves. `near`: the gaps had to be looked at in the step before.
    pub(super) fn stays_apart(&mut self, system: &mut WithContacts<Y>, near: bool) -> bool {
        if !system.is_open() {
            self.travel.as_mut().fill(Y::Scalar::constant(f64::INFINITY));
            return false;
        }
        // Where displacements alone tell that gaps have to be looked at, rates at the end are not asked for.
        let apart = [[true, false], [true, true]].into_iter().skip(usize::from(!near)).all(|rates| {
            let [moved, size] = self.solver.travel(system, rates);
            travels(system.system().reaches(), moved.as_ref(), size.as_ref(), self.travel.as_mut());
            let mut left = self.reserve.as_ref().iter().zip(self.travel.as_ref()).zip(self.ignored.as_ref());
            left.all(|((reserve, travel), ignored)| *ignored || *reserve > *travel)
        });
        for (reserve, travel) in self.reserve.as_mut().iter_mut().zip(self.travel.as_ref()) {
            *reserve = *reserve - *travel;
        }
        apart
    }

    /// The travel of the last step with the velocities that were found at its end, after [`WithContacts::look`] there. The
    /// reserves are used up.
    pub(super) fn travel_with_end(&mut self, system: &mut WithContacts<Y>) {
        if !system.is_open() {
            return;
        }
        let (two, h) = (Y::Scalar::constant(2.0), self.solver.last_step().1);
        let [moved, size] = self.solver.travel(system, [true, false]);
        for (x, v) in moved.as_mut().iter_mut().zip(system.at.v.as_ref()) {
            let way = (two * h * *v).abs();
            *x = if way <= *x { *x } else { way };
        }
        travels(system.system().reaches(), moved.as_ref(), size.as_ref(), self.travel.as_mut());
    }

    /// Whether a contact that is open is ignored, or cannot have closed in the last step, by its gap at the end.
    pub(super) fn is_far(&self, k: usize) -> bool {
        let (end, travel) = (self.end.as_ref().get(k), self.travel.as_ref().get(k));
        self.ignores(k) || end.zip(travel).is_some_and(|(end, travel)| end.first > *travel)
    }

    /// How far bodies whose contacts may have changed in the last step turn in it, in units of the angle within which
    /// functions are searched; `None` where no contact can have changed.
    pub(super) fn turn_of_near(&self, system: &WithContacts<Y>, h: Y::Scalar) -> Option<f64> {
        let all_open = system.is_open();
        let mut most: Option<f64> = None;
        for (k, (a, b)) in self.left.as_ref().iter().zip(self.end.as_ref()).enumerate() {
            if system.mode(k) == Mode::Open && self.is_far(k) {
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

/// By how much each gap can have changed, m (rad): for coordinates of the sizes `size` where the step began that have moved
/// by up to `moved`.
fn travels<S: Real>(reaches: &[Reach<S>], moved: &[S], size: &[S], out: &mut [S]) {
    let zero = S::zero();
    // Where nothing is known, everything may have happened.
    out.fill(S::constant(f64::INFINITY));
    let mut contact = usize::MAX;
    let (mut way, mut angle, mut arm) = (zero, zero, zero);
    for reach in reaches {
        if reach.contact != contact {
            contact = reach.contact;
            (way, angle, arm) = (zero, zero, zero);
        }
        let (moved, size) = (get(moved, reach.velocity), get(size, reach.velocity));
        way = way + reach.rate * moved;
        angle = angle + reach.turn * moved;
        arm = arm + reach.slide * (size + moved);
        // The last entry of a contact has the whole sum.
        if let Some(out) = out.get_mut(contact) {
            *out = way + angle * arm;
        }
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
