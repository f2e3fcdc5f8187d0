//! What the page has to know of a mechanism, as JSON.

use multibody::codegen::diag::{Diagnostics, Severity};
use multibody::codegen::model::{ShapeKind, Unit, Value};
use multibody::runtime::constrained::{close, Closing};
use multibody::runtime::tree::Source;
use multibody::runtime::{Constrained, System as _};

use crate::json::{list, number, numbers, object, text};
use crate::picture::shapes::{Line, Shapes};
use crate::picture::solid::{plate, Directions, Mesh};
use crate::picture::{flesh, limbs};
use crate::scene::{value, Scene};

/// The findings of a file.
pub fn findings(findings: &Diagnostics) -> String {
    list(findings.0.iter().map(|finding| {
        let kind = match finding.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            _ => "notice",
        };
        object(&[
            ("kind", text(kind)),
            ("line", finding.line.to_string()),
            ("column", finding.column.to_string()),
            ("file", text(&finding.file)),
            ("message", text(&finding.message)),
            ("help", text(&finding.help)),
        ])
    }))
}

/// Unit, bounds, whether it is a plain number that a slider can set, and the velocity that is its rate, for each coordinate.
/// Translations of planar and floating joints have none: their velocities are in body axes.
fn coordinates(scene: &Scene) -> String {
    let plan = &scene.plan;
    let mut places = vec![(String::new(), [None; 2], false, None); plan.dims.nq];
    for slot in &plan.slots {
        let Some(Source::State { q, v }) = slot.at else { continue };
        let joint = &plan.model.joints[slot.joint];
        let spec = joint.kind.spec();
        for (k, coordinate) in spec.coordinates.iter().enumerate() {
            let range = joint.bounds.range.map_or([None; 2], |range| range.map(Some));
            let rate = (spec.group.is_none() || coordinate.unit == Unit::Radian).then_some(v + k);
            places[q + k] = (coordinate.unit.symbol().into(), range, coordinate.unit != Unit::One, rate);
        }
    }
    let names = plan.coordinate_names();
    list(names.iter().zip(places).map(|(name, (unit, range, plain, rate))| {
        let bound = |x: Option<f64>| x.map_or("null".into(), number);
        object(&[
            ("name", text(name)),
            ("unit", text(&unit)),
            ("low", bound(range[0])),
            ("high", bound(range[1])),
            ("plain", plain.to_string()),
            ("v", rate.map_or("null".into(), |v: usize| v.to_string())),
        ])
    }))
}

/// Name, unit of the effort and its limit, for each velocity.
fn velocities(scene: &Scene) -> String {
    let plan = &scene.plan;
    let mut units = vec![""; plan.dims.nv];
    for slot in &plan.slots {
        let Some(Source::State { v, .. }) = slot.at else { continue };
        for (k, freedom) in plan.model.joints[slot.joint].kind.spec().freedoms.iter().enumerate() {
            units[v + k] = freedom.unit.symbol();
        }
    }
    let (names, limits) = (plan.velocity_names(), plan.effort_limits());
    list(
        names.iter().zip(units).zip(limits).map(|((name, unit), limit)| {
            object(&[("name", text(name)), ("unit", text(unit)), ("limit", number(limit))])
        }),
    )
}

/// Shapes of the model: frame, pose in it, kind, dimensions, colour.
fn shapes(scene: &Scene, colours: &[usize], frame: &dyn Fn(Option<usize>) -> String) -> String {
    let model = &scene.plan.model;
    let of = |x: Value| value(model, x);
    list(model.shapes.iter().filter_map(|shape| {
        let dims = match &shape.kind {
            ShapeKind::Point => return None,
            ShapeKind::Sphere { radius } => vec![*radius],
            ShapeKind::Capsule { radius, length } | ShapeKind::Cylinder { radius, length, .. } => vec![*radius, *length],
            ShapeKind::Box { size, .. } => size.to_vec(),
            ShapeKind::Ellipsoid { semi_axes } => semi_axes.to_vec(),
            ShapeKind::Plane { normal } => normal.to_vec(),
            // How far it extends along its axes.
            ShapeKind::Hull { points, .. } => {
                [0, 1, 2].map(|k| points.iter().fold(0.0, |most: f64, p| most.max(2.0 * p[k].abs()))).to_vec()
            }
        };
        let rotation = flesh::rotation(&shape.mount.placement.rotation, &of);
        let pose = rotation.into_iter().flatten().chain(shape.mount.placement.xyz.map(of));
        Some(object(&[
            ("name", text(&shape.name)),
            ("frame", frame(shape.mount.body)),
            ("kind", text(shape.kind.word())),
            ("dims", numbers(dims)),
            ("pose", numbers(pose)),
            ("colour", shape.mount.body.map_or("-1".into(), |b| colours[b].to_string())),
        ]))
    }))
}

/// Number with the digits that a picture needs.
fn short(x: f64) -> String {
    number((x * 1e6).round() / 1e6)
}

/// Bodies of which something is drawn.
fn drawn_bodies(drawn: &Shapes) -> impl Iterator<Item = (Option<usize>, Line)> {
    drawn.bodies().into_iter().filter(|(_, line)| !line.points.is_empty())
}

/// Triangles: of a ball of radius 1, then of every part, then of every shape that is no point. Of each the number of its
/// corners, and six numbers for each corner.
pub fn meshes(scene: &Scene) -> Vec<f32> {
    let (all, drawn) = (Directions::default(), Shapes::new(&scene.plan));
    let parts: Vec<(Option<usize>, Line)> = drawn_bodies(&drawn).collect();
    let size = parts.iter().flat_map(|(_, line)| line.points.iter().flatten()).fold(1e-3, |m: f64, x| m.max(x.abs()));
    let mesh = |line: &Line| match line.closed {
        true => plate(&line.points),
        // What has no thickness is drawn as a wire.
        false => all.hull(&line.points, if line.radius > 0.0 { line.radius } else { 0.004 * size }),
    };
    let shapes = scene.plan.model.shapes.iter().filter(|shape| shape.kind != ShapeKind::Point);
    let meshes = std::iter::once(all.hull(&[[0.0; 3]], 1.0));
    let meshes =
        meshes.chain(parts.iter().map(|(_, line)| mesh(line))).chain(shapes.map(|shape| all.shape(&shape.kind)));
    meshes.flat_map(|mesh: Mesh| std::iter::once(mesh.len() as f32).chain(mesh.into_iter().flatten())).collect()
}

/// What bodies without shapes look like: frame, colour, radius, points.
fn parts(drawn: &Shapes) -> String {
    list(drawn_bodies(drawn).map(|(frame, line)| {
        object(&[
            ("frame", frame.map_or("-1".into(), |f| f.to_string())),
            ("colour", line.colour.map_or("-1".into(), |k| k.to_string())),
            ("radius", short(line.radius)),
            ("closed", line.closed.to_string()),
            ("points", list(line.points.iter().flatten().map(|x| short(*x)))),
            ("joints", list(line.marks.iter().flat_map(|(p, _)| p).map(|x| short(*x)))),
        ])
    }))
}

fn rods(drawn: &Shapes) -> String {
    list(drawn.rods().into_iter().map(|(ends, colour)| {
        let ends = ends
            .map(|(frame, p)| object(&[("frame", frame.map_or("-1".into(), |f| f.to_string())), ("at", numbers(p))]));
        object(&[("ends", list(ends)), ("colour", colour.to_string())])
    }))
}

/// Rows, independent rows and mobility of the loops, and how they were closed.
fn loops(scene: &Scene) -> String {
    let plan = &scene.plan;
    let mut view = plan.default_interpreter();
    let rows = view.rows().len();
    if rows == 0 {
        return "null".into();
    }
    let mut q = plan.start();
    let closed = close(&mut view, &mut q, &Closing::holding(&plan.held())).ok();
    let (mut residual, mut dq, mut pivots) = (view.zero_rows(), view.zero_momenta(), view.zero_rows());
    view.position_correction(&q, &mut residual, &mut dq, &mut pivots);
    let rank = pivots.iter().filter(|pivot| **pivot != 0.0).count();
    object(&[
        ("names", list(plan.constraint_names().iter().map(|name| text(name)))),
        ("rows", rows.to_string()),
        ("rank", rank.to_string()),
        ("mobility", (plan.dims.nv - rank.min(plan.dims.nv)).to_string()),
        ("iterations", closed.map_or("null".into(), |closed| closed.iterations.to_string())),
    ])
}

/// The whole mechanism.
pub fn scene(scene: &Scene) -> String {
    let plan = &scene.plan;
    let model = &plan.model;
    let of = |x: Value| value(model, x);
    let (drawn, colours) = (Shapes::new(plan), limbs::colours(model, &of));
    let frame_of = |b: usize| plan.frames.iter().position(|f| f.name == model.bodies[b].name);
    let frame = |body: Option<usize>| body.and_then(frame_of).map_or("-1".into(), |f| f.to_string());
    let grounded = limbs::grounded(model);
    let bodies = list(model.bodies.iter().enumerate().map(|(b, body)| {
        object(&[
            ("name", text(&body.name)),
            ("frame", frame(Some(b))),
            ("mass", number(of(body.mass))),
            ("com", numbers(body.com.map(of))),
            ("colour", if grounded[b] { "-1".into() } else { colours[b].to_string() }),
        ])
    }));
    let named =
        list(drawn.named.iter().map(|(frame, name, _)| object(&[("frame", frame.to_string()), ("name", text(name))])));
    let params = model.params.iter();
    let params = list(params.map(|p| object(&[("name", text(&p.name)), ("value", number(p.default))])));
    let gravity = match model.gravity {
        multibody::codegen::model::Gravity::Constant(g) => g.map(of),
        _ => [0.0, 0.0, -9.81],
    };
    object(&[
        ("name", text(&model.name)),
        ("nq", plan.dims.nq.to_string()),
        ("nv", plan.dims.nv.to_string()),
        ("coordinates", coordinates(scene)),
        ("velocities", velocities(scene)),
        ("frames", list(plan.frames.iter().map(|f| text(&f.name)))),
        ("bodies", bodies),
        ("named", named),
        ("parts", parts(&drawn)),
        ("rods", rods(&drawn)),
        ("supports", numbers(drawn.supports.iter().flatten().copied())),
        ("shapes", shapes(scene, &colours, &frame)),
        ("params", params),
        ("contacts", list(model.contacts.iter().map(|contact| text(&contact.name)))),
        ("loops", loops(scene)),
        ("gravity", numbers(gravity)),
        ("lie", (plan.dims.nq != plan.dims.nv).to_string()),
        ("findings", findings(&scene.findings)),
        ("notices", list(plan.notices.iter().map(|notice| text(notice)))),
    ])
}
