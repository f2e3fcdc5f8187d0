//! Centre of mass, centroidal momentum matrix and its bias (D. E. Orin, A. Goswami, S.-H. Lee, *Centroidal dynamics of
//! a humanoid robot*, Autonomous Robots 35, 2013).

use super::pass::{Arguments, Results, Sweep};
use super::{Inputs, Quantity, Sweeps, Trace};
use crate::lists::array;
use crate::spatial::{add3, cross, dot3, Force, Vec3};
use crate::tree::Source;
use crate::workspace::Workspace;
use crate::Scalar;

impl<S: Scalar, T: Trace> Sweeps<'_, S, T> {
    /// Centre of mass `c` in the ground (3 numbers, m), centroidal momentum matrix `A` (`6 × nv`, row by row) and bias
    /// (6 numbers), on a tree that was not regrouped.
    ///
    /// `A v` is the momentum `[linear; angular]` of all bodies about `c`, in ground axes, as far as it comes from `v`
    /// (prescribed rates add theirs). It changes at the rate `A v̇ + bias`; the bias includes prescribed accelerations.
    /// Bodies that are fixed to the ground do not count, and neither do rotor inertias.
    pub fn centroidal(
        &self,
        q: &[S],
        v: &[S],
        u: &Inputs<S>,
        w: &mut Workspace<S>,
        center: &mut [S],
        matrix: &mut [S],
        bias: &mut [S],
    ) {
        // Without gravity and external wrenches, Newton's and Euler's equations give the rate of the momentum alone.
        let weightless = Inputs { gravity: [S::zero(); 3], wrenches: &[], ..*u };
        let given = Arguments::new(q, v, &weightless);
        let mut cx = self.context(&given, w, Results::none());
        cx.articulate();
        cx.sweep([Sweep::MOMENT, Sweep::PLACEMENT, Sweep::NEWTON, Sweep::NEEDED_WRENCHES, Sweep::TRANSMITTED]);
        let com = self.center_of_mass(w);
        center.copy_from_slice(&com);
        self.centroidal_matrix(com, w, matrix);
        self.trace.at(None, Quantity::Load);
        let roots = (0..self.tree.nodes.len()).filter(|&i| self.tree.nodes[i].parent.is_none());
        let total = roots.fold(Force::zero(), |sum, i| sum.plus(&self.steps(&w.poses, i).force(w.force[i])));
        bias.copy_from_slice(&about(com, &total));
    }

    /// Centre of all moving mass in the ground, after [`Sweep::MOMENT`].
    fn center_of_mass(&self, w: &Workspace<S>) -> Vec3<S> {
        self.trace.at(None, Quantity::Placement);
        let roots = self.tree.nodes.iter().zip(&w.loads.mass).filter(|(node, _)| node.parent.is_none());
        let mass = roots.fold(S::zero(), |sum, (_, m)| sum + *m);
        // Rotors alone may resist every freedom: then there is no mass and no centre.
        let inverse = mass.reciprocal_above(S::zero());
        w.loads.ground_moment.map(|s| inverse * s)
    }

    /// Momentum about `com` for a unit of every velocity: that of the bodies outboard of its freedoms, whose composite
    /// inertias are summed from tip to base.
    fn centroidal_matrix(&self, com: Vec3<S>, w: &mut Workspace<S>, out: &mut [S]) {
        out.fill(S::zero());
        for i in 0..self.tree.nodes.len() {
            w.factor.m[i] = self.inertia(&w.poses, i).articulated();
        }
        for i in (0..self.tree.nodes.len()).rev() {
            let node = &self.tree.nodes[i];
            self.trace.at(Some(i), Quantity::Momentum);
            if let Source::State { v, .. } = node.source {
                let arm = array(|c| w.position[i][c] - com[c]);
                for k in 0..node.kind.nv() {
                    let momentum = w.factor.m[i].times(&node.kind.axis(k).motion(node.ratio));
                    let turned = |x: Vec3<S>| w.rotation[i].map(|row| dot3(row, x));
                    let lin = turned(momentum.lin);
                    let column = [lin, add3(turned(momentum.ang), cross(arm, lin))];
                    for (row, x) in column.into_iter().flatten().enumerate() {
                        let entry = &mut out[row * self.tree.dims.nv + v + k];
                        *entry = *entry + x;
                    }
                }
            }
            self.add_composite(i, w);
        }
    }
}

/// A force or momentum `[linear; angular]` about `point`, of one about the origin.
fn about<S: Scalar>(point: Vec3<S>, f: &Force<S>) -> [S; 6] {
    let moment = cross(point, f.lin);
    [f.lin[0], f.lin[1], f.lin[2], f.ang[0] - moment[0], f.ang[1] - moment[1], f.ang[2] - moment[2]]
}
