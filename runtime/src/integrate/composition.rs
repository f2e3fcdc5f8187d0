//! Symmetric compositions of symmetric methods.

use super::chart::{Chart, Point};
use super::constant::{decimal, Constant};
use super::field::Field;
use super::stepper::{hermite, Statistics, Stepper};
use super::StepError;
use crate::system::{Real, System};
use crate::Scalar;

/// Lengths `γᵢ` of `S` steps, relative to the whole, the same from both ends.
///
/// All as in E. Hairer, C. Lubich, G. Wanner, *Geometric Numerical Integration*, 2006, V.3.2.
#[derive(Clone, Copy, Debug)]
pub struct Symmetric<const S: usize> {
    /// Order of the composition of a symmetric method of order 2.
    pub order: u32,
    /// The first half of them; the one in the middle is what is left of 1.
    half: &'static [Constant],
}

impl Symmetric<3> {
    /// Order 4 in three steps, the triple jump (II.4.4): `1 / (2 − 2^(1/3))`. H. Yoshida, *Construction of higher order
    /// symplectic integrators*, Physics Letters A 150, 1990; M. Suzuki, the same volume's year.
    pub const YOSHIDA_4: Self = Symmetric { order: 4, half: &[decimal("1.3512071919596576340476878089714608269")] };
}

impl Symmetric<5> {
    /// Order 4 in five steps (II.4.5): `1 / (4 − 4^(1/3))`. M. Suzuki, *Fractal decomposition of exponential operators*,
    /// Physics Letters A 146, 1990. Errors are far below those of the triple jump.
    pub const SUZUKI_4: Self = {
        const OUTER: Constant = decimal("0.41449077179437573714235406286076149571");
        Symmetric { order: 4, half: &[OUTER, OUTER] }
    };
}

impl Symmetric<7> {
    /// Order 6 in seven steps (V.3.11), solution A of H. Yoshida, Physics Letters A 150, 1990.
    pub const YOSHIDA_6: Self = Symmetric {
        order: 6,
        half: &[
            decimal("0.78451361047755726381949763"),
            decimal("0.23557321335935813368479318"),
            decimal("-1.17767998417887100694641568"),
        ],
    };
}

impl Symmetric<9> {
    /// Order 6 in nine steps (V.3.12). W. Kahan, R.-C. Li, *Composition constants for raising the orders of unconventional
    /// schemes for ordinary differential equations*, Mathematics of Computation 66, 1997.
    pub const KAHAN_LI_6: Self = Symmetric {
        order: 6,
        half: &[
            decimal("0.39216144400731413927925056"),
            decimal("0.33259913678935943859974864"),
            decimal("-0.70624617255763935980996482"),
            decimal("0.08221359629355080023149045"),
        ],
    };
}

impl Symmetric<17> {
    /// Order 8 in seventeen steps (V.3.14), of the same paper.
    pub const KAHAN_LI_8: Self = Symmetric {
        order: 8,
        half: &[
            decimal("0.13020248308889008087881763"),
            decimal("0.56116298177510838456196441"),
            decimal("-0.38947496264484728640807860"),
            decimal("0.15884190655515560089621075"),
            decimal("-0.39590389413323757733623154"),
            decimal("0.18453964097831570709183254"),
            decimal("0.25837438768632204729397911"),
            decimal("0.29501172360931029887096624"),
        ],
    };
}

impl<const S: usize> Symmetric<S> {
    /// All of them.
    pub fn steps<T: Scalar>(&self) -> [T; S] {
        let one = self.half.iter().fold(T::one(), |rest, c| rest - c.get::<T>() - c.get::<T>());
        core::array::from_fn(|k| self.half.get(k.min(S - 1 - k)).map_or(one, |c| c.get()))
    }
}

/// A symmetric method `M` of order 2, an implicit midpoint rule for example, in steps of the lengths of [`Symmetric`], some of
/// them backwards: a symmetric method of a higher order; symplectic if `M` is.
///
/// On joints with quaternions the order is 3 at most, however high that of the lengths: the coordinates of a step are those
/// of [`chart`](super::chart) about its start, and half of a vector `φ` is not half of its turn, so that no `M` is
/// symmetric there beyond the cube of the step. (Of the triple jump and Suzuki's five steps this only shows in very small
/// errors.)
///
/// If `M` is not symmetric the order is that of `M`. No error is estimated. What `M` keeps from one step to the next it
/// keeps here as well.
#[derive(Clone, Debug)]
pub struct Composition<Y: System, M, const S: usize> {
    method: M,
    order: u32,
    lengths: [Y::Scalar; S],
    /// Its chart is that of the step's start; the method's own moves on within the step.
    field: Field<Y>,
    steps: u64,
    /// The method stands at the start of the step.
    ready: bool,
    start: Point<Y>,
    start_known: bool,
    end: Point<Y>,
    end_known: bool,
    delta: Point<Y>,
    /// What the method made of the last attempt.
    made: Point<Y>,
    q: Y::Coordinates,
    p: Y::Momenta,
}

impl<Y, M, const S: usize> Composition<Y, M, S>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    /// Over a method of the same system.
    pub fn new(system: &Y, method: M, lengths: Symmetric<S>) -> Self {
        let point = || Point::zero(system);
        Composition {
            order: if method.order() == 2 { lengths.order } else { method.order() },
            method,
            lengths: lengths.steps(),
            field: Field::new(system, false),
            steps: 0,
            ready: false,
            start: point(),
            start_known: false,
            end: point(),
            end_known: false,
            delta: point(),
            made: point(),
            q: system.neutral(),
            p: system.zero_momenta(),
        }
    }

    /// The method, where it stands.
    pub fn method(&self) -> &M {
        &self.method
    }

    /// Sets the method to the start of the step.
    fn prepare(&mut self, system: &mut Y, t: Y::Scalar) -> Result<(), StepError> {
        if !self.ready {
            self.field.chart().base(system, &mut self.q, &mut self.p);
            self.method.begin(system, t, &self.q, &self.p)?;
            self.ready = true;
        }
        Ok(())
    }
}

impl<Y, M, const S: usize> Stepper<Y> for Composition<Y, M, S>
where
    Y: System,
    Y::Scalar: Real,
    M: Stepper<Y>,
{
    fn order(&self) -> u32 {
        self.order
    }

    fn error_order(&self) -> Option<u32> {
        None
    }

    fn begin(&mut self, system: &mut Y, t: Y::Scalar, q: &Y::Coordinates, p: &Y::Momenta) -> Result<(), StepError> {
        self.ready &= self.field.holds(q, p);
        (self.start_known, self.end_known) = (false, false);
        if self.ready {
            return Ok(());
        }
        self.field.load(system, t, q, p)
    }

    fn attempt(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        _scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        self.prepare(system, t)?;
        (self.ready, self.end_known) = (false, false);
        self.delta.clear();
        let mut at = t;
        for (k, length) in self.lengths.into_iter().enumerate() {
            let part = length * h;
            self.method.attempt(system, at, part, None)?;
            Chart::compose(system, self.method.parts().1, &mut self.delta);
            if k + 1 < S {
                self.method.accept(system, at, part)?;
                at = at + part;
            }
        }
        self.made.copy_from(&self.delta);
        Ok(0.0)
    }

    fn parts(&mut self) -> (&mut Field<Y>, &mut Point<Y>) {
        (&mut self.field, &mut self.delta)
    }

    fn start_rate(&mut self, system: &mut Y, t: Y::Scalar) -> &Point<Y> {
        if !self.start_known {
            self.start.clear();
            self.end.clear();
            self.field.rates(system, t, &self.end, &mut self.start);
            (self.start_known, self.end_known) = (true, false);
        }
        &self.start
    }

    fn end_rate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> &Point<Y> {
        if !self.end_known {
            self.field.rates(system, t + h, &self.delta, &mut self.end);
            self.end_known = true;
        }
        &self.end
    }

    fn accept(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar) -> Result<(), StepError> {
        if let Some(index) = self.delta.not_finite() {
            return Err(StepError::NotFinite { time: t.to_f64(), index });
        }
        let last = self.lengths[S - 1] * h;
        let corrected = self.delta.parts() != self.made.parts();
        if corrected {
            self.field.advance(system, t, &self.delta)?;
        } else {
            // The method goes on from where it is, and this one follows it to the last bit.
            self.method.accept(system, t + h - last, last)?;
            self.field.join(self.method.parts().0);
        }
        (self.ready, self.start_known, self.end_known) = (!corrected, false, false);
        self.steps += 1;
        Ok(())
    }

    fn interpolate(&mut self, system: &mut Y, t: Y::Scalar, h: Y::Scalar, theta: Y::Scalar, out: &mut Point<Y>) {
        self.start_rate(system, t);
        self.end_rate(system, t, h);
        hermite(h, theta, &self.delta, [&self.start, &self.end], out);
    }

    fn statistics(&self) -> Statistics {
        let inner = self.method.statistics();
        Statistics { evaluations: inner.evaluations + self.field.evaluations(), steps: self.steps, ..inner }
    }

    fn step(
        &mut self,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        q: &mut Y::Coordinates,
        p: &mut Y::Momenta,
    ) -> Result<(), StepError> {
        self.begin(system, t, q, p)?;
        self.attempt(system, t, h, None)?;
        self.accept(system, t, h)?;
        self.field.store(system, q, p);
        Ok(())
    }
}
