//! Pictures of a motion, as SVG text: the mechanism at several instants, or moving.

mod animate;
mod base;
pub mod flesh;
pub mod limbs;
mod names;
mod outline;
pub mod shapes;
mod solid;
mod terrain;
mod touch;
mod view;

use std::fmt::Write as _;

use multibody::codegen::model::{Gravity, Value};
use multibody::codegen::plan::Plan;
use multibody::codegen::words;
use multibody::runtime::sweep::FrameState;
use multibody::runtime::Interpreter;

use super::args::{Names, SimulateArgs};
use super::ink;
use super::motion::Record;
use super::{Failure, Outcome};
use outline::Outline;
use shapes::Line;
pub use shapes::Shapes;
pub use solid::{plate, Directions, Mesh};
pub use touch::towards;
use touch::{Arrow, Scale, Touch};
use view::{Page, View, HEAD, WIDTH};

/// Settings of a picture.
pub struct Drawing {
    /// Direction from the mechanism to the eye.
    view: Option<[f64; 3]>,
    /// Frames whose paths are drawn.
    traces: Vec<usize>,
    /// Number of instants.
    strobes: usize,
    /// Whether the picture moves.
    moves: bool,
    /// What is named.
    names: Names,
}

/// Largest number of points of a path; more points enlarge the file without a visible difference.
const POINTS: usize = 400;
/// Largest number of names that are drawn unasked.
const FEW: usize = 9;

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
    let strobes = usize::from(args.strobes);
    Ok(Drawing { view: args.view, traces, strobes, moves: args.animate, names: args.names })
}

/// What is drawn of a model, and the record of its motion.
struct Scene<'a> {
    record: &'a Record,
    forces: &'a [Vec<[f64; 3]>],
    shapes: Shapes,
    touch: Option<Touch>,
    interpreter: Interpreter<f64>,
    /// Number of frames.
    frames: usize,
}

/// The mechanism at one time.
struct Instant {
    frames: Frames,
    /// Bodies and solids.
    lines: Vec<Line>,
    /// Poses of shapes and places of contacts; empty where there are none.
    touched: Frames,
    arrows: Vec<Arrow>,
}

impl Scene<'_> {
    /// Index of the last row of the record.
    fn last(&self) -> usize {
        self.record.t.len().saturating_sub(1)
    }

    /// Row of the `k`-th of `n` instants that divide the record evenly.
    fn row(&self, k: usize, n: usize) -> usize {
        if n < 2 {
            self.last()
        } else {
            (k * self.last() + (n - 1) / 2) / (n - 1)
        }
    }

    fn frames(&mut self, row: usize) -> Frames {
        let mut out = vec![FrameState::ground(); self.frames];
        if let (Some(q), Some(v)) = (self.record.q.get(row), self.record.v.get(row)) {
            self.interpreter.frames(q, v, &mut out);
        }
        out
    }

    fn instant(&mut self, row: usize) -> Instant {
        let frames = self.frames(row);
        let mut lines = self.shapes.lines(&frames);
        let (mut touched, mut arrows) = (Vec::new(), Vec::new());
        if let (Some(touch), Some(q), Some(v)) = (&mut self.touch, self.record.q.get(row), self.record.v.get(row)) {
            touched = touch.poses(q, v);
            lines.extend(touch.solids(&touched, false));
            arrows = self.forces.get(row).map_or(Vec::new(), |forces| touch.arrows(&touched, forces));
        }
        Instant { frames, lines, touched, arrows }
    }

    /// The path of a frame.
    fn path(&mut self, frame: usize) -> Vec<[f64; 3]> {
        let n = POINTS.min(self.last() + 1);
        (0..n).map(|k| self.frames(self.row(k, n))[frame].position).collect()
    }
}

/// What all instants share on the page.
struct Sheet {
    page: Page,
    view: View,
    scale: Option<Scale>,
    /// Direction of gravity, if it is known and not zero.
    down: Option<[f64; 3]>,
    grounds: Vec<Ground>,
    /// Lines on height fields.
    terrain: Vec<Vec<[f64; 3]>>,
}

/// A piece of ground: its corners in order, m, and its normal.
type Ground = ([[f64; 3]; 4], [f64; 3]);

/// The direction of a plan's gravity.
fn gravity(plan: &Plan) -> Option<[f64; 3]> {
    let Gravity::Constant(g) = &plan.model.gravity else { return None };
    let params = plan.default_params();
    let g = g.map(|x| match x {
        Value::Const(x) => x,
        Value::Param(k) => params[k],
    });
    let size = g.iter().fold(0.0_f64, |n, x| n.hypot(*x));
    (size > 0.0 && size.is_finite()).then(|| g.map(|x| x / size))
}

/// Chooses view and scale so that everything fits on the page.
fn sheet(plan: &Plan, scene: &Scene, drawing: &Drawing, instants: &[Instant], paths: &[Vec<[f64; 3]>]) -> Sheet {
    let finite = |p: &[f64; 3]| p.iter().all(|x| x.is_finite());
    let bare = instants.iter().flat_map(|i| scene.shapes.points(&i.frames)).chain(paths.iter().flatten().copied());
    let joints: Vec<[f64; 3]> = bare.filter(finite).collect();
    let flat = flat(plan, drawing, instants, &joints);
    let mut seen = joints;
    let (mut grounds, mut on_fields) = (Vec::new(), Vec::new());
    if let (Some(touch), Some(last)) = (&scene.touch, instants.last()) {
        let solids =
            instants.iter().flat_map(|i| touch.solids(&i.touched, false)).chain(touch.solids(&last.touched, true));
        seen.extend(solids.flat_map(|line| line.points).filter(finite));
        grounds = touch.grounds(&last.touched, &seen);
        on_fields = touch.terrains(&last.touched, &seen);
    }
    // What moves in a plane is seen from its side, whatever the widths of its shapes.
    let view = if flat.sees_a_plane() { flat } else { View::new(drawing.view, &seen) };
    floors(scene, &seen, &mut grounds);
    let corners = || grounds.iter().flat_map(|(corners, _)| corners.iter().copied());
    let head = if paths.is_empty() { 0.0 } else { HEAD };
    let supports = &scene.shapes.supports;
    let extent = Page::new(seen.iter().map(|p| view.project(*p)), 0.0).size();
    // Seen from their side, supports have a size on the page, for which its edge has room.
    let pieces = if view.sees_a_plane() { Vec::new() } else { base::pieces(supports, extent, gravity(plan)) };
    let all = seen
        .iter()
        .copied()
        .chain(corners())
        .chain(on_fields.iter().flatten().copied())
        .chain(pieces.into_iter().flatten());
    let all: Vec<[f64; 2]> = all.map(|p| view.project(p)).collect();
    let mut page = Page::new(all.iter().copied(), head);
    // Forces that are nothing but round-off are none.
    let params = plan.default_params();
    let mass = |v: Value| match v {
        Value::Const(x) => x,
        Value::Param(k) => params[k],
    };
    let least = 1e-8 * plan.model.bodies.iter().map(|b| mass(b.mass)).sum::<f64>();
    let scale = Scale::new(instants.iter().flat_map(|i| &i.arrows), &page, least);
    if let Some(scale) = &scale {
        // Arrows fit on the page too.
        let ends = instants.iter().flat_map(|i| &i.arrows);
        let ends = ends.map(|(p, f)| view.project(std::array::from_fn(|k| p[k] + scale.metres * f[k])));
        page = Page::new(all.iter().copied().chain(ends), head);
    }
    Sheet { page, view, scale, down: gravity(plan), grounds, terrain: on_fields }
}

/// The view of a mechanism whose joints move in a plane, whatever the widths of its bodies, or else one in space.
fn flat(plan: &Plan, drawing: &Drawing, instants: &[Instant], seen: &[[f64; 3]]) -> View {
    let origins = instants.iter().flat_map(|i| i.frames.iter().map(|f| f.position));
    let origins: Vec<[f64; 3]> = origins.filter(|p| p.iter().all(|x| x.is_finite())).collect();
    let view = View::new(drawing.view, &origins);
    // A single body says nothing of a plane.
    let moves = plan.model.bodies.len() > 1 && origins.iter().any(|p| *p != origins[0]);
    let view = if view.sees_a_plane() && moves { view } else { View::new(drawing.view, seen) };
    // What stands on a floor is not seen from above unasked.
    let above = drawing.view.is_none() && view.depth([0.0, 0.0, 1.0]).abs() > 0.999;
    match above && !plan.model.contacts.is_empty() {
        true => View::new(Some(view::OBLIQUE), seen),
        false => view,
    }
}

/// Adds the floors on which something rolls, as far as the mechanism goes.
fn floors(scene: &Scene, seen: &[[f64; 3]], grounds: &mut Vec<Ground>) {
    for floor in scene.shapes.floors.iter().filter(|f| f.iter().all(|x| x.is_finite())) {
        let known = grounds.iter().any(|(corners, _)| (corners[0][2] - floor[2]).abs() < 1e-9);
        let range = |k: usize| seen.iter().fold((floor[k], floor[k]), |(a, b), p| (a.min(p[k]), b.max(p[k])));
        let ((a, b), (c, d)) = (range(0), range(1));
        let pad = 0.05 * (b - a).max(d - c);
        if !known {
            let corner = |(x, y): (f64, f64)| [x, y, floor[2]];
            let all = [(a - pad, c - pad), (b + pad, c - pad), (b + pad, d + pad), (a - pad, d + pad)];
            grounds.push((all.map(corner), [0.0, 0.0, 1.0]));
        }
    }
}

/// The picture. `forces` are those of the contacts, along their rows, for every time of the record; nothing where none are
/// known.
pub fn svg(plan: &Plan, record: &Record, forces: &[Vec<[f64; 3]>], drawing: &Drawing) -> String {
    let (shapes, touch) = (Shapes::new(plan), Touch::new(plan));
    let interpreter = plan.default_interpreter();
    let mut scene = Scene { record, forces, shapes, touch, interpreter, frames: plan.frames.len() };
    let rows: Vec<usize> = (0..drawing.strobes).map(|k| scene.row(k, drawing.strobes)).collect();
    let still: Vec<Instant> = rows.into_iter().map(|row| scene.instant(row)).collect();
    let moving: Vec<Instant> = match drawing.moves {
        true => animate::rows(&scene).into_iter().map(|row| scene.instant(row)).collect(),
        false => Vec::new(),
    };
    let paths: Vec<Vec<[f64; 3]>> = drawing.traces.iter().map(|f| scene.path(*f)).collect();
    let sheet = sheet(plan, &scene, drawing, if drawing.moves { &moving } else { &still }, &paths);
    let end = record.t.last().copied().unwrap_or_default();
    let caption = match (drawing.moves, drawing.strobes) {
        (true, _) => animate::caption(end),
        (_, 1) => format!("t = {end} s"),
        (_, n) => format!("{n} instants from 0 to {end} s"),
    };
    let Sheet { page, view, scale, down, .. } = &sheet;
    let mut text = ink::head([WIDTH, page.height + view::FOOT], &format!("{}: {caption}", plan.model.name));
    still_parts(&mut text, &scene, &sheet, still.last());
    let names: Vec<String> = drawing.traces.iter().map(|f| plan.frames[*f].name.clone()).collect();
    names::legend(&mut text, &names);
    if drawing.moves {
        animate::draw(&mut text, &sheet, &moving, &paths, end);
        text.push_str("<g class=\"still\">\n");
    }
    strobes(&mut text, &sheet, &still);
    for (k, path) in paths.iter().enumerate() {
        let d = path_of(&sheet, path);
        let _ = writeln!(text, "<path class=\"n ink{}\" stroke-width=\"1.4\" d=\"{d}\"/>", names::dashes(k));
    }
    name_bodies(&mut text, &scene, &sheet, drawing, &still, &paths);
    if drawing.moves {
        text.push_str("</g>\n");
    }
    base::foot(&mut text, (page, view), &caption, scale.as_ref().map(|scale| scale.metres), *down);
    text + "</svg>\n"
}

/// Floors, walls, supports, and solids on the ground.
fn still_parts(text: &mut String, scene: &Scene, sheet: &Sheet, last: Option<&Instant>) {
    let Sheet { page, view, down, grounds, terrain, .. } = sheet;
    terrain.iter().for_each(|line| terrain::draw(text, page, view, line));
    grounds.iter().for_each(|ground| touch::ground(text, page, view, ground));
    if let (Some(touch), Some(last)) = (&scene.touch, last) {
        touch.solids(&last.touched, true).iter().for_each(|line| Outline::new(line, page, view).draw(text, false));
    }
    base::supports(text, page, view, &scene.shapes.supports, *down);
}

/// The path of a frame on the page.
fn path_of(sheet: &Sheet, path: &[[f64; 3]]) -> String {
    let places = path.iter().map(|p| sheet.page.place(sheet.view.project(*p)));
    let list: Vec<String> =
        places.filter(|p| p.iter().all(|x| x.is_finite())).map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
    if list.is_empty() {
        String::new()
    } else {
        format!("M{}", list.join("L"))
    }
}

/// Indices of the parts from the farthest to the nearest; parts at the same distance keep their order in spite of rounding.
fn by_depth(sheet: &Sheet, lines: &[Line]) -> Vec<usize> {
    let depth: Vec<f64> =
        lines.iter().map(|line| (sheet.view.depth(line.middle()) / (1e-6 * sheet.page.size())).round()).collect();
    let mut order: Vec<usize> = (0..lines.len()).collect();
    order.sort_by(|a, b| depth[*a].total_cmp(&depth[*b]));
    order
}

/// The instants, the last one in full colour.
fn strobes(text: &mut String, sheet: &Sheet, instants: &[Instant]) {
    for (k, instant) in instants.iter().enumerate() {
        let last = k + 1 == instants.len();
        let part = (k + 1) as f64 / instants.len() as f64;
        let opacity = if last { 1.0 } else { 0.12 + 0.26 * part * part };
        let _ = writeln!(text, "<g opacity=\"{opacity:.2}\">");
        for at in by_depth(sheet, &instant.lines) {
            Outline::new(&instant.lines[at], &sheet.page, &sheet.view).draw(text, last);
        }
        if let Some(scale) = &sheet.scale {
            instant.arrows.iter().for_each(|arrow| scale.draw(text, &sheet.page, &sheet.view, arrow));
        }
        text.push_str("</g>\n");
    }
}

/// The names of the bodies at the last instant.
fn name_bodies(
    text: &mut String,
    scene: &Scene,
    sheet: &Sheet,
    drawing: &Drawing,
    still: &[Instant],
    paths: &[Vec<[f64; 3]>],
) {
    let named = &scene.shapes.named;
    let wanted = match drawing.names {
        Names::Auto => named.len() <= FEW,
        Names::All => true,
        Names::None => false,
    };
    let Some(last) = still.last().filter(|_| wanted) else { return };
    let Sheet { page, view, .. } = sheet;
    let place = |p: [f64; 3]| page.place(view.project(p));
    let at = |frame: usize| {
        // A body whose shape contacts know is named at its centre.
        scene.shapes.middle(frame, &last.frames).unwrap_or(last.frames[frame].position)
    };
    let names: Vec<names::Named> = named.iter().map(|(frame, name, k)| (place(at(*frame)), name.clone(), *k)).collect();
    let outlines = last.lines.iter().map(|line| Outline::new(line, page, view));
    let mut drawn: Vec<[f64; 2]> = outlines.flat_map(|o| names::covered(&o.corners, o.width)).collect();
    drawn.extend(paths.iter().flatten().map(|p| place(*p)));
    if let Some(scale) = &sheet.scale {
        drawn.extend(last.arrows.iter().flat_map(|arrow| names::grains(&scale.ends(page, view, arrow))));
    }
    let top = if paths.is_empty() { 4.0 } else { HEAD };
    names::draw(text, &names, &drawn, [top, page.height + 6.0]);
}
