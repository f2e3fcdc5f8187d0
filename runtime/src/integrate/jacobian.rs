//! Derivatives of the rates in a chart.
//!
//! A system gives the derivatives of velocities and momentum rates by small displacements in body axes and by momenta
//! in body axes ([`Differentiable`]). In a chart that is all there is to it but for joints on groups: there the
//! displacement leads to the state, and the state's rates to those of the displacement, by the formulas of
//! [`super::lie_joint`]. These are run on [`Dual`] numbers, once for each of the at most 24 directions of a joint, and
//! give: how the state follows the displacement (`inner`), the rates of the displacement the velocities and momentum
//! rates (`outer`), and what the former depend on the displacement beside (`direct`). Then `J = outer · D · inner +
//! direct` with the system's derivatives `D`.

use super::chart::Point;
use super::field::Field;
use super::linear::Jacobian;
use crate::system::{Differentiable, LieJoint, Real};
use crate::{Dual, Scalar};

/// Coordinates and momenta of one joint, at most.
const NQ: usize = 7;
const NV: usize = 6;

type Table<S> = [[S; 2 * NV]; 2 * NV];

/// One joint about a state.
struct Joint<S> {
    /// The joint, with indices as if it were the first one.
    group: LieJoint,
    /// State of the chart, momenta in outer axes.
    base: ([S; NQ], [S; NV]),
    /// Displacement.
    x: [S; NV],
    dp: [S; NV],
    /// Velocities and momentum rates there, body axes.
    v: [S; NV],
    pd: [S; NV],
}

/// The first numbers of a slice.
fn first<S: Scalar, const N: usize>(from: &[S]) -> [S; N] {
    let mut out = [S::zero(); N];
    for (to, from) in out.iter_mut().zip(from) {
        *to = *from;
    }
    out
}

impl<S: Scalar> Joint<S> {
    fn new(group: &LieJoint, base: (&[S], &[S]), point: [&[S]; 2], rates: [&[S]; 2]) -> Self {
        let (q, v) = (group.q, group.v);
        Joint {
            group: LieJoint { q: 0, v: 0, ..*group },
            base: (first(&base.0[q..]), first(&base.1[v..])),
            x: first(&point[0][v..]),
            dp: first(&point[1][v..]),
            v: first(&rates[0][v..]),
            pd: first(&rates[1][v..]),
        }
    }

    /// Numbers with derivatives along component `k` of the four vectors one after the other, each of `nv`.
    fn along(&self, k: usize) -> Joint<Dual<S>> {
        let nv = self.group.kind.sizes().1;
        let still = |x: S| Dual::new(x, S::zero());
        let moved = |from: &[S; NV], start: usize| {
            let mut to = from.map(still);
            if let Some(x) = k.checked_sub(start).filter(|k| *k < nv).and_then(|k| to.get_mut(k)) {
                x.du = S::one();
            }
            to
        };
        Joint {
            group: self.group,
            base: (self.base.0.map(still), self.base.1.map(still)),
            x: moved(&self.x, 0),
            dp: moved(&self.dp, nv),
            v: moved(&self.v, 2 * nv),
            pd: moved(&self.pd, 3 * nv),
        }
    }

    /// The state.
    fn state(&self) -> ([S; NQ], [S; NV]) {
        let (mut q, mut p) = self.base;
        for (q, x) in q.iter_mut().zip(&self.x).take(self.group.kind.positions()) {
            *q = *q + *x;
        }
        self.group.displace(&self.base.0, &self.x, &mut q);
        for (p, dp) in p.iter_mut().zip(&self.dp) {
            *p = *p + *dp;
        }
        self.group.inward(&q, self.group.shift(&self.x), &mut p);
        (q, p)
    }

    /// Rates of the displacement.
    fn rates(&self) -> ([S; NV], [S; NV]) {
        let (q, p) = self.state();
        let (mut xd, mut pd) = ([S::zero(); NV], self.pd);
        self.group.rates_of_velocity(&self.x, (&q, &p), &self.v, &mut xd, &mut pd);
        (xd, pd)
    }

    /// `inner`, `outer`, `direct` as above; rows and columns of the second half start at `nv`.
    fn tables(&self) -> [Table<S>; 3] {
        let nv = self.group.kind.sizes().1;
        let mut tables = [[[S::zero(); 2 * NV]; 2 * NV]; 3];
        let [inner, outer, direct] = &mut tables;
        let fill = |table: &mut Table<S>, k: usize, x: [S; NV], p: [S; NV]| {
            for (i, value) in x.into_iter().take(nv).chain(p.into_iter().take(nv)).enumerate() {
                table[i][k] = value;
            }
        };
        for k in 0..2 * nv {
            let joint = self.along(k);
            let (q, p) = joint.state();
            let mut body = [S::zero(); NV];
            self.group.body(&q.map(|q| q.re), &q.map(|q| q.du), &mut body);
            fill(inner, k, body, p.map(|p| p.du));
            let (xd, pd) = joint.rates();
            fill(direct, k, xd.map(|x| x.du), pd.map(|p| p.du));
            let (xd, pd) = self.along(2 * nv + k).rates();
            fill(outer, k, xd.map(|x| x.du), pd.map(|p| p.du));
        }
        tables
    }
}

impl<Y> Field<Y>
where
    Y: Differentiable,
    Y::Scalar: Real,
{
    /// Rates of the displacement at time `t` (s) and displacement `point`, and their derivatives by the displacement.
    pub(super) fn linearise(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        point: &Point<Y>,
        rate: &mut Point<Y>,
        jacobian: &mut Jacobian<Y>,
    ) {
        self.chart.state(system, point, &mut self.q, &mut self.p);
        self.stored = false;
        system.rate_derivatives(t, &self.q, &self.p, jacobian);
        rate.x.as_mut().copy_from_slice(jacobian.v.as_ref());
        rate.p.as_mut().copy_from_slice(jacobian.pd.as_ref());
        for group in system.lie_joints() {
            let joint = Joint::new(group, self.chart.held(), point.parts(), rate.parts());
            let (n, v) = (group.kind.sizes().1, group.v);
            let (xd, pd) = joint.rates();
            rate.x.as_mut()[v..v + n].copy_from_slice(&xd[..n]);
            rate.p.as_mut()[v..v + n].copy_from_slice(&pd[..n]);
            let [inner, outer, direct] = joint.tables();
            columns::<Y>(jacobian, v, n, &inner);
            rows::<Y>(jacobian, v, n, &outer);
            for (half, rows) in jacobian.blocks_mut().into_iter().enumerate() {
                for (other, block) in rows.into_iter().enumerate() {
                    for (i, row) in block.as_mut()[v..v + n].iter_mut().enumerate() {
                        for (j, x) in row.as_mut()[v..v + n].iter_mut().enumerate() {
                            *x = *x + direct[half * n + i][other * n + j];
                        }
                    }
                }
            }
        }
    }
}

/// `J ← J table` on the columns of a joint.
fn columns<Y: Differentiable>(jacobian: &mut Jacobian<Y>, v: usize, n: usize, table: &Table<Y::Scalar>) {
    for [left, right] in jacobian.blocks_mut() {
        for (left, right) in left.as_mut().iter_mut().zip(right.as_mut()) {
            let (left, right) = (&mut left.as_mut()[v..v + n], &mut right.as_mut()[v..v + n]);
            let mut old = [Y::Scalar::zero(); 2 * NV];
            old[..n].copy_from_slice(left);
            old[n..2 * n].copy_from_slice(right);
            for (j, x) in left.iter_mut().chain(right).enumerate() {
                *x = (0..2 * n).fold(Y::Scalar::zero(), |sum, k| sum + old[k] * table[k][j]);
            }
        }
    }
}

/// `J ← table J` on the rows of a joint.
fn rows<Y: Differentiable>(jacobian: &mut Jacobian<Y>, v: usize, n: usize, table: &Table<Y::Scalar>) {
    let [[a, b], [c, d]] = jacobian.blocks_mut();
    for (top, bottom) in [(a, c), (b, d)] {
        for j in 0..top.as_ref().len() {
            let mut old = [Y::Scalar::zero(); 2 * NV];
            for k in 0..n {
                old[k] = top.as_ref()[v + k].as_ref()[j];
                old[n + k] = bottom.as_ref()[v + k].as_ref()[j];
            }
            let row = |i: usize| (0..2 * n).fold(Y::Scalar::zero(), |sum, k| sum + table[i][k] * old[k]);
            for k in 0..n {
                top.as_mut()[v + k].as_mut()[j] = row(k);
                bottom.as_mut()[v + k].as_mut()[j] = row(n + k);
            }
        }
    }
}
