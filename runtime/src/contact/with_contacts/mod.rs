//! Rates of a mechanism whose contacts slide with friction.
//!
//! Sticking contacts are constraints like any other. A sliding contact keeps its normal row only; its friction is the force
//! `−µ N t̂` against the slip direction `t̂`, with the normal force `N`, on which it acts back. Multipliers `λ` are linear
//! in the forces on the joints: the response of all normal forces to the friction of each sliding contact for `N = 1`
//! comes from the momenta `−µ Φ_tᵀt̂` (one solve each), and a small linear system gives `N`.

mod friction;
mod system;

pub(super) use friction::CREEP;

use super::instant::Touches;
use super::{Contact, Mode, Touching};
use crate::lists::{copy, get, get_or, set};
use crate::Scalar;

/// Number of contacts up to which all gaps are computed at once: finding out which are far takes as long.
const FEW: usize = 8;

/// A mechanism with contacts and their modes: its rates include the friction of sliding contacts.
#[derive(Clone, Debug)]
pub struct WithContacts<Y: Touching> {
    pub(super) system: Y,
    modes: Y::PerContact<Mode>,
    /// Whether there are rows that are no contacts': of loops and couplings.
    loops: bool,
    /// Whether rows of contacts act, by these modes or by those of a solve.
    closed: bool,
    /// Direction of slip where the step began, for contacts that slide.
    pub(super) slip: Y::PerContact<[Y::Scalar; 2]>,
    /// Whether a contact begins to slide: its friction is against the acceleration of slip.
    begins: Y::PerContact<bool>,
    /// Coefficient of friction of a contact as a part of the described one: more than one where it crept and was stopped.
    grip: Y::PerContact<Y::Scalar>,
    /// Memory for the forces by which the direction of slip that begins is found.
    instant: Option<Touches<Y>>,
    /// Whether it has forces found with the present modes, from which the next ones are searched.
    near: bool,
    /// Whether no such forces were found once in this step.
    unsure: bool,
    /// Whether any contact slides with friction.
    pub(super) rubs: bool,
    /// Rounding error of the normal forces of contacts that rub, N.
    rounding: f64,
    /// Whether rows of closed contacts depend on one another.
    pub(super) redundant: bool,
    /// Whether a contact that slides with friction is among those whose forces are not unique for this reason.
    pub(super) shares: bool,
    pub(super) at: Contacts<Y>,
    /// Contacts that [`WithContacts::look`] looks at: all that are not known to be far.
    minded: Y::PerContact<bool>,
    /// Contacts that are closed.
    pressed: Y::PerContact<bool>,
    /// Momenta of the state, freed of multipliers; the response to the friction of a contact.
    pub(super) p: Y::Momenta,
    pub(super) response: Y::Momenta,
    pub(super) response_v: Y::Momenta,
    pub(super) sigma: Y::Rows,
    /// Friction on the joints for normal forces of 1 N, and in total.
    pub(super) unit: Y::Momenta,
    friction: Y::Momenta,
    /// Normal force of each contact that slides with friction, zero for others, N.
    normals: Y::PerContact<Y::Scalar>,
    /// Memory for these forces.
    table: Y::Delassus,
}

/// What is known of all contacts at a state.
#[derive(Clone, Debug)]
pub(super) struct Contacts<Y: Touching> {
    /// Velocities of the mechanism.
    pub v: Y::Momenta,
    /// Residuals of all rows; those of the normal rows are the gaps.
    pub gaps: Y::Rows,
    /// Velocities of all rows.
    pub velocities: Y::Rows,
    /// Entries of `Φ`, of all rows.
    pub entries: Y::Entries,
    /// Multipliers, those of sliding contacts without the effect of friction.
    pub lambda: Y::Rows,
    /// Force of each contact `[normal, tangential, tangential]`, N: on the second body, the opposite on the first.
    pub forces: Y::PerContact<[Y::Scalar; 3]>,
}

impl<Y: Touching> WithContacts<Y> {
    /// All contacts are open at first.
    pub fn new(mut system: Y) -> Self {
        let zero = Y::Scalar::zero();
        let (rows, momenta) = (|y: &Y| y.zero_rows(), |y: &Y| y.zero_momenta());
        let modes = system.per_contact(Mode::Open);
        system.act(modes.as_ref());
        let count = system.contacts().len();
        let of_contacts: usize = system.contacts().iter().map(Contact::rows).sum();
        WithContacts {
            modes,
            loops: system.rows().len() > of_contacts,
            closed: false,
            slip: system.per_contact([zero; 2]),
            begins: system.per_contact(false),
            grip: system.per_contact(Y::Scalar::one()),
            instant: Some(Touches::new(&system)),
            near: false,
            unsure: false,
            rubs: false,
            rounding: 0.0,
            redundant: false,
            shares: false,
            at: Contacts {
                v: momenta(&system),
                gaps: rows(&system),
                velocities: rows(&system),
                entries: system.zero_entries(),
                lambda: rows(&system),
                forces: system.per_contact([zero; 3]),
            },
            minded: system.per_contact(true),
            pressed: system.per_contact(false),
            p: momenta(&system),
            response: momenta(&system),
            response_v: momenta(&system),
            sigma: rows(&system),
            unit: momenta(&system),
            friction: momenta(&system),
            normals: system.per_contact(zero),
            table: system.zero_delassus(count * (count + 1)),
            system,
        }
    }

    /// The mechanism.
    pub fn system(&self) -> &Y {
        &self.system
    }

    /// Gives the mechanism back.
    pub fn into_system(self) -> Y {
        self.system
    }

    /// The mechanism, for setting its inputs. Its modes must not be changed.
    pub fn system_mut(&mut self) -> &mut Y {
        &mut self.system
    }

    /// The modes of the contacts.
    pub fn modes(&self) -> &[Mode] {
        self.modes.as_ref()
    }

    /// The mode of contact `k`.
    pub(super) fn mode(&self, k: usize) -> Mode {
        get_or(self.modes.as_ref(), k, Mode::Open)
    }

    /// Direction of slip of contact `k` where the step began.
    pub(super) fn slip_of(&self, k: usize) -> [Y::Scalar; 2] {
        get_or(self.slip.as_ref(), k, [Y::Scalar::zero(); 2])
    }

    /// Force of contact `k`, after [`WithContacts::loads`].
    pub(super) fn force(&self, k: usize) -> [Y::Scalar; 3] {
        get_or(self.at.forces.as_ref(), k, [Y::Scalar::zero(); 3])
    }

    /// Whether contact `k` begins to slide.
    fn begins(&self, k: usize) -> bool {
        get_or(self.begins.as_ref(), k, false)
    }

    /// Whether there are rows that are no contacts': of loops and couplings.
    pub(super) fn has_loops(&self) -> bool {
        self.loops
    }

    /// Whether all contacts are open.
    pub(super) fn is_open(&self) -> bool {
        self.modes().iter().all(|mode| *mode == Mode::Open)
    }

    /// Forces of the contacts `[normal, tangential, tangential]`, N (N m for stops of rotations), at a state: on the second
    /// body, the opposite on the first. The two tangential directions form a right-handed triple with the normal and turn with the
    /// first body; they are along no axis of it.
    pub fn forces(&mut self, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> &[[Y::Scalar; 3]] {
        self.look_at_closed(t, q, p);
        self.loads(t, q, true);
        self.at.forces.as_ref()
    }

    /// Takes the modes of the contacts over from another evaluator of the same mechanism, with all that their forces depend on
    /// beside the state and the inputs: [`WithContacts::forces`] are then those of the other one, as far as they are searched. A
    /// copy that follows a motion in this way changes nothing of it, and takes far less time than a new copy at every state.
    pub fn take_modes_of(&mut self, other: &Self) {
        copy(self.modes.as_mut(), other.modes.as_ref());
        copy(self.slip.as_mut(), other.slip.as_ref());
        copy(self.begins.as_mut(), other.begins.as_ref());
        copy(self.grip.as_mut(), other.grip.as_ref());
        (self.redundant, self.shares) = (other.redundant, other.shares);
        self.modes_are_set();
    }

    /// Sets the modes and the directions of slip.
    pub(super) fn set_modes(&mut self, found: &Touches<Y>) {
        copy(self.modes.as_mut(), found.modes.as_ref());
        copy(self.slip.as_mut(), found.slip.as_ref());
        copy(self.begins.as_mut(), found.begins.as_ref());
        self.modes_are_set();
    }

    /// Sets modes that were there before, none of which begins to slide.
    pub(super) fn take_back(&mut self, modes: &[Mode]) {
        copy(self.modes.as_mut(), modes);
        self.begins.as_mut().fill(false);
        self.modes_are_set();
    }

    /// Opens all contacts, none of which is known to be far.
    pub(super) fn open_all(&mut self) {
        self.minded.as_mut().fill(true);
        self.release();
    }

    /// Opens all contacts at an event.
    pub(super) fn release(&mut self) {
        self.modes.as_mut().fill(Mode::Open);
        self.begins.as_mut().fill(false);
        self.modes_are_set();
    }

    fn modes_are_set(&mut self) {
        (self.near, self.unsure, self.rounding) = (false, false, 0.0);
        let of_contacts = self.pressed.as_mut().iter_mut().zip(self.grip.as_mut());
        for ((pressed, grip), mode) in of_contacts.zip(self.modes.as_ref()) {
            *pressed = *mode != Mode::Open;
            if *mode != Mode::Stick {
                *grip = Y::Scalar::one();
            }
        }
        self.restore();
        self.rubs = (0..self.modes.as_ref().len()).any(|k| self.rubs(k));
    }

    /// Whether contacts that slide with friction share a load.
    pub(super) fn shares(&self) -> bool {
        self.rubs && self.shares
    }

    /// Whether contact `k` is one of those whose forces are not unique and are not looked at one by one: contacts that stick,
    /// or have no friction, among redundant ones. What moves does not depend on how they share their load.
    pub(super) fn is_one_of_many(&self, k: usize) -> bool {
        self.redundant && !self.shares() && self.mode(k) != Mode::Open && !self.rubs(k)
    }

    /// Lets rows act as `modes` say, for a solve; [`WithContacts::restore`] ends this.
    pub(super) fn borrow_modes(&mut self, modes: &[Mode]) {
        self.closed = modes.iter().any(|mode| *mode != Mode::Open);
        self.system.act(modes);
    }

    /// Multipliers of the rows that act by `modes`, in `self.at.lambda`, after [`WithContacts::look`].
    pub(super) fn hold(&mut self, t: Y::Scalar, q: &Y::Coordinates, modes: &[Mode]) {
        self.borrow_modes(modes);
        self.system.multipliers(t, q, &self.at.v, &mut self.at.lambda);
        self.restore();
    }

    /// Lets rows act by the modes again.
    pub(super) fn restore(&mut self) {
        self.closed = !self.is_open();
        self.system.act(self.modes.as_ref());
    }

    /// Velocities of the momenta `self.response`, in `self.response_v`.
    pub(super) fn answer(&mut self, t: Y::Scalar, q: &Y::Coordinates) {
        self.system.project_momenta(t, q, &mut self.response, &mut self.response_v, &mut self.sigma);
    }

    /// Pivots of all rows, zero for those that do not act or depend on others, in `self.sigma`.
    pub(super) fn find_pivots(&mut self, q: &Y::Coordinates) {
        let (residual, pivots) = (&mut self.at.lambda, &mut self.sigma);
        self.system.position_correction(q, residual, &mut self.response_v, pivots);
    }

    /// Contact `k`, with the friction that holds it.
    pub(super) fn contact(&self, k: usize) -> Contact<Y::Scalar> {
        let grip = get_or(self.grip.as_ref(), k, Y::Scalar::one());
        let contact = self.system.contacts().get(k);
        contact.map_or(Contact::nowhere(), |contact| Contact { friction: grip * contact.friction, ..*contact })
    }

    /// Sets the coefficient of friction of contact `k`, as a part of the described one, until it no longer sticks or is hit.
    pub(super) fn set_grip(&mut self, k: usize, grip: Y::Scalar) {
        set(self.grip.as_mut(), k, grip);
    }

    /// Gives all contacts the friction that is described for them.
    pub(super) fn reset_grips(&mut self) {
        self.grip.as_mut().fill(Y::Scalar::one());
    }

    /// Momenta freed of multipliers, in `self.p`, and their velocities, in `self.at.v`.
    pub(super) fn free(&mut self, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) {
        copy(self.p.as_mut(), p.as_ref());
        self.system.project_momenta(t, q, &mut self.p, &mut self.at.v, &mut self.sigma);
    }

    /// Velocities at a state, with gaps and their like of the contacts that are minded, in `self.at`.
    pub(super) fn look(&mut self, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) {
        self.free(t, q, p);
        let Contacts { v, gaps, velocities, entries, .. } = &mut self.at;
        self.system.gaps_of([self.minded.as_ref(); 2], t, (q, v), gaps, velocities, entries);
    }

    /// [`WithContacts::look`] that sees only gaps and their rates of the contacts that are open.
    pub(super) fn glance(&mut self, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) {
        if !cfg!(feature = "hulls") {
            // With few corners, it is not worth its code.
            return self.look(t, q, p);
        }
        self.free(t, q, p);
        let Contacts { v, gaps, velocities, entries, .. } = &mut self.at;
        let of = [self.minded.as_ref(), self.pressed.as_ref()];
        self.system.gaps_of(of, t, (q, v), gaps, velocities, entries);
    }

    /// [`WithContacts::look`] at those contacts only that are closed.
    fn look_at_closed(&mut self, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) {
        self.free(t, q, p);
        let Contacts { v, gaps, velocities, entries, .. } = &mut self.at;
        self.system.gaps_of([self.pressed.as_ref(); 2], t, (q, v), gaps, velocities, entries);
    }

    /// [`WithContacts::look`] at all contacts, all of which are minded then.
    pub(super) fn look_at_all(&mut self, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) {
        self.minded.as_mut().fill(true);
        self.look(t, q, p);
    }

    /// [`WithContacts::glance`] at all contacts, all of which are minded then.
    pub(super) fn glance_at_all(&mut self, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) {
        self.minded.as_mut().fill(true);
        self.glance(t, q, p);
    }

    /// Whether there are so many contacts that those are left out that are far: also where all gaps are computed at once, so that
    /// steps are searched at the same points on every way.
    pub(super) fn has_many(&self) -> bool {
        self.modes.as_ref().len() > FEW
    }

    /// Exchanges the contacts that are minded with others.
    pub(super) fn exchange_minded(&mut self, others: &mut Y::PerContact<bool>) {
        core::mem::swap(&mut self.minded, others);
    }

    /// Whether contact `k` is minded.
    pub(super) fn minds(&self, k: usize) -> bool {
        get_or(self.minded.as_ref(), k, true)
    }

    /// Whether all contacts are minded.
    pub(super) fn minds_all(&self) -> bool {
        !self.minded.as_ref().contains(&false)
    }

    /// Whether any contact is minded.
    pub(super) fn minds_any(&self) -> bool {
        self.minded.as_ref().contains(&true)
    }

    /// Minds some contacts from now on, and those that are closed.
    pub(super) fn mind(&mut self, of: impl Fn(usize) -> bool) {
        self.mind_if(|k, _| of(k));
    }

    /// [`WithContacts::mind`] by whether a contact was minded, too.
    pub(super) fn mind_if(&mut self, mut of: impl FnMut(usize, bool) -> bool) {
        for k in 0..self.minded.as_ref().len() {
            let minded = of(k, self.minds(k)) || self.mode(k) != Mode::Open;
            set(self.minded.as_mut(), k, minded);
        }
    }

    /// Gap of contact `k`, m or rad, after [`WithContacts::look`].
    pub(super) fn gap(&self, k: usize) -> Y::Scalar {
        get(self.at.gaps.as_ref(), self.contact(k).row)
    }

    /// Rate of the gap of contact `k`, m/s or rad/s, after [`WithContacts::look`].
    pub(super) fn gap_rate(&self, k: usize) -> Y::Scalar {
        get(self.at.velocities.as_ref(), self.contact(k).row)
    }

    /// Tangential velocity of contact `k`, m/s, after [`WithContacts::look`].
    pub(super) fn tangential(&self, k: usize) -> [Y::Scalar; 2] {
        let c = self.contact(k);
        let rows = self.at.velocities.as_ref();
        if c.tangents {
            [get(rows, c.row + 1), get(rows, c.row + 2)]
        } else {
            [Y::Scalar::zero(); 2]
        }
    }
}
