//! Height fields on the ground in pictures.

use std::fmt::Write as _;

use multibody::codegen::model::{Frame, ShapeKind};
use multibody::codegen::plan::Plan;
use multibody::runtime::field::Field;
use multibody::runtime::sweep::FrameState;

use super::view::{Page, View};

/// Lines along either axis, and points of each.
const LINES: usize = 9;
const POINTS: usize = 80;

/// Lines on the height fields of a plan that are fixed to the ground, as far as what is seen goes.
pub fn lines(plan: &Plan, seen: &[[f64; 3]]) -> Vec<Vec<[f64; 3]>> {
    let mut model = plan.model.clone();
    let mut fields: Vec<(String, &Field)> = Vec::new();
    for shape in plan.model.shapes.iter().filter(|shape| shape.mount.body.is_none()) {
        if let ShapeKind::HeightField { field, .. } = shape.kind {
            // A control character is in no name of the model.
            let name = format!("\u{1}{}", fields.len());
            model.frames.push(Frame { name: name.clone(), body: None, placement: shape.mount.placement });
            fields.push((name, field));
        }
    }
    if fields.is_empty() {
        return Vec::new();
    }
    // Where the mechanism is makes no difference to the ground.
    let shown = Plan::new(&model, 1e-9);
    let mut poses = vec![FrameState::ground(); shown.frames.len()];
    shown.default_interpreter().frames(&shown.start(), &vec![0.0; shown.dims.nv], &mut poses);
    let pose = |name: &str| shown.frames.iter().position(|frame| frame.name == name).map(|k| &poses[k]);
    let of_field = |(name, field): &(String, &Field)| pose(name).map_or(Vec::new(), |at| on(field, at, seen));
    fields.iter().flat_map(of_field).collect()
}

fn on(field: &Field, at: &FrameState<f64>, seen: &[[f64; 3]]) -> Vec<Vec<[f64; 3]>> {
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
            let p = [x, y, field.at([x, y]).height];
            std::array::from_fn(|i| at.position[i] + (0..3).map(|k| at.rotation[i][k] * p[k]).sum::<f64>())
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
