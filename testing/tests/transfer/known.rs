//! Changes of a tree with known results.

use mbd_codegen::model::{JointKind, Placement};
use mbd_codegen::plan::Rigid;
use mbd_codegen::transfer::{RejoinError, TransferError};

use super::{model, near, pose, same_motion, Machine};

/// Two discs on one axis; the second one on the ground or on the first.
fn discs(second: &str) -> Machine {
    Machine::new(model(&format!(
        r#"
name = "clutch"
[[body]]
name = "engine"
mass = 1.0
inertia = [0.2, 0.2, 0.3]
[[body]]
name = "load"
mass = 1.0
inertia = [0.4, 0.4, 0.7]
[[joint]]
name = "shaft"
type = "revolute"
parent = "ground"
child = "engine"
[[joint]]
name = "clutch"
{second}
child = "load"
xyz = [0, 0, 0.1]
"#
    )))
}

#[test]
fn a_clutch_locks() {
    let mut open = discs("type = \"revolute\"\nparent = \"ground\"");
    // A locked clutch joins the discs as they stand, so that the angle at that moment is the placement.
    let mut locked = discs("type = \"fixed\"\nparent = \"engine\"");
    let state = open.transfer(&[0.4, 0.4], &[10.0, 0.0], &mut locked).expect("a transfer");
    let (a, b) = (0.3, 0.7);
    near("angle", &state.q, &[0.4], 1e-15);
    near("speed", &state.v, &[a * 10.0 / (a + b)], 1e-12);
    near("energy lost", &[state.lost()], &[0.5 * a * b / (a + b) * 100.0], 1e-12);
    let jump = state.jump.expect("a jump");
    assert_eq!(jump.body, "engine");
    near("jump", &[jump.linear, jump.angular], &[0.0, 7.0], 1e-12);

    // Where they stand apart, it cannot lock; the message names the joint and the angle.
    let error = open.transfer(&[0.4, 0.5], &[10.0, 0.0], &mut locked).expect_err("apart");
    let TransferError::Position { joint, length, angle } = &error else { panic!("{error}") };
    assert_eq!(joint, "clutch");
    near("misfit", &[*length, *angle], &[0.0, 0.1], 1e-14);
    assert!(error.to_string().contains("`clutch`") && error.to_string().contains("1.000e-1 rad"), "{error}");
}

const TWO_BOXES: &str = r#"
name = "docking"
[[body]]
name = "station"
mass = 40.0
com = [0.1, -0.2, 0.05]
inertia = { xx = 8, yy = 9, zz = 7, xy = 0.3, xz = -0.2, yz = 0.1 }
[[body]]
name = "ship"
mass = 5.0
com = [0.0, 0.1, 0.3]
inertia = { xx = 0.5, yy = 0.6, zz = 0.4, xy = 0.01, xz = 0.02, yz = -0.03 }
[[joint]]
name = "orbit"
type = "floating"
parent = "ground"
child = "station"
[[joint]]
name = "dock"
type = "floating"
parent = "ground"
child = "ship"
"#;

/// A state of two floating bodies.
fn apart() -> ([f64; 14], [f64; 12]) {
    let turn = [0.1, 0.7, -0.1, 0.7];
    let other = [0.5, -0.5, 0.1, 0.7];
    let q = |p: [f64; 3], t: [f64; 4]| {
        let size = t.iter().map(|x| x * x).sum::<f64>().sqrt();
        [p[0], p[1], p[2], t[0] / size, t[1] / size, t[2] / size, t[3] / size]
    };
    let q = [q([1.0, 2.0, 3.0], turn), q([2.0, 2.5, 2.0], other)].concat();
    let v = [0.3, -0.1, 0.2, 0.05, 0.2, -0.1, 0.9, 0.4, -0.6, 0.3, -0.5, 0.8];
    (q.try_into().expect("14 numbers"), v)
}

#[test]
fn docking_keeps_momentum() {
    let mut free = Machine::new(model(TWO_BOXES));
    let (q, v) = apart();
    let before = free.momentum(&q, &v);
    let relative = pose(&free.body("station", &q, &v)).inverse().then(&pose(&free.body("ship", &q, &v)));
    for kind in [
        JointKind::Fixed,
        JointKind::Revolute { axis: [1.0, 2.0, -1.0] },
        JointKind::Spherical,
        JointKind::Universal { axes: [[1.0, 0.0, 0.0], [0.3, 1.0, 0.0]] },
    ] {
        let docked = free.model.rejoined("ship", Some("station"), kind, Placement::of_pose(&relative));
        let mut docked = Machine::new(docked.expect("a model"));
        let state = free.transfer(&q, &v, &mut docked).expect("a transfer");
        let after = docked.momentum(&state.q, &state.v);
        let size = before.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        near(kind.word(), &after, &before, 1e-13 * size.max(1.0));
        assert!(state.lost() > 0.1, "{}: {}", kind.word(), state.lost());
        // What is joined already is not changed by joining it again.
        let again = docked.transfer(&state.q, &state.v, &mut Machine::new(docked.model.clone())).expect("the same");
        assert_eq!(again.q, state.q);
        near("again", &again.v, &state.v, 1e-13);
        assert!(again.lost().abs() < 1e-13 * again.before[0], "{}", again.lost());
    }
}

#[test]
fn a_gripper_takes_a_box_that_lies_there() {
    let text = r#"
name = "gripper"
gravity = [0, 0, -9.81]
[[body]]
name = "box"
mass = 0.5
inertia = [0.002, 0.002, 0.001]
[[body]]
name = "arm"
mass = 2.0
com = [0.25, 0, 0]
inertia = [0.001, 0.04, 0.04]
[[body]]
name = "hand"
mass = 0.4
com = [0.05, 0, 0]
inertia = [0.001, 0.001, 0.001]
[[joint]]
name = "lies"
type = "floating"
parent = "ground"
child = "box"
[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "arm"
axis = [0, 1, 0]
armature = 0.1
[[joint]]
name = "wrist"
type = "cylindrical"
parent = "arm"
child = "hand"
xyz = [0.5, 0, 0]
axis = [1, 0, 0]
"#;
    let mut open = Machine::new(model(text));
    let q = [0.4, 0.05, -0.5, 0.0, 0.0, 0.6, 0.8, 7.0, 0.02, 0.3];
    let v = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.5, 0.2, 0.4];
    let [hand, thing] = ["hand", "box"].map(|name| pose(&open.body(name, &q, &v)));
    let held = Placement::of_pose(&hand.inverse().then(&thing));
    let mut closed =
        Machine::new(open.model.rejoined("box", Some("hand"), JointKind::Fixed, held).expect("a held box"));
    let state = open.transfer(&q, &v, &mut closed).expect("a grip");
    // The arm keeps its coordinates, with the turn.
    assert_eq!(state.q, q[7..]);
    assert!(state.lost() > 0.0);
    // The velocities are those of the least change: p' = p + Jᵀ h with a box at rest, the rotor among p.
    let arm = {
        let mut p = vec![0.0; 9];
        open.interpreter.momenta(&q, &v, &mut p);
        p[6..].to_vec()
    };
    near("momenta", &state.p, &arm, 1e-13);
    let misfit = state.misfit.expect("a joint");
    assert!(misfit.length < 1e-15 && misfit.angle < 1e-15, "{misfit:?}");

    // It lets go: the box moves on as it was held.
    let freed = closed.transfer(&state.q, &state.v, &mut open).expect("a release");
    assert!(freed.lost().abs() < 1e-13, "{}", freed.lost());
    same_motion((&mut closed, &state.q, &state.v), (&mut open, &freed.q, &freed.v), 1e-13);
}

const CHAIN: &str = r#"
name = "chain"
gravity = [0, 0, -9.81]
[[body]]
name = "a"
mass = 1.0
com = [0, 0, -0.2]
inertia = [0.02, 0.02, 0.001]
[[body]]
name = "b"
mass = 0.7
com = [0, 0.05, -0.2]
inertia = [0.02, 0.02, 0.001]
[[body]]
name = "c"
mass = 0.4
com = [0, 0, -0.1]
inertia = [0.01, 0.01, 0.001]
[[joint]]
name = "ja"
type = "revolute"
parent = "ground"
child = "a"
axis = [0, 1, 0]
[[joint]]
name = "jb"
type = "universal"
parent = "a"
child = "b"
xyz = [0, 0, -0.4]
[[joint]]
name = "jc"
type = "helical"
parent = "b"
child = "c"
xyz = [0, 0, -0.4]
pitch = 0.05
"#;

#[test]
fn a_cut_changes_nothing_but_the_coordinates() {
    let mut whole = Machine::new(model(CHAIN));
    let (q, v) = ([0.5, -0.4, 7.0, 20.0], [1.0, -2.0, 0.7, 5.0]);
    for (joint, nq) in [("ja", 7 + 3), ("jb", 1 + 7 + 1), ("jc", 3 + 7)] {
        let mut cut = Machine::new(whole.model.cut(joint).expect("a joint"));
        let state = whole.transfer(&q, &v, &mut cut).expect("a transfer");
        assert_eq!(state.q.len(), nq, "{joint}");
        same_motion((&mut whole, &q, &v), (&mut cut, &state.q, &state.v), 1e-13);
        assert!(state.lost().abs() < 1e-13 && (state.before[1] - state.after[1]).abs() < 1e-13, "{joint}");
        // And back: the turns of a screw come back from its displacement, those of other angles are lost.
        let back = cut.transfer(&state.q, &state.v, &mut whole).expect("back");
        let turns = if joint == "jb" { std::f64::consts::TAU } else { 0.0 };
        near(joint, &back.q, &[q[0], q[1], q[2] - turns, q[3]], 1e-13);
        near(joint, &back.v, &v, 1e-13);
    }
}

#[test]
fn a_loop_closes_by_a_plastic_impact() {
    let closed = r#"
[[frame]]
name = "end"
body = "c"
xyz = [0, 0, -0.2]
[[frame]]
name = "eye"
body = "ground"
xyz = [X, Y, Z]
[[loop]]
name = "hook"
type = "spherical"
between = ["eye", "end"]
"#;
    let mut open = Machine::new(model(CHAIN));
    let (q, v) = ([0.5, -0.4, 0.3, 0.2], [1.0, -2.0, 0.7, 5.0]);
    let c = pose(&open.body("c", &q, &v));
    let end = c.then(&Rigid { pos: [0.0, 0.0, -0.2], ..Rigid::IDENTITY }).pos;
    let text = |end: [f64; 3]| {
        let hook = closed.replace('X', &format!("{:?}", end[0])).replace('Y', &format!("{:?}", end[1]));
        format!("{CHAIN}{}", hook.replace('Z', &format!("{:?}", end[2])))
    };
    let mut hooked = Machine::new(model(&text(end)));
    let state = open.transfer(&q, &v, &mut hooked).expect("a closed loop");
    assert_eq!(state.q, q);
    assert!(state.lost() > 0.0);
    // Three rows on four joints.
    let (mut gaps, mut rates, mut entries) = (vec![0.0; 3], vec![0.0; 3], vec![0.0; 3 * 4]);
    hooked.interpreter.gaps(&state.q, &state.v, &mut gaps, &mut rates, &mut entries);
    near("velocity of the hook", &rates, &[0.0; 3], 1e-12);
    // Of all velocities that the hook allows the nearest: the change does no work on them.
    let mut p = vec![0.0; 4];
    open.interpreter.momenta(&q, &v, &mut p);
    let work: f64 = p.iter().zip(&state.p).zip(&state.v).map(|((a, b), v)| (a - b) * v).sum();
    near("work", &[work], &[0.0], 1e-12);

    let mut elsewhere = Machine::new(model(&text([end[0], end[1] + 0.1, end[2]])));
    let error = open.transfer(&q, &v, &mut elsewhere).expect_err("open");
    let TransferError::Open { constraint, residual } = &error else { panic!("{error}") };
    assert_eq!(constraint, "hook");
    assert!(*residual > 0.05 && *residual < 0.1 + 1e-12, "{residual}");
}

#[test]
fn bad_input_is_named() {
    let mut whole = Machine::new(model(CHAIN));
    let (q, v) = ([0.5, -0.4, 0.3, 0.2], [1.0, -2.0, 0.7, 5.0]);
    let mut other = Machine::new(model(&CHAIN.replace("\"c\"", "\"d\"")));
    let error = whole.transfer(&q, &v, &mut other).expect_err("no body");
    assert_eq!(error, TransferError::Body { body: "c".into(), model: "chain".into() });
    let mut other = Machine::new(model(&CHAIN.replace("mass = 0.7", "mass = 0.8")));
    let error = whole.transfer(&q, &v, &mut other).expect_err("another mass");
    assert_eq!(error, TransferError::Inertia { body: "b".into() });
    let mut other = Machine::new(whole.model.clone());
    let error = whole.transfer(&q[1..], &v, &mut other).expect_err("too short");
    assert!(matches!(error, TransferError::Size { expected: 4, found: 3, .. }), "{error}");
    let error = whole.transfer(&[f64::NAN; 4], &v, &mut other).expect_err("not numbers");
    assert!(matches!(error, TransferError::Position { .. }), "{error}");
    let error = whole.transfer(&q, &[f64::INFINITY; 4], &mut other).expect_err("infinite");
    assert_eq!(error, TransferError::NotFinite);

    let cut = |joint: &str| whole.model.cut(joint).expect_err("no cut");
    assert_eq!(cut("jx"), RejoinError::NoJoint { joint: "jx".into() });
    let carried = whole.model.rejoined("a", Some("c"), JointKind::Fixed, Placement::IDENTITY).expect_err("a cycle");
    assert_eq!(carried, RejoinError::Cycle { body: "a".into(), parent: "c".into() });
    let coupled = model(&format!(
        "{CHAIN}\n[[coupling]]\nname = \"gear\"\njoints = [\"ja\", \"jc\"]\nratios = [1.0, -2.0]\noffset = 0.0\n"
    ));
    let error = coupled.cut("jc").expect_err("a gear");
    assert_eq!(error, RejoinError::Used { joint: "jc".into(), by: "coupling `gear`".into() });
}
