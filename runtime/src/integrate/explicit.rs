//! Explicit Runge-Kutta methods.

use super::chart::Point;
use super::integrator::{Attempt, FromSystem, Integrator, Scheme};
use super::stepper::{hermite, norm};
use super::tableau::{self, Dense, Tableau};
use super::weights::{weights, Weights};
use super::StepError;
use crate::system::{Real, System};

/// A method with `S` stages, by name. With `X - 1` more for dense output, if `X` is not zero.
pub trait Method<const S: usize, const X: usize> {
    /// Coefficients of the method.
    const TABLEAU: &'static Tableau<S>;
    /// The weights of the stages, row by row. Where a loop over few stages is unrolled, they become operands.
    const STAGES: Weights<S, S> = weights!(&Self::TABLEAU.a);
    /// Those of the step.
    const STEP: Weights<S, 1> = weights!(core::slice::from_ref(&Self::TABLEAU.b));
    /// Those of the error estimates, of which there are two at most.
    const ERRORS: Weights<S, 2> = weights!(Self::TABLEAU.error);
}

macro_rules! methods {
    ($($name:ident $stages:literal $extra:literal $tableau:ident $doc:literal;)*) => {
        /// Names of methods.
        pub mod method {
            $(#[doc = $doc]
            #[derive(Clone, Copy, Debug)]
            pub struct $name;
            impl super::Method<$stages, $extra> for $name {
                const TABLEAU: &'static super::Tableau<$stages> = &super::tableau::$tableau;
            })*
        }
        $(#[doc = $doc]
        pub type $name<Y> = Integrator<Y, Explicit<Y, method::$name, $stages, $extra>>;)*
    };
}

methods! {
    Euler 1 0 EULER "Euler's method, order 1: one evaluation a step.";
    Midpoint 2 0 MIDPOINT "The explicit midpoint rule, order 2: two evaluations a step (C.3).";
    Rk4 4 0 RK4 "Kutta's method of order 4: four evaluations a step (C.6). W. Kutta, 1901.";
    Rkf45 6 0 RKF45 "Fehlberg's pair of orders 4 and 5: six evaluations a step. E. Fehlberg, NASA TR R-315, 1969.";
    CashKarp 6 0 CASH_KARP "Cash and Karp's pair of orders 5 and 4: six evaluations a step. ACM TOMS 16, 1990.";
    Tsit5 7 0 TSIT5 "Tsitouras' pair of orders 5 and 4: six evaluations a step. Comput. Math. Appl. 62, 2011.";
    Dop853 12 4 DOP853 "Dormand and Prince's method of order 8: twelve evaluations a step. Hairer, Nørsett, Wanner, II.5.";
    Verner9 16 5 VERNER9 "Verner's most efficient pair of orders 9 and 8: sixteen evaluations a step. Numer. Algorithms 53, 2010.";
}

/// Any explicit Runge-Kutta method; take one by its name, [`Rk4`] for example.
#[derive(Clone, Debug)]
pub struct Explicit<Y: System, T, const S: usize, const X: usize> {
    /// Rates of the stages, the first one that at the start of the step.
    k: [Point<Y>; S],
    /// Rates of the extra stages of dense output; in the last place the displacement of one of them.
    extra: [Point<Y>; X],
    extra_known: bool,
    method: core::marker::PhantomData<T>,
}

impl<Y: System, T, const S: usize, const X: usize> FromSystem<Y> for Explicit<Y, T, S, X> {
    fn new(system: &Y) -> Self {
        Explicit {
            k: core::array::from_fn(|_| Point::zero(system)),
            extra: core::array::from_fn(|_| Point::zero(system)),
            extra_known: false,
            method: core::marker::PhantomData,
        }
    }
}

impl<Y, T, const S: usize, const X: usize> Explicit<Y, T, S, X>
where
    Y: System,
    Y::Scalar: Real,
    T: Method<S, X>,
{
    /// Error by the estimators of the tableau: one, or two combined as in DOP853 (Hairer, Nørsett, Wanner, II.10, eq.
    /// 10.17). Overwrites `work`.
    fn error(&self, h: Y::Scalar, scale: &Point<Y>, work: &mut Point<Y>) -> f64 {
        let mut norms = [0.0; 2];
        for (row, norm_) in norms.iter_mut().enumerate().take(T::TABLEAU.error.len()) {
            work.combine(h, T::ERRORS.row(row), &self.k);
            *norm_ = norm(work, scale);
        }
        match T::TABLEAU.error.len() {
            2 => {
                let [five, three] = norms;
                let size = libm::sqrt(five * five + 0.01 * three * three);
                if size == 0.0 {
                    0.0
                } else {
                    five * five / size
                }
            }
            _ => norms[0],
        }
    }

    /// The rates that rows of dense output are over. The last stage may be the rate at the end; then it stands once,
    /// and may not have been evaluated as a stage.
    fn rates_of_rows<'a>(
        k: &'a [Point<Y>; S],
        end: &'a Point<Y>,
        extra: &'a [Point<Y>],
    ) -> impl Iterator<Item = &'a Point<Y>> {
        k[..S - usize::from(T::TABLEAU.fsal)].iter().chain([end]).chain(extra)
    }

    /// Extra stages of dense output, after the rate at the end is known.
    fn extend(&mut self, step: &mut Attempt<Y>, system: &mut Y, t: Y::Scalar, h: Y::Scalar, dense: &Dense) {
        let Some((stage, extra)) = self.extra.split_last_mut() else { return };
        for (i, (c, row)) in dense.c.iter().zip(dense.a).enumerate().take(extra.len()) {
            stage.clear();
            let (known, rest) = extra.split_at_mut(i);
            let rates = Self::rates_of_rows(&self.k, &step.end, known);
            for (w, k) in row.iter().zip(rates) {
                stage.add(w.get(), k);
            }
            stage.scale(h);
            step.field.rates(system, t + c.get::<Y::Scalar>() * h, stage, &mut rest[0]);
        }
        self.extra_known = true;
    }
}

impl<Y, T, const S: usize, const X: usize> Scheme<Y> for Explicit<Y, T, S, X>
where
    Y: System,
    Y::Scalar: Real,
    T: Method<S, X>,
{
    const ENDS_WITH_RATE: bool = true;

    fn order(&self) -> u32 {
        T::TABLEAU.order
    }

    fn error_order(&self) -> Option<u32> {
        (!T::TABLEAU.error.is_empty()).then_some(T::TABLEAU.error_order)
    }

    fn share(&self) -> f64 {
        T::TABLEAU.share
    }

    fn attempt(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        scale: Option<&Point<Y>>,
    ) -> Result<f64, StepError> {
        // The last stage of a pair whose last stage is the rate at the end only serves the estimate and the next step.
        let stages = if T::TABLEAU.fsal && scale.is_none() { S - 1 } else { S };
        // The rate at the start is the first stage; a second call for it would be a second copy of inlined rates.
        for i in usize::from(step.start_known)..stages {
            let (known, rest) = self.k.split_at_mut(i);
            let time = t + T::TABLEAU.c[i].get::<Y::Scalar>() * h;
            let row = (T::STAGES.row(i), &*known);
            step.field.stage_rates(system, (time, h), row, &mut step.end, &mut rest[0]);
        }
        step.start_known = true;
        step.delta.combine(h, T::STEP.row(0), &self.k);
        self.extra_known = false;
        let error = scale.map_or(0.0, |scale| self.error(h, scale, &mut step.end));
        if T::TABLEAU.fsal && stages == S {
            step.end.copy_from(&self.k[S - 1]);
            step.end_known = true;
        }
        Ok(error)
    }

    fn start(&mut self) -> &mut Point<Y> {
        &mut self.k[0]
    }

    fn accepted(&mut self, step: &mut Attempt<Y>, system: &Y, _h: Y::Scalar) -> bool {
        step.hand_on(system, &mut self.k[0])
    }

    fn interpolate(
        &mut self,
        step: &mut Attempt<Y>,
        system: &mut Y,
        t: Y::Scalar,
        h: Y::Scalar,
        theta: Y::Scalar,
        out: &mut Point<Y>,
    ) {
        step.end_rate(system, t, h);
        hermite(h, theta, &step.delta, [&self.k[0], &step.end], out);
        let Some(dense) = T::TABLEAU.dense else { return };
        if !self.extra_known {
            self.extend(step, system, t, h, dense);
        }
        let rates = Self::rates_of_rows(&self.k, &step.end, &self.extra);
        for (i, (row, k)) in dense.bend.iter().zip(rates).enumerate() {
            if !row.is_empty() {
                out.add(h * dense.weight(i, theta), k);
            }
        }
    }
}
