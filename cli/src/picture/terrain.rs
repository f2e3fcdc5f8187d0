//! Height fields on the ground in pictures.

use std::fmt::Write as _;

use multibody::codegen::model::ShapeKind;
use multibody::runtime::field::Field;
use multibody::runtime::sweep::FrameState;

use super::touch::{plus, rotated};
use super::view::{Page, View};

/// Lines along either axis, and points of each.
const LINES: usize = 9;
const POINTS: usize = 80;

/// The ground of a shape that is a height field.
pub fn field_of(kind: &ShapeKind) -> Option<&'static Field> {
    match *kind {
        ShapeKind::HeightField { field, .. } => Some(field),
        _ => None,
    }
}

/// Lines on a height field with its axes at a pose, as far as what is seen goes.
pub fn lines(field: &Field, at: &FrameState<f64>, seen: &[[f64; 3]]) -> Vec<Vec<[f64; 3]>> {
    let bounds = [0, 1].map(|k: usize| {
        let along = |p: &[f64; 3]| (0..3).map(|i| (p[i] - at.position[i]) * at.rotation[i][k]).sum::<f64>();
        seen.iter().map(along).fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)))
    });
    let pad = 0.1 * bounds.iter().fold(1e-3, |m: f64, (a, b)| m.max(b - a));
    let place = |k: usize, part: f64| {
        let (low, high) = bounds[k];
        low - pad + part * (high - low + 2.0 * pad)
    };
    let line = |n: usize| {
        let (along, line) = (n / LINES, n % LINES);
        let point = |k: usize| {
            let mut x = [line as f64 / (LINES - 1) as f64; 2];
            x[along] = k as f64 / POINTS as f64;
            let [x, y] = [0, 1].map(|axis| place(axis, x[axis]));
            plus(at.position, rotated(&at.rotation, [x, y, field.at([x, y]).height]))
        };
        (0..=POINTS).map(point).collect()
    };
    (0..2 * LINES).map(line).collect()
}

/// Draws a line.
pub fn draw(text: &mut String, page: &Page, view: &View, points: &[[f64; 3]]) {
    let places = points.iter().map(|p| page.place(view.project(*p)));
    let path: Vec<String> = places.map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
    let _ = writeln!(text, "<path class=\"axis\" stroke-opacity=\".6\" d=\"M{}\"/>", path.join("L"));
}
