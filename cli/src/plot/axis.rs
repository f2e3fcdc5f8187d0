//! Axes: ranges, marks at 1, 2 or 5 times powers of ten, and their numbers.

use crate::ink::nice;

/// One axis of a chart.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Smallest and largest value; their decadic logarithms on a logarithmic axis.
    range: [f64; 2],
    /// Distance of marks; decades on a logarithmic axis.
    step: f64,
    logarithmic: bool,
}

/// Range of the finite ones of some values.
pub fn range(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let finite = values.filter(|x| x.is_finite());
    finite.fold(None, |range, x| match range {
        None => Some([x, x]),
        Some([low, high]) => Some([f64::min(low, x), f64::max(high, x)]),
    })
}

impl Axis {
    /// A linear axis with at most about `n` marks.
    pub fn linear([low, high]: [f64; 2], n: f64) -> Axis {
        // A constant needs a range too.
        let least = low.abs().max(high.abs()) * 1e-9;
        let (low, high) = match high - low > least {
            true => (low, high),
            false => {
                let half = if least > 0.0 { 0.05 * low.abs().max(high.abs()) } else { 1.0 };
                (low - half, high + half)
            }
        };
        Axis { range: [low, high], step: nice((high - low) / n), logarithmic: false }
    }

    /// A linear axis with some air at both ends.
    pub fn airy([low, high]: [f64; 2], n: f64) -> Axis {
        let pad = 0.05 * (high - low);
        Axis::linear([low - pad, high + pad], n)
    }

    /// A logarithmic axis over whole decades of positive values.
    pub fn logarithmic(values: impl Iterator<Item = f64>, n: f64) -> Axis {
        let logs = range(values.filter(|x| *x > 0.0).map(f64::log10)).unwrap_or([-1.0, 0.0]);
        let (low, high) = (logs[0].floor(), (logs[1] + 1e-9).ceil());
        let high = high.max(low + 1.0);
        Axis { range: [low, high], step: ((high - low) / n).ceil().max(1.0), logarithmic: true }
    }

    /// Smallest and largest value.
    pub fn ends(&self) -> [f64; 2] {
        self.range.map(|x| if self.logarithmic { 10.0_f64.powf(x) } else { x })
    }

    /// Place of a value: 0 at the low end, 1 at the high one.
    pub fn place(&self, value: f64) -> f64 {
        let value = if self.logarithmic { value.log10() } else { value };
        (value - self.range[0]) / (self.range[1] - self.range[0])
    }

    /// Marks: places and numbers.
    pub fn marks(&self) -> Vec<(f64, String)> {
        let [low, high] = self.range;
        let slack = 1e-9 * (high - low);
        let (first, last) = (((low - slack) / self.step).ceil(), ((high + slack) / self.step).floor());
        let count = (last - first).clamp(0.0, 100.0) as usize;
        let largest = low.abs().max(high.abs());
        (0..=count)
            .map(|k| (first + k as f64) * self.step)
            .filter(|x| *x >= low - slack && *x <= high + slack)
            .map(|x| {
                let number = if self.logarithmic { power(x) } else { number(x, self.step, largest) };
                ((x - low) / (high - low), number)
            })
            .collect()
    }
}

/// An integer as an exponent.
fn raised(power: i32) -> String {
    let digit = |c: char| match c {
        '-' => '⁻',
        c => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][c.to_digit(10).unwrap_or_default() as usize],
    };
    power.to_string().chars().map(digit).collect()
}

/// A power of ten.
fn power(exponent: f64) -> String {
    match exponent.round() as i32 {
        0 => "1".to_string(),
        1 => "10".to_string(),
        k => format!("10{}", raised(k)),
    }
}

/// The number at a mark, with enough digits to distinguish it from the next; `largest` of the axis decides on powers of
/// ten.
fn number(x: f64, step: f64, largest: f64) -> String {
    if x.abs() < 0.5 * step {
        return "0".to_string();
    }
    let digits = |step: f64| (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    if largest < 1e5 && step > 0.9e-4 {
        return format!("{x:.0$}", digits(step)).replace('-', "−");
    }
    let exponent = largest.log10().floor();
    let unit = 10.0_f64.powf(exponent);
    format!("{:.1$}·10{2}", x / unit, digits(step / unit), raised(exponent as i32)).replace('-', "−")
}
