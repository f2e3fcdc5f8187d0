//! Loops, couplings and starts of valid TOML models.

use mbd_codegen::model::{Constraint, ConstraintKind, LoopKind, Model, Mount, Placement, Rotation, Start, Value};
use mbd_codegen::read;

const ALL: &str = include_str!("constraints.toml");
const C: fn(f64) -> Value = Value::Const;
const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// The model of a text that must give no findings at all.
fn clean(text: &str) -> Model {
    let (model, findings) = read::load("m.toml", text, &Default::default());
    assert!(findings.0.is_empty(), "{findings}");
    model.expect("a model where nothing was found")
}

/// Kind and bodies of a loop.
fn parts(model: &Model, name: &str) -> (LoopKind, Mount, Mount) {
    let found = model.constraints.iter().find(|c| c.name == name).expect("a constraint of that name");
    let ConstraintKind::Loop { kind, first, second } = found.kind.clone() else { panic!("{name} is no loop") };
    (kind, first, second)
}

#[test]
fn constraints_come_in_file_order() {
    let names: Vec<String> = clean(ALL).constraints.into_iter().map(|c| c.name).collect();
    let all =
        "close guide gears tubes screw shaft shaft_2 table socket weld rod rail floor pipe disc marble marbles stone pills die drum skate odd rack";
    assert_eq!(names, all.split(' ').map(|n| n.replace("shaft_2", "shaft 2")).collect::<Vec<_>>());
}

#[test]
fn every_type_is_read() {
    let m = clean(ALL);
    let lead = Value::Param(0);
    for (name, kind) in [
        ("close", LoopKind::Revolute { axis: [0.0, 0.0, 2.0] }),
        ("guide", LoopKind::Prismatic { axis: X }),
        ("tubes", LoopKind::Cylindrical { axis: Z }),
        ("screw", LoopKind::Helical { axis: Y, pitch: lead }),
        ("shaft", LoopKind::Universal { axes: [X, Y] }),
        ("shaft 2", LoopKind::Universal { axes: [Z, [1.0, 1.0, 0.0]] }),
        ("table", LoopKind::Planar { normal: Y }),
        ("socket", LoopKind::Spherical),
        ("weld", LoopKind::Fixed),
        ("rod", LoopKind::Distance { length: Value::Param(1) }),
        ("rail", LoopKind::PointOnLine { axis: [1.0, 1.0, 0.0] }),
        ("floor", LoopKind::PointOnPlane { normal: Z }),
        ("pipe", LoopKind::PointOnCylinder { axis: [0.0, 0.0, -1.0], radius: C(0.25) }),
        ("disc", LoopKind::RollingDisc { normal: [0.0, 0.0, 3.0], axis: Y, radius: C(0.3) }),
        ("marble", LoopKind::RollingBall { normal: Z, radius: C(0.1) }),
        ("marbles", LoopKind::RollingBalls { radii: [C(0.1), lead] }),
        ("stone", LoopKind::RollingEllipsoid { normal: Z, semi_axes: [C(0.1), C(0.2), lead] }),
        ("pills", LoopKind::RollingCapsules { axes: [X, Z], lengths: [C(0.3), C(0.0)], radii: [C(0.1), lead] }),
        ("die", LoopKind::RollingBallOnBox { size: [C(0.1), C(0.2), lead], rounding: 0.0, radius: C(0.05) }),
        ("drum", LoopKind::RollingBallOnCylinder { axis: Y, length: C(0.4), radii: [C(0.1), C(0.2)] }),
        ("skate", LoopKind::KnifeEdge { axis: Y }),
        ("odd", LoopKind::Pfaffian { row: [C(1.0), C(0.0), C(0.0), C(0.0), C(0.0), lead] }),
    ] {
        assert_eq!(parts(&m, name).0, kind, "{name}");
    }
}

/// The model knows the lines of its constraints and joints. Comparisons of models ignore them.
#[test]
fn origins_are_kept() {
    let m = clean(ALL);
    let line = |name: &str| 1 + ALL.lines().position(|l| l == format!("name = \"{name}\"")).expect("a line");
    for constraint in &m.constraints {
        let place = format!("m.toml:{}:8", line(&constraint.name));
        assert_eq!(constraint.origin.to_string(), place, "{}", constraint.name);
    }
    for joint in &m.joints {
        assert_eq!(joint.origin.line, line(&joint.name), "{}", joint.name);
    }
    assert_eq!(m, clean(&format!("# One line further down.\n{ALL}")));
}

#[test]
fn ends_are_bodies_frames_or_the_ground() {
    let m = clean(ALL);
    let body = |name: &str| m.bodies.iter().position(|b| b.name == name);
    let at_body = |name: &str| Mount { body: body(name), placement: Placement::IDENTITY };
    let frame = |name: &str| {
        let frame = m.frames.iter().find(|f| f.name == name).expect("a frame of that name");
        Mount { body: frame.body, placement: frame.placement }
    };
    let (_, first, second) = parts(&m, "close");
    assert_eq!((&first, &second), (&frame("pivot"), &frame("tip")));
    assert_eq!((first.body, second.body), (None, Some(1)));
    assert_eq!(second.placement.xyz, [Value::Param(1), C(0.0), C(0.0)]);
    assert_eq!(second.placement.rotation, Rotation::Rpy([C(0.0), C(0.0), C(90f64.to_radians())]));
    let (_, first, second) = parts(&m, "guide");
    assert_eq!((first, second), (Mount { body: None, placement: Placement::IDENTITY }, at_body("crank")));
    let (_, first, second) = parts(&m, "tubes");
    assert_eq!((first, second), (at_body("pump"), at_body("tube")));
    let (_, first, second) = parts(&m, "shaft 2");
    assert_eq!((first, second), (at_body("cross"), frame("rim")));
}

#[test]
fn decay_is_read() {
    let m = clean(ALL);
    let decays: Vec<(&str, Value)> =
        m.constraints.iter().filter(|c| c.decay != Value::ZERO).map(|c| (c.name.as_str(), c.decay)).collect();
    assert_eq!(decays, [("close", Value::Param(3)), ("guide", C(20.0)), ("gears", C(5.0)), ("marble", C(10.0))]);
}

#[test]
fn couplings_name_joints_in_their_final_order() {
    let m = clean(ALL);
    let names: Vec<&str> = m.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["lift", "shoulder", "elbow", "roll", "bounce", "slip", "sleeve", "cardan"]);
    let kind = |name: &str| m.constraints.iter().find(|c| c.name == name).map(|c| c.kind.clone());
    let gears =
        ConstraintKind::Coupling { terms: vec![(1, C(1.0)), (2, Value::Param(2))], offset: C(15f64.to_radians()) };
    assert_eq!(kind("gears"), Some(gears));
    let terms = vec![(2, C(0.05)), (0, C(-1.0)), (1, C(0.5))];
    assert_eq!(kind("rack"), Some(ConstraintKind::Coupling { terms, offset: C(0.0) }));
}

#[test]
fn starts_come_in_the_order_of_joints() {
    let m = clean(ALL);
    let degrees = f64::to_radians;
    let start = |joint: usize, q: &[f64], held| {
        let v = vec![0.0; m.joints[joint].kind.nv()];
        Start { joint, q: q.to_vec(), v, held, stated: true }
    };
    assert_eq!(
        m.starts,
        [
            start(0, &[0.1], false),
            start(1, &[degrees(30.0)], true),
            start(2, &[degrees(-90.0)], false),
            start(3, &[1.0, 2.0, 0.3, 0.0, 0.0, 0.6, 0.8], false),
            // A joint that is held without a start is held at its neutral position.
            start(4, &[0.0, 0.0, 0.0, 1.0], true),
            start(5, &[0.1, 0.2, degrees(45.0)], false),
            start(7, &[degrees(10.0), degrees(20.0)], false),
        ]
    );
}

#[test]
fn quaternions_are_scaled() {
    let with =
        |q: &str| clean(&ALL.replace("[1, 2, 0.3, 0, 0, 0.6, 0.8]", &format!("[0, 0, 0, {q}]"))).starts[3].q.clone();
    let q = with("0.5001, 0.5, 0.5, 0.5");
    let n = q[3..].iter().map(|x| x * x).sum::<f64>();
    assert!((n - 1.0).abs() < 4.0 * f64::EPSILON, "{n}");
    // A quaternion that already has unit length keeps its digits.
    assert_eq!(with("0.6, 0, -0.8, 0")[3..], [0.6, 0.0, -0.8, 0.0]);
}

/// Without constraints, starts are the coordinates of the state at the beginning.
#[test]
fn starts_need_no_loops() {
    let text =
        "[[body]]\nname = 'a'\nmass = 1\ncom = [1, 0, 0]\n[[joint]]\nname = 'j'\ntype = 'pin'\nchild = 'a'\nstart = 1";
    assert_eq!(clean(text).starts, [Start { joint: 0, q: vec![1.0], v: vec![0.0], held: false, stated: true }]);
    let moving = clean(&text.replace("start = 1", "start_velocity = -2.5")).starts;
    assert_eq!(moving, [Start { joint: 0, q: vec![0.0], v: vec![-2.5], held: false, stated: false }]);
    assert_eq!(clean(&text.replace("start = 1", "held = false")).starts, []);
    assert_eq!(clean(text).constraints, []);
}

/// Two axes that are written with seven digits count as perpendicular.
#[test]
fn rounded_axes_are_square() {
    let with = |axis2: &str| {
        read::load("m.toml", &ALL.replace("axis2 = [1, 1, 0]", &format!("axis2 = {axis2}")), &Default::default()).1
    };
    assert_eq!(with("[0.7071068, 0.7071068, 1e-7]").0, []);
    assert!(with("[0.7071, 0.7071, 1e-5]").0[0].message.contains("not at right angles"));
}

/// A loop may connect two bodies between which there is only a mimic joint.
#[test]
fn followers_move() {
    let text = "[[body]]\nname = 'a'\nmass = 1\ncom = [1, 0, 0]\n[[joint]]\nname = 'j'\ntype = 'pin'\nchild = 'a'\n\
        [[body]]\nname = 'b'\nmass = 1\ncom = [1, 0, 0]\n[[joint]]\nname = 'k'\ntype = 'pin'\nparent = 'a'\nchild = 'b'\nmimic = { joint = 'j' }\n\
        [[loop]]\nname = 'l'\ntype = 'spherical'\nbetween = ['a', 'b']\n";
    let Constraint { name, kind, decay, .. } = clean(text).constraints.remove(0);
    assert_eq!((name.as_str(), decay), ("l", C(0.0)));
    let mount = |body| Mount { body: Some(body), placement: Placement::IDENTITY };
    assert_eq!(kind, ConstraintKind::Loop { kind: LoopKind::Spherical, first: mount(0), second: mount(1) });
}
