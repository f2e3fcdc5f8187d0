//! The regressor: joint forces as a linear function of the dynamic parameters, `τ = Y(q, v, v̇) π` (C. G. Atkeson, C.
//! H. An, J. M. Hollerbach, *Estimation of inertial parameters of manipulator loads and links*, IJRR 5(3), 1986).

use super::pass::{Arguments, Results, Sweep};
use super::{Accelerations, Inputs, Quantity, Sweeps, Trace};
use crate::lists::array;
use crate::spatial::RigidInertia;
use crate::tree::INERTIAL_PARAMETERS;
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Regressor `Y`, row by row: one row for each velocity, one column for each parameter of
    /// [`Tree::dynamic_parameters`](crate::tree::Tree::dynamic_parameters), in that order. The column of a damping is
    /// the velocity, that of a dry friction its sign.
    ///
    /// `Y π` are the joint forces that the motion takes, without springs, rotor inertias and external wrenches.
    pub fn regressor(&self, q: &[S], v: &[S], a: &[S], u: &Inputs<S>, w: &mut Workspace<S>, out: &mut [S]) {
        let given = Arguments { accelerations: Accelerations::Given(a), ..Arguments::new(q, v, u) };
        let mut cx = self.context(&given, w, Results::none());
        cx.articulate();
        cx.sweep([Sweep::NEWTON]);
        out.fill(S::zero());
        let (nv, columns) = (self.tree.dims.nv, self.tree.regressor_columns());
        let bodies = self.tree.frames.iter().take(self.tree.joint_nodes.len());
        for (body, frame) in bodies.enumerate() {
            let Some(motion) = self.classic_frame_motion(frame, w) else { continue };
            self.trace.at(frame.node, Quantity::Effort);
            let wrenches: [_; INERTIAL_PARAMETERS] = array(|k| motion.wrench(&RigidInertia::from_parameters(&unit(k))));
            self.jacobian_columns(frame, w, |v, column| {
                for (k, wrench) in wrenches.iter().enumerate() {
                    let along = (0..6).fold(S::zero(), |sum, c| sum + column[c] * wrench.get(c));
                    let entry = &mut out[v * columns + body * INERTIAL_PARAMETERS + k];
                    *entry = *entry + along;
                }
            });
        }
        let friction = self.tree.joint_nodes.len() * INERTIAL_PARAMETERS;
        self.trace.at(None, Quantity::Effort);
        for (k, v) in v.iter().enumerate().take(nv) {
            out[k * columns + friction + k] = *v;
            out[k * columns + friction + nv + k] = sign(*v);
        }
    }
}

/// The parameters of which one is 1 and the others are 0.
fn unit<S: Scalar>(k: usize) -> [S; INERTIAL_PARAMETERS] {
    array(|i| if i == k { S::one() } else { S::zero() })
}

/// −1, 0 or 1 up to rounding: 0 where the velocity is smaller than 1e-30 m/s or rad/s.
fn sign<S: Scalar>(v: S) -> S {
    let rest = S::constant(1e-30);
    v * v.reciprocal_above(rest) + v * (-v).reciprocal_above(rest)
}
