//! The steps between the frames of neighbouring nodes, and the quantities that are carried along them.

use super::{Sweeps, Trace};
use crate::spatial::{ArticulatedInertia, ElementaryTransform, Force, Motion, Vec3};
use crate::workspace::Poses;
use crate::Scalar;

/// Steps from a frame to one further outward. What carries a quantity along them is compiled as part of each caller, which
/// keeps the quantity in registers; only for WebAssembly, where size counts, it is one function.
#[derive(Clone, Copy)]
pub(super) struct Steps<'b, S>(&'b [ElementaryTransform<S>]);

impl<'b, S: Scalar> Steps<'b, S> {
    /// One by one.
    #[inline]
    pub fn iter(self) -> impl DoubleEndedIterator<Item = &'b ElementaryTransform<S>> {
        self.0.iter()
    }

    /// A motion given at the inner frame, at the outer frame: `X Ω`.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    pub fn motion(self, mut m: Motion<S>) -> Motion<S> {
        for step in self.0 {
            step.carry_motion(&mut m);
        }
        m
    }

    /// Components of a vector of the inner frame in the outer frame.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    pub fn vector(self, mut x: Vec3<S>) -> Vec3<S> {
        for step in self.0 {
            step.carry_vector(&mut x);
        }
        x
    }

    /// A momentum or wrench given at the outer frame, at the inner frame: `Xᵀ P`.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    pub fn force(self, mut f: Force<S>) -> Force<S> {
        for step in self.0.iter().rev() {
            step.carry_force(&mut f);
        }
        f
    }

    /// An inertia given at the outer frame, taken to the inner frame: `Xᵀ M X`.
    pub fn carry_inertia(self, m: &mut ArticulatedInertia<S>) {
        for step in self.0.iter().rev() {
            step.carry_inertia(m);
        }
    }

    /// First moment of a mass `m`, given in the outer frame, in the inner frame.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    pub fn moment(self, m: S, mut s: Vec3<S>) -> Vec3<S> {
        for step in self.0.iter().rev() {
            s = step.moment(m, s);
        }
        s
    }
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Whether the frame of the parent of node `i` does not turn with its body: then the placement of node `i` in it
    /// does.
    #[inline(always)]
    pub(super) fn placement_turns(&self, i: usize) -> bool {
        !T::PLAIN && self.tree.nodes[i].parent.is_some_and(|p| self.elimination(p).non_rotating)
    }

    /// Steps from the parent frame to node `i`.
    #[inline(always)]
    pub(super) fn steps<'b>(&self, w: &'b Poses<S>, i: usize) -> Steps<'b, S> {
        Steps(w.steps.all(i))
    }

    /// The part of [`Sweeps::steps`] ahead of the frame that node `i` is eliminated in.
    #[inline(always)]
    pub(super) fn entering<'b>(&self, w: &'b Poses<S>, i: usize) -> Steps<'b, S> {
        Steps(if self.elimination(i).before_joint { w.steps.placing(i) } else { w.steps.all(i) })
    }

    /// The rest: from there to the node frame.
    #[inline(always)]
    pub(super) fn leaving<'b>(&self, w: &'b Poses<S>, i: usize) -> Steps<'b, S> {
        Steps(if self.elimination(i).before_joint { w.steps.own(i) } else { &[] })
    }
}
