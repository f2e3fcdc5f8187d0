//! Rates of a mechanism whose contacts slide with friction.
//!
//! Sticking contacts are constraints like any other. A sliding contact keeps its normal row only; its friction is the force
//! `−µ N t̂` against the slip direction `t̂`, with the normal force `N`, on which it acts back. Multipliers `λ` are linear
//! in the forces on the joints: the response of all normal forces to the friction of each sliding contact for `N = 1`
//! comes from the momenta `−µ Φ_tᵀt̂` (one solve each), and a small linear system gives `N`.

use super::assembly::lines;
use super::instant::Touches;
use super::touching::add_row;
use super::{Contact, Effort, Mode, Touching};
use crate::lists::{copy, first, get, get_or, largest, set};
use crate::system::{system_within, Conjugate, Constrained, Energetic, LieJoint, Real, Row, System};
use crate::Scalar;

/// Speed of slip below which its direction is the one that it had where the step began, m/s.
const SLOW: f64 = 1e-13;
/// Speed of slip, m/s, up to which a contact that begins to slide has its friction against the acceleration of slip.
///
/// Where slip begins, friction turns it within about `|v|/(µ N/m)` into the direction of its acceleration: explicit steps
/// would have to be as short, and the speed grows from zero as slowly as `t²`. So this fast motion is left out until its
/// time has grown; the velocity then errs by about `ω m/(µ N)` times the square of this speed, where `ω` is the rate at
/// which the direction turns, which is near 1e-11 m/s.
pub(super) const CREEP: f64 = 1e-5;
/// Part of the largest force below which a force does not tell the direction of slip.
const UNSURE: f64 = 1e-3;

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
    /// Memory for the forces by which the direction of slip that begins is found.
    instant: Option<Touches<Y>>,
    /// Whether it has forces found with the present modes, from which the next ones are searched.
    near: bool,
    /// Whether no such forces were found in this step, so that they are not searched again before the next one.
    unsure: bool,
    /// Whether any contact slides with friction.
    pub(super) rubs: bool,
    /// Whether rows of closed contacts depend on one another.
    pub(super) redundant: bool,
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
            instant: Some(Touches::new(&system)),
            near: false,
            unsure: false,
            rubs: false,
            redundant: false,
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
    /// body, the opposite on the first.
    pub fn forces(&mut self, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> &[[Y::Scalar; 3]] {
        self.look_at_closed(t, q, p);
        self.loads(t, q, true);
        self.at.forces.as_ref()
    }

    /// Sets the modes and the directions of slip.
    pub(super) fn set_modes(&mut self, found: &Touches<Y>) {
        copy(self.modes.as_mut(), found.modes.as_ref());
        copy(self.slip.as_mut(), found.slip.as_ref());
        copy(self.begins.as_mut(), found.begins.as_ref());
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
        (self.near, self.unsure) = (false, false);
        for (pressed, mode) in self.pressed.as_mut().iter_mut().zip(self.modes.as_ref()) {
            *pressed = *mode != Mode::Open;
        }
        self.restore();
        self.rubs = (0..self.modes.as_ref().len()).any(|k| self.rubs(k));
    }

    /// Whether contacts that slide with friction share a load.
    pub(super) fn shares(&self) -> bool {
        self.rubs && self.redundant
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

    pub(super) fn contact(&self, k: usize) -> Contact<Y::Scalar> {
        self.system.contacts().get(k).map_or(Contact::nowhere(), |contact| *contact)
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

    /// Minds some contacts from now on, and those that are closed.
    pub(super) fn mind(&mut self, of: impl Fn(usize) -> bool) {
        for k in 0..self.minded.as_ref().len() {
            let minded = self.mode(k) != Mode::Open || of(k);
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

    /// Speed of slip of contact `k`, m/s, after [`WithContacts::look`].
    pub(super) fn speed(&self, k: usize) -> Y::Scalar {
        let [x, y] = self.tangential(k);
        (x * x + y * y).sqrt()
    }

    /// Whether contact `k` slides with friction, and does not just begin to.
    pub(super) fn slides_on(&self, k: usize) -> bool {
        self.rubs(k) && !self.begins(k)
    }

    /// Speed of slip of contact `k` along the direction that is noted for it, m/s, after [`WithContacts::look`].
    pub(super) fn along_slip(&self, k: usize) -> Y::Scalar {
        let ([x, y], [a, b]) = (self.tangential(k), self.slip_of(k));
        x * a + y * b
    }

    /// Whether contact `k` slides against the direction of slip that is noted for it, after [`WithContacts::look`].
    pub(super) fn is_turned(&self, k: usize) -> bool {
        self.slides_on(k) && self.along_slip(k) < Y::Scalar::zero()
    }

    /// Direction of slip of contact `k` after [`WithContacts::look`]. Beyond the end of the motion along the direction
    /// where the step began, it is the mirror image: it does not jump within a step that leads too far.
    pub(super) fn direction(&self, k: usize) -> [Y::Scalar; 2] {
        if self.begins(k) {
            return self.slip_of(k);
        }
        let ([x, y], [a, b]) = (self.tangential(k), self.slip_of(k));
        let speed = (x * x + y * y).sqrt();
        if !(speed.to_f64() > SLOW) {
            return [a, b];
        }
        let along = self.along_slip(k);
        let back = if along < Y::Scalar::zero() { along + along } else { Y::Scalar::zero() };
        [(x - back * a) / speed, (y - back * b) / speed]
    }

    /// Notes the directions of slip where a step begins.
    pub(super) fn note_slip(&mut self, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) {
        if !self.rubs {
            return;
        }
        self.unsure = false;
        self.look_at_closed(t, q, p);
        for k in 0..self.modes.as_ref().len() {
            let begins = self.begins(k) && !(self.speed(k).to_f64() > CREEP);
            set(self.begins.as_mut(), k, begins);
            if self.rubs(k) {
                let direction = self.direction(k);
                set(self.slip.as_mut(), k, direction);
            }
        }
    }

    /// Directions of slip that begins, after [`WithContacts::look`]: with forces that satisfy Coulomb's law at the level of
    /// accelerations, friction against the acceleration of slip. Where no such forces are found, the directions stay until the
    /// next step begins, because to find none takes much longer than to find some.
    fn begin(&mut self, t: Y::Scalar, q: &Y::Coordinates) {
        let Some(mut instant) = self.instant.take() else { return };
        instant.take_closed(self);
        for i in 0..instant.count {
            let k = instant.contact(i);
            if self.slides_on(k) {
                instant.set_slip(i, Some(self.direction(k)));
            }
        }
        self.near = instant.find_forces(self, t, q, Effort::default(), self.near).is_ok();
        self.unsure = !self.near;
        if self.near {
            for i in 0..instant.count {
                let k = instant.contact(i);
                if self.begins(k) {
                    self.turn_slip(&instant, i, k);
                }
            }
        }
        self.instant = Some(instant);
    }

    /// The direction of slip of contact `k`, which is the problem's contact `i`: against its friction, or along its
    /// acceleration where its force is small, because others can take it over.
    fn turn_slip(&mut self, instant: &Touches<Y>, i: usize, k: usize) {
        let zero = Y::Scalar::zero();
        let c = instant.touch(i).contact;
        let f = first(instant.impulses.as_ref(), instant.rows());
        let largest = largest(f);
        let [n, mut x, mut y] = [get(f, c.row), -get(f, c.row + 1), -get(f, c.row + 2)];
        if !(n > Y::Scalar::constant(UNSURE) * largest) {
            (x, y) = (instant.with_impulses(c.row + 1), instant.with_impulses(c.row + 2));
        }
        let size = (x * x + y * y).sqrt();
        if size > zero {
            set(self.slip.as_mut(), k, [x / size, y / size]);
        }
    }

    /// Whether contact `k` slides with friction.
    pub(super) fn rubs(&self, k: usize) -> bool {
        let c = self.contact(k);
        self.mode(k) == Mode::Slide && c.tangents && c.friction > Y::Scalar::zero()
    }

    /// Friction of contact `k` on the joints for a normal force of 1 N, in `self.unit`.
    fn unit_friction(&mut self, k: usize) {
        let c = self.contact(k);
        self.unit.as_mut().fill(Y::Scalar::zero());
        let [a, b] = self.direction(k);
        for (row, along) in [(c.row + 1, a), (c.row + 2, b)] {
            add_row(&self.system, &self.at.entries, row, -(c.friction * along), &mut self.unit);
        }
    }

    /// Forces of all contacts that are closed, after [`WithContacts::look`]; the friction of those that slide as forces
    /// on the joints. With `all`, those of sticking contacts include the effect of friction elsewhere.
    pub(super) fn loads(&mut self, t: Y::Scalar, q: &Y::Coordinates, all: bool) {
        let zero = Y::Scalar::zero();
        if self.begins.as_ref().contains(&true) && !self.unsure {
            self.begin(t, q);
        }
        self.friction.as_mut().fill(zero);
        if self.shares() && self.share(t, q) {
            return;
        }
        self.system.multipliers(t, q, &self.at.v, &mut self.at.lambda);
        let count = self.modes.as_ref().len();
        if self.rubs {
            self.normal_forces(t, q, count);
        }
        if self.rubs && all {
            self.respond(t, q, false);
            for (lambda, sigma) in self.at.lambda.as_mut().iter_mut().zip(self.sigma.as_ref()) {
                *lambda = *lambda + *sigma;
            }
        }
        for k in 0..count {
            let c = self.contact(k);
            let lambda = self.at.lambda.as_ref();
            let own = |row: usize, acts: bool| if acts { -get(lambda, row) } else { zero };
            let mode = self.mode(k);
            let mut force = [zero; 3];
            for (i, force) in force.iter_mut().enumerate().take(c.rows()) {
                *force = own(c.row + i, mode.acts(i));
            }
            if self.rubs(k) {
                let normal = if all { force[0] } else { get(self.table.as_ref(), k * (count + 1) + count) };
                let [a, b] = self.direction(k);
                force = [normal, -(c.friction * normal * a), -(c.friction * normal * b)];
            }
            set(self.at.forces.as_mut(), k, force);
        }
    }

    /// [`WithContacts::loads`] where contacts that slide share a load; `false` where no forces are found.
    fn share(&mut self, t: Y::Scalar, q: &Y::Coordinates) -> bool {
        let Some(mut instant) = self.instant.take() else { return false };
        self.near = false; // Its forces are those of other lines.
        let found = instant.share(self, t, q);
        if found {
            let zero = Y::Scalar::zero();
            let (lambda, friction) = (self.at.lambda.as_mut(), &mut self.friction);
            lambda.fill(zero);
            for (line, force) in lines(self.system.contacts(), instant.sharing()).zip(instant.impulses.as_ref()) {
                for (i, (row, force)) in line.forces(*force).enumerate() {
                    set(lambda, row, -force);
                    if i > 0 {
                        add_row(&self.system, &self.at.entries, row, force, friction);
                    }
                }
            }
            for (force, c) in self.at.forces.as_mut().iter_mut().zip(self.system.contacts()) {
                *force = core::array::from_fn(|i| if i < c.rows() { -get(lambda, c.row + i) } else { zero });
            }
        }
        self.instant = Some(instant);
        found
    }

    /// Multipliers of forces on the joints at rest, in `self.sigma`: of `self.unit`, or of all friction.
    fn respond(&mut self, t: Y::Scalar, q: &Y::Coordinates, unit: bool) {
        let force = if unit { &self.unit } else { &self.friction };
        // The state's momenta have no multipliers, so that these are those of the force alone.
        for (r, (p, f)) in self.response.as_mut().iter_mut().zip(self.p.as_ref().iter().zip(force.as_ref())) {
            *r = *p + *f;
        }
        self.answer(t, q);
    }

    /// Normal forces `N` of the contacts that rub, from `N − R N = N₀`, and their friction in total.
    fn normal_forces(&mut self, t: Y::Scalar, q: &Y::Coordinates, count: usize) {
        let (one, width) = (Y::Scalar::one(), count + 1);
        for k in 0..count {
            if !self.rubs(k) {
                continue;
            }
            self.unit_friction(k);
            self.respond(t, q, true);
            for j in 0..count {
                if !self.rubs(j) {
                    continue;
                }
                let response = -get(self.sigma.as_ref(), self.contact(j).row);
                set(self.table.as_mut(), j * width + k, if j == k { one - response } else { -response });
            }
            let free = -get(self.at.lambda.as_ref(), self.contact(k).row);
            set(self.table.as_mut(), k * width + count, free);
        }
        self.eliminate(count);
        for k in 0..count {
            if self.rubs(k) {
                self.unit_friction(k);
                let normal = get(self.table.as_ref(), k * width + count);
                for (sum, unit) in self.friction.as_mut().iter_mut().zip(self.unit.as_ref()) {
                    *sum = *sum + normal * *unit;
                }
            }
        }
    }

    /// Solves the system of [`WithContacts::normal_forces`] among the contacts that rub.
    fn eliminate(&mut self, count: usize) {
        let width = count + 1;
        for k in 0..count {
            if !self.rubs(k) {
                continue;
            }
            let pivot = get(self.table.as_ref(), k * width + k);
            for j in 0..count {
                if j == k || !self.rubs(j) {
                    continue;
                }
                let table = self.table.as_mut();
                let factor = get(table, j * width + k) / pivot;
                for i in k..width {
                    let left = get(table, j * width + i) - factor * get(table, k * width + i);
                    set(table, j * width + i, left);
                }
            }
        }
        for k in 0..count {
            if self.rubs(k) {
                let table = self.table.as_mut();
                let normal = get(table, k * width + count) / get(table, k * width + k);
                set(table, k * width + count, normal);
            }
        }
    }
}

impl<Y: Touching> System for WithContacts<Y> {
    system_within!(system: Y);

    fn lie_joints(&self) -> &[LieJoint] {
        self.system.lie_joints()
    }

    fn rates_at(
        &mut self,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &Y::Momenta,
        qd: &mut Y::Coordinates,
        pd: &mut Y::Momenta,
    ) {
        self.system.rates_at(t, q, p, qd, pd);
        if self.rubs {
            self.look_at_closed(t, q, p);
            self.loads(t, q, false);
            for (rate, force) in pd.as_mut().iter_mut().zip(self.friction.as_ref()) {
                *rate = *rate + *force;
            }
        }
    }
}

impl<Y: Touching + Energetic> Energetic for WithContacts<Y> {
    fn energies(&mut self, q: &Y::Coordinates, p: &Y::Momenta) -> (Y::Scalar, Y::Scalar) {
        self.system.energies(q, p)
    }
}

impl<Y: Touching + Conjugate> Conjugate for WithContacts<Y> {
    fn conjugate_momenta(&mut self, q: &Y::Coordinates, v: &Y::Momenta, p: &mut Y::Momenta) {
        self.system.conjugate_momenta(q, v, p);
    }
}

impl<Y: Touching> Constrained for WithContacts<Y> {
    type Rows = Y::Rows;
    type Entries = Y::Entries;

    fn zero_rows(&self) -> Y::Rows {
        self.system.zero_rows()
    }

    fn zero_entries(&self) -> Y::Entries {
        self.system.zero_entries()
    }

    fn rows(&self) -> &[Row] {
        self.system.rows()
    }

    /// Rows of loops and couplings always act, those of contacts that are closed do.
    fn rows_act(&self) -> bool {
        self.closed || self.has_loops()
    }

    fn entry_columns(&self) -> &[usize] {
        self.system.entry_columns()
    }

    fn constraint_residuals(&mut self, q: &Y::Coordinates, residual: &mut Y::Rows, jacobian: &mut Y::Entries) {
        self.system.constraint_residuals(q, residual, jacobian);
    }

    fn project_momenta(
        &mut self,
        t: Y::Scalar,
        q: &Y::Coordinates,
        p: &mut Y::Momenta,
        v: &mut Y::Momenta,
        sigma: &mut Y::Rows,
    ) {
        self.system.project_momenta(t, q, p, v, sigma);
    }

    fn position_correction(
        &mut self,
        q: &Y::Coordinates,
        residual: &mut Y::Rows,
        dq: &mut Y::Momenta,
        pivots: &mut Y::Rows,
    ) {
        self.system.position_correction(q, residual, dq, pivots);
    }

    /// Without the effect of friction on the other multipliers; [`WithContacts::forces`] includes it.
    fn multipliers(&mut self, t: Y::Scalar, q: &Y::Coordinates, v: &Y::Momenta, lambda: &mut Y::Rows) {
        self.system.multipliers(t, q, v, lambda);
    }

    fn reorder_rows(&mut self, q: &Y::Coordinates) -> bool {
        self.system.reorder_rows(q)
    }
}
