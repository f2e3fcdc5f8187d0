//! Small charts side by side, one for each curve of a panel, over the same times.

use std::fmt::Write as _;

use super::axis::range;
use super::{heading, under, Axis, Chart, Panel, EDGE, FOOT, HEADING, LABEL, NUMBERS, WIDTH};
use crate::ink::{escaped, shortened};

/// Largest number of charts; what is left out is said.
const MOST: usize = 96;
/// Height of a name and of a chart, pixels.
const NAME: f64 = 17.0;
const CHART: f64 = 74.0;
/// Distance of two rows of charts, pixels.
const BETWEEN: f64 = 10.0;
/// Part of the largest range that the middle one of all ranges must have for all charts to share their scale.
const ALIKE: f64 = 0.05;

/// Charts in a row.
fn columns(count: usize) -> usize {
    match count {
        0..=12 => 4,
        13..=30 => 5,
        31..=48 => 6,
        _ => 8,
    }
}

/// The charts of a panel below `y`; returns their height.
pub fn draw(text: &mut String, panel: &Panel, x: &str, y: f64) -> f64 {
    let all = panel.lines.len();
    let shown: Vec<usize> = match all > MOST {
        true => (0..MOST).map(|k| k * (all - 1) / (MOST - 1)).collect(),
        false => (0..all).collect(),
    };
    let ranges: Vec<[f64; 2]> =
        shown.iter().map(|k| range(panel.lines[*k].1.iter().copied()).unwrap_or([0.0, 0.0])).collect();
    let mut lengths: Vec<f64> = ranges.iter().map(|[low, high]| high - low).collect();
    lengths.sort_by(f64::total_cmp);
    let shared = lengths[lengths.len() / 2] >= ALIKE * lengths[lengths.len() - 1];
    let whole = range(ranges.iter().flatten().copied()).unwrap_or([0.0, 1.0]);
    let mut more =
        String::from(if shared { "the same scale in all charts" } else { "every chart has a scale of its own" });
    if all > MOST {
        let _ = write!(more, "; {MOST} of {all}, evenly chosen, the others are in the table");
    }
    heading(text, &panel.label, &more, y);
    let n = columns(shown.len());
    // Scales of their own have their numbers at every chart.
    let gap = if shared { 22.0 } else { 52.0 };
    let first = EDGE + if shared { NUMBERS - 14.0 } else { 50.0 };
    let width = (WIDTH - first - EDGE - gap * (n - 1) as f64) / n as f64;
    let row = NAME + CHART + BETWEEN;
    for (place, (k, own)) in shown.iter().zip(&ranges).enumerate() {
        let (column, line) = (place % n, place / n);
        let (name, values) = &panel.lines[*k];
        let left = first + column as f64 * (width + gap);
        let top = y + HEADING + line as f64 * row;
        let span = if shared { whole } else { *own };
        let chart = Chart {
            corner: [left, top + NAME],
            size: [width, CHART],
            x: Axis::linear(panel.span(), (width / 44.0).max(2.0)),
            y: Axis::airy(span, 3.5),
        };
        let last = place + n >= shown.len();
        chart.frame(text, [last, !shared || column == 0]);
        chart.curve(text, (&panel.t, values), "c0", name);
        let short = escaped(&shortened(name, 11.0, width));
        let name = escaped(name);
        let _ = writeln!(
            text,
            "<text class=\"small\" x=\"{left:.1}\" y=\"{:.1}\"><title>{name}</title>{short}</text>",
            top + NAME - 5.0
        );
    }
    let height = HEADING + shown.len().div_ceil(n) as f64 * row - BETWEEN + FOOT;
    under(text, x, [0.5 * WIDTH, y + height + 9.0]);
    height + LABEL + 8.0
}
