//! One chart: axes, grid and curves in a rectangle of the page.

use std::fmt::Write as _;

use super::axis::Axis;
use crate::ink::{escaped, line_class};

/// Largest distance of a drawn curve from its points, pixels.
const FLAT: f64 = 0.12;
/// Distance below which two curves cannot be told apart, pixels.
const SAME: f64 = 1.3;
/// Part of its points at which a curve has to be on another to be dashed.
const OFTEN: f64 = 0.25;
/// Number of points at which curves are compared.
const COMPARED: usize = 400;

/// A rectangle of the page with its axes. Places are in pixels, to the right and down.
pub struct Chart {
    /// Corner above and to the left.
    pub corner: [f64; 2],
    /// Width and height.
    pub size: [f64; 2],
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
}

impl Chart {
    /// The place of a point.
    pub fn place(&self, x: f64, y: f64) -> [f64; 2] {
        let [left, top] = self.corner;
        [left + self.size[0] * self.x.place(x), top + self.size[1] * (1.0 - self.y.place(y))]
    }

    /// Grid, axes, and their numbers where these are wanted: below, and to the left.
    pub fn frame(&self, text: &mut String, numbers: [bool; 2]) {
        let ([left, top], [width, height]) = (self.corner, self.size);
        let bottom = top + height;
        let mut grid = String::new();
        for (at, number) in self.x.marks() {
            let x = left + width * at;
            let _ = write!(grid, "M{x:.1} {top:.1}V{bottom:.1}");
            if numbers[0] {
                let y = bottom + 15.0;
                let _ = writeln!(text, "<text class=\"small m mid\" x=\"{x:.1}\" y=\"{y:.1}\">{number}</text>");
            }
        }
        for (at, number) in self.y.marks() {
            let y = bottom - height * at;
            let _ = write!(grid, "M{left:.1} {y:.1}h{width:.1}");
            if numbers[1] {
                let (x, y) = (left - 6.0, y + 4.0);
                let _ = writeln!(text, "<text class=\"small m end\" x=\"{x:.1}\" y=\"{y:.1}\">{number}</text>");
            }
        }
        let _ = writeln!(text, "<path class=\"grid\" d=\"{grid}\"/>");
        let _ = writeln!(text, "<path class=\"axis\" d=\"M{left:.1} {top:.1}V{bottom:.1}h{width:.1}\"/>");
    }

    /// A curve; it has gaps where values are not finite. Its name is shown where the reader points at it.
    pub fn curve(&self, text: &mut String, (x, y): (&[f64], &[f64]), class: &str, name: &str) {
        let mut d = String::new();
        for run in self.runs(x, y) {
            let points = simplified(&run);
            let list: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
            match list.len() {
                0 => {}
                // A dot: a line of three pixels.
                1 => drop(write!(d, "M{:.1} {:.1}h3", points[0][0] - 1.5, points[0][1])),
                _ => drop(write!(d, "M{}", list.join("L"))),
            }
        }
        if !d.is_empty() {
            let title = if name.is_empty() { String::new() } else { format!("<title>{}</title>", escaped(name)) };
            let _ = writeln!(text, "<path class=\"curve {class}\" d=\"{d}\">{title}</path>");
        }
    }

    /// Places of the points of a curve between its gaps, at most about four in a column of pixels.
    fn runs(&self, x: &[f64], y: &[f64]) -> Vec<Vec<[f64; 2]>> {
        let mut runs: Vec<Vec<[f64; 2]>> = vec![Vec::new()];
        for (x, y) in x.iter().zip(y) {
            let place = self.place(*x, *y);
            let last = runs.len() - 1;
            if place.iter().all(|c| c.is_finite()) {
                runs[last].push(place);
            } else if !runs[last].is_empty() {
                runs.push(Vec::new());
            }
        }
        runs.iter().map(|run| thinned(run)).collect()
    }

    /// Patterns of dashes for curves over the same `x`: a curve that is on an earlier one over much of its length gets
    /// another pattern, so that both are seen.
    pub fn dashes(&self, x: &[f64], curves: &[&[f64]]) -> Vec<usize> {
        let stride = x.len().div_ceil(COMPARED).max(1);
        let places = |curve: &[f64]| -> Vec<f64> {
            let all = x.iter().zip(curve).step_by(stride);
            all.map(|(x, y)| self.place(*x, *y)[1]).collect()
        };
        let places: Vec<Vec<f64>> = curves.iter().map(|c| places(c)).collect();
        let together = |a: &[f64], b: &[f64]| {
            let near = a.iter().zip(b).filter(|(a, b)| (*a - *b).abs() < SAME).count();
            near as f64 / a.len().min(b.len()).max(1) as f64
        };
        let mut found: Vec<usize> = Vec::new();
        for (k, place) in places.iter().enumerate() {
            let on = (0..k).filter(|j| together(&places[*j], place) > OFTEN);
            let dash = on.map(|j| found[j] + 1).max().unwrap_or(0);
            found.push(dash);
        }
        found
    }
}

/// The class of the `k`-th curve with its pattern.
pub fn class(k: usize, dash: usize) -> String {
    line_class(k, dash)
}

/// First, lowest, highest and last point of every column of pixels, in their order.
fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    let mut from = 0;
    while from < points.len() {
        let column = points[from][0].floor();
        let count = points[from..].iter().take_while(|p| p[0].floor() == column).count().max(1);
        let here = &points[from..from + count];
        let by = |a: &usize, b: &usize| here[*a][1].total_cmp(&here[*b][1]);
        let low = (0..count).min_by(by).unwrap_or_default();
        let high = (0..count).max_by(by).unwrap_or_default();
        let mut kept = [0, low, high, count - 1];
        kept.sort_unstable();
        for (k, at) in kept.iter().enumerate() {
            if k == 0 || kept[k - 1] != *at {
                out.push(here[*at]);
            }
        }
        from += count;
    }
    out
}

/// The points without those that are within [`FLAT`] of the line between their neighbours (Ramer, Douglas, Peucker).
fn simplified(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut kept = vec![false; points.len()];
    let Some(last) = points.len().checked_sub(1) else { return Vec::new() };
    (kept[0], kept[last]) = (true, true);
    let mut parts = vec![(0, last)];
    while let Some((from, to)) = parts.pop() {
        let ([x, y], [u, v]) = (points[from], points[to]);
        let (dx, dy) = (u - x, v - y);
        let length = dx.hypot(dy);
        let distance = |k: usize| {
            let [a, b] = [points[k][0] - x, points[k][1] - y];
            if length > 0.0 {
                (a * dy - b * dx).abs() / length
            } else {
                a.hypot(b)
            }
        };
        let farthest = (from + 1..to).max_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        if let Some(k) = farthest.filter(|k| distance(*k) > FLAT) {
            kept[k] = true;
            parts.extend([(from, k), (k, to)]);
        }
    }
    points.iter().zip(kept).filter(|(_, kept)| *kept).map(|(p, _)| *p).collect()
}
