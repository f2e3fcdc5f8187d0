//! Weights of the stages of explicit methods.

use crate::constant::Constant;

/// Rows of weights that are not zero, with the stages that they belong to: `N` rows of at most `S`. They are computed at compile
/// time, so that they are not in writable memory. Every part is a table of its own, and the image of a small processor holds
/// those parts that its number type reads.
#[derive(Clone, Copy, Debug)]
pub struct Weights<const S: usize, const N: usize> {
    /// How many weights each row has.
    pub(super) len: &'static [u8; N],
    /// Their stages.
    pub(super) stage: &'static [[u8; S]; N],
    /// The nearest doubles.
    pub(super) hi: &'static [[f64; S]; N],
    /// The remainders.
    pub(super) lo: &'static [[f64; S]; N],
    /// The nearest numbers of single precision.
    pub(super) single: &'static [[f32; S]; N],
}

/// One row of [`Weights`].
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    stage: &'a [u8],
    hi: &'a [f64],
    lo: &'a [f64],
    single: &'a [f32],
}

/// [`Weights`] of the rows of an expression, of which there may be fewer than the type has: the others are empty.
macro_rules! weights {
    ($rows:expr) => {
        $crate::integrate::weights::Weights {
            len: &$crate::integrate::weights::len($rows),
            stage: &$crate::integrate::weights::stage($rows),
            hi: &$crate::integrate::weights::hi($rows),
            lo: &$crate::integrate::weights::lo($rows),
            single: &$crate::integrate::weights::single($rows),
        }
    };
}
pub(super) use weights;

/// Functions that make one part each: in row `row`, `len[row]` numbers of the weights that are not zero.
macro_rules! parts {
    ($($(#[$doc:meta])* $part:ident $number:ty, $zero:literal, |$stage:ident, $weight:ident| $value:expr;)*) => {$(
        $(#[$doc])*
        pub(super) const fn $part<const S: usize, const N: usize>(rows: &[[Constant; S]]) -> [[$number; S]; N] {
            let mut out = [[$zero; S]; N];
            let mut row = 0;
            while row < rows.len() {
                let (mut $stage, mut n) = (0, 0);
                while $stage < S {
                    let $weight = rows[row][$stage];
                    if !$weight.is_zero() {
                        out[row][n] = $value;
                        n += 1;
                    }
                    $stage += 1;
                }
                row += 1;
            }
            out
        }
    )*};
}

parts! {
    /// The stages.
    stage u8, 0, |stage, weight| stage as u8;
    /// The nearest doubles.
    hi f64, 0.0, |stage, weight| weight.hi();
    /// The remainders.
    lo f64, 0.0, |stage, weight| weight.lo();
    /// The nearest numbers of single precision.
    single f32, 0.0, |stage, weight| weight.single();
}

/// How many weights of each row are not zero.
pub(super) const fn len<const S: usize, const N: usize>(rows: &[[Constant; S]]) -> [u8; N] {
    let mut out = [0; N];
    let mut row = 0;
    while row < rows.len() {
        let mut stage = 0;
        while stage < S {
            out[row] += !rows[row][stage].is_zero() as u8;
            stage += 1;
        }
        row += 1;
    }
    out
}

impl<const S: usize, const N: usize> Weights<S, N> {
    /// Row `i`; an empty one beyond the last.
    #[inline(always)]
    pub(super) fn row(self, i: usize) -> Row<'static> {
        let len = self.len.get(i).map_or(0, |n| usize::from(*n));
        Row {
            stage: self.stage.get(i).and_then(|row| row.get(..len)).unwrap_or_default(),
            hi: self.hi.get(i).map_or(&[], |row| row),
            lo: self.lo.get(i).map_or(&[], |row| row),
            single: self.single.get(i).map_or(&[], |row| row),
        }
    }
}

impl Row<'_> {
    /// The stages and their weights.
    #[inline(always)]
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, Constant)> + '_ {
        let parts = self.stage.iter().zip(self.hi).zip(self.lo).zip(self.single);
        parts.map(|(((stage, hi), lo), single)| (usize::from(*stage), Constant::of_parts(*hi, *lo, *single)))
    }
}
