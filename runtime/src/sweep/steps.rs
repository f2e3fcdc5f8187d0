//! The steps between the frames of neighbouring nodes, and the quantities that are carried along them.

use super::{Sweeps, Trace};
use crate::spatial::{ArticulatedInertia, ElementaryTransform, Force, Motion, Vec3};
use crate::workspace::Poses;
use crate::Scalar;

/// Steps from a frame to one further outward: constant ones, then those of a joint.
#[derive(Clone, Copy)]
pub(super) struct Steps<'b, S> {
    runs: [&'b [ElementaryTransform<S>]; 2],
}

impl<'b, S: Scalar> Steps<'b, S> {
    /// One by one.
    #[inline]
    pub fn iter(self) -> impl DoubleEndedIterator<Item = &'b ElementaryTransform<S>> {
        self.runs.into_iter().flatten()
    }

    /// A motion given at the inner frame, at the outer frame: `X Ω`.
    pub fn motion(self, mut m: Motion<S>) -> Motion<S> {
        for run in self.runs {
            for step in run {
                step.carry_motion(&mut m);
            }
        }
        m
    }

    /// Components of a vector of the inner frame in the outer frame.
    pub fn vector(self, mut x: Vec3<S>) -> Vec3<S> {
        for run in self.runs {
            for step in run {
                step.carry_vector(&mut x);
            }
        }
        x
    }

    /// A momentum or wrench given at the outer frame, at the inner frame: `Xᵀ P`.
    pub fn force(self, mut f: Force<S>) -> Force<S> {
        for run in self.runs.into_iter().rev() {
            for step in run.iter().rev() {
                step.carry_force(&mut f);
            }
        }
        f
    }

    /// An inertia given at the outer frame, taken to the inner frame: `Xᵀ M X`.
    pub fn carry_inertia(self, m: &mut ArticulatedInertia<S>) {
        for run in self.runs.into_iter().rev() {
            for step in run.iter().rev() {
                step.carry_inertia(m);
            }
        }
    }

    /// First moment of a mass `m`, given in the outer frame, in the inner frame.
    pub fn moment(self, m: S, mut s: Vec3<S>) -> Vec3<S> {
        for run in self.runs.into_iter().rev() {
            for step in run.iter().rev() {
                s = step.moment(m, s);
            }
        }
        s
    }
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Whether the frame of the parent of node `i` does not turn with its body: then the placement of node `i` in it
    /// does.
    #[inline]
    pub(super) fn placement_turns(&self, i: usize) -> bool {
        !T::PLAIN && self.tree.nodes[i].parent.is_some_and(|p| self.elimination(p).non_rotating)
    }

    /// Constant steps from the parent frame to the joint of node `i`: none where the placement turns, and its steps are
    /// among those of the joint.
    #[inline]
    pub(super) fn place<'b>(&'b self, w: &'b Poses<S>, i: usize) -> &'b [ElementaryTransform<S>] {
        match T::PLAIN || w.joint[i].placing().is_empty() {
            true => &self.tree.nodes[i].place,
            false => &[],
        }
    }

    /// Steps from the parent frame to node `i`.
    #[inline]
    pub(super) fn steps<'b>(&'b self, w: &'b Poses<S>, i: usize) -> Steps<'b, S> {
        Steps { runs: [self.place(w, i), w.joint[i].get()] }
    }

    /// The part of [`Sweeps::steps`] ahead of the frame that node `i` is eliminated in.
    #[inline]
    pub(super) fn entering<'b>(&'b self, w: &'b Poses<S>, i: usize) -> Steps<'b, S> {
        let joint = &w.joint[i];
        let steps = if self.elimination(i).before_joint { joint.placing() } else { joint.get() };
        Steps { runs: [self.place(w, i), steps] }
    }

    /// The rest: from there to the node frame.
    #[inline]
    pub(super) fn leaving<'b>(&'b self, w: &'b Poses<S>, i: usize) -> Steps<'b, S> {
        let own = if self.elimination(i).before_joint { w.joint[i].own() } else { &[] };
        Steps { runs: [own, &[]] }
    }
}
