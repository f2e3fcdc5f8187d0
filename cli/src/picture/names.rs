//! Names of bodies, placed where they hide least.

use std::fmt::Write as _;

use super::view::{MARGIN, WIDTH};
use crate::ink::{self, escaped, COLOURS};

/// Size of the letters, and height of a name, pixels.
const LETTERS: f64 = 11.0;
const HEIGHT: f64 = 14.0;
/// Directions and distances from a body in which its name is tried, pixels.
const DIRECTIONS: usize = 16;
const DISTANCES: [f64; 7] = [16.0, 24.0, 34.0, 48.0, 66.0, 90.0, 120.0];
/// Distance of the points that stand for lines, pixels.
const GRAIN: f64 = 4.0;

/// A body to name: its place on the page, its name, and the index of its colour.
pub type Named = ([f64; 2], String, usize);

/// A rectangle: left, top, right, bottom.
type Room = [f64; 4];

fn overlap(a: &Room, b: &Room) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Points along closed or open lines, for [`draw`].
pub fn grains(corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    for (k, a) in corners.iter().enumerate() {
        let b = corners[(k + 1) % corners.len()];
        let n = ((b[0] - a[0]).hypot(b[1] - a[1]) / GRAIN).ceil().clamp(1.0, 400.0) as usize;
        out.extend((0..n).map(|i| [0, 1].map(|c| a[c] + (b[c] - a[c]) * i as f64 / n as f64)));
    }
    out
}

/// Points that stand for a body: its outline at both sides of its corners, and what is within, more loosely.
pub fn covered(corners: &[[f64; 2]], width: f64) -> Vec<[f64; 2]> {
    let n = corners.len().max(1) as f64;
    let middle = [0, 1].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / n);
    let mut out = Vec::new();
    for part in [1.0, 0.7, 0.4] {
        let shrunk: Vec<[f64; 2]> =
            corners.iter().map(|c| [0, 1].map(|k| middle[k] + part * (c[k] - middle[k]))).collect();
        out.extend(grains(&shrunk));
    }
    if width > 8.0 {
        let at = |dx: f64, dy: f64| corners.iter().map(|c| [c[0] + dx, c[1] + dy]).collect::<Vec<_>>();
        let r = 0.4 * width;
        [(r, 0.0), (-r, 0.0), (0.0, r), (0.0, -r)].iter().for_each(|(dx, dy)| out.extend(grains(&at(*dx, *dy))));
    }
    out
}

/// Draws the names with leaders. `drawn` are points of what they had better not hide; `heights` bound the page.
pub fn draw(text: &mut String, names: &[Named], drawn: &[[f64; 2]], heights: [f64; 2]) {
    let mut taken: Vec<Room> = Vec::new();
    let mut order: Vec<&Named> = names.iter().filter(|n| n.0.iter().all(|x| x.is_finite())).collect();
    order.sort_by(|a, b| a.0[1].total_cmp(&b.0[1]).then(a.0[0].total_cmp(&b.0[0])));
    for (place, name, colour) in order {
        let width = ink::width(name, LETTERS);
        let mut best: Option<(f64, Room)> = None;
        for (distance, direction) in DISTANCES.iter().flat_map(|d| (0..DIRECTIONS).map(move |k| (*d, k))) {
            let (s, c) = (std::f64::consts::TAU * direction as f64 / DIRECTIONS as f64).sin_cos();
            // The nearest edge of the name is at this distance.
            let middle = [place[0] + c * (distance + 0.5 * width), place[1] - s * (distance + 0.5 * HEIGHT)];
            let room =
                [middle[0] - 0.5 * width, middle[1] - 0.5 * HEIGHT, middle[0] + 0.5 * width, middle[1] + 0.5 * HEIGHT];
            let inside = room[0] > 6.0 && room[2] < WIDTH - 6.0 && room[1] > heights[0] && room[3] < heights[1];
            if !inside || taken.iter().any(|other| overlap(&room, other)) {
                continue;
            }
            let air = [room[0] - 3.0, room[1] - 2.0, room[2] + 3.0, room[3] + 2.0];
            let hidden = drawn.iter().filter(|p| overlap(&air, &[p[0], p[1], p[0], p[1]])).count();
            let cost = 3.0 * hidden as f64 + distance;
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, room));
            }
        }
        let Some((_, room)) = best else { continue };
        taken.push(room);
        let to = [place[0].clamp(room[0] - 2.0, room[2] + 2.0), place[1].clamp(room[1], room[3])];
        let ([x, y], [u, v], k) = (*place, to, colour % COLOURS);
        let _ = writeln!(text, "<path class=\"n c{k}\" d=\"M{x:.1} {y:.1}L{u:.1} {v:.1}\"/>");
        let _ = writeln!(text, "<circle class=\"k{k}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\"/>");
        let (left, base) = (room[0], room[3] - 3.5);
        let _ = writeln!(text, "<text class=\"small\" x=\"{left:.1}\" y=\"{base:.1}\">{}</text>", escaped(name));
    }
}

/// The legend of the paths above the picture: samples of the lines and names, as far as they fit.
pub fn legend(text: &mut String, paths: &[String]) {
    let mut x = MARGIN;
    for (k, name) in paths.iter().enumerate() {
        let name = ink::shortened(&format!("path of {name}"), LETTERS, 220.0);
        let end = x + 34.0 + ink::width(&name, LETTERS);
        if end > WIDTH - 12.0 {
            break;
        }
        let _ = writeln!(text, "<path class=\"n ink{}\" stroke-width=\"1.4\" d=\"M{x:.1} 17h26\"/>", dashes(k));
        let _ = writeln!(text, "<text class=\"small\" x=\"{:.1}\" y=\"21\">{}</text>", x + 32.0, escaped(&name));
        x = end + 20.0;
    }
}

/// Class of the pattern of a path.
pub fn dashes(k: usize) -> String {
    match k % ink::DASHES {
        0 => String::new(),
        d => format!(" d{d}"),
    }
}
