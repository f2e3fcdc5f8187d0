//! What does not move: supports of joints on the ground, gravity, scales.

use std::fmt::Write as _;

use super::touch::{across, arrow, hatched};
use super::view::{Page, View, FOOT, MARGIN, WIDTH};
use crate::ink::escaped;

/// Size of the support of a joint, pixels.
const SUPPORT: f64 = 15.0;

/// Supports of the points that hold the mechanism: the usual triangle on hatched ground where it is seen from its side, a
/// piece of floor in space. `down` is the direction of gravity.
pub fn supports(text: &mut String, page: &Page, view: &View, points: &[[f64; 3]], down: Option<[f64; 3]>) {
    if view.sees_a_plane() {
        let mut done: Vec<[f64; 2]> = Vec::new();
        for p in points {
            let place = page.place(view.project(*p));
            if done.iter().all(|q| (place[0] - q[0]).hypot(place[1] - q[1]) > 2.0) {
                support(text, place, down.map_or([0.0, -1.0], |d| view.project(d)));
                done.push(place);
            }
        }
        return;
    }
    for corners in pieces(points, page.size(), down) {
        let list: Vec<String> =
            corners.iter().map(|p| page.place(view.project(*p))).map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let _ = writeln!(text, "<polygon class=\"floor\" points=\"{}\"/>", list.join(" "));
    }
}

/// The pieces of floor below the points that hold a mechanism of some size, m: their corners.
pub fn pieces(points: &[[f64; 3]], size: f64, down: Option<[f64; 3]>) -> Vec<[[f64; 3]; 4]> {
    let down = down.unwrap_or([0.0, 0.0, -1.0]);
    let n = down.map(|x| -x);
    let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let bounds = |axis: &[f64; 3]| {
        points.iter().fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(dot(p, axis)), b.max(dot(p, axis))))
    };
    let (low, high) = bounds(&n);
    let pad = 0.07 * size;
    if points.is_empty() {
        return Vec::new();
    }
    // One piece below all of them where they are at one height, or else one below each.
    let pieces: Vec<Vec<[f64; 3]>> = match high - low < 0.3 * pad {
        true => vec![points.to_vec()],
        false => points.iter().map(|p| vec![*p]).collect(),
    };
    let pad = if pieces.len() > 1 { 0.5 * pad } else { pad };
    let corners = |piece: Vec<[f64; 3]>| {
        let [x, y] = across(n);
        let level = piece.iter().map(|p| dot(p, &n)).fold(f64::MAX, f64::min);
        let range = |axis: &[f64; 3]| {
            let all = piece.iter().map(|p| dot(p, axis));
            all.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x - pad), b.max(x + pad)))
        };
        let ((a, b), (c, d)) = (range(&x), range(&y));
        let corner = |(s, t): (f64, f64)| [0, 1, 2].map(|k| s * x[k] + t * y[k] + level * n[k]);
        [(a, c), (b, c), (b, d), (a, d)].map(corner)
    };
    pieces.into_iter().map(corners).collect()
}

/// The support of a joint in the plane.
fn support(text: &mut String, [x, y]: [f64; 2], down: [f64; 2]) {
    let length = down[0].hypot(down[1]);
    // Down the page is positive.
    let [u, v] = if length > 1e-6 { [down[0] / length, -down[1] / length] } else { [0.0, 1.0] };
    let along = [v, -u];
    let at = |s: f64, t: f64| [x + s * along[0] + t * u, y + s * along[1] + t * v];
    let ([ax, ay], [bx, by]) = (at(-0.7 * SUPPORT, SUPPORT), at(0.7 * SUPPORT, SUPPORT));
    let _ = writeln!(text, "<path class=\"floor round\" d=\"M{x:.1} {y:.1}L{ax:.1} {ay:.1}L{bx:.1} {by:.1}Z\"/>");
    hatched(text, at(-1.4 * SUPPORT, SUPPORT), along, 2.8 * SUPPORT, [u, v]);
}

/// The largest number of one digit, 1, 2 or 5, that is at most `x`.
fn round(x: f64) -> f64 {
    let decade = 10.0_f64.powf(x.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|m| m * decade).find(|l| *l <= x).unwrap_or(decade)
}

/// The foot of the picture: scale, that of forces in m on the page per N where there are any, gravity, and the caption.
pub fn foot(
    text: &mut String,
    (page, view): (&Page, &View),
    caption: &str,
    force: Option<f64>,
    down: Option<[f64; 3]>,
) {
    let length = round(WIDTH / 6.0 / page.scale);
    let (y, to) = (page.height + 0.5 * FOOT, MARGIN + length * page.scale);
    let _ = writeln!(text, "<path class=\"axis\" d=\"M{MARGIN} {:.1}v8m0 -4H{to:.1}m0 -4v8\"/>", y - 4.0);
    let write = |text: &mut String, x: f64, what: &str| {
        let _ = writeln!(text, "<text class=\"m\" x=\"{x:.1}\" y=\"{:.1}\">{what}</text>", y + 4.0);
        x + crate::ink::width(what, 12.0)
    };
    let mut x = write(text, to + 8.0, &format!("{length} m")) + 24.0;
    if let Some(metres) = force {
        let newtons = round(WIDTH / 8.0 / (metres * page.scale));
        let to = x + newtons * metres * page.scale;
        arrow(text, [x, y], [to, y], "force");
        x = write(text, to + 8.0, &format!("{newtons} N")) + 24.0;
    }
    if let Some(down) = down {
        gravity(text, view.project(down), view.depth(down), [x + 8.0, y]);
        write(text, x + 24.0, "g");
    }
    let _ = writeln!(
        text,
        "<text class=\"m end\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
        WIDTH - MARGIN,
        y + 4.0,
        escaped(caption)
    );
}

/// The direction of gravity: an arrow, or the feathers or the point of one that is seen from its end.
fn gravity(text: &mut String, [u, v]: [f64; 2], towards: f64, [x, y]: [f64; 2]) {
    let length = u.hypot(v);
    if length > 0.3 {
        let [dx, dy] = [u, -v].map(|c| 13.0 * c / length);
        arrow(text, [x - dx, y - dy], [x + dx, y + dy], "ink");
        return;
    }
    let _ = writeln!(text, "<circle class=\"pin\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"7\"/>");
    let _ = match towards > 0.0 {
        true => writeln!(text, "<circle class=\"ink\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\"/>"),
        false => {
            let (x, y) = (x - 4.5, y - 4.5);
            writeln!(text, "<path class=\"n ink\" d=\"M{x:.1} {y:.1}l9 9m-9 0l9 -9\"/>")
        }
    };
}
