//! The freedoms of a loop, for the derivatives of mechanisms with constraints: `closed.rs` has the formulas.

use super::{single, velocity, Derivatives};
use crate::lists::array;
use crate::spatial::{dot3, scale3, Force, Motion};
use crate::sweep::constraint::difference;
use crate::sweep::jacobian::before;
use crate::sweep::{Sweeps, Trace};
use crate::tree::Cut;
use crate::workspace::Workspace;
use crate::Scalar;

/// A freedom on the path of a loop, in axes of the second frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct LoopFreedom<S> {
    /// Its node.
    pub node: usize,
    /// Whether it is on the path to the second frame.
    pub second: bool,
    /// Its velocity, if it belongs to the state.
    pub velocity: Option<usize>,
    /// Its rate.
    pub rate: S,
    /// Motion of the second frame relative to the first at a unit rate.
    pub axis: Motion<S>,
    /// Motion of the body before the joint, relative to the first frame.
    pub inner: Motion<S>,
    /// The same of the body behind the joint.
    pub outer: Motion<S>,
    /// `(Ω_outer − Ω_inner) × s`: zero, and known to be, where the joint has no other freedom.
    pub twist: Motion<S>,
}

impl<S> LoopFreedom<S> {
    /// Whether a change of the coordinate of `other` turns this axis.
    pub fn turned_by(&self, other: &Self) -> bool {
        match self.second {
            true => other.second && other.node > self.node,
            false => other.second || other.node <= self.node,
        }
    }
}

/// Of the motions before and behind a joint with one freedom, either serves in products with its axis: that one is taken
/// which is known to be zero at an end of the loop.
impl<S: Scalar> LoopFreedom<S> {
    /// `Ω_a × s_a`.
    pub fn turn(&self) -> Motion<S> {
        match self.second {
            true => self.inner.cross_motion(&self.axis),
            false => difference(&self.outer.cross_motion(&self.axis), &self.twist),
        }
    }

    /// `(Ω − Ω_a) × s_a`, with the motion `Ω` of the second frame.
    pub fn swing(&self, motion: &Motion<S>) -> Motion<S> {
        difference(motion, &self.outer).cross_motion(&self.axis).plus(&self.twist)
    }

    /// `χ`, with the motion of the second frame, `f`, `f°` and `φ`.
    pub fn chi(&self, motion: &Motion<S>, f: &Force<S>, turning: &Force<S>, phi: &Force<S>) -> Force<S> {
        let ahead = difference(motion, &self.outer).cross_force(f).plus(turning);
        let all = self.outer.cross_force(phi).plus(&self.axis.cross_force(&ahead));
        all.minus(&self.twist.cross_force(f))
    }
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// The freedoms of a loop, and the motion of its second frame relative to the first.
    pub(super) fn loop_freedoms(
        &self,
        index: usize,
        cut: &Cut<S>,
        w: &Workspace<S>,
        d: &mut Derivatives<S>,
    ) -> Motion<S> {
        let (o, one) = (S::zero(), S::one());
        let (path, rates) = (&mut d.closed.path, &d.rate);
        path.clear();
        let mut push = |second: bool, i: usize, k: usize, [x, y, z, a, b, c]: [S; 6]| {
            let node = &self.tree.nodes[i];
            let sign = if second { one } else { -one };
            let axis = scaled(&Motion { lin: [x, y, z], ang: [a, b, c] }, sign);
            let (velocity, rate) = (velocity(node).map(|v| v + k), rates[w.first[i] + k]);
            let (inner, outer, twist) = (Motion::zero(), Motion::zero(), Motion::zero());
            path.push(LoopFreedom { node: i, second, velocity, rate, axis, inner, outer, twist });
        };
        let at = &w.constraints.relative[index];
        let mut rot = array(|i| at.axis(i));
        let mut pos = array(|i| dot3(at.axis(i), at.d));
        self.on_body(&w.poses, &cut.a).rev().for_each(|step| before(&step, &mut rot, &mut pos));
        self.columns_along(cut.path_a.iter().rev().copied(), (rot, pos), w, |i, k, axis| push(false, i, k, axis));
        let (mut rot, mut pos) = ([[one, o, o], [o, one, o], [o, o, one]], [o; 3]);
        self.on_body(&w.poses, &cut.b).for_each(|step| step.pose(&mut rot, &mut pos));
        self.columns_along(cut.path_b.iter().rev().copied(), (rot, pos), w, |i, k, axis| push(true, i, k, axis));
        // Around the loop: inward from the first frame, then outward to the second.
        let mut motion = Motion::zero();
        let sides = [(false, &cut.path_a), (true, &cut.path_b)];
        let order = sides[0].1.iter().rev().map(|i| (false, *i)).chain(sides[1].1.iter().map(|i| (true, *i)));
        for (second, i) in order {
            let here = |x: &&mut LoopFreedom<S>| x.second == second && x.node == i;
            let rates = path.iter_mut().filter(here).map(|x| scaled(&x.axis, x.rate));
            let own = rates.fold(Motion::zero(), |sum, rate| sum.plus(&rate));
            let start = motion;
            motion = motion.plus(&own);
            let (inner, outer, own) = if second { (start, motion, own) } else { (motion, start, scaled(&own, -one)) };
            let several = !single(&self.tree.nodes[i]);
            for x in path.iter_mut().filter(here) {
                (x.inner, x.outer) = (inner, outer);
                x.twist = if several { own.cross_motion(&x.axis) } else { Motion::zero() };
            }
        }
        motion
    }
}

fn scaled<S: Scalar>(m: &Motion<S>, x: S) -> Motion<S> {
    Motion { lin: scale3(x, m.lin), ang: scale3(x, m.ang) }
}
