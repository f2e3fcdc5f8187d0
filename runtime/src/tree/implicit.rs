//! Springs and dampers of joints that a step takes implicitly.

use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

use super::{Passive, Source, Tree};
use crate::system::Real;
use crate::Scalar;

impl<S: Scalar> Passive<S> {
    /// What a spring and a damper add to the inertia in a step of `h` s by the implicit midpoint rule, kg m² or kg:
    /// `d h/2 + k h²/4`. A change `Δ` of the velocity in the step changes the damper's velocity in its middle by `Δ/2`,
    /// and the spring's length there by `Δ h/4`.
    pub fn implicit_inertia(&self, step: S) -> S {
        let half = S::constant(0.5) * step;
        half * self.damping + half * half * self.stiffness
    }

    /// The same elements with a rotor that has this inertia too.
    #[must_use]
    pub fn with_implicit_inertia(self, step: S) -> Self {
        Passive { armature: self.armature + self.implicit_inertia(step), ..self }
    }
}

impl<S: Real> Tree<S> {
    /// Whether any joint that moves freely has a spring or a damper.
    pub fn has_springs_or_dampers(&self) -> bool {
        let free = self.nodes.iter().filter(|node| matches!(node.source, Source::State { .. }));
        free.flat_map(|node| &node.passive).any(|p| p.damping != S::zero() || p.stiffness != S::zero())
    }
}

impl<S: Scalar> Tree<S> {
    /// The tree whose rotors have the inertia of springs and dampers too: [`Passive::implicit_inertia`].
    #[must_use]
    pub fn with_implicit_springs(mut self, step: S) -> Self {
        for passive in self.nodes.iter_mut().flat_map(|node| &mut node.passive) {
            *passive = passive.with_implicit_inertia(step);
        }
        self.accelerations = self.accelerations.map(|other| Box::new(other.with_implicit_springs(step)));
        self
    }

    /// What [`Tree::with_implicit_springs`] adds to the diagonal of the inertia, for each velocity.
    pub fn implicit_inertias(&self, step: S) -> Vec<S> {
        self.by_velocity(|passive| passive.implicit_inertia(step))
    }

    /// Stiffness of the springs at each velocity, N m/rad or N/m.
    pub fn stiffnesses(&self) -> Vec<S> {
        self.by_velocity(|passive| passive.stiffness)
    }

    /// Sum over the nodes that each velocity moves.
    fn by_velocity(&self, of: impl Fn(&Passive<S>) -> S) -> Vec<S> {
        let mut all = vec![S::zero(); self.dims.nv];
        for node in &self.nodes {
            let Source::State { v, .. } = node.source else { continue };
            for (sum, passive) in all[v..].iter_mut().zip(&node.passive) {
                *sum = *sum + node.ratio * node.ratio * of(passive);
            }
        }
        all
    }
}
