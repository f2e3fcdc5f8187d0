//! What is left of the digits of a run, in words.

use std::fmt::Display;
use std::io::Write;

use multibody::codegen::plan::Plan;

use super::tangent::Growth;
use super::{Errors, Record};
use crate::displacement::{components, range, Component};
use crate::Outcome;

/// Errors in the measure of the motion.
pub struct Findings {
    /// Components of the errors.
    components: Vec<Component>,
    /// Largest error at the end as a part of what moves: of one radian, or of the largest range of a position.
    end: f64,
    /// When no digit is left, s.
    until: Until,
}

/// When no digit is left.
enum Until {
    /// Within the run, s.
    Met(f64),
    /// After it, if errors go on growing as they did, s.
    Expected(f64),
    /// Errors do not grow.
    Never,
    /// The growth is not known, or there is no error that could grow.
    Unknown,
}

impl Findings {
    /// Judges the errors of a run.
    pub fn new(plan: &Plan, record: &Record, errors: &Errors, growth: Option<&Growth>) -> Findings {
        let components = components(plan);
        let range = match range(&components, &record.q) {
            range if range > 0.0 => range,
            _ => 1.0,
        };
        let relative = |x: &Vec<f64>| -> f64 {
            let parts = x.iter().zip(&components).map(|(x, c)| x.abs() / c.position.map_or(1.0, |_| range));
            parts.fold(0.0, |m, x| if x <= m { m } else { x })
        };
        let lost = errors.x.iter().position(|x| all_lost(relative(x)));
        let end = errors.x.last().map_or(0.0, relative);
        let time = record.t.last().copied().unwrap_or(0.0);
        let until = match (lost, growth) {
            (Some(row), _) => Until::Met(record.t[row]),
            (None, None) => Until::Unknown,
            (None, _) if end == 0.0 => Until::Unknown,
            (None, Some(growth)) if growth.exponential() => Until::Expected(time + (1.0 / end).ln() / growth.rate),
            (None, Some(growth)) if growth.power() > 0.1 => {
                Until::Expected(time * (1.0 / end).powf(1.0 / growth.power()))
            }
            _ => Until::Never,
        };
        Findings { components, end, until }
    }

    /// Whether a digit is left at the end.
    pub fn some_left(&self) -> bool {
        !all_lost(self.end)
    }

    /// Writes the report.
    pub fn write(
        &self,
        plan: &Plan,
        record: &Record,
        errors: &Errors,
        growth: Result<&Growth, &dyn Display>,
        out: &mut dyn Write,
    ) -> Outcome {
        let time = record.t.last().copied().unwrap_or(0.0);
        writeln!(out, "trust: compared with {}; errors at {time} s:", errors.with)?;
        let last = |list: &[Vec<f64>]| list.last().cloned().unwrap_or_default();
        let x = last(&errors.x);
        let rates = plan.velocity_names();
        let width = self.components.iter().map(|c| c.name.len()).max().unwrap_or(0);
        for (k, Component { name, position }) in self.components.iter().enumerate() {
            let unit = if position.is_some() { "m" } else { "rad" };
            writeln!(
                out,
                "  {name:width$}  {:.1e} {unit:3}  velocity {} {:.1e} {unit}/s",
                x[k].abs(),
                rates[k],
                errors.v[k]
            )?;
        }
        let digits = match self.end {
            end if all_lost(end) => "no digit".to_string(),
            end if end > 0.0 => format!("{:.1} digits", -end.log10()),
            _ => "all digits".to_string(),
        };
        writeln!(
            out,
            "digits: {digits} left of what moves at the end{}",
            match self.until {
                Until::Met(t) => format!("; none from {t:.3} s on"),
                Until::Expected(t) if t < 1e4 => format!("; none after about {t:.1} s, if errors go on growing"),
                Until::Expected(t) => format!("; none after about {t:.0e} s, if errors go on growing"),
                Until::Never => "; errors do not grow".to_string(),
                Until::Unknown => String::new(),
            }
        )?;
        match growth {
            Ok(growth) if growth.exponential() => writeln!(
                out,
                "growth: errors grow e-fold in {:.3} s (largest Lyapunov exponent {:.3}/s, tangent flow, second half of the run), {:.1e} times in all",
                1.0 / growth.rate,
                growth.rate,
                growth.factor
            )?,
            Ok(growth) => writeln!(
                out,
                "growth: not exponential in this run: errors grow like t^{:.1} in its second half, {:.1e} times in all (tangent flow)",
                growth.power().max(0.0),
                growth.factor
            )?,
            Err(e) => writeln!(out, "growth: not measured: {e}")?,
        }
        Ok(())
    }
}

/// Whether a relative error leaves no digit.
fn all_lost(error: f64) -> bool {
    error.is_nan() || error >= 1.0
}
