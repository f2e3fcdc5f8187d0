//! Figures with logarithmic axes.

use std::fmt::Write as _;

use mbd_cli::ink::{self, escaped, shortened};
use mbd_cli::plot::{class, Axis, Chart};

/// One line: points `(x, y)`, both positive.
pub struct Line {
    /// Name in the legend.
    pub name: String,
    /// Points, in order.
    pub points: Vec<(f64, f64)>,
    /// Whether the line is dashed and without marks, as lines for comparison are.
    pub thin: bool,
}

/// Two charts side by side with one legend.
pub struct Figure {
    /// Title over both charts.
    pub title: String,
    /// Label of the horizontal axes.
    pub x: [String; 2],
    /// Labels of the vertical axes.
    pub y: [String; 2],
    /// Lines of both charts, in the same order.
    pub lines: [Vec<Line>; 2],
}

const SIZE: [f64; 2] = [1180.0, 448.0];
/// Room for the legend, for the numbers of an axis, and at the edges, pixels.
const LEGEND: f64 = 250.0;
const NUMBERS: f64 = 48.0;
const EDGE: f64 = 16.0;
/// Top of the charts, and their height, pixels.
const TOP: f64 = 72.0;
const HEIGHT: f64 = 316.0;

impl Figure {
    /// The figure as SVG.
    pub fn svg(&self) -> String {
        let mut text = ink::head(SIZE, &self.title);
        let title = escaped(&self.title);
        let _ = writeln!(text, "<text class=\"head\" style=\"font-size:16px\" x=\"{EDGE}\" y=\"28\">{title}</text>");
        let width = 0.5 * (SIZE[0] - LEGEND);
        for (k, lines) in self.lines.iter().enumerate() {
            chart(&mut text, EDGE + k as f64 * width, width, (&self.x[k], &self.y[k]), lines);
        }
        for (k, line) in self.lines[0].iter().enumerate() {
            let (x, y) = (SIZE[0] - LEGEND + 8.0, TOP + 8.0 + 16.0 * k as f64);
            let _ = writeln!(text, "<path class=\"curve {}\" d=\"M{x:.1} {y:.1}h28\"/>", stroke(k, line));
            if !line.thin {
                let _ = writeln!(text, "<circle class=\"{}\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"3\"/>", fill(k), x + 14.0);
            }
            let short = escaped(&shortened(&line.name, 11.0, LEGEND - 48.0));
            let _ = writeln!(text, "<text class=\"small\" x=\"{:.1}\" y=\"{:.1}\">{short}</text>", x + 34.0, y + 4.0);
        }
        text + "</svg>\n"
    }
}

/// Class of a line: those for comparison are dashed.
fn stroke(k: usize, line: &Line) -> String {
    class(k, usize::from(line.thin))
}

/// Class of the marks of a line.
fn fill(k: usize) -> String {
    format!("k{}", k % ink::COLOURS)
}

fn chart(text: &mut String, left: f64, width: f64, (x, y): (&str, &str), lines: &[Line]) {
    let all = || lines.iter().flat_map(|l| &l.points);
    let chart = Chart {
        corner: [left + NUMBERS, TOP],
        size: [width - NUMBERS - EDGE, HEIGHT],
        x: Axis::logarithmic(all().map(|p| p.0), 9.0),
        y: Axis::logarithmic(all().map(|p| p.1), 9.0),
    };
    chart.frame(text, [true, true]);
    let _ = writeln!(text, "<text class=\"small m\" x=\"{left:.1}\" y=\"{:.1}\">{}</text>", TOP - 12.0, escaped(y));
    let (middle, bottom) = (chart.corner[0] + 0.5 * chart.size[0], TOP + HEIGHT + 34.0);
    let _ = writeln!(text, "<text class=\"small m mid\" x=\"{middle:.1}\" y=\"{bottom:.1}\">{}</text>", escaped(x));
    for (k, line) in lines.iter().enumerate() {
        let (xs, ys): (Vec<f64>, Vec<f64>) = line.points.iter().copied().unzip();
        chart.curve(text, (&xs, &ys), &stroke(k, line), &line.name);
        for (x, y) in line.points.iter().filter(|_| !line.thin) {
            let [x, y] = chart.place(*x, *y);
            if x.is_finite() && y.is_finite() {
                let _ = writeln!(text, "<circle class=\"{}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.6\"/>", fill(k));
            }
        }
    }
}
