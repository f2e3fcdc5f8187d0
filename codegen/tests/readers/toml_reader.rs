//! Valid TOML models: every entry of the format, defaults, order, and models that must not cause findings.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, FRAC_PI_6, PI};

use mbd_codegen::model::{Gravity, JointKind, JointMotion, Model, Placement, Rotation, Value, WrenchAxes};
use mbd_codegen::read;

const EVERYTHING: &str = include_str!("everything.toml");
const C: fn(f64) -> Value = Value::Const;

/// The model of a text that must give no findings at all.
fn clean(text: &str) -> Model {
    let (model, findings) = read::load("robot arm-2.toml", text, &Default::default());
    assert!(findings.0.is_empty(), "{findings}");
    model.expect("a model where nothing was found")
}

/// Messages of the findings about a text, without file and help.
fn messages(text: &str) -> Vec<String> {
    read::load("m.toml", text, &Default::default()).1 .0.into_iter().map(|d| d.message).collect()
}

#[test]
fn everything_is_read() {
    let m = clean(EVERYTHING);
    assert_eq!(m.name, "everything");
    let params: Vec<_> = m.params.iter().map(|p| (p.name.as_str(), p.default)).collect();
    assert_eq!(params, [("payload", 1.5), ("tilt", FRAC_PI_2), ("g", -9.81), ("k", 10.0)]);
    assert_eq!(m.gravity, Gravity::Constant([C(0.0), C(0.0), Value::Param(2)]));

    let base = &m.bodies[0];
    assert_eq!((base.mass, base.com), (C(20.0), [C(0.0), C(0.0), C(0.1)]));
    assert_eq!(base.inertia, [1.0, 1.1, 1.2, 0.1, -0.1, 0.05].map(C));
    assert_eq!(base.inertia_axes, Rotation::Rpy([C(0.0), C(FRAC_PI_2), C(0.0)]));
    assert_eq!(m.bodies[2].mass, Value::Param(0));
    assert_eq!(m.bodies[5].inertia, [Value::ZERO; 6]);
    let names: Vec<_> = m.bodies.iter().map(|b| b.name.as_str()).collect();
    assert_eq!(names, ["base", "second", "first-leg", "foot", "wheel", "cross", "ball", "screw", "sled", "tube"]);

    assert_eq!(m.frames[0].body, Some(3));
    assert_eq!(m.frames[0].placement.rotation, Rotation::Rpy([C(0.0), C(0.0), C(0.5)]));
    assert_eq!((m.frames[1].name.as_str(), m.frames[1].body), ("station", None));
    let wrenches: Vec<_> = m.wrenches.iter().map(|w| (w.name.as_str(), w.body, w.axes)).collect();
    assert_eq!(wrenches, [("foot", 3, WrenchAxes::World), ("push", 3, WrenchAxes::Body)]);
}

#[test]
fn joints_come_depth_first() {
    let m = clean(EVERYTHING);
    let names: Vec<_> = m.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["root", "slide", "axle", "cardan", "socket", "hip", "ankle", "thread", "table", "sleeve"]);
    let mut placed = vec![false; m.bodies.len()];
    for j in &m.joints {
        assert!(j.parent.is_none_or(|b| placed[b]), "{}: the parent comes first", j.name);
        placed[j.child] = true;
        for list in [&j.damping, &j.stiffness, &j.rest, &j.armature] {
            assert_eq!(list.len(), j.kind.nv(), "{}", j.name);
        }
    }
}

#[test]
fn joints_are_read() {
    let m = clean(EVERYTHING);
    let joint = |name: &str| m.joints.iter().find(|j| j.name == name).expect("a joint of that name");
    let ankle = joint("ankle");
    assert_eq!(ankle.kind, JointKind::Revolute { axis: [0.0, 1.0, 0.0] });
    assert_eq!(ankle.placement.xyz, [C(0.0), C(0.0), C(-0.4)]);
    assert_eq!(ankle.placement.rotation, Rotation::AxisAngle { axis: [0.0, 0.0, 2.0], angle: Value::Param(1) });
    assert_eq!((ankle.damping[0], ankle.stiffness[0]), (C(0.1), Value::Param(3)));
    assert_eq!((ankle.rest[0], ankle.armature[0]), (C(FRAC_PI_4), C(0.01)));
    assert_eq!(joint("root").damping, [1.0, 1.0, 1.0, 2.0, 2.0, 2.0].map(C));
    assert_eq!(joint("root").placement, Placement::IDENTITY);
    assert_eq!(joint("slide").motion, JointMotion::Prescribed);
    assert_eq!(joint("hip").placement.rotation, Rotation::Rpy([C(0.0), C(PI), Value::Param(1)]));
    // The leader is an index in the final order of joints.
    assert_eq!(joint("axle").motion, JointMotion::Mimic { leader: 6, ratio: C(-2.0), offset: C(30f64.to_radians()) });
    assert_eq!(joint("cardan").kind, JointKind::Universal { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]] });
    assert_eq!(joint("cardan").rest, [10f64.to_radians(), 20f64.to_radians()].map(C));
    assert_eq!(joint("socket").armature, [C(0.001); 3]);
    assert_eq!(joint("thread").kind, JointKind::Helical { axis: [0.0, 0.0, 1.0], pitch: C(0.001) });
    assert_eq!(joint("table").kind, JointKind::Planar { normal: [1.0, 0.0, 0.0] });
    assert_eq!(joint("table").rest[..2], [0.1, 0.2].map(C));
    assert!((joint("table").rest[2].constant().expect("a constant") - FRAC_PI_6).abs() < 1e-15);
    assert_eq!(joint("table").stiffness, [C(5.0); 3]);
    assert_eq!(joint("sleeve").motion, JointMotion::Free);
}

const ONE: &str = "[[body]]\nname = 'a'\nmass = 1\ncom = [1, 0, 0]\n[[joint]]\nname = 'j'\ntype = 'pin'\nchild = 'a'\n";

#[test]
fn defaults() {
    let m = clean(ONE);
    assert_eq!(m.name, "robot_arm_2");
    assert_eq!(m.gravity, Gravity::Constant([C(0.0), C(0.0), C(-9.81)]));
    assert_eq!(m.joints[0].kind, JointKind::Revolute { axis: [0.0, 0.0, 1.0] });
    assert_eq!((m.joints[0].parent, m.joints[0].motion), (None, JointMotion::Free));
    assert_eq!(clean(&format!("gravity = 'input'\n{ONE}")).gravity, Gravity::Input);
    assert_eq!(clean(&ONE.replace("child", "parent = 'ground'\nchild")).joints[0].parent, None);
    assert_eq!(clean(&ONE.replace("mass = 1", "mass = 0x1_0")).bodies[0].mass, C(16.0));
    assert_eq!(clean(&ONE.replace("mass = 1", "mass = +1_0.5e0")).bodies[0].mass, C(10.5));
}

#[test]
fn columns_count_characters() {
    let (_, findings) = read::load("m.toml", "# Größe\nname = 'ä' # ü\n'öl' = 3\n'größe' = nan", &Default::default());
    let places: Vec<_> = findings.0.iter().map(|d| (d.line, d.column)).collect();
    assert_eq!(places, [(2, 8), (3, 1), (4, 1)], "{findings}");
    let (_, findings) = read::load("m.toml", "x = { 'ä' = 'ö', 'ß' = }", &Default::default());
    assert_eq!((findings.0[0].line, findings.0[0].column), (1, 24), "{findings}");
}

/// Inertias of real bodies at the edge of the triangle inequality cause no findings.
#[test]
fn fair_inertias_pass() {
    for inertia in [
        "[1, 1, 2]",                            // a ring
        "[0, 1, 1]",                            // a rod
        "[0.1, 0.2, 0.3]",                      // 0.1 + 0.2 is not 0.3 in floating point
        "[0.1234567, 0.7654321, 0.8888889]",    // a plate, seven digits
        "[0, 0, 0]",                            // a point
        "{ xx = 1, yy = 1, zz = 1, xy = 0.5 }", // 0.5, 1, 1.5
        "{ xx = 1, yy = 1, zz = 2, xy = 1 }",   // a rod across x = y: 0, 2, 2
        "[1e-3, 1e-3, 2e-3]",
    ] {
        clean(&ONE.replace("mass = 1", &format!("mass = 1\ninertia = {inertia}")));
    }
}

#[test]
fn triangle_slack_is_relative() {
    let with = |scale: f64, excess: f64| {
        let izz = 2.0 * scale * (1.0 + excess);
        let mass = 1.0 * scale;
        messages(&ONE.replace("mass = 1", &format!("mass = {mass:e}\ninertia = [{scale:e}, {scale:e}, {izz:e}]")))
    };
    for scale in [1e-9, 1.0, 1e3] {
        assert_eq!(with(scale, 1e-8), [""; 0], "{scale}");
        assert!(with(scale, 1e-4)[0].contains("triangle inequality by 0.009999 % ("), "{scale}");
        assert_eq!(with(scale, 0.1), ["inertia of `a` violates the triangle inequality (Ixx + Iyy < Izz)"], "{scale}");
    }
}

/// A body at the end of the tree must have inertia about every freedom of its joint, unless the freedom has an armature
/// or a given motion. Missing inertia is reported with the axis.
#[test]
fn massless_leaves() {
    let two = |body: &str, joint: &str| {
        messages(&format!(
            "{ONE}[[body]]\nname = 'b'\n{body}\n[[joint]]\nname = 'k'\nparent = 'a'\nchild = 'b'\nxyz = [1, 0, 0]\n{joint}\n[params]\n#"
        ))
    };
    for (body, joint) in [
        ("", "type = 'fixed'"),
        ("", "type = 'pin'\narmature = 0.1"),
        ("", "type = 'pin'\nmotion = 'prescribed'"),
        ("", "type = 'pin'\nmimic = { joint = 'j' }"),
        ("mass = 1", "type = 'slider'"),
        ("mass = 1", "type = 'helical'\npitch = 0.1"),
        ("mass = 1\ncom = [0, 1, 0]", "type = 'pin'"),
        ("mass = 1\ninertia = [0.1, 0.1, 0.1]", "type = 'floating'"),
        ("mass = 1\ninertia = [0.1, 0.1, 0.1]", "type = 'planar'\naxis = [1, 2, 3]"),
        ("mass = 1", "type = 'spherical'\narmature = 0.1"),
        ("mass = 1\ncom = [0, 0, 1]", "type = 'universal'"),
    ] {
        assert_eq!(two(body, joint), [""; 0], "{body} {joint}");
    }
    for (body, joint, way) in [
        ("", "type = 'pin'", "neither mass nor inertia"),
        ("", "type = 'universal'\narmature = [1, 0]", "neither mass nor inertia"),
        ("mass = 1", "type = 'pin'", "about the axis"),
        ("mass = 1\ncom = [0, 0, 3]", "type = 'pin'", "about the axis"),
        ("mass = 1\ncom = [1, 1, 0]", "type = 'pin'\naxis = [2, 2, 0]", "about the axis"),
        ("mass = 1", "type = 'cylindrical'", "about the axis"),
        ("mass = 1\ncom = [0, 2, 0]", "type = 'universal'", "about the second axis"),
        ("mass = 1\ncom = [0, 2, 0]", "type = 'spherical'", "about y"),
        ("mass = 1\ncom = [1, 2, 3]", "type = 'floating'", "about x"),
        ("mass = 1\ninertia = [0, 1, 1]", "type = 'pin'\naxis = [1, 0, 0]", "about the axis"),
        (
            "mass = 1\ninertia = [1, 1, 0]\ninertia_rpy = [0, 1.5708, 0]",
            "type = 'pin'\naxis = [1, 0, 0]",
            "about the axis",
        ),
    ] {
        let got = two(body, joint);
        assert_eq!(got.len(), 1, "{body} {joint}: {got:?}");
        assert!(got[0].starts_with("joint `k`: ") && got[0].contains(way), "{body} {joint}: {got:?}");
    }
}

/// A body that a fixed joint connects to a massless body gives it inertia, with any placement except a point mass on
/// the axis.
#[test]
fn welded_bodies_count_together() {
    let welded = |placement: &str| {
        messages(&format!(
            "[[body]]\nname = 'frame'\n[[joint]]\nname = 'j'\ntype = 'pin'\nchild = 'frame'\n[[body]]\nname = 'weight'\nmass = 1\ncom = [0, 0, 1]\n\
             [[joint]]\nname = 'weld'\ntype = 'fixed'\nparent = 'frame'\nchild = 'weight'\n{placement}"
        ))
    };
    assert_eq!(welded("xyz = [1, 0, 0]"), [""; 0]);
    assert_eq!(welded("rpy = [1, 0, 0]"), [""; 0]);
    // With these placements the mass is on the axis.
    assert_eq!(welded("xyz = [0, 0, 2]").len(), 1);
    assert_eq!(welded("rpy = { deg = [90, 0, 0] }\nxyz = [0, 1, 0]").len(), 1);
}

#[test]
fn long_chains_are_no_trouble() {
    let n = 20_000;
    let mut text = String::new();
    // The joints are listed from the tip to the root.
    for k in (0..n).rev() {
        let parent = if k == 0 { "ground".into() } else { format!("b{}", k - 1) };
        text += &format!("[[body]]\nname = 'b{k}'\nmass = 1\ncom = [1, 0, 0]\n[[joint]]\nname = 'j{k}'\ntype = 'pin'\nparent = '{parent}'\nchild = 'b{k}'\n");
    }
    let m = clean(&text);
    assert_eq!(m.joints.len(), n);
    assert_eq!(m.joints[n - 1].name, format!("j{}", n - 1));
    // The same bodies in a ring cause one finding.
    let ring = text.replace("parent = 'ground'", &format!("parent = 'b{}'", n - 1));
    assert_eq!(messages(&ring).len(), 1);
}

/// All models of this project are without findings.
#[test]
fn shipped_models_are_clean() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../models");
    let files = std::fs::read_dir(folder).expect("the folder of models").map(|e| e.expect("an entry").path());
    let mut count = 0;
    for path in files.filter(|p| p.extension().is_some_and(|e| e == "toml")) {
        // A base is read from the folder of the file.
        let (name, text) = (path.to_string_lossy(), std::fs::read_to_string(&path).expect("UTF-8"));
        let (model, mut findings) = read::load(&name, &text, &Default::default());
        // About a base by others, there are findings.
        findings.0.retain(|finding| finding.file == name);
        assert!(model.is_some() && findings.0.is_empty(), "{findings}");
        count += 1;
    }
    assert!(count >= 5, "{count} models");
}
