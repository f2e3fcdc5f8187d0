//! The equations of Newton and Euler, body by body: the motion of every frame from base to tip, and the wrench that its
//! body needs for that motion.
//!
//! The acceleration of a frame's origin is the second derivative of its position as a vector, not a spatial
//! acceleration. No linear velocity is formed: an origin `r` away accelerates by `B r` more, `B = α× + ω×ω×`, and the
//! bodies' own wrenches are made of the entries of `B`.

use super::pass::{each_node, Sweep};
use super::{name, Inputs, Quantity, Sweeps, Trace};
use crate::lists::array;
use crate::spatial::{add3, cross, Axis, ElementaryTransform, Force, Motion, RigidInertia, Vec3};
use crate::tree::{Freedom, Kind, Node, Source};
use crate::workspace::Workspace;
use crate::Scalar;

/// Accelerations of the state's velocities in a sweep after Newton and Euler.
#[derive(Clone, Copy, Debug)]
pub enum Accelerations<'a, S> {
    /// All accelerations are zero.
    Zero,
    /// The given accelerations.
    Given(&'a [S]),
    /// For every freedom the value that makes the acceleration of its body along it zero, which leaves the fewest
    /// operations; zero for coordinates that joints share. Kept in
    /// [`Newton::reference`](crate::workspace::Newton::reference).
    Chosen,
}

impl<S: Scalar, T: Trace> Sweep<S, T> {
    /// Motion of all nodes at given velocities and the accelerations of [`Arguments::accelerations`], on a ground that
    /// accelerates against gravity.
    ///
    /// [`Arguments::accelerations`]: super::pass::Arguments::accelerations
    pub(super) const NEWTON: Self = Sweep {
        carried: |cx, i, visit| {
            let newton = &mut cx.w.newton;
            newton.spin[i].iter_mut().chain(&mut newton.alpha[i]).chain(&mut newton.accel[i]).for_each(visit);
        },
        ..each_node!(BaseToTip, |cx, i| cx.sweeps.newton_node(
            i,
            cx.given.second,
            cx.given.accelerations,
            &cx.given.inputs,
            cx.w
        ))
    };

    /// Wrench that every body needs for its motion beside the external ones.
    pub(super) const NEEDED_WRENCHES: Self = Sweep {
        begin: |cx| cx.sweeps.wrench_loads(&cx.given.inputs, cx.w),
        ..each_node!(BaseToTip, |cx, i| cx.sweeps.newton_wrench_node(i, cx.w))
    };
}

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Angular velocity, angular acceleration and acceleration of the origin of node `i`, in its own axes, after its
    /// parent.
    fn newton_node(&self, i: usize, v: &[S], a: Accelerations<S>, u: &Inputs<S>, w: &mut Workspace<S>) {
        let node = &self.tree.nodes[i];
        self.trace.at(Some(i), Quantity::Velocity);
        let mut m = self.classic_motion(node.parent, u, w);
        w.poses.steps.placing(i).iter().for_each(|step| m.carry(step));
        // A translation along the axis of a rotation is applied after it, where `B` is that of the body.
        let steps = w.poses.steps.own(i);
        let late = match (node.kind, steps.first()) {
            (Kind::Revolute | Kind::Helical { .. }, Some(ElementaryTransform::Shift { .. })) => Some(0),
            _ => None,
        };
        for (k, step) in steps.iter().enumerate() {
            if Some(k) != late {
                m.carry(step);
            }
        }
        let outer = m.spin;
        let mut joint = Motion::zero();
        for k in 0..node.kind.nv() {
            let rate = match node.source {
                Source::State { v: at, .. } => node.ratio * v[at + k],
                Source::Drive { v: at, .. } => node.ratio * u.drive_v[at + k],
            };
            w.velocity.rate[w.first[i] + k] = rate;
            joint = joint.plus(&node.kind.axis(k).motion(rate));
        }
        m.spin = add3(m.spin, joint.ang);
        self.trace.at(Some(i), Quantity::Acceleration);
        m.alpha = add3(m.alpha, cross(outer, joint.ang));
        m.accel = add3(m.accel, cross(add3(outer, m.spin), joint.lin));
        for k in 0..node.kind.nv() {
            w.newton.reference[w.first[i] + k] = m.accelerate(node, k, a, u);
        }
        late.into_iter().for_each(|k| m.carry(&steps[k]));
        (w.newton.spin[i], w.newton.alpha[i], w.newton.accel[i]) = (m.spin, m.alpha, m.accel);
        name::vector(self.trace, "spin", &m.spin);
        name::vector(self.trace, "alpha", &m.alpha);
        name::vector(self.trace, "accel", &m.accel);
    }

    /// Motion of a node after [`Sweeps::newton_node`], or of the ground.
    pub(super) fn classic_motion(&self, node: Option<usize>, u: &Inputs<S>, w: &Workspace<S>) -> ClassicMotion<S> {
        match node {
            Some(i) => ClassicMotion { spin: w.newton.spin[i], alpha: w.newton.alpha[i], accel: w.newton.accel[i] },
            None => ClassicMotion { spin: [S::zero(); 3], alpha: [S::zero(); 3], accel: u.gravity.map(|g| -g) },
        }
    }

    /// Wrench that the body of node `i` needs for its motion, less the external one, in [`Workspace::force`].
    fn newton_wrench_node(&self, i: usize, w: &mut Workspace<S>) {
        self.trace.at(Some(i), Quantity::Load);
        let motion = ClassicMotion { spin: w.newton.spin[i], alpha: w.newton.alpha[i], accel: w.newton.accel[i] };
        let needed = motion.wrench(self.inertia(&w.poses, i));
        name::force(self.trace, "f", &needed);
        w.force[i] = match self.tree.wrenches.is_empty() {
            true => needed,
            false => needed.minus(&w.loads.own[i]),
        };
    }
}

/// Motion of a frame in its own axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClassicMotion<S> {
    /// Angular velocity, rad/s.
    pub spin: Vec3<S>,
    /// Angular acceleration, rad/s².
    pub alpha: Vec3<S>,
    /// Acceleration of the origin, m/s²: the derivative of its velocity as a vector, not of components.
    pub accel: Vec3<S>,
}

impl<S: Scalar> ClassicMotion<S> {
    /// Motion of a frame that is fixed to this one.
    pub(super) fn carry(&mut self, step: &ElementaryTransform<S>) {
        match step {
            ElementaryTransform::Shift { axis, r } => {
                let (a, b, n) = axis.cyclic();
                let column = self.column(*axis);
                for k in [a, b, n] {
                    self.accel[k] = self.accel[k] + *r * column[k];
                }
            }
            _ => {
                self.spin = step.vector(self.spin);
                self.alpha = step.vector(self.alpha);
                self.accel = step.vector(self.accel);
            }
        }
    }

    /// `B e = α × e + ω × (ω × e)` of a unit vector.
    fn column(&self, axis: Axis) -> Vec3<S> {
        let (a, b, n) = axis.cyclic();
        let (w, alpha) = (&self.spin, &self.alpha);
        let mut column = [S::zero(); 3];
        column[a] = w[a] * w[n] + alpha[b];
        column[b] = w[b] * w[n] - alpha[a];
        column[n] = -(w[a] * w[a] + w[b] * w[b]);
        column
    }

    /// Adds the acceleration of freedom `k` of a node; gives it where it was chosen, else zero.
    fn accelerate(&mut self, node: &Node<S>, k: usize, a: Accelerations<S>, u: &Inputs<S>) -> S {
        let axis = node.kind.axis(k);
        let given = match (node.source, a) {
            (Source::Drive { v, .. }, _) => node.ratio * u.drive_a[v + k],
            (Source::State { v, .. }, Accelerations::Given(a)) => node.ratio * a[v + k],
            (_, Accelerations::Zero) => S::zero(),
            (_, Accelerations::Chosen) if node.elimination.unknown.is_some() && !node.elimination.deferred => S::zero(),
            (_, Accelerations::Chosen) => {
                let (part, z) = match axis {
                    Freedom::Unit(z) if z < 3 => (&mut self.accel, z),
                    Freedom::Unit(z) => (&mut self.alpha, z - 3),
                    Freedom::Screw(_) => (&mut self.alpha, 2),
                };
                let chosen = -part[z];
                part[z] = S::zero();
                if let Freedom::Screw(h) = axis {
                    self.accel[2] = self.accel[2] + h * chosen;
                }
                return chosen;
            }
        };
        let more = axis.motion(given);
        self.accel = add3(self.accel, more.lin);
        self.alpha = add3(self.alpha, more.ang);
        S::zero()
    }

    /// `[m a + B s; s × a + J α + ω × J ω]`, the products of the spin formed once and grouped by the entries of `J`.
    pub(super) fn wrench(&self, body: &RigidInertia<S>) -> Force<S> {
        let ([x, y, z], [ax, ay, az], a) = (self.spin, self.alpha, self.accel);
        let (m, s, [jxx, jxy, jxz, jyy, jyz, jzz]) = (body.mass, body.moment, body.inertia);
        let (xx, yy, zz, xy, xz, yz) = (x * x, y * y, z * z, x * y, x * z, y * z);
        let b = [[-(yy + zz), xy - az, xz + ay], [xy + az, -(xx + zz), yz - ax], [xz - ay, yz + ax, -(xx + yy)]];
        let lin = array(|k| m * a[k] + (b[k][0] * s[0] + b[k][1] * s[1] + b[k][2] * s[2]));
        let spin = [
            jxx * ax + (jzz - jyy) * yz - jxy * b[2][0] + jxz * b[1][0] + jyz * (yy - zz),
            jyy * ay + (jxx - jzz) * xz + jxy * b[2][1] - jyz * b[0][1] + jxz * (zz - xx),
            jzz * az + (jyy - jxx) * xy - jxz * b[1][2] + jyz * b[0][2] + jxy * (xx - yy),
        ];
        Force { lin, ang: add3(cross(s, a), spin) }
    }
}
