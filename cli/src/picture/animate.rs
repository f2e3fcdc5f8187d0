//! The moving picture: every part has its outline at many instants, and the reader's program goes from one to the next.
//!
//! The file has no script. Who prefers reduced motion sees the still picture, which is in the same file.

use std::fmt::Write as _;

use super::names::dashes;
use super::outline::{mark, Outline};
use super::touch::arrow_paths;
use super::{by_depth, path_of, Instant, Scene, Sheet};

/// Time for which a motion is shown, s: between these, by factors of 1, 2 or 5.
const SHOWN: [f64; 2] = [2.5, 20.0];
/// Instants in a second of the picture, and the largest number of them.
const RATE: f64 = 24.0;
const MOST: usize = 120;
/// Part of the page's size within which the end of a motion has come back to its start.
const CLOSED: f64 = 0.02;
/// Part of the time for which the last instant is held of a motion that does not come back.
const HELD: f64 = 0.15;
/// Corners of an outline whose number of corners changes.
const CORNERS: usize = 24;

/// How many times slower than in truth a motion of `time` s is shown.
fn slower(time: f64) -> f64 {
    let mut factor = 1.0;
    let steps = [2.0, 2.5, 2.0];
    let positive = time.is_finite() && time > 0.0;
    let mut k = 0;
    while positive && time * factor < SHOWN[0] && k < 60 {
        factor *= steps[k % 3];
        k += 1;
    }
    while positive && time * factor > SHOWN[1] && k < 60 {
        factor /= steps[k % 3];
        k += 1;
    }
    factor
}

/// What the picture shows.
pub fn caption(time: f64) -> String {
    let factor = slower(time);
    let pace = match factor {
        f if f > 1.5 => format!(", {f:.0} times slower"),
        f if f < 0.7 => format!(", {:.0} times faster", 1.0 / f),
        _ => String::new(),
    };
    // Four digits tell times apart; more are noise.
    let digits = (3.0 - time.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    let shown = format!("{time:.digits$}");
    let shown = if shown.contains('.') { shown.trim_end_matches('0').trim_end_matches('.') } else { &shown };
    format!("{shown} s{pace}")
}

/// Rows of the instants.
pub fn rows(scene: &Scene) -> Vec<usize> {
    let time = scene.record.t.last().copied().unwrap_or_default();
    let n = (RATE * time * slower(time)).clamp(2.0, MOST as f64) as usize;
    let n = n.min(scene.last() + 1);
    (0..n).map(|k| scene.row(k, n)).collect()
}

/// Attributes of the timing.
struct Clock {
    seconds: f64,
    /// Times of the instants, and of the end, where the last one is held.
    times: String,
    holds: bool,
}

impl Clock {
    fn new(sheet: &Sheet, instants: &[Instant], time: f64) -> Clock {
        let ends = (instants.first(), instants.last());
        let away = |(a, b): (&Instant, &Instant)| {
            let points = a.lines.iter().flat_map(|l| &l.points).zip(b.lines.iter().flat_map(|l| &l.points));
            points.map(|(p, q)| (0..3).fold(0.0_f64, |n, k| n.hypot(p[k] - q[k]))).fold(0.0, f64::max)
        };
        let holds = match ends {
            (Some(a), Some(b)) => away((a, b)) > CLOSED * sheet.page.size(),
            _ => true,
        };
        let seconds = (time * slower(time)).max(1.0) / if holds { 1.0 - HELD } else { 1.0 };
        let n = instants.len();
        let at = |k: usize| (1.0 - HELD) * k as f64 / (n.max(2) - 1) as f64;
        let times: Vec<String> = (0..n).map(|k| format!("{:.4}", at(k))).collect();
        let times = if holds { format!(" keyTimes=\"{};1\"", times.join(";")) } else { String::new() };
        Clock { seconds, times, holds }
    }

    /// An animation of an attribute through values, one for each instant; nothing where they are all the same.
    fn animation(&self, attribute: &str, values: &[String]) -> String {
        let (Some(first), Some(last)) = (values.first(), values.last()) else { return String::new() };
        if values.iter().all(|v| v == first) {
            return String::new();
        }
        let end = if self.holds { format!(";{last}") } else { String::new() };
        let (list, seconds) = (values.join(";"), self.seconds);
        // Times are written only where they are not even.
        let times = if self.holds { self.times.as_str() } else { "" };
        format!(
            "<animate attributeName=\"{attribute}\" dur=\"{seconds:.2}s\" repeatCount=\"indefinite\"{times} values=\"{list}{end}\"/>"
        )
    }
}

/// Draws the moving mechanism, and the rules that show it or the still one.
pub fn draw(text: &mut String, sheet: &Sheet, instants: &[Instant], paths: &[Vec<[f64; 3]>], time: f64) {
    let Some(first) = instants.first() else { return };
    let clock = Clock::new(sheet, instants, time);
    text.push_str(
        "<style>.still{display:none}@media(prefers-reduced-motion:reduce){.still{display:inline}.moving{display:none}}</style>\n\
         <g class=\"moving\">\n",
    );
    for (k, path) in paths.iter().enumerate() {
        let class = dashes(k);
        let _ = writeln!(
            text,
            "<path class=\"n ink{class}\" stroke-width=\"1.4\" stroke-opacity=\".6\" d=\"{}\"/>",
            path_of(sheet, path)
        );
    }
    for part in by_depth(sheet, &first.lines) {
        let outlines: Vec<Outline> = instants
            .iter()
            .filter_map(|i| i.lines.get(part))
            .map(|line| Outline::new(line, &sheet.page, &sheet.view))
            .collect();
        moving_part(text, &clock, part, outlines);
    }
    arrows(text, sheet, &clock, instants);
    for path in paths {
        let n = instants.len();
        let at = |k: usize| path[(k * (path.len() - 1) + (n.max(2) - 1) / 2) / (n.max(2) - 1)];
        let places = (0..n).map(|k| sheet.page.place(sheet.view.project(at(k))));
        dot(text, &clock, &places.collect::<Vec<_>>(), |text, place, inside| {
            let [x, y] = place;
            let _ = writeln!(text, "<circle class=\"ink\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\">{inside}</circle>");
        });
    }
    text.push_str("</g>\n");
}

/// Draws what is at a place that moves.
fn dot(text: &mut String, clock: &Clock, places: &[[f64; 2]], draw: impl Fn(&mut String, [f64; 2], &str)) {
    let Some(first) = places.first().filter(|_| places.iter().flatten().all(|x| x.is_finite())) else { return };
    let values = |k: usize| places.iter().map(|p| format!("{:.1}", p[k])).collect::<Vec<_>>();
    let inside = clock.animation("cx", &values(0)) + &clock.animation("cy", &values(1));
    draw(text, *first, &inside);
}

/// Draws one part and the marks of its joints.
fn moving_part(text: &mut String, clock: &Clock, part: usize, mut outlines: Vec<Outline>) {
    let Some(most) = outlines.iter().map(|o| o.corners.len()).max() else { return };
    if most > 1 {
        matched(&mut outlines);
        let values: Vec<String> = outlines.iter().map(|o| Outline::path(&o.corners)).collect();
        let first = &outlines[0];
        let inside = clock.animation("d", &values);
        // The path is written once, and drawn with each of its strokes.
        let _ = writeln!(text, "<defs><path id=\"p{part}\" d=\"{}\">{inside}</path></defs>", values[0]);
        for (class, width) in first.strokes() {
            let _ = writeln!(text, "<use href=\"#p{part}\" class=\"round {class}\" stroke-width=\"{width:.1}\"/>");
        }
    }
    let (count, size) = (outlines[0].marks.len(), outlines[0].mark_size());
    for m in 0..count {
        let places: Vec<[f64; 2]> = outlines.iter().filter_map(|o| o.marks.get(m)).map(|(p, _)| *p).collect();
        dot(text, clock, &places, |text, place, inside| mark(text, place, false, size, inside));
    }
}

/// Gives the outlines of all instants the same number of corners, those of one instant beside those of the next.
fn matched(outlines: &mut [Outline]) {
    let count = outlines[0].corners.len();
    if !(2..=CORNERS).contains(&count) || outlines.iter().any(|o| o.corners.len() != count) {
        outlines.iter_mut().for_each(|o| o.corners = supported(&o.corners));
        return;
    }
    for k in 1..outlines.len() {
        let before = outlines[k - 1].corners.clone();
        let here = &mut outlines[k].corners;
        let away = |shift: usize| -> f64 {
            (0..count).map(|i| (0..2).map(|c| (here[(i + shift) % count][c] - before[i][c]).powi(2)).sum::<f64>()).sum()
        };
        let best = (0..count).min_by(|a, b| away(*a).total_cmp(&away(*b))).unwrap_or_default();
        here.rotate_left(best);
    }
}

/// The corners that are farthest in evenly spaced directions.
fn supported(corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let farthest = |k: usize| {
        let (s, c) = (std::f64::consts::TAU * k as f64 / CORNERS as f64).sin_cos();
        let along = |p: &[f64; 2]| c * p[0] + s * p[1];
        corners.iter().copied().max_by(|a, b| along(a).total_cmp(&along(b))).unwrap_or_default()
    };
    (0..CORNERS).map(farthest).collect()
}

/// Draws the forces of contacts. Where one is zero, its arrow is a point.
fn arrows(text: &mut String, sheet: &Sheet, clock: &Clock, instants: &[Instant]) {
    let Some(scale) = &sheet.scale else { return };
    let most = instants.iter().map(|i| i.arrows.len()).max().unwrap_or_default();
    for k in 0..most {
        let mut place = [0.0; 2];
        let paths = instants.iter().map(|i| {
            let ends = i.arrows.get(k).map(|arrow| scale.ends(&sheet.page, &sheet.view, arrow));
            if let Some([from, _]) = ends {
                place = from;
            }
            let [x, y] = place;
            let point =
                || [format!("M{x:.1} {y:.1}L{x:.1} {y:.1}"), format!("M{x:.1} {y:.1}L{x:.1} {y:.1}L{x:.1} {y:.1}Z")];
            ends.and_then(|[from, to]| arrow_paths(from, to)).unwrap_or_else(point)
        });
        let (shafts, tips): (Vec<String>, Vec<String>) = paths.map(|[shaft, tip]| (shaft, tip)).unzip();
        for (values, width) in [(shafts, 2.0), (tips, 0.0)] {
            let inside = clock.animation("d", &values);
            let _ =
                writeln!(text, "<path class=\"force\" stroke-width=\"{width}\" d=\"{}\">{inside}</path>", values[0]);
        }
    }
}
