//! Constraints on accelerations: the right-hand sides of their rows relative to a reference motion, and the multipliers
//! `λ`.

use super::constraint::difference;
use super::pass::Sweep;
use super::{Inputs, Quantity, Sweeps, Trace};
use crate::lists::array;
use crate::spatial::{add3, cross, Motion, Vec3};
use crate::tree::{Bond, Constraint, Cut};
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// Right-hand sides of the rows relative to a reference motion, after [`Sweep::NEWTON`], from the velocities of all
    /// nodes.
    pub(super) const ROW_ACCELERATIONS: Self = Sweep {
        needed: |tree| !T::PLAIN && !tree.constraints.is_empty(),
        end: |cx| cx.sweeps.row_accelerations(&cx.given.inputs, cx.w),
        ..Self::VELOCITY
    };
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Right-hand sides of the rows that the accelerations of a reference motion leave, in
    /// [`crate::workspace::Constraints::rhs`]: the negative of `Eᵀ dΩ_rel/dt + ĖᵀΩ_rel`, and Baumgarte's terms.
    fn row_accelerations(&self, u: &Inputs<S>, w: &mut Workspace<S>) {
        for (index, constraint) in self.tree.constraints.iter().enumerate() {
            self.trace.at(None, Quantity::Constraint);
            match &constraint.bond {
                Bond::Cut(cut) => self.cut_accelerations(index, constraint, cut, u, w),
                Bond::Coupling { terms, .. } => {
                    let sum = |of: &[S]| terms.iter().fold(S::zero(), |sum, (i, ratio)| sum + *ratio * of[w.first[*i]]);
                    let (rate, rate2) = (sum(&w.velocity.rate), sum(&w.newton.reference));
                    self.put_acceleration(constraint, 0, rate, rate2, w);
                }
            }
        }
    }

    fn put_acceleration(&self, constraint: &Constraint<S>, k: usize, rate: S, rate2: S, w: &mut Workspace<S>) {
        let r = constraint.first + k;
        let held = match constraint.decay {
            Some(decay) if constraint.holonomic(k) => {
                (decay + decay) * rate + decay * decay * w.constraints.rows[r].residual
            }
            _ => S::zero(),
        };
        w.constraints.rhs[r] = -(rate2 + held);
    }

    fn cut_accelerations(
        &self,
        index: usize,
        constraint: &Constraint<S>,
        cut: &Cut<S>,
        u: &Inputs<S>,
        w: &mut Workspace<S>,
    ) {
        let at = w.constraints.relative[index];
        let [va, vb] = [&cut.a, &cut.b].map(|frame| self.frame_motion(frame, w));
        let [aa, ab] = [&cut.a, &cut.b].map(|frame| {
            let mut m = self.classic_motion(frame.node, u, w);
            self.on_body(&w.poses, frame).for_each(|step| m.carry(&step));
            m
        });
        let rel = difference(&vb, &at.motion(&va));
        let rates = cut.closure.direction_rates(&at, &rel);
        // Derivatives of the components of Ω_rel, from accelerations of the origins as vectors.
        let (spin, alpha) = (at.turned(va.ang), at.turned(aa.alpha));
        let carried = add3(cross(alpha, at.d), cross(spin, add3(rel.lin, cross(spin, at.d))));
        let a_origin = add3(at.turned(aa.accel), carried);
        let along = cross(vb.ang, rel.lin);
        let lin: Vec3<S> = array(|k| ab.accel[k] - a_origin[k] - along[k]);
        let gyro = cross(vb.ang, spin);
        let ang: Vec3<S> = array(|k| ab.alpha[k] - alpha[k] + gyro[k]);
        let change = Motion { lin, ang };
        for k in 0..constraint.slots.len() {
            let e = w.constraints.rows[constraint.first + k].e;
            self.put_acceleration(constraint, k, e.dot(&rel), e.dot(&change) + rates[k].dot(&rel), w);
        }
    }
}
