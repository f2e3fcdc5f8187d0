//! Pictures of a motion: the mechanism at several instants, as SVG text.

mod shapes;
mod touch;
mod view;

use std::fmt::Write as _;

use multibody::codegen::plan::Plan;
use multibody::codegen::words;
use multibody::runtime::sweep::FrameState;
use multibody::runtime::Interpreter;

use super::args::SimulateArgs;
use super::motion::Record;
use super::plot::colour;
use super::{Failure, Outcome};
use shapes::{Line, Shapes};
use touch::{Arrow, Scale, Touch};
use view::{hull, Page, View};

/// Settings of a picture.
pub struct Drawing {
    /// Direction from the mechanism to the eye.
    view: Option<[f64; 3]>,
    /// Frames whose paths are drawn.
    traces: Vec<usize>,
    /// Number of instants.
    strobes: usize,
}

/// Largest number of points of a path; more points enlarge the file without a visible difference.
const POINTS: usize = 400;

type Frames = Vec<FrameState<f64>>;

/// The settings of the arguments.
pub fn drawing(plan: &Plan, args: &SimulateArgs) -> Outcome<Drawing> {
    let find = |name: &String| {
        let names = || plan.frames.iter().map(|f| f.name.as_str());
        names().position(|n| n == name).ok_or_else(|| {
            let help = words::did_you_mean(name, names(), || format!("frames are {}", words::list(names())));
            Failure::new(format!("--trace: no body or frame is named {}", words::quote(name)), help)
        })
    };
    let traces = args.trace.iter().map(find).collect::<Outcome<Vec<usize>>>()?;
    if args.view.is_some_and(|v| v.iter().all(|x| *x == 0.0)) {
        return Err(Failure::new("--view is 0,0,0, which is no direction", "give the direction to the eye, as 0,-1,0"));
    }
    Ok(Drawing { view: args.view, traces, strobes: usize::from(args.strobes) })
}

/// The picture. `forces` are those of the contacts, along their rows, for every time of the record; nothing where none are
/// known.
pub fn svg(plan: &Plan, record: &Record, forces: &[Vec<[f64; 3]>], drawing: &Drawing) -> String {
    let shapes = Shapes::new(plan);
    let mut touch = Touch::new(plan);
    let mut interpreter: Interpreter<f64> = plan.default_interpreter();
    let mut frames = |row: usize| -> Frames {
        let mut out = vec![FrameState::ground(); plan.frames.len()];
        interpreter.frames(&record.q[row], &record.v[row], &mut out);
        out
    };
    let last = record.t.len() - 1;
    let part = |k: usize, n: usize| if n < 2 { last } else { (k * last + (n - 1) / 2) / (n - 1) };
    let rows: Vec<usize> = (0..drawing.strobes).map(|k| part(k, drawing.strobes)).collect();
    let instants: Vec<Frames> = rows.iter().map(|row| frames(*row)).collect();
    // Poses of shapes and places of contacts.
    let touched: Vec<Frames> = match &mut touch {
        Some(touch) => rows.iter().map(|&row| touch.poses(&record.q[row], &record.v[row])).collect(),
        None => Vec::new(),
    };
    let arrows: Vec<Vec<Arrow>> = touched
        .iter()
        .zip(&rows)
        .map(|(poses, &row)| match (&touch, forces.get(row)) {
            (Some(touch), Some(forces)) => touch.arrows(poses, forces),
            _ => Vec::new(),
        })
        .collect();
    let paths: Vec<Vec<[f64; 3]>> = match drawing.traces.is_empty() {
        true => Vec::new(),
        false => {
            let n = POINTS.min(last + 1);
            let all: Vec<Frames> = (0..n).map(|k| frames(part(k, n))).collect();
            drawing.traces.iter().map(|&f| all.iter().map(|a| a[f].position).collect()).collect()
        }
    };
    let seen = instants.iter().flat_map(|f| shapes.points(f)).chain(paths.iter().flatten().copied());
    let mut seen: Vec<[f64; 3]> = seen.filter(|p| p.iter().all(|x| x.is_finite())).collect();
    let flat = View::new(drawing.view, &seen);
    let mut grounds = Vec::new();
    if let (Some(touch), Some(poses)) = (&touch, touched.last()) {
        let solids = touched.iter().flat_map(|poses| touch.solids(poses, false)).chain(touch.solids(poses, true));
        seen.extend(solids.flat_map(|line| line.points).filter(|p| p.iter().all(|x| x.is_finite())));
        grounds = touch.grounds(poses, &seen);
    }
    // What moves in a plane is seen from its side, whatever the widths of its shapes.
    let view = if flat.sees_a_plane() { flat } else { View::new(drawing.view, &seen) };
    let corners = grounds.iter().flat_map(|(corners, _)| corners.iter());
    let mut page = Page::new(seen.iter().chain(corners).map(|p| view.project(*p)));
    let scale = Scale::new(arrows.iter().flatten(), &page);
    if let Some(scale) = &scale {
        // Arrows fit on the page too.
        let ends = arrows.iter().flatten().map(|(p, f)| std::array::from_fn(|k| p[k] + scale.metres * f[k]));
        let corners = grounds.iter().flat_map(|(corners, _)| corners.iter().copied());
        page = Page::new(seen.iter().copied().chain(corners).chain(ends).map(|p| view.project(p)));
    }
    let mut text = page.head();
    grounds.iter().for_each(|ground| touch::ground(&mut text, &page, &view, ground));
    if let (Some(touch), Some(poses)) = (&touch, touched.last()) {
        touch.solids(poses, true).iter().for_each(|line| body(&mut text, &page, &view, line, "#888"));
    }
    let still = vec![FrameState::ground(); plan.frames.len()];
    body(&mut text, &page, &view, &shapes.ground(&still), "#777");
    for (k, frames) in instants.iter().enumerate() {
        let fade = if drawing.strobes < 2 { 1.0 } else { k as f64 / (drawing.strobes - 1) as f64 };
        let opacity = 0.14 + 0.86 * fade * fade * fade;
        let _ = writeln!(text, "<g opacity=\"{opacity:.2}\">");
        let mut lines = shapes.lines(frames);
        if let (Some(touch), Some(poses)) = (&touch, touched.get(k)) {
            lines.extend(touch.solids(poses, false));
        }
        // Nearer parts are drawn over those behind them; parts at the same distance keep their order in spite of
        // rounding.
        let depth = |line: &Line| (view.depth(line.middle()) / (1e-6 * page.size())).round();
        lines.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
        for line in &lines {
            body(&mut text, &page, &view, line, &hsl(line.colour));
        }
        if let (Some(scale), Some(arrows)) = (&scale, arrows.get(k)) {
            arrows.iter().for_each(|arrow| scale.draw(&mut text, &page, &view, arrow));
        }
        text.push_str("</g>\n");
    }
    for (k, path) in paths.iter().enumerate() {
        let points: Vec<String> = path.iter().map(|p| page.at(view.project(*p))).collect();
        let colour = ["#c00000", "#0050b0", "#208020"][k % 3];
        let points = points.join(" ");
        let _ =
            writeln!(text, "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.3\"/>");
    }
    text + &page.foot(&caption(record, drawing), scale.as_ref().map(|scale| scale.metres))
}

/// The caption below the picture.
fn caption(record: &Record, drawing: &Drawing) -> String {
    let end = record.t.last().copied().unwrap_or_default();
    match drawing.strobes {
        1 => format!("t = {end} s"),
        n => format!("{n} instants from 0 to {end} s"),
    }
}

fn hsl(k: usize) -> String {
    let c = colour(k);
    format!("hsl({:.0},{:.0}%,{:.0}%)", c.0 * 360.0, c.1 * 100.0, c.2 * 100.0)
}

/// One body: its outline and the marks of its joints.
fn body(text: &mut String, page: &Page, view: &View, line: &Line, colour: &str) {
    let points: Vec<[f64; 2]> = line.points.iter().map(|p| view.project(*p)).collect();
    let outline = if line.closed { points.clone() } else { hull(&points, line.flat * page.size()) };
    let list: Vec<String> = outline.iter().map(|p| page.at(*p)).collect();
    let (list, width) = (list.join(" "), line.width);
    let _ = match outline.len() {
        0 | 1 => Ok(()),
        2 => writeln!(text, "<polyline points=\"{list}\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\"/>"),
        _ => writeln!(
            text,
            "<polygon points=\"{list}\" fill=\"{colour}\" fill-opacity=\".18\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"/>"
        ),
    };
    for (mark, square) in &line.marks {
        let [x, y] = page.place(view.project(*mark));
        let _ = match square {
            true => {
                let (x, y) = (x - 5.0, y - 5.0);
                writeln!(text, "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"10\" height=\"10\" fill=\"#fff\" stroke=\"{colour}\" stroke-width=\"1.5\"/>")
            }
            false => writeln!(text, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"#fff\" stroke=\"{colour}\" stroke-width=\"1.3\"/>"),
        };
    }
}
