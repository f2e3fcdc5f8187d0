//! Velocities of several momenta at one state, in vector registers.

use mbd_runtime::contact::ColumnsOf;

use super::instructions::{ARGUMENTS, INPUTS};
use super::lanes::best_lanes;
use super::Compiled;
use crate::output::{Output, FIELDS};

/// Memory for several states at once: coordinates, momenta, velocities, momenta freed of multipliers, multipliers; the fields.
#[derive(Clone, Debug, Default)]
pub(super) struct Several<S> {
    state: [Vec<S>; 5],
    fields: [Vec<S>; FIELDS.len()],
}

/// Columns for which vectors are worth filling.
const WORTHWHILE: usize = 3;

impl Compiled<f64> {
    /// Velocities of several momenta at one state, as many at once as vectors have numbers.
    pub(super) fn columns_in_lanes(&mut self, q: &[f64], columns: &mut ColumnsOf<f64>) -> bool {
        let count = columns.count();
        if count < WORTHWHILE || self.interprets(Output::ProjectMomenta) {
            return false;
        }
        match best_lanes() {
            8 => self.columns_in::<8>(q, columns, count),
            4 => self.columns_in::<4>(q, columns, count),
            _ => self.columns_in::<2>(q, columns, count),
        }
    }

    fn columns_in<const L: usize>(&mut self, q: &[f64], columns: &mut ColumnsOf<f64>, count: usize) -> bool {
        let shared = self.shared.clone();
        let Ok(code) = shared.in_lanes(Output::ProjectMomenta, L) else { return false };
        let mut several = std::mem::take(&mut self.several);
        let Several { state: [coordinates, p, v, free, sigma], fields } = &mut several;
        coordinates.clear();
        coordinates.extend(q.iter().flat_map(|x| [*x; L]));
        let (nv, rows) = (shared.sizes().nv, shared.sizes().rows);
        for (all, len) in [(&mut *p, nv), (&mut *v, nv), (&mut *free, nv), (&mut *sigma, rows)] {
            all.resize(L * len, 0.0);
        }
        let read = if code.reads_more() { FIELDS.len() } else { 1 };
        for (to, from) in fields.iter_mut().zip(self.fields()).take(read) {
            to.clear();
            to.extend(from.iter().flat_map(|x| [*x; L]));
        }
        if self.scratch.len() < code.scratch() {
            self.scratch.resize(code.scratch(), 0.0);
        }
        let mut done = true;
        for begin in (0..count).step_by(L) {
            columns.momenta::<L>(begin, p);
            let mut given: [&[f64]; INPUTS] = [&[]; INPUTS];
            (given[0], given[1]) = (&coordinates[..], &p[..]);
            given[ARGUMENTS..].iter_mut().zip(&*fields).for_each(|(to, from)| *to = from);
            // Angles that are too large for several states at once are those of all columns.
            done = code.call(&given, &mut [&mut v[..], &mut free[..], &mut sigma[..]], &mut self.scratch);
            if !done {
                break;
            }
            columns.take::<L>(begin, v);
        }
        self.several = several;
        done
    }
}
