//! Dense linear equations of twice as many unknowns as there are velocities: LU factors with partial pivoting.
//!
//! A matrix is stored in four blocks of the type of the derivatives, so that it needs no heap; a vector is a [`Point`].
//! Real and complex matrices share the code: an element is `[S; C]`, with `C` parts.

use super::chart::Point;
use crate::system::{Differentiable, Real, StateDerivatives, System};
use crate::Scalar;

/// A matrix of `2 nv` rows and columns; coordinates before momenta.
#[derive(Clone, Debug)]
pub(super) struct Matrix<Y: Differentiable> {
    pub(super) blocks: [[Y::Square; 2]; 2],
}

impl<Y: Differentiable> Matrix<Y> {
    pub(super) fn zero(system: &Y) -> Self {
        let square = || system.square();
        Matrix { blocks: [[square(), square()], [square(), square()]] }
    }

    /// Number of velocities.
    fn half(&self) -> usize {
        let [[block, _], _] = &self.blocks;
        block.as_ref().len()
    }

    /// Both halves of a row. The index is never beyond the last row, but the code must not contain a panic path for
    /// firmware.
    #[inline]
    fn row(&self, i: usize) -> Option<[&[Y::Scalar]; 2]> {
        let (nv, [top, bottom]) = (self.half(), &self.blocks);
        let ([left, right], i) = if i < nv { (top, i) } else { (bottom, i - nv) };
        Some([left.as_ref().get(i)?.as_ref(), right.as_ref().get(i)?.as_ref()])
    }

    #[inline]
    fn row_mut(&mut self, i: usize) -> Option<[&mut [Y::Scalar]; 2]> {
        let nv = self.half();
        let [top, bottom] = &mut self.blocks;
        let ([left, right], i) = if i < nv { (top, i) } else { (bottom, i - nv) };
        Some([left.as_mut().get_mut(i)?.as_mut(), right.as_mut().get_mut(i)?.as_mut()])
    }

    #[inline]
    fn get(&self, i: usize, j: usize) -> Y::Scalar {
        self.row(i).map_or(Y::Scalar::zero(), |row| component(row, j))
    }

    #[inline]
    fn put(&mut self, i: usize, j: usize, value: Y::Scalar) {
        if let Some(row) = self.row_mut(i) {
            put(row, j, value);
        }
    }

    /// Sets row `i` to the components of a point.
    fn put_row(&mut self, i: usize, point: &Point<Y>) {
        if let Some(row) = self.row_mut(i) {
            for (to, from) in row.into_iter().zip(point.parts()) {
                to.copy_from_slice(from);
            }
        }
    }
}

/// The derivatives of a system's rates, in the chart of a [`Field`](super::Field).
pub(super) type Jacobian<Y> = StateDerivatives<<Y as System>::Momenta, <Y as Differentiable>::Square>;

/// `out = J · vector`.
#[cfg(test)]
pub(super) fn times<Y: Differentiable>(jacobian: &Jacobian<Y>, vector: &Point<Y>, out: &mut Point<Y>) {
    for (rows, out) in jacobian.blocks().into_iter().zip(out.parts_mut()) {
        out.fill(Y::Scalar::zero());
        for (block, x) in rows.into_iter().zip(vector.parts()) {
            for (out, row) in out.iter_mut().zip(block.as_ref()) {
                *out = *out + dot(row.as_ref(), x);
            }
        }
    }
}

#[inline]
fn component<S: Scalar>([x, p]: [&[S]; 2], i: usize) -> S {
    x.get(i).or_else(|| p.get(i.wrapping_sub(x.len()))).copied().unwrap_or(S::zero())
}

#[inline]
fn put<S: Scalar>([x, p]: [&mut [S]; 2], i: usize, value: S) {
    let nv = x.len();
    if let Some(to) = if i < nv { x.get_mut(i) } else { p.get_mut(i - nv) } {
        *to = value;
    }
}

#[inline]
fn dot<S: Scalar>(a: &[S], b: &[S]) -> S {
    // Four partial sums, because a single one would wait for its own latency.
    let mut sums = [S::zero(); 4];
    let (mut a, mut b) = (a.chunks_exact(4), b.chunks_exact(4));
    for (a, b) in a.by_ref().zip(b.by_ref()) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum = *sum + *a * *b;
        }
    }
    let [s0, s1, s2, s3] = sums;
    let rest = a.remainder().iter().zip(b.remainder()).fold(S::zero(), |sum, (a, b)| sum + *a * *b);
    ((s0 + s1) + (s2 + s3)) + rest
}

#[inline]
fn subtract<S: Scalar>(to: &mut [S], factor: S, from: &[S]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = *to - factor * *from;
    }
}

/// Product of elements.
#[inline]
fn product<S: Scalar, const C: usize>(a: [S; C], b: [S; C]) -> [S; C] {
    let mut out = a;
    if C == 2 {
        out[0] = a[0] * b[0] - a[1] * b[1];
        out[1] = a[0] * b[1] + a[1] * b[0];
    } else {
        out[0] = a[0] * b[0];
    }
    out
}

#[inline]
fn inverse<S: Scalar, const C: usize>(a: [S; C]) -> [S; C] {
    let mut out = a;
    if C == 2 {
        let size = a[0] * a[0] + a[1] * a[1];
        out[0] = a[0] / size;
        out[1] = -(a[1] / size);
    } else {
        out[0] = S::one() / a[0];
    }
    out
}

/// LU factors of `1 − w J`, with a real (`C = 1`) or complex (`C = 2`) number `w`.
#[derive(Clone, Debug)]
pub(super) struct Lu<Y: Differentiable, const C: usize> {
    /// `L` below the diagonal, `U` above, inverses of the pivots on it.
    parts: [Matrix<Y>; C],
    /// For each row, the later row with which it was exchanged.
    exchanged: Point<Y>,
    /// A row that is at work, and one that waits.
    pivot: [Point<Y>; C],
    spare: [Point<Y>; C],
}

impl<Y, const C: usize> Lu<Y, C>
where
    Y: Differentiable,
    Y::Scalar: Real,
{
    pub(super) fn new(system: &Y) -> Self {
        let points = || core::array::from_fn(|_| Point::zero(system));
        Lu {
            parts: core::array::from_fn(|_| Matrix::zero(system)),
            exchanged: Point::zero(system),
            pivot: points(),
            spare: points(),
        }
    }

    /// Factors `1 − w J`.
    ///
    /// # Errors
    /// The first column without a pivot: all zero, or not numbers.
    pub(super) fn factor(&mut self, w: [Y::Scalar; C], jacobian: &Jacobian<Y>) -> Result<(), usize> {
        for (part, w) in self.parts.iter_mut().zip(w) {
            for (to, from) in part.blocks.iter_mut().flatten().zip(jacobian.blocks().into_iter().flatten()) {
                for (to, from) in to.as_mut().iter_mut().zip(from.as_ref()) {
                    for (to, from) in to.as_mut().iter_mut().zip(from.as_ref()) {
                        *to = -(w * *from);
                    }
                }
            }
        }
        let n = 2 * jacobian.v.as_ref().len();
        if let Some(real) = self.parts.first_mut() {
            for i in 0..n {
                real.put(i, i, Y::Scalar::one() + real.get(i, i));
            }
        }
        (0..n).try_for_each(|k| self.eliminate(k, n))
    }

    fn element(&self, i: usize, j: usize) -> [Y::Scalar; C] {
        let mut out = [Y::Scalar::zero(); C];
        for (out, part) in out.iter_mut().zip(&self.parts) {
            *out = part.get(i, j);
        }
        out
    }

    /// Brings the row with the largest element of column `k` to its place, and clears the column below.
    fn eliminate(&mut self, k: usize, n: usize) -> Result<(), usize> {
        let (mut best, mut largest) = (k, Y::Scalar::zero());
        for i in k..n {
            let size = self.element(i, k).into_iter().fold(Y::Scalar::zero(), |sum, x| sum + x.abs());
            if size > largest {
                (best, largest) = (i, size);
            }
        }
        // A pivot that is not a number is never larger.
        if !(largest > Y::Scalar::zero() && largest.is_finite()) {
            return Err(k);
        }
        let [x, p] = self.exchanged.parts_mut();
        put([x, p], k, Y::Scalar::from_index(best));
        self.copy_row(best, false);
        if best != k {
            self.copy_row(k, true);
            for ((part, pivot), spare) in self.parts.iter_mut().zip(&self.pivot).zip(&self.spare) {
                part.put_row(best, spare);
                part.put_row(k, pivot);
            }
        }
        let inverse = inverse(self.element(k, k));
        for (part, inverse) in self.parts.iter_mut().zip(inverse) {
            part.put(k, k, inverse);
        }
        for i in k + 1..n {
            let factor = product(self.element(i, k), inverse);
            for (part, factor) in self.parts.iter_mut().zip(factor) {
                part.put(i, k, factor);
            }
            self.reduce(i, k, factor);
        }
        Ok(())
    }

    fn copy_row(&mut self, i: usize, spare: bool) {
        let to = if spare { &mut self.spare } else { &mut self.pivot };
        for (to, part) in to.iter_mut().zip(&self.parts) {
            if let Some(row) = part.row(i) {
                for (to, from) in to.parts_mut().into_iter().zip(row) {
                    to.copy_from_slice(from);
                }
            }
        }
    }

    /// Row `i` less a multiple of the pivot's row, right of column `k`.
    #[inline]
    fn reduce(&mut self, i: usize, k: usize, factor: [Y::Scalar; C]) {
        for (a, part) in self.parts.iter_mut().enumerate() {
            let nv = part.half();
            let starts = [(k + 1).min(nv), (k + 1).saturating_sub(nv)];
            let Some(row) = part.row_mut(i) else { continue };
            for (half, (row, start)) in row.into_iter().zip(starts).enumerate() {
                let row = row.get_mut(start..).unwrap_or(&mut []);
                for (b, (pivot, factor)) in self.pivot.iter().zip(part_of(factor, a)).enumerate() {
                    debug_assert!(b < C);
                    let from = pivot.parts().into_iter().nth(half).and_then(|from| from.get(start..));
                    subtract(row, factor, from.unwrap_or(&[]));
                }
            }
        }
    }

    /// Solves for a right side, in place; as many points as an element has parts.
    pub(super) fn solve(&self, b: &mut [Point<Y>; C]) {
        let n = self.exchanged.parts().into_iter().fold(0, |n, part| n + part.len());
        for k in 0..n {
            let other = component(self.exchanged.parts(), k).index();
            if other != k {
                for b in b.iter_mut() {
                    let (x, y) = (component(b.parts(), k), component(b.parts(), other));
                    put(b.parts_mut(), k, y);
                    put(b.parts_mut(), other, x);
                }
            }
        }
        for i in 0..n {
            let value = self.remainder(i, (0, i), b);
            self.set(b, i, value);
        }
        for i in (0..n).rev() {
            let value = product(self.remainder(i, (i + 1, n), b), self.element(i, i));
            self.set(b, i, value);
        }
    }

    fn set(&self, b: &mut [Point<Y>; C], i: usize, value: [Y::Scalar; C]) {
        for (b, value) in b.iter_mut().zip(value) {
            put(b.parts_mut(), i, value);
        }
    }

    /// Component `i` of `b` less the products of row `i`'s columns from a first one to one before a last.
    #[inline]
    fn remainder(&self, i: usize, (first, last): (usize, usize), b: &[Point<Y>; C]) -> [Y::Scalar; C] {
        let mut out = [Y::Scalar::zero(); C];
        for (out, b) in out.iter_mut().zip(b) {
            *out = component(b.parts(), i);
        }
        for (m, part) in self.parts.iter().enumerate() {
            let nv = part.half();
            let Some(row) = part.row(i) else { continue };
            let ranges = [(first.min(nv), last.min(nv)), (first.saturating_sub(nv), last.saturating_sub(nv))];
            for (l, b) in b.iter().enumerate() {
                let mut sum = Y::Scalar::zero();
                for ((row, b), (from, to)) in row.into_iter().zip(b.parts()).zip(ranges) {
                    let (row, b) = (row.get(from..to).unwrap_or(&[]), b.get(from..to).unwrap_or(&[]));
                    sum = sum + dot(row, b);
                }
                // Part of the product that parts m and l make.
                match (m, l) {
                    (0, 0) => out[0] = out[0] - sum,
                    (1, 1) => out[0] = out[0] + sum,
                    _ => out[C - 1] = out[C - 1] - sum,
                }
            }
        }
        out
    }
}

/// Factors of the parts of an element in part `a` of its product with another one.
#[inline]
fn part_of<S: Scalar, const C: usize>(factor: [S; C], a: usize) -> [S; C] {
    let mut out = factor;
    if C == 2 {
        out = match a {
            // Real: fr·r − fi·i. Imaginary: fi·r + fr·i.
            0 => [factor[0]; C],
            _ => [factor[1]; C],
        };
        out[1] = if a == 0 { -factor[1] } else { factor[0] };
    }
    out
}
