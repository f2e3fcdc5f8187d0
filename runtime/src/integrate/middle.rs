//! The chart about the middle of a step, for symmetric methods.
//!
//! The chart about the start of a step ([`super::chart`]) is another one than that about its end, so that a method that
//! is symmetric for sums is not symmetric in it: a step back does not return, and the energy drifts. In the chart about
//! the middle, `R = cay(ζ − ξ) cay(ξ) R₀`, the start is at `ζ = 0` and the end at `ζ = 2 ξ`: a step back has the same
//! chart, with both ends exchanged. As `ξ` is half of the step that is wanted, it is found with the stages. Positions
//! and momenta are the same in all charts but for a constant linear map, under which Runge-Kutta methods do not change.
//! E. Hairer, C. Lubich, G. Wanner, *Geometric Numerical Integration*, V.4.3: symmetric methods on manifolds by local
//! coordinates.

use super::chart::Point;
use crate::system::{LieGroup, Real, System};
use crate::Scalar;

/// Whether a system has rotations whose charts differ.
pub(crate) fn turns<Y: System>(system: &Y) -> bool {
    system.lie_joints().iter().any(|group| group.kind != LieGroup::SE2)
}

/// The middle of a step: half of its rotations.
#[derive(Clone, Debug)]
pub(crate) struct Middle<Y: System> {
    half: Y::Momenta,
    /// Displacement of the step's end, of rotations in the chart about its start.
    end: Y::Momenta,
    /// A displacement in another chart.
    at: Point<Y>,
}

impl<Y> Middle<Y>
where
    Y: System,
    Y::Scalar: Real,
{
    /// Makes it for one system.
    pub fn new(system: &Y) -> Self {
        Middle { half: system.zero_momenta(), end: system.zero_momenta(), at: Point::zero(system) }
    }

    /// Begins with stages in the chart about the start: the middle is half of the end `Σ wᵢ pᵢ`.
    pub fn begin(&mut self, system: &Y, weights: &[Y::Scalar], stages: &[Point<Y>]) {
        self.end(Y::Scalar::one(), weights, stages);
        self.halve(system);
    }

    /// Half of the end.
    fn halve(&mut self, system: &Y) {
        for group in system.lie_joints() {
            group.halve(self.end.as_ref(), self.half.as_mut());
        }
    }

    /// Rewrites a displacement and its rate from the chart about the start.
    pub fn enter(&mut self, system: &Y, x: &mut Y::Momenta, rate: &mut Y::Momenta) {
        let half = self.half.as_ref();
        self.at.x.as_mut().copy_from_slice(x.as_ref());
        for group in system.lie_joints() {
            group.about_middle(half, x.as_mut());
            group.rate_about_middle(half, self.at.x.as_ref(), x.as_ref(), rate.as_mut());
        }
    }

    /// Notes the end of the step, `factor Σ wᵢ pᵢ`.
    pub fn end(&mut self, factor: Y::Scalar, weights: &[Y::Scalar], points: &[Point<Y>]) {
        self.end.as_mut().fill(Y::Scalar::zero());
        for (w, point) in weights.iter().zip(points) {
            for (to, from) in self.end.as_mut().iter_mut().zip(point.x.as_ref()) {
                *to = *to + factor * *w * *from;
            }
        }
    }

    /// Rewrites the stages and the end for the chart about the start, then moves the middle to half of the end. So a
    /// move of the middle leaves the rotations of the stages where they are: an iteration that kept their numbers
    /// instead would converge for short steps only.
    pub fn leave(&mut self, system: &Y, stages: &mut [Point<Y>]) {
        let half = self.half.as_ref();
        for group in system.lie_joints() {
            stages.iter_mut().for_each(|z| group.about_start(half, z.x.as_mut()));
            group.about_start(half, self.end.as_mut());
        }
        self.halve(system);
    }

    /// The rotations of the end in the chart about the start, in place of those in `x`.
    pub fn give_end(&self, system: &Y, x: &mut Y::Momenta) {
        for group in system.lie_joints() {
            group.copy_rotation(self.end.as_ref(), x.as_mut());
        }
    }

    /// A displacement in the chart about the start, rewritten for that about the middle.
    pub fn seen_from(&mut self, system: &Y, point: &Point<Y>) -> &Point<Y> {
        self.at.copy_from(point);
        for group in system.lie_joints() {
            group.about_middle(self.half.as_ref(), self.at.x.as_mut());
        }
        &self.at
    }

    /// From the chart about the middle to that about the start.
    pub fn to_start(&self, system: &Y, x: &mut Y::Momenta) {
        for group in system.lie_joints() {
            group.about_start(self.half.as_ref(), x.as_mut());
        }
    }

    /// Places it at half of an end in the chart about the middle.
    pub fn place_half(&mut self, step: &Y::Momenta) {
        let half = Y::Scalar::constant(0.5);
        for (to, from) in self.half.as_mut().iter_mut().zip(step.as_ref()) {
            *to = half * *from;
        }
    }

    /// Rewrites the rates at the start and at the displacement `end` of a step from the chart about its start.
    pub fn rates_of_ends(&mut self, system: &Y, end: &Y::Momenta, [first, second]: [&mut Y::Momenta; 2]) {
        self.at.clear();
        self.at.p.as_mut().copy_from_slice(end.as_ref());
        for group in system.lie_joints() {
            let (half, zero) = (self.half.as_ref(), self.at.x.as_ref());
            group.rate_about_middle(half, zero, zero, first.as_mut());
            group.about_middle(half, self.at.p.as_mut());
            group.rate_about_middle(half, end.as_ref(), self.at.p.as_ref(), second.as_mut());
        }
    }
}
