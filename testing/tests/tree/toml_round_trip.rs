//! Random models through the TOML reader and back.

use mbd_codegen::diag::Severity;
use mbd_codegen::model::{
    Constraint, ConstraintKind, JointKind, JointMotion, LoopKind, Model, Mount, Placement, Start, Value,
};
use mbd_codegen::read;
use mbd_testing::random::{random_model, Distribution, Rng};
use mbd_testing::toml::{to_toml_in, Order};

#[test]
fn reader_gives_the_model_that_was_written() {
    for seed in 0..300 {
        let model = random_model(seed, &Distribution::everything(seed, 12));
        for order in [Order::DepthFirst, Order::BreadthFirst] {
            let text = to_toml_in(&model, order);
            let (read, findings) = read::load("model.toml", &text, &Default::default());
            let errors = findings.0.iter().any(|d| d.severity == Severity::Error);
            assert!(!errors, "seed {seed}: {findings}\n{text}");
            assert_eq!(read.as_ref(), Some(&model), "seed {seed}, {order:?}\n{text}");
        }
    }
}

/// A random constraint between joints or bodies of the model. Only its text matters: the mechanism need not be able to
/// move.
fn constraint(model: &Model, k: usize, rng: &mut Rng) -> Option<Constraint> {
    let single = |j: &usize| model.joints[*j].kind.nv() == 1 && model.joints[*j].motion == JointMotion::Free;
    let singles: Vec<usize> = (0..model.joints.len()).filter(single).collect();
    let decay = Value::Const(rng.pick(&[0.0, 20.0]));
    if singles.len() >= 2 && rng.chance(0.3) {
        // Each joint occurs at most once; the first one is random.
        let first = rng.below(singles.len());
        let terms = (0..2 + rng.below(singles.len() - 1))
            .map(|t| (singles[(first + t) % singles.len()], value(model, rng, 0.5, 2.0)))
            .collect();
        let offset = Value::Const(rng.pick(&[0.0, 0.3, std::f64::consts::FRAC_PI_2]));
        return Some(Constraint::new(format!("c{k}"), ConstraintKind::Coupling { terms, offset }, decay));
    }
    let mut ends: Vec<Mount> = model.frames.iter().map(|f| Mount { body: f.body, placement: f.placement }).collect();
    let bodies = std::iter::once(None).chain((0..model.bodies.len()).map(Some));
    ends.extend(bodies.map(|body| Mount { body, placement: Placement::IDENTITY }));
    let [first, second] = [0; 2].map(|_| ends[rng.below(ends.len())].clone());
    // For each body, the body that it follows through fixed and prescribed joints. A loop between bodies that follow
    // the same body has no freedom to bind.
    let mut root = vec![None; model.bodies.len()];
    for j in &model.joints {
        let rigid = j.kind.nv() == 0 || j.motion == JointMotion::Prescribed;
        root[j.child] = if rigid { j.parent.and_then(|b| root[b]) } else { Some(j.child) };
    }
    if first.body.and_then(|b| root[b]) == second.body.and_then(|b| root[b]) {
        return None;
    }
    let kind = loop_kind(model, rng);
    let held = matches!(kind, LoopKind::KnifeEdge { .. } | LoopKind::Pfaffian { .. });
    let decay = if held { Value::ZERO } else { decay };
    Some(Constraint::new(format!("c{k}"), ConstraintKind::Loop { kind, first, second }, decay))
}

/// A constant, or a parameter whose default is in the range.
fn value(model: &Model, rng: &mut Rng, low: f64, high: f64) -> Value {
    let fits: Vec<usize> =
        (0..model.params.len()).filter(|&k| (low..high).contains(&model.params[k].default)).collect();
    match fits.is_empty() || rng.chance(0.6) {
        true => Value::Const(rng.range(low, high)),
        false => Value::Param(rng.pick(&fits)),
    }
}

fn loop_kind(model: &Model, rng: &mut Rng) -> LoopKind {
    let axis = std::array::from_fn(|_| rng.range(0.1, 1.0));
    let normal = rng.pick(&[[0.0, 0.0, 1.0], [0.0, 0.0, -2.0], axis]);
    let axis = rng.pick(&[[0.0, 0.0, 1.0], axis]);
    let square = rng.pick(&[[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0.0, 0.0, 1.0], [3.0, -1.0, 0.0]]]);
    let size = value(model, rng, 0.1, 1.0);
    match rng.below(21) {
        0 => LoopKind::Revolute { axis },
        1 => LoopKind::Prismatic { axis },
        2 => LoopKind::Cylindrical { axis },
        3 => LoopKind::Helical { axis, pitch: size },
        4 => LoopKind::Universal { axes: square },
        5 => LoopKind::Planar { normal },
        6 => LoopKind::Spherical,
        7 => LoopKind::Fixed,
        8 => LoopKind::Distance { length: size },
        9 => LoopKind::PointOnLine { axis },
        10 => LoopKind::PointOnPlane { normal },
        11 => LoopKind::PointOnCylinder { axis, radius: size },
        12 => LoopKind::RollingDisc { normal, axis, radius: size },
        13 => LoopKind::RollingBall { normal, radius: size },
        14 => LoopKind::RollingBalls { radii: [size, value(model, rng, 0.1, 1.0)] },
        15 => LoopKind::RollingCapsules { axes: [axis, normal], lengths: [Value::ZERO, size], radii: [size; 2] },
        16 => LoopKind::RollingBallOnBox {
            size: [size, value(model, rng, 0.1, 1.0), Value::ONE],
            rounding: 0.0,
            radius: size,
        },
        17 => LoopKind::RollingBallOnCylinder { axis, length: size, radii: [Value::ONE, size] },
        18 => LoopKind::KnifeEdge { axis },
        19 => LoopKind::RollingEllipsoid { normal, semi_axes: [size, Value::ONE, size] },
        _ => LoopKind::Pfaffian { row: [Value::ONE, Value::ZERO, size, Value::ZERO, Value::ZERO, size] },
    }
}

fn start(model: &Model, joint: usize, rng: &mut Rng) -> Option<Start> {
    let j = &model.joints[joint];
    if j.motion != JointMotion::Free || j.kind.nq() == 0 || rng.chance(0.5) {
        return None;
    }
    let mut q: Vec<f64> = (0..j.kind.nq()).map(|_| rng.around(1.0)).collect();
    if let JointKind::Spherical | JointKind::Floating = j.kind {
        let first = q.len() - 4;
        q[first..].copy_from_slice(&rng.pick(&[[0.0, 0.0, 0.0, 1.0], [0.6, 0.0, 0.0, -0.8], [0.5; 4]]));
    }
    let v = (0..j.kind.nv()).map(|_| rng.pick(&[0.0, 0.7, -2.0])).collect();
    Some(Start { joint, q, v, held: rng.chance(0.3), stated: true })
}

#[test]
fn reader_gives_the_constraints_that_were_written() {
    let mut seen = [0; 2];
    for seed in 0..300 {
        let mut model = random_model(seed, &Distribution::everything(seed, 12));
        let rng = &mut Rng::new(seed, 5);
        let constraints = (0..6).filter_map(|k| constraint(&model, k, rng)).collect::<Vec<_>>();
        let starts = (0..model.joints.len()).filter_map(|j| start(&model, j, rng)).collect();
        (model.constraints, model.starts) = (constraints, starts);
        seen[0] += model.constraints.len();
        seen[1] += model.starts.len();
        for order in [Order::DepthFirst, Order::BreadthFirst] {
            let text = to_toml_in(&model, order);
            let (read, findings) = read::load("model.toml", &text, &Default::default());
            assert_eq!(read.as_ref(), Some(&model), "seed {seed}, {order:?}\n{findings}\n{text}");
        }
    }
    assert!(seen[0] > 900 && seen[1] > 300, "{seen:?}");
}

/// An end of a loop without a frame of its own gets one.
#[test]
fn ends_without_a_frame_are_written_with_one() {
    let mut model = random_model(3, &Distribution::everything(3, 12));
    let body = model.joints.iter().find(|j| j.kind.nv() > 0 && j.motion == JointMotion::Free).map(|j| j.child);
    let first = Mount { body: None, placement: Placement::IDENTITY };
    let xyz = [Value::Const(0.125), Value::ZERO, Value::ZERO];
    let second = Mount { body, placement: Placement { xyz, ..Placement::IDENTITY } };
    let kind = ConstraintKind::Loop { kind: LoopKind::Spherical, first, second };
    model.constraints = vec![Constraint::new("socket", kind, Value::ZERO)];
    let read = read::model("model.toml", &to_toml_in(&model, Order::DepthFirst), &Default::default())
        .unwrap_or_else(|findings| panic!("{findings}"))
        .model;
    assert_eq!(read.constraints, model.constraints);
    assert_eq!(read.frames.len(), model.frames.len() + 1);
}

/// The scenes with contacts: what is written gives the model again, with all places of all pairs of shapes.
#[test]
fn reader_gives_the_contacts_that_were_written() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/contacts");
    let mut contacts = 0;
    for entry in std::fs::read_dir(folder).expect("the scenes").flatten() {
        let text = std::fs::read_to_string(entry.path()).expect("UTF-8");
        // A pair of shapes that is not supported yet is an error.
        let Ok(read) = read::model("scene.toml", &text, &Default::default()) else { continue };
        contacts += read.model.contacts.len();
        for order in [Order::DepthFirst, Order::BreadthFirst] {
            let text = to_toml_in(&read.model, order);
            let again = read::model("scene.toml", &text, &Default::default());
            let again = again.unwrap_or_else(|findings| panic!("{findings}\n{text}")).model;
            assert_eq!(again, read.model, "{}\n{text}", entry.path().display());
        }
    }
    assert!(contacts > 25, "{contacts}");
}
