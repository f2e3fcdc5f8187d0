//! Plots as SVG text: panels below each other, with many curves in small charts side by side.

mod axis;
mod chart;
mod multiples;

use std::fmt::Write as _;

pub use axis::Axis;
pub use chart::{class, Chart};

use super::ink::{self, escaped, shortened, COLOURS, DASHES};
use axis::range;

/// One panel: curves over time, or over another quantity.
pub struct Panel {
    /// Quantity of the vertical axis, with the unit.
    pub label: String,
    /// Times, s.
    pub t: Vec<f64>,
    /// Name (empty: not in the legend) and values; a curve has gaps where values are not finite.
    pub lines: Vec<(String, Vec<f64>)>,
    /// A sentence in place of the curves, where they would show nothing.
    pub note: Option<String>,
    /// Whether more curves than there are colours get a small chart each.
    pub apart: bool,
}

impl Panel {
    /// Curves in one chart.
    pub fn new(label: impl Into<String>, t: Vec<f64>, lines: Vec<(String, Vec<f64>)>) -> Panel {
        Panel { label: label.into(), t, lines, note: None, apart: false }
    }

    /// The same with a small chart for each curve where there are more curves than colours.
    pub fn apart(self) -> Panel {
        Panel { apart: true, ..self }
    }

    /// The same with a sentence in place of the curves.
    pub fn in_words(self, note: String) -> Panel {
        Panel { note: Some(note), ..self }
    }

    /// Range of the horizontal axis, which begins at zero.
    fn span(&self) -> [f64; 2] {
        let [low, high] = range(self.t.iter().copied()).unwrap_or([0.0, 1.0]);
        [low.min(0.0), high]
    }
}

/// Width of a plot, pixels.
pub const WIDTH: f64 = 960.0;
const EDGE: f64 = 16.0;
/// Room for the numbers of the vertical axis, pixels.
const NUMBERS: f64 = 64.0;
/// Room for the names at the ends of curves, pixels.
const NAMES: f64 = 200.0;
/// Distance of two names, pixels.
const ROW: f64 = 15.0;
/// Height of a heading, of the numbers of the horizontal axis, and of its label, pixels.
const HEADING: f64 = 26.0;
const FOOT: f64 = 20.0;
const LABEL: f64 = 18.0;
/// Height of a chart, pixels.
const CHART: f64 = 190.0;

/// Panels below each other over the same time.
pub fn svg(title: &str, panels: &[Panel]) -> String {
    svg_over(title, "time [s]", panels)
}

/// Panels below each other over the same quantity, whose label is `x`.
pub fn svg_over(title: &str, x: &str, panels: &[Panel]) -> String {
    let mut body = String::new();
    let size = 15.0_f64.min(15.0 * (WIDTH - 2.0 * EDGE) / ink::width(title, 15.0).max(1.0)).max(9.0);
    let shown = shortened(title, size, WIDTH - 2.0 * EDGE);
    let _ = writeln!(
        body,
        "<text class=\"head\" style=\"font-size:{size:.1}px\" x=\"{EDGE}\" y=\"26\">{}</text>",
        escaped(&shown)
    );
    let mut y = 40.0;
    for panel in panels {
        y += match &panel.note {
            Some(note) => words(&mut body, panel, note, y),
            None if panel.apart && panel.lines.len() > COLOURS => multiples::draw(&mut body, panel, x, y),
            None => draw(&mut body, panel, x, y),
        };
    }
    ink::head([WIDTH, y + 8.0], title) + &body + "</svg>\n"
}

/// The heading of a panel.
fn heading(text: &mut String, label: &str, more: &str, y: f64) {
    let more = match more {
        "" => String::new(),
        more => format!("<tspan class=\"m\" font-weight=\"400\" dx=\"10\">{}</tspan>", escaped(more)),
    };
    let label = escaped(&shortened(label, 12.0, WIDTH - 2.0 * EDGE));
    let _ = writeln!(text, "<text class=\"head\" x=\"{EDGE}\" y=\"{:.1}\">{label}{more}</text>", y + 16.0);
}

/// The label of the horizontal axis, in the middle of a chart.
fn under(text: &mut String, x: &str, at: [f64; 2]) {
    let _ = writeln!(text, "<text class=\"small m mid\" x=\"{:.1}\" y=\"{:.1}\">{}</text>", at[0], at[1], escaped(x));
}

/// A panel in words; returns its height.
fn words(text: &mut String, panel: &Panel, note: &str, y: f64) -> f64 {
    heading(text, &panel.label, "", y);
    let _ = writeln!(text, "<text x=\"{EDGE}\" y=\"{:.1}\">{}</text>", y + 37.0, escaped(note));
    HEADING + 30.0
}

/// A panel with one chart, and the names at the ends of its curves; returns its height.
fn draw(text: &mut String, panel: &Panel, x: &str, y: f64) -> f64 {
    let named = panel.lines.iter().filter(|l| !l.0.is_empty()).count().min(COLOURS * DASHES);
    let height = CHART.max(ROW * named as f64);
    let values = panel.lines.iter().flat_map(|l| &l.1).copied();
    let right = if named == 0 { EDGE } else { NAMES };
    let chart = Chart {
        corner: [EDGE + NUMBERS, y + HEADING],
        size: [WIDTH - EDGE - NUMBERS - right, height],
        x: Axis::linear(panel.span(), 10.0),
        y: Axis::airy(range(values).unwrap_or([0.0, 1.0]), 6.0),
    };
    chart.frame(text, [true, true]);
    let curves: Vec<&[f64]> = panel.lines.iter().map(|l| l.1.as_slice()).collect();
    let dashes = chart.dashes(&panel.t, &curves);
    let hint = if dashes.iter().any(|d| *d > 0) { "dashed where a curve lies on another" } else { "" };
    heading(text, &panel.label, hint, y);
    for (k, (name, values)) in panel.lines.iter().enumerate() {
        chart.curve(text, (&panel.t, values), &class(k, dashes[k]), name);
    }
    names(text, &chart, panel, &dashes);
    let middle = chart.corner[0] + 0.5 * chart.size[0];
    under(text, x, [middle, y + HEADING + height + FOOT + 11.0]);
    HEADING + height + FOOT + LABEL + 8.0
}

/// Names at the ends of curves, moved apart, with the colour and dashes of the curve.
fn names(text: &mut String, chart: &Chart, panel: &Panel, dashes: &[usize]) {
    let (top, bottom) = (chart.corner[1], chart.corner[1] + chart.size[1]);
    let right = chart.corner[0] + chart.size[0];
    let mut ends: Vec<(f64, usize)> = Vec::new();
    for (k, (name, values)) in panel.lines.iter().enumerate().take(COLOURS * DASHES) {
        let last = panel.t.iter().zip(values).rev().map(|(t, y)| chart.place(*t, *y)[1]).find(|y| y.is_finite());
        if let (Some(y), false) = (last, name.is_empty()) {
            ends.push((y.clamp(top, bottom), k));
        }
    }
    ends.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut places: Vec<f64> = ends.iter().map(|e| e.0).collect();
    spread(&mut places, ROW, [top + 4.0, bottom - 4.0]);
    for ((end, k), y) in ends.iter().zip(places) {
        let (name, dash) = (&panel.lines[*k].0, dashes[*k]);
        let (colour, short) = (k % COLOURS, escaped(&shortened(name, 11.0, NAMES - 58.0)));
        let [a, b, c, d] = [2.0, 12.0, 36.0, 41.0].map(|dx| right + dx);
        let _ =
            writeln!(text, "<path class=\"n c{colour}\" stroke-opacity=\".55\" d=\"M{a:.1} {end:.1}L{b:.1} {y:.1}\"/>");
        let _ = writeln!(text, "<path class=\"curve {}\" d=\"M{b:.1} {y:.1}H{c:.1}\"/>", class(*k, dash));
        let _ = writeln!(
            text,
            "<text class=\"small\" x=\"{d:.1}\" y=\"{:.1}\"><title>{}</title>{short}</text>",
            y + 4.0,
            escaped(name)
        );
    }
}

/// Moves sorted places apart to a distance, within bounds as far as these have room.
fn spread(places: &mut [f64], distance: f64, [low, high]: [f64; 2]) {
    let mut least = low;
    for y in places.iter_mut() {
        *y = y.max(least);
        least = *y + distance;
    }
    let mut most = high;
    for y in places.iter_mut().rev() {
        *y = y.min(most);
        most = *y - distance;
    }
}
