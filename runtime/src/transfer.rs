//! States carried over between models of the same bodies (6.4 of the thesis), for generated code.
//!
//! Joints that both models have keep their coordinates. A floating joint of the new model takes the pose and the velocity
//! of its child in its parent. The new conjugate momenta are those of the old motion in the new tree, `p' = Σ J'ᵀ h`,
//! over all bodies, with the momentum `h` of a body and the velocity Jacobian `J'` of its frame. A joint that is prescribed
//! in the new model has the old rate in this sum and none afterwards: that is the plastic impact by which it locks.

use crate::spatial::Mat3;
use crate::{Real, System};

/// A number of the new state is not finite: one of the old state or of an input is not. Nothing was changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotFinite;

impl core::fmt::Display for NotFinite {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the new state is not finite: are all numbers of the old one and of the inputs finite?")
    }
}

impl core::error::Error for NotFinite {}

/// A state of a mechanism as the state of another one of the same bodies, in which joints were cut, locked or released.
/// `mbd_model!` implements it for the types that it is asked for (`from = ...`).
pub trait TransferFrom<Old: System>: System {
    /// Coordinates and conjugate momenta of this mechanism where `old` has coordinates `q` (rad, m, unit quaternions) and
    /// velocities `v` (rad/s, m/s). Prescribed positions of this mechanism are set to where the bodies stand, their rates
    /// to zero, or, where `old` prescribes them too, to those of `old`; so are parameters. Other inputs keep their values.
    ///
    /// Joints that lock with a rate lock by a plastic impact; the energy that it takes is the difference of the kinetic
    /// energies.
    ///
    /// # Errors
    /// [`NotFinite`].
    #[allow(clippy::type_complexity)]
    fn transfer_from(
        &mut self,
        old: &Old,
        q: &Old::Coordinates,
        v: &Old::Momenta,
    ) -> Result<(Self::Coordinates, Self::Momenta), NotFinite>;
}

/// Pose and velocity of a frame: rotation to the axes of the ground, position in it (m), velocity of the origin (m/s)
/// and angular velocity (rad/s) in the frame's own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameMotion<S> {
    /// Its components to ground components.
    pub rotation: Mat3<S>,
    /// Origin, m.
    pub position: [S; 3],
    /// `[linear; angular]`, m/s and rad/s.
    pub velocity: [S; 6],
}

impl<S: Real> FrameMotion<S> {
    /// The ground itself.
    pub fn ground() -> Self {
        let (o, i) = (S::zero(), S::one());
        FrameMotion { rotation: [[i, o, o], [o, i, o], [o, o, i]], position: [o; 3], velocity: [o; 6] }
    }

    /// Coordinates and velocities of a floating joint that carries the frame `child` from this one: position (m) and unit
    /// quaternion (x, y, z, w); velocity of the child's origin and angular velocity in this frame, in the child's axes.
    pub fn floating(&self, child: &Self) -> ([S; 7], [S; 6]) {
        let turn: Mat3<S> = core::array::from_fn(|i| {
            core::array::from_fn(|j| (0..3).fold(S::zero(), |sum, k| sum + self.rotation[k][i] * child.rotation[k][j]))
        });
        let apart: [S; 3] = core::array::from_fn(|k| child.position[k] - self.position[k]);
        let place: [S; 3] =
            core::array::from_fn(|i| (0..3).fold(S::zero(), |sum, k| sum + self.rotation[k][i] * apart[k]));
        let [vx, vy, vz, wx, wy, wz] = self.velocity;
        let [x, y, z] = place;
        // Of the point of this frame at which the child's origin stands.
        let carried = [vx + (wy * z - wz * y), vy + (wz * x - wx * z), vz + (wx * y - wy * x), wx, wy, wz];
        let own = |part: usize, i: usize| {
            (0..3).fold(child.velocity[part + i], |rest, k| rest - turn[k][i] * carried[part + k])
        };
        let [a, b, c, d] = quaternion(&turn);
        ([x, y, z, a, b, c, d], core::array::from_fn(|k| own(k / 3 * 3, k % 3)))
    }
}

/// Unit quaternion `(x, y, z, w)` of a rotation matrix, from its largest component: no cancellation.
pub fn quaternion<S: Real>(r: &Mat3<S>) -> [S; 4] {
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = *r;
    let one = S::one();
    // Each row is four times one component times all of them.
    let rows = [
        [one + xx - yy - zz, xy + yx, xz + zx, zy - yz],
        [xy + yx, one - xx + yy - zz, yz + zy, xz - zx],
        [xz + zx, yz + zy, one - xx - yy + zz, yx - xy],
        [zy - yz, xz - zx, yx - xy, one + xx + yy + zz],
    ];
    let mut best = 3;
    for k in 0..3 {
        if rows[k][k] > rows[best][best] {
            best = k;
        }
    }
    let size = rows[best].iter().fold(S::zero(), |sum, x| sum + *x * *x).sqrt();
    rows[best].map(|x| x / size)
}

/// The frames that `write` writes.
pub fn frames<S: Real, const N: usize>(
    write: impl FnOnce(&mut [Mat3<S>; N], &mut [[S; 3]; N], &mut [[S; 6]; N]),
) -> [FrameMotion<S>; N] {
    let o = S::zero();
    let (mut rotation, mut position, mut velocity) = ([[[o; 3]; 3]; N], [[o; 3]; N], [[o; 6]; N]);
    write(&mut rotation, &mut position, &mut velocity);
    core::array::from_fn(|k| FrameMotion { rotation: rotation[k], position: position[k], velocity: velocity[k] })
}

/// That all numbers of a state are finite.
///
/// # Errors
/// [`NotFinite`].
pub fn finite<S: Real>(q: &[S], p: &[S]) -> Result<(), NotFinite> {
    match q.iter().chain(p).all(|x| x.is_finite()) {
        true => Ok(()),
        false => Err(NotFinite),
    }
}
