//! Rates of several states at once, in the coordinates in which methods integrate.

use alloc::vec;
use alloc::vec::Vec;

use super::chart::Point;
use super::field::Field;
use crate::kernel::{call_lanes, Arithmetic, Kernel};
use crate::system::{Real, System};
use crate::Scalar;

/// Compiled for the instructions of the processor, as generated code is: rows of states, from the state that
/// displacements start from and the displacements.
struct Displace;

/// The state, displacements, states.
type Displacements<'a, S, const L: usize> = (&'a [S], &'a [[S; L]], &'a mut [[S; L]]);

impl<S: Scalar, const L: usize> Kernel<0, L, Displacements<'_, S, L>> for Displace {
    #[inline(always)]
    fn run<A: Arithmetic>((base, z, out): Displacements<'_, S, L>) {
        for ((out, base), z) in out.iter_mut().zip(base).zip(z) {
            *out = z.map(|z| *base + z);
        }
    }
}

/// Memory for `L` states of a system, side by side. Rows of displacements and of their rates have coordinates before
/// momenta: component `k` of lane `l` is `rows[k][l]`, `k < 2 nv`.
#[derive(Clone, Debug)]
pub(super) struct InLanes<Y: System, const L: usize> {
    q: Vec<[Y::Scalar; L]>,
    p: Vec<[Y::Scalar; L]>,
    qd: Vec<[Y::Scalar; L]>,
    /// The state that displacements start from.
    base: (Y::Coordinates, Y::Momenta),
    /// The state and the rate of one lane.
    state: (Y::Coordinates, Y::Momenta),
    lane_qd: Y::Coordinates,
    point: Point<Y>,
    rate: Point<Y>,
}

impl<Y, const L: usize> InLanes<Y, L>
where
    Y: System,
    Y::Scalar: Real,
{
    /// Memory for one system.
    pub fn new(system: &Y) -> Self {
        let (q, p) = (system.neutral(), system.zero_momenta());
        let rows = |n| vec![[Y::Scalar::zero(); L]; n];
        InLanes {
            q: rows(q.as_ref().len()),
            p: rows(p.as_ref().len()),
            qd: rows(q.as_ref().len()),
            lane_qd: q.clone(),
            base: (q.clone(), p.clone()),
            state: (q, p),
            point: Point::zero(system),
            rate: Point::zero(system),
        }
    }

    /// Takes the state that displacements start from, before the evaluations of a step.
    pub fn begin(&mut self, field: &Field<Y>, system: &Y) {
        self.point.clear();
        let (q, p) = &mut self.base;
        field.chart().state(system, &self.point, q, p);
    }

    /// Rates at the displacements `z`, at times `t` (s). Systems without lanes are evaluated state by state.
    pub fn rates(
        &mut self,
        field: &mut Field<Y>,
        system: &mut Y,
        t: &[Y::Scalar; L],
        z: &[[Y::Scalar; L]],
        out: &mut [[Y::Scalar; L]],
    ) {
        let plain = system.lie_joints().is_empty();
        if plain {
            let (x, dp) = z.split_at(self.q.len());
            call_lanes::<Displace, 0, L, Y::Scalar, _>((self.base.0.as_ref(), x, &mut self.q[..]));
            call_lanes::<Displace, 0, L, Y::Scalar, _>((self.base.1.as_ref(), dp, &mut self.p[..]));
        } else {
            self.displace_each(field, system, z);
        }
        let nv = self.p.len();
        let (qd, pd) = match plain {
            true => out.split_at_mut(nv),
            false => (&mut self.qd[..], &mut out[nv..]),
        };
        if !system.rates_in_lanes(t, &self.q, &self.p, qd, pd) {
            return self.one_by_one(field, system, t, z, out);
        }
        field.count(L as u64);
        if plain {
            return;
        }
        for l in 0..L {
            read(z, l, &mut self.point);
            read(out, l, &mut self.rate);
            let (q, p) = &mut self.state;
            copy_lane(&self.q, l, q.as_mut());
            copy_lane(&self.p, l, p.as_mut());
            copy_lane(&self.qd, l, self.lane_qd.as_mut());
            field.chart().rates(system, &self.point, (q, p), &self.lane_qd, &mut self.rate);
            write(&self.rate, out, l);
        }
    }

    /// States at displacements of which some are rotations.
    fn displace_each(&mut self, field: &Field<Y>, system: &Y, z: &[[Y::Scalar; L]]) {
        for l in 0..L {
            read(z, l, &mut self.point);
            let (q, p) = &mut self.state;
            field.chart().state(system, &self.point, q, p);
            set_lane(&mut self.q, l, q.as_ref());
            set_lane(&mut self.p, l, p.as_ref());
        }
    }

    fn one_by_one(
        &mut self,
        field: &mut Field<Y>,
        system: &mut Y,
        t: &[Y::Scalar; L],
        z: &[[Y::Scalar; L]],
        out: &mut [[Y::Scalar; L]],
    ) {
        for (l, t) in t.iter().enumerate() {
            read(z, l, &mut self.point);
            field.rates(system, *t, &self.point, &mut self.rate);
            write(&self.rate, out, l);
        }
    }

    /// Changes the displacement of each lane.
    pub fn change_each(&mut self, z: &mut [[Y::Scalar; L]], mut change: impl FnMut(&mut Point<Y>)) {
        for l in 0..L {
            read(z, l, &mut self.point);
            change(&mut self.point);
            write(&self.point, z, l);
        }
    }
}

fn copy_lane<S: Copy, const L: usize>(rows: &[[S; L]], lane: usize, out: &mut [S]) {
    for (x, row) in out.iter_mut().zip(rows) {
        *x = row[lane];
    }
}

fn set_lane<S: Copy, const L: usize>(rows: &mut [[S; L]], lane: usize, values: &[S]) {
    for (row, x) in rows.iter_mut().zip(values) {
        row[lane] = *x;
    }
}

/// Reads the displacement of one lane.
fn read<Y: System, const L: usize>(rows: &[[Y::Scalar; L]], lane: usize, out: &mut Point<Y>) {
    let (x, p) = rows.split_at(rows.len() / 2);
    copy_lane(x, lane, out.x.as_mut());
    copy_lane(p, lane, out.p.as_mut());
}

/// Writes the displacement of one lane.
fn write<Y: System, const L: usize>(point: &Point<Y>, rows: &mut [[Y::Scalar; L]], lane: usize) {
    let (x, p) = rows.split_at_mut(rows.len() / 2);
    set_lane(x, lane, point.x.as_ref());
    set_lane(p, lane, point.p.as_ref());
}
