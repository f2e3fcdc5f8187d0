//! MJCF: one test for each rule that could be taken otherwise. Whole models are compared with MuJoCo's numbers elsewhere.

use std::io::{Error, ErrorKind};
use std::path::Path;

use mbd_codegen::model::{ConstraintKind, Gravity, JointKind, LoopKind, Model, Rotation, ShapeKind, Value};
use mbd_codegen::read::{load_with, to_toml, Base, Floor, ImportOptions};

/// Files that can be included or changed.
fn files(path: &Path) -> std::io::Result<Vec<u8>> {
    let path = path.to_string_lossy().replace('\\', "/");
    let text = match path.as_str() {
        "robots/arm.xml" => ARM,
        "robots/parts/body.xml" => {
            "<mujocoinclude>\n<worldbody><include file='parts/tip.xml'/></worldbody>\n</mujocoinclude>\n"
        }
        "robots/parts/tip.xml" => "<x><body name='tip'><joint name='j'/>\n<geom size='0.1' type='bal'/></body></x>",
        "robots/parts/good.xml" => "<x><body name='tip'><joint name='j'/><geom size='0.1'/></body></x>",
        "robots/parts/ring.xml" => "<x><include file='parts/ring.xml'/></x>",
        "robots/parts/open.xml" => "<x>\n<body></x>",
        "robots/meshes/corner.obj" => {
            "# a tetrahedron\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1/1 4/1 3/1\nf -3 -2 -1\n"
        }
        "robots/meshes/corner.stl" => return Ok(stl()),
        "robots/meshes/corner.msh" => return Ok(msh()),
        "robots/meshes/short.stl" => return Ok(stl()[..90].to_vec()),
        "robots/meshes/square.obj" => "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3 4\n",
        "robots/meshes/lost.obj" => "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
        "robots/meshes/flat.obj" => "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "robots/ground/steps.hf" => return Ok(heights(4, 5, |k| k as f32)),
        "robots/ground/short.hf" => return Ok(heights(4, 5, |k| k as f32)[..50].to_vec()),
        "robots/ground/few.hf" => return Ok(heights(3, 5, |k| k as f32)),
        "robots/ground/many.hf" => return Ok(heights(300, 300, |k| k as f32)),
        "robots/ground/odd.hf" => return Ok(heights(4, 4, |k| if k == 3 { f32::NAN } else { 1.0 })),
        "robots/ground/none.hf" => "",
        _ => return Err(Error::new(ErrorKind::NotFound, "no such file")),
    };
    Ok(text.as_bytes().to_vec())
}

/// The robot in `robots/arm.xml`.
const ARM: &str = "<?xml version='1.0'?>\n<mujoco model='arm'>\n<include file='parts/body.xml'/>\n\
                   <option gravity='0 0 -1'/>\n</mujoco>";

/// The corners and faces of a tetrahedron.
const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const FACES: [[i32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn stl() -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend(4u32.to_le_bytes());
    for face in FACES {
        bytes.extend([0; 12]);
        face.iter().for_each(|k| CORNERS[*k as usize].iter().for_each(|x| bytes.extend(x.to_le_bytes())));
        bytes.extend([0; 2]);
    }
    bytes
}

fn msh() -> Vec<u8> {
    let counts = [4, 0, 0, 4].iter().flat_map(|n: &i32| n.to_le_bytes());
    let corners = CORNERS.iter().flatten().flat_map(|x| x.to_le_bytes());
    counts.chain(corners).chain(FACES.iter().flatten().flat_map(|k| k.to_le_bytes())).collect()
}

/// A file of MuJoCo's format for height fields.
fn heights(rows: i32, columns: i32, h: impl Fn(i32) -> f32) -> Vec<u8> {
    let counts = [rows, columns].into_iter().flat_map(i32::to_le_bytes);
    counts.chain((0..rows * columns).flat_map(|k| h(k).to_le_bytes())).collect()
}

fn load(file: &str, text: &str, options: &ImportOptions) -> (Option<Model>, String) {
    let (read, findings) = load_with(file, text, options, &files);
    (read.map(|(model, _)| model), findings.to_string())
}

/// The model of a file with this content, and its findings.
fn model(content: &str) -> (Model, String) {
    let (model, findings) = load("robots/m.xml", &format!("<mujoco>{content}</mujoco>"), &ImportOptions::default());
    (model.unwrap_or_else(|| panic!("{findings}")), findings)
}

/// The findings about a file that is refused.
fn refused(content: &str) -> String {
    let (model, findings) = load("robots/m.xml", &format!("<mujoco>{content}</mujoco>"), &ImportOptions::default());
    assert!(model.is_none(), "{content}");
    findings
}

fn x(value: Value) -> f64 {
    value.constant().expect("no parameters")
}

fn near<const N: usize>(got: [Value; N], wanted: [f64; N]) {
    for (got, wanted) in got.map(x).iter().zip(wanted) {
        assert!((got - wanted).abs() <= 1e-14 * wanted.abs().max(1.0), "{got} for {wanted}");
    }
}

/// Axis and angle of a rotation.
fn turn(rotation: Rotation) -> ([f64; 3], f64) {
    match rotation {
        Rotation::AxisAngle { axis, angle } => (axis, x(angle)),
        rotation => {
            assert_eq!(rotation, Rotation::NONE);
            ([0.0; 3], 0.0)
        }
    }
}

/// The orientation of the only body, with this attribute and these settings.
fn orientation(compiler: &str, attribute: &str) -> ([f64; 3], f64) {
    let text = format!(
        "<compiler {compiler}/><worldbody><body {attribute}><joint name='j'/><geom size='0.1'/></body></worldbody>"
    );
    turn(model(&text).0.joints[0].placement.rotation)
}

const BALL: &str = "<geom size='0.1'/>";

#[test]
fn angles_are_degrees_unless_the_compiler_says_otherwise() {
    let right = std::f64::consts::FRAC_PI_2;
    assert_eq!(orientation("", "euler='0 90 0'"), ([0.0, 1.0, 0.0], right));
    assert_eq!(orientation("angle='radian'", "axisangle='0 3 0 0.5'"), ([0.0, 1.0, 0.0], 0.5));
    let text = "<worldbody><body><joint name='a' range='-90 45' ref='30' springref='60' stiffness='2'/>\
                <joint name='b' type='slide' range='-90 45' ref='30' axis='1 0 0'/><geom size='0.1'/></body></worldbody>";
    let (m, _) = model(text);
    let (a, b) = (&m.joints[0], &m.joints[1]);
    let [lower, upper] = a.bounds.range.expect("a range");
    assert!((lower + right).abs() < 1e-15 && (upper - right / 2.0).abs() < 1e-15);
    assert!((x(a.rest[0]) - right / 1.5).abs() < 1e-15);
    assert_eq!(b.bounds.range, Some([-90.0, 45.0]));
    assert_eq!(m.starts.iter().map(|s| s.q[0]).collect::<Vec<_>>(), [30.0 / 180.0 * std::f64::consts::PI, 30.0]);
}

#[test]
fn quaternions_have_their_real_part_first() {
    let (axis, angle) = orientation("", "quat='1 0 0 1'");
    assert_eq!(axis, [0.0, 0.0, 1.0]);
    assert!((angle - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    // Of any length, and with either sign.
    assert_eq!(orientation("", "quat='-3 0 0 -3'"), (axis, angle));
    assert_eq!(orientation("", "quat='2 0 0 0'"), ([0.0; 3], 0.0));
}

#[test]
fn frames_by_their_axes() {
    let right = std::f64::consts::FRAC_PI_2;
    let close = |(axis, angle): ([f64; 3], f64), wanted: [f64; 3]| {
        let turned = axis.map(|a| a * angle);
        assert!((0..3).all(|k| (turned[k] - wanted[k]).abs() < 1e-14), "{turned:?} for {wanted:?}");
    };
    close(orientation("", "xyaxes='0 2 0 -1 5 0'"), [0.0, 0.0, right]);
    close(orientation("", "zaxis='3 0 0'"), [0.0, right, 0.0]);
    close(orientation("", "zaxis='0 0 -1'"), [2.0 * right, 0.0, 0.0]);
    // Small letters turn along, capitals stay: the second turn is about another axis.
    close(orientation("eulerseq='zxy'", "euler='90 0 90'"), {
        let third = 2.0 * right / 3.0 * 2.0 / 3.0_f64.sqrt();
        [-third, third, third].map(|x| x / 1.0)
    });
    close(orientation("eulerseq='ZXY'", "euler='90 0 90'"), {
        let third = 2.0 * right / 3.0 * 2.0 / 3.0_f64.sqrt();
        [third, third, third]
    });
}

#[test]
fn several_joints_of_a_body_follow_each_other_at_their_anchors() {
    let text = "<worldbody><body name='b' pos='1 0 0'><joint name='s' type='slide' axis='1 0 0' pos='9 9 9'/>\
                <joint name='h' axis='0 2 0' pos='0 0 0.5'/><joint name='g' pos='0.1 0 0.5'/><geom size='0.1'/>\
                <site name='t' pos='0 0 1'/><body name='c' pos='0 0 2'><geom size='0.1'/></body></body></worldbody>";
    let (m, _) = model(text);
    let shown: Vec<_> = m.joints.iter().map(|j| (j.name.as_str(), m.bodies[j.child].name.as_str())).collect();
    assert_eq!(shown, [("s", "b_s"), ("h", "b_h"), ("g", "b_g"), ("b_fixed", "b"), ("c_fixed", "c")]);
    near(m.joints[0].placement.xyz, [1.0, 0.0, 0.0]);
    near(m.joints[1].placement.xyz, [0.0, 0.0, 0.5]);
    near(m.joints[2].placement.xyz, [0.1, 0.0, 0.0]);
    near(m.joints[3].placement.xyz, [-0.1, 0.0, -0.5]);
    // Everything else stands in the frame of the file.
    near(m.joints[4].placement.xyz, [0.0, 0.0, 2.0]);
    near(m.frames[0].placement.xyz, [0.0, 0.0, 1.0]);
    assert_eq!(m.joints[1].kind, JointKind::Revolute { axis: [0.0, 1.0, 0.0] });
    let massless = m.bodies.iter().filter(|b| x(b.mass) == 0.0).count();
    assert_eq!(massless, 3);
}

#[test]
fn a_body_stands_at_the_reference_of_its_joints() {
    let text = format!(
        "<worldbody><body name='b'><joint name='h' axis='0 1 0' pos='0 0 1' ref='90'/>\
         <joint name='s' type='slide' axis='0 0 1' ref='2'/>{BALL}</body></worldbody>"
    );
    let (m, _) = model(&text);
    // At zero, the hinge has turned the body by -90 degrees about its anchor.
    let (axis, angle) = turn(m.joints[0].placement.rotation);
    assert!((axis[1] * angle + std::f64::consts::FRAC_PI_2).abs() < 1e-15, "{axis:?} {angle}");
    near(m.joints[0].placement.xyz, [0.0, 0.0, 1.0]);
    near(m.joints[1].placement.xyz, [0.0, 0.0, -2.0]);
    near(m.joints[2].placement.xyz, [0.0, 0.0, -1.0]);
}

#[test]
fn free_bodies_start_where_the_file_places_them() {
    let text = format!("<worldbody><body pos='1 2 3' quat='0 1 0 0'><freejoint/>{BALL}</body></worldbody>");
    let (m, _) = model(&text);
    assert_eq!((m.joints[0].kind, m.joints[0].name.as_str()), (JointKind::Floating, "body_1_free"));
    near(m.joints[0].placement.xyz, [0.0; 3]);
    assert_eq!(m.starts[0].q, [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0]);
    // MuJoCo's rotors of a free joint act in the axes of the world.
    let text = format!(
        "<default><joint armature='0.5'/></default><worldbody><body pos='1 2 3' quat='0 1 0 0'>\
         <joint name='f' type='free'/>{BALL}</body></worldbody>"
    );
    let (m, _) = model(&text);
    let names: Vec<_> = m.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["f_x", "f_y", "f_z", "f"]);
    assert_eq!(m.joints[3].kind, JointKind::Spherical);
    assert!(m.joints.iter().flat_map(|j| &j.armature).all(|a| *a == Value::Const(0.5)));
    assert_eq!(m.starts.iter().flat_map(|s| s.q.clone()).collect::<Vec<_>>(), [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0]);
    // A `freejoint` has no defaults.
    let text = format!(
        "<default><joint armature='0.5'/></default><worldbody><body><freejoint name='f'/>{BALL}</body></worldbody>"
    );
    assert_eq!(model(&text).0.joints[0].armature, [Value::ZERO; 6]);
}

#[test]
fn classes_of_defaults() {
    let text = "<default><joint damping='1' stiffness='1'/><geom size='0.1 0.2 0.3' density='10'/>\
        <default class='a'><joint damping='2'/><geom type='box'/>\
        <default class='b'><joint stiffness='3'/></default></default></default>\
        <worldbody><body childclass='b'><joint name='j1'/><geom/>\
        <frame childclass='a'><body><joint name='j2'/><geom size='0.5'/></body></frame>\
        <body><joint name='j3' class='main' axis='1 0 0'/><geom class='main'/></body></body></worldbody>";
    let (m, _) = model(text);
    let passive: Vec<_> = m.joints.iter().map(|j| (x(j.damping[0]), x(j.stiffness[0]))).collect();
    assert_eq!(passive, [(2.0, 3.0), (2.0, 1.0), (1.0, 1.0)]);
    let ball = 10.0 * 4.0 * std::f64::consts::PI * 1e-3 / 3.0;
    // A size replaces the first numbers of a default only.
    near([m.bodies[0].mass, m.bodies[1].mass, m.bodies[2].mass], [0.48, 2.4, ball]);
}

#[test]
fn inertias_of_geoms() {
    let of = |geom: &str| {
        let text = format!("<worldbody><body><joint name='j'/>{geom}</body></worldbody>");
        let (m, _) = model(&text);
        m.bodies.into_iter().next().expect("a body")
    };
    let pi = std::f64::consts::PI;
    let ball = of("<geom size='0.2' mass='3' pos='1 2 3'/>");
    near(ball.com, [1.0, 2.0, 3.0]);
    near(ball.inertia, [0.048, 0.048, 0.048, 0.0, 0.0, 0.0]);
    near([of("<geom size='0.2'/>").mass], [1000.0 * 4.0 / 3.0 * pi * 0.008]);
    let shell = of("<geom size='0.2' mass='3' shellinertia='true'/>");
    near(shell.inertia, [0.08, 0.08, 0.08, 0.0, 0.0, 0.0]);
    let rod = of("<geom type='cylinder' fromto='0 0 0 0 2 0' size='0.1' mass='6'/>");
    near(rod.com, [0.0, 1.0, 0.0]);
    near(rod.inertia, [2.015, 2.015, 0.03, 0.0, 0.0, 0.0]);
    let Rotation::Rpy(rpy) = rod.inertia_axes else { panic!("{:?}", rod.inertia_axes) };
    near(rpy, [pi / 2.0, 0.0, 0.0]);
    near([of("<geom type='capsule' size='0.1 1' density='1'/>").mass], [pi * (0.02 + 0.004 / 3.0)]);
    let two =
        of("<geom size='0.1' mass='1' pos='1 0 0'/><geom size='0.1' mass='1' pos='-1 0 0'/><geom size='1' mass='0'/>");
    near(two.com, [0.0; 3]);
    near(two.inertia, [0.008, 2.008, 2.008, 0.0, 0.0, 0.0]);
}

#[test]
fn sources_and_bounds_of_inertias() {
    let body = "<worldbody><body><joint name='j'/><inertial pos='0 0 0' mass='2' fullinertia='3 4 5 0.1 0.2 0.3'/>\
                <geom size='0.1' mass='7' group='2'/><geom size='0.1' mass='1'/></body></worldbody>";
    let of = |compiler: &str| model(&format!("<compiler {compiler}/>{body}")).0.bodies.into_iter().next().expect("one");
    near(of("").inertia, [3.0, 4.0, 5.0, 0.1, 0.2, 0.3]);
    near([of("inertiafromgeom='true'").mass], [8.0]);
    near([of("inertiafromgeom='true' inertiagrouprange='0 1'").mass], [1.0]);
    near([of("boundmass='3'").mass], [3.0]);
    // Bounds hold for principal moments.
    let bounded = of("boundinertia='10'").inertia;
    near(bounded, [10.0, 10.0, 10.0, 0.0, 0.0, 0.0]);
    let scaled = of("settotalmass='1'");
    near(scaled.inertia, [1.5, 2.0, 2.5, 0.05, 0.1, 0.15]);
    let flat = body.replace("3 4 5 0.1 0.2 0.3", "1 2 9 0 0 0");
    let (m, _) = model(&format!("<compiler balanceinertia='true'/>{flat}"));
    near(m.bodies[0].inertia, [4.0, 4.0, 4.0, 0.0, 0.0, 0.0]);
}

#[test]
fn equalities_close_where_the_file_places_the_bodies() {
    let text = format!(
        "<worldbody><body name='a' pos='1 0 0'><joint name='ja' ref='10'/>{BALL}</body>\
         <body name='b' pos='0 2 0' euler='0 0 90'><joint name='jb' type='slide'/>{BALL}</body></worldbody>\
         <equality><connect name='c' body1='a' body2='b' anchor='1 0 0'/><weld body1='b'/>\
         <joint joint1='jb' joint2='ja' polycoef='0.5 2 0 0 0'/><joint joint1='ja' active='false'/>\
         <tendon tendon1='t'/></equality>\
         <tendon><fixed name='t'><joint joint='ja' coef='3'/><joint joint='jb' coef='-1'/></fixed></tendon>"
    );
    let (m, findings) = model(&text);
    let ConstraintKind::Loop { kind: LoopKind::Spherical, first, second } = &m.constraints[0].kind else { panic!() };
    near(first.placement.xyz, [1.0, 0.0, 0.0]);
    near(second.placement.xyz, [-2.0, -2.0, 0.0]);
    // The second body is the world where none is named.
    let ConstraintKind::Loop { kind: LoopKind::Fixed, first, second } = &m.constraints[1].kind else { panic!() };
    assert_eq!((first.body, second.body), (Some(1), None));
    near(first.placement.xyz, [-2.0, 0.0, 0.0]);
    let reference = 10.0 / 180.0 * std::f64::consts::PI;
    let ConstraintKind::Coupling { terms, offset } = &m.constraints[2].kind else { panic!() };
    assert_eq!(terms, &[(1, Value::ONE), (0, Value::Const(-2.0))]);
    near([*offset], [0.5 - 2.0 * reference]);
    let ConstraintKind::Coupling { terms, offset } = &m.constraints[3].kind else { panic!() };
    assert_eq!(terms, &[(0, Value::Const(3.0)), (1, Value::Const(-1.0))]);
    near([*offset], [3.0 * reference]);
    assert_eq!(m.constraints.len(), 4);
    assert!(findings.contains("an equality that is not active is not used"), "{findings}");
}

/// The defaults of all equalities are those of `equality`.
#[test]
fn defaults_of_equalities_have_one_name() {
    let text = format!(
        "<default><equality active='false'/></default><worldbody><body name='a'><joint name='j'/>{BALL}</body></worldbody>\
         <equality><connect body1='a' anchor='0 0 0'/><weld body1='a' active='true'/></equality>"
    );
    let (m, findings) = model(&text);
    let welded = |kind: &ConstraintKind| matches!(kind, ConstraintKind::Loop { kind: LoopKind::Fixed, .. });
    assert!(matches!(&m.constraints[..], [only] if welded(&only.kind)), "{findings}");
}

/// What a flag cannot be called is told.
#[test]
fn flags_have_known_names() {
    let text = format!(
        "<option><flag gravty='disable'/></option><worldbody><body name='a'><joint name='j'/>{BALL}</body></worldbody>"
    );
    let (_, findings) = model(&text);
    assert!(findings.contains("unknown attribute `gravty`"), "{findings}");
}

/// What of `option` is not used is named, and nothing is said where all of it is.
#[test]
fn options_that_are_not_used_are_named() {
    let told = |option: &str| {
        let (_, findings) =
            model(&format!("{option}<worldbody><body name='a'><joint name='j'/>{BALL}</body></worldbody>"));
        let lines = findings.lines().filter(|line| line.contains("of `option`"));
        lines.filter_map(|line| line.split_once("notice: ")).map(|(_, told)| told.to_string()).collect::<Vec<_>>()
    };
    for used in ["<option gravity='0 0 -5'/>", "<option/>", "<option><flag contact='disable'/></option>"] {
        assert_eq!(told(used), [""; 0], "{used}");
    }
    assert_eq!(told("<option gravity='0 0 -5' solver='CG'/>"), ["`solver` of `option` is not used"]);
    assert_eq!(
        told("<option integrator='RK4' timestep='0.001'/>"),
        ["`timestep` and `integrator` of `option` are not used"]
    );
}

#[test]
fn flags_switch_off_what_acts() {
    let text = format!(
        "<option gravity='0 0 -5'><flag gravity='disable' spring='disable' equality='disable'/></option>\
         <worldbody><body name='a'><joint name='j' stiffness='1' damping='2'/>{BALL}</body></worldbody>\
         <equality><weld body1='a'/></equality>"
    );
    let (m, _) = model(&text);
    assert_eq!(m.gravity, Gravity::Constant([Value::ZERO; 3]));
    assert_eq!((x(m.joints[0].stiffness[0]), x(m.joints[0].damping[0])), (0.0, 2.0));
    assert!(m.constraints.is_empty());
    let (m, _) = model(&text.replace("<flag gravity='disable' spring='disable' equality='disable'/>", ""));
    assert_eq!(m.gravity, Gravity::Constant([0.0, 0.0, -5.0].map(Value::Const)));
    assert_eq!(m.constraints.len(), 1);
}

#[test]
fn actuators_and_tendons_tell_what_joints_have() {
    let text = format!(
        "<default><motor gear='10' ctrlrange='-2 1'/></default>\
         <worldbody><body><joint name='a'/><joint name='b' axis='0 1 0' actuatorfrcrange='-7 7'/>{BALL}</body></worldbody>\
         <actuator><motor joint='a'/><motor joint='b'/><position joint='b' kp='5'/></actuator>\
         <tendon><fixed damping='1' armature='0.5' stiffness='2'><joint joint='a' coef='2'/></fixed></tendon>"
    );
    let (m, findings) = model(&text);
    assert_eq!(m.joints[0].bounds.effort, Some(20.0));
    assert_eq!(m.joints[1].bounds.effort, Some(7.0));
    let passive = |values: &[Value]| x(values[0]);
    assert_eq!(passive(&m.joints[0].damping), 4.0);
    assert_eq!(passive(&m.joints[0].armature), 2.0);
    assert_eq!(passive(&m.joints[0].stiffness), 8.0);
    assert!(findings.contains("warning: the law of an actuator (`position`)"), "{findings}");
}

/// Rotors and dampers of actuators are their joints', times the square of `gear`. The numbers are the differences that they make
/// to `mj_fullM` and `qfrc_passive` of MuJoCo 4.0.0.
#[test]
fn rotors_and_dampers_of_actuators_are_those_of_joints() {
    let of = |before: &str, actuators: &str| {
        let text = format!(
            "{before}<worldbody><body><joint name='a' damping='0.1'/>{BALL}<site name='s'/></body>\
             <body><joint name='b' type='ball'/>{BALL}</body><body><freejoint name='f'/>{BALL}</body></worldbody>\
             <tendon><fixed name='t'><joint joint='a' coef='2'/></fixed></tendon><actuator>{actuators}</actuator>"
        );
        let (m, _) = model(&text);
        let first = |values: &[Value]| x(values[0]);
        m.joints.iter().map(|j| (first(&j.armature), first(&j.damping))).collect::<Vec<_>>()
    };
    let close = |got: Vec<(f64, f64)>, wanted: [(f64, f64); 3]| {
        let far = |(a, b): (f64, f64), (c, d): (f64, f64)| (a - c).abs() > 1e-14 || (b - d).abs() > 1e-14;
        assert!(
            got.len() == 3 && got.iter().zip(wanted).all(|(got, wanted)| !far(*got, wanted)),
            "{got:?}, {wanted:?}"
        );
    };
    let both = "armature='0.5' damping='0.7'";
    for motor in [
        format!("<motor joint='a' {both} gear='3'/>"),
        format!("<motor jointinparent='a' {both} gear='-3 7 7'/>"),
        format!("<general joint='a' {both} gear='3' forcerange='-1 1'/>"),
        format!("<position joint='a' kp='1' {both} gear='3'/>"),
        format!("<velocity joint='a' {both} gear='3' group='1'/>"),
        format!("<dcmotor joint='a' motorconst='0.1' resistance='1' {both} gear='3'/>"),
        format!("<motor tendon='t' {both} gear='1.5'/>"),
    ] {
        close(of("", &motor), [(4.5, 6.4), (0.0, 0.0), (0.0, 0.0)]);
    }
    // Those of several are added, and classes of all kinds of actuators count.
    let two = "<motor joint='a' armature='0.5'/><motor joint='a' armature='0.5' damping='0.2' gear='2'/>";
    close(of("", two), [(2.5, 0.9), (0.0, 0.0), (0.0, 0.0)]);
    let class = "<default><general armature='0.5'/><position damping='0.7 0 0'/></default>";
    close(of(class, "<motor joint='a' gear='3'/>"), [(4.5, 6.4), (0.0, 0.0), (0.0, 0.0)]);
    // All freedoms of a ball have them, and so have those of a free joint; an `orientation` has none.
    let others = format!("<motor joint='b' {both} gear='3 2 1'/><motor joint='f' damping='0.7' gear='3 2 1'/>");
    close(of("", &others), [(0.0, 0.1), (4.5, 6.3), (0.0, 6.3)]);
    close(of(class, "<orientation joint='b'/>"), [(0.0, 0.1), (0.0, 0.0), (0.0, 0.0)]);
    // A flag switches dampers off, and rotors never.
    let off = "<option><flag damper='disable' actuation='disable'/></option>";
    close(of(off, &format!("<motor joint='a' {both}/>")), [(0.5, 0.0), (0.0, 0.0), (0.0, 0.0)]);

    // A free joint with a rotor is three slides and a ball, all of which have that of the actuator, too.
    let free = |rotor: &str| {
        format!(
            "<worldbody><body><joint name='f' type='free' {rotor}/>{BALL}</body></worldbody>\
             <actuator><motor joint='f' armature='0.5' damping='0.7' gear='2'/></actuator>"
        )
    };
    let (m, _) = model(&free("armature='1'"));
    assert_eq!(m.joints.len(), 4);
    for joint in &m.joints {
        assert!(joint.armature.iter().all(|a| *a == Value::Const(3.0)), "{:?}", joint.armature);
        assert!(joint.damping.iter().all(|d| (x(*d) - 2.8).abs() < 1e-14), "{:?}", joint.damping);
    }
    let findings = refused(&free(""));
    assert!(findings.contains("`armature` of an actuator on a free joint without one of its own"), "{findings}");
}

/// Rotors and dampers of actuators that are not those of a joint are refused where they act.
#[test]
fn rotors_and_dampers_of_actuators_on_no_joint_are_refused() {
    let text = |actuator: &str| {
        format!(
            "<worldbody><body><joint name='a'/><joint name='b' axis='1 0 0'/>{BALL}<site name='s'/></body></worldbody>\
             <tendon><fixed name='two'><joint joint='a' coef='2'/><joint joint='b' coef='1'/></fixed>\
             <spatial name='string'><site site='s'/><site site='s'/></spatial></tendon><actuator>{actuator}</actuator>"
        )
    };
    for (on, said) in [
        ("site='s'", "on neither a joint nor a tendon is not modelled"),
        ("cranksite='s' slidersite='s' cranklength='1'", "on neither a joint nor a tendon is not modelled"),
        ("tendon='two'", "on a tendon that is not a fixed one over one joint is not modelled"),
        ("tendon='string'", "on a tendon that is not a fixed one over one joint is not modelled"),
        ("tendon='three'", "`three` is not a tendon"),
        ("joint='c'", "`c` is not a joint"),
    ] {
        for key in ["armature", "damping"] {
            let findings = refused(&text(&format!("<motor name='m' {on} {key}='1'/>")));
            assert!(findings.contains("error: actuator `m`: ") && findings.contains(said), "{said}: {findings}");
        }
        model(&text(&format!("<motor name='m' {on} armature='0' damping='0 0 0'/>")));
    }
    let findings = refused(&text("<motor joint='a' damping='1 2'/>"));
    assert!(findings.contains("actuator without a name: a `damping` that is not linear is not modelled"), "{findings}");
}

#[test]
fn ranges_are_stops_and_geoms_touch_where_that_is_asked_for() {
    let text = "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body name='a' pos='0 0 1'>\
        <joint name='j' type='slide' range='-1 1'/><geom name='g' type='box' size='0.1 0.2 0.3'/>\
        <geom size='0.5' contype='0' conaffinity='0'/></body></worldbody></mujoco>";
    let (m, findings) = load("m.xml", text, &ImportOptions::default());
    assert_eq!(m.expect(&findings).contacts, []);
    assert!(findings.contains("`range` makes no stops") && findings.contains("touches nothing"), "{findings}");
    let floor = Some(Floor { height: 0.0, friction: 0.5 });
    let (m, findings) = load("m.xml", text, &ImportOptions { limits: true, floor, ..ImportOptions::default() });
    let m = m.expect(&findings);
    // Eight corners and two stops; a geom that touches nothing in MuJoCo is no shape.
    assert_eq!((m.contacts.len(), m.shapes.len()), (10, 3));
    let (_, findings) = load("m.xml", text, &ImportOptions { base: Base::Floating, ..ImportOptions::default() });
    assert!(findings.contains("error: a model of MuJoCo states its own base"), "{findings}");
}

/// An empty range is a limit where it is called one only, and then refused: `jnt_limited`, `tendon_limited`,
/// `actuator_forcelimited` and the errors of MuJoCo 4.0.0.
#[test]
fn empty_ranges_are_no_limits() {
    let text = |joint: &str, tendon: &str, motor: &str| {
        format!(
            "<default><joint range='-9 9'/></default><worldbody><body><joint name='j' {joint}/>{BALL}</body></worldbody>\
             <tendon><fixed {tendon}><joint joint='j' coef='1'/></fixed></tendon><actuator><motor joint='j' {motor}/></actuator>"
        )
    };
    for joint in
        ["range='0 0'", "range='-0 0' limited='auto'", "range='1 1'", "range='1 -1'", "range='0 0' limited='false'"]
    {
        let (m, findings) = model(&text(joint, "", ""));
        assert_eq!(m.joints[0].bounds.range, None, "{joint}");
        // What looks like a mistake is told.
        let told = findings.contains("warning: joint `j`: `range` from 1 to ");
        assert_eq!(told, joint.contains('1'), "{findings}");
    }
    assert!(model(&text("", "", "")).0.joints[0].bounds.range.is_some());
    let findings = refused(&text("range='0 0' limited='true'", "", ""));
    assert!(findings.contains("error: joint `j`: `range` from 0 to 0 is empty"), "{findings}");
    let (_, findings) = model(&text("", "range='0 0'", ""));
    assert!(!findings.contains("the limit of a tendon"), "{findings}");
    let (_, findings) = model(&text("", "range='0 1'", ""));
    assert!(findings.contains("the limit of a tendon"), "{findings}");
    let effort = |joint: &str, motor: &str| model(&text(joint, "", motor)).0.joints[0].bounds.effort;
    assert_eq!(effort("actuatorfrcrange='2 2'", "ctrlrange='0 0' forcerange='3 3'"), None);
    assert_eq!(effort("actuatorfrcrange='0 0'", "ctrlrange='0 0' forcerange='-3 3'"), Some(3.0));
    for wrong in ["range='0'", "range='0 x'", "range='0 0 x'", "range='0 0 0'", "range='NaN 0'", "range='0 NaN'"] {
        let findings = refused(&text(wrong, "", ""));
        assert!(findings.contains("error: joint `j`: `range`"), "{wrong}: {findings}");
    }
}

/// Where there is a floor, meshes of moving bodies touch it with the corners of their hulls, placed as MuJoCo places the
/// vertices.
#[test]
fn meshes_touch_the_floor() {
    let asset = "<compiler meshdir='meshes'/><asset><mesh file='corner.obj' scale='1 -2 1' refpos='0 0 1'/>\
        <mesh name='m' file='corner.msh'/><mesh name='none' file='none.stl'/>\
        <mesh name='box' vertex='0 0 0  1 0 0  0 1 0  1 1 0  0 0 1  1 0 1  0 1 1  1 1 1  0.5 0.5 0.5'/></asset>";
    let text = format!(
        "<mujoco>{asset}<worldbody><geom type='mesh' mesh='m'/><body name='a'><freejoint/>\
         <inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\
         <geom name='first' type='mesh' mesh='corner' pos='0 0 5'/><geom type='mesh' mesh='m'/><geom type='mesh' mesh='m'/>\
         <geom type='mesh' mesh='box'/><geom type='mesh' mesh='none'/><geom type='mesh' mesh='none'/>\
         <geom type='mesh' mesh='m' contype='0' conaffinity='0'/></body></worldbody></mujoco>"
    );
    let floor = Some(Floor { height: -1.0, friction: 0.5 });
    let (m, findings) = load("robots/m.xml", &text, &ImportOptions { floor, ..ImportOptions::default() });
    let m = m.expect(&findings);
    let hulls = m.shapes.iter().filter_map(|shape| match &shape.kind {
        ShapeKind::Hull { points, .. } => Some((shape.name.as_str(), points.len())),
        _ => None,
    });
    let hulls: Vec<_> = hulls.collect();
    assert_eq!(hulls, [("first", 4), ("a", 4), ("a_shape_2", 4), ("a_shape_3", 8)]);
    assert_eq!(m.contacts.len(), 4 + 4 + 4 + 8);
    let first = m.shapes.iter().find(|shape| shape.name == "first").expect("a shape");
    let ShapeKind::Hull { points, .. } = &first.kind else { panic!("no hull") };
    for corner in [[0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, -2.0, -1.0], [0.0; 3]] {
        assert!(points.contains(&corner), "{points:?}");
    }
    assert_eq!(first.mount.placement.xyz.map(x), [0.0, 0.0, 5.0]);
    for wanted in [
        "notice: 4 meshes are hulls for contacts",
        "warning: mesh `none`: cannot read `none.stl`",
        "notice: the mesh of a `geom` is not used for contacts: those of moving bodies are",
    ] {
        assert_eq!(findings.matches(wanted).count(), 1, "{wanted}\n{findings}");
    }
    // Without a floor, no file is read.
    let (m, findings) = load("robots/m.xml", &text, &ImportOptions::default());
    assert!(m.expect(&findings).shapes.is_empty());
    assert!(
        findings
            .contains("those of moving bodies are, where a floor or contacts between bodies are asked for (7 times"),
        "{findings}"
    );
}

#[test]
fn names_that_are_taken_or_missing() {
    let text = "<worldbody><body name='ground'><joint/><joint axis='1 0 0'/><geom size='0.1'/><site name='Ground'/>\
        <body><joint name='ground_hinge'/><geom size='0.1'/></body></body></worldbody>";
    let (m, findings) = model(text);
    let joints: Vec<_> = m.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(joints, ["ground_2_hinge", "ground_2_hinge_2", "ground_hinge"]);
    assert_eq!(m.bodies[0].name, "ground_2");
    assert_eq!(m.bodies[1].name, "body_2");
    assert_eq!(m.frames[0].name, "Ground_site_2");
    assert!(findings.contains("body `ground` is called `ground_2` here"), "{findings}");
}

#[test]
fn included_files_are_read_and_named() {
    let options = ImportOptions::default();
    let (m, findings) = load("robots/arm.xml", ARM, &options);
    assert!(m.is_none());
    assert!(findings.contains("robots/parts/tip.xml:2:24: error: geom in body `tip`: `type` is `bal`"), "{findings}");
    let (m, findings) = load("robots/arm.xml", &ARM.replace("body.xml", "none.xml"), &options);
    assert!(m.is_none());
    assert!(
        findings.contains("robots/arm.xml:3:16: error: cannot include `parts/none.xml`: no such file"),
        "{findings}"
    );
    for (name, said) in [
        ("parts/ring.xml", "robots/parts/ring.xml:1:19: error: `parts/ring.xml` is included a second time"),
        ("m.xml", "robots/m.xml:1:44: error: `m.xml` is included a second time"),
        ("parts/../m.xml", "is included a second time"),
        ("/etc/passwd", "error: cannot include `/etc/passwd`"),
        ("parts/open.xml", "robots/parts/open.xml:2:7: error"),
    ] {
        let findings = refused(&format!("<worldbody><body/><include   file='{name}'/></worldbody>"));
        assert!(findings.contains(said), "{said}: {findings}");
    }
    let (m, findings) = load(
        "robots/m.xml",
        "<mujoco>\n<worldbody><include file='parts/good.xml'/></worldbody>\n<optoin/>\n</mujoco>",
        &options,
    );
    assert_eq!(m.expect(&findings).joints.len(), 1);
    assert!(findings.contains("robots/m.xml:3:1: warning: unknown element `optoin`"), "{findings}");
}

#[test]
fn a_toml_text_changes_a_model_of_mujoco() {
    let text = "[base]\nfile = 'changed.xml'\n[[joint]]\nname = 'j'\narmature = 0.5\n";
    let with_base = |path: &Path| match path.to_string_lossy().ends_with("changed.xml") {
        true => Ok(b"<mujoco>\n<worldbody><include file='parts/good.xml'/></worldbody>\n<optoin/>\n</mujoco>".to_vec()),
        false => files(path),
    };
    let options = ImportOptions::default();
    let (read, findings) = load_with("robots/m.toml", text, &options, &with_base);
    let findings = findings.to_string();
    let (model, _) = read.expect(&findings);
    assert_eq!(model.joints[0].armature, [Value::Const(0.5)]);
    assert!(findings.contains("robots/changed.xml:3:1: warning: unknown element `optoin`"), "{findings}");
    let (toml, _) = to_toml("robots/m.toml", text, &options, &with_base).expect("a sound model");
    assert!(toml.contains("armature = 0.5"), "{toml}");
}

#[test]
fn deep_nesting_is_no_trouble() {
    let depth = 3000;
    let bodies = "<body pos='0 0 1'><joint/><geom size='0.1'/>".repeat(depth);
    let (m, _) = model(&format!("<worldbody>{bodies}{}</worldbody>", "</body>".repeat(depth)));
    assert_eq!(m.joints.len(), depth);
    let findings = refused(&format!("{}{}", "<default class='a'>".repeat(200), "</default>".repeat(200)));
    assert!(findings.contains("error"), "{findings}");
}

#[test]
fn inertias_of_meshes() {
    let text = |mesh: &str, geom: &str| {
        format!(
            "<compiler meshdir='meshes'/><asset><mesh name='m' {mesh}/></asset><worldbody><body name='b'><joint name='j'/>\
             <geom type='mesh' mesh='m' {geom}/></body></worldbody>"
        )
    };
    let inline = "vertex='0 0 0 1 0 0 0 1 0 0 0 1' face='0 2 1 0 1 3 0 3 2 1 2 3'";
    for mesh in ["file='corner.stl'", "file='corner.msh'", "file='corner.obj'", inline] {
        for how in ["", "inertia='exact'"] {
            let (m, _) = model(&text(&format!("{mesh} {how} scale='2 2 2'"), "mass='3' pos='1 0 0'"));
            // Of a tetrahedron with legs a: a/4, 3/80 m a² and 1/80 m a².
            near(m.bodies[0].com, [1.5, 0.5, 0.5]);
            near(m.bodies[0].inertia, [0.9, 0.9, 0.9, 0.15, 0.15, 0.15]);
        }
    }
    let (m, _) = model(&text("file='corner.stl'", "density='6'"));
    near([m.bodies[0].mass], [1.0]);
    for (mesh, said) in [
        ("file='none.stl'", "mesh `m`: cannot read `none.stl`: no such file"),
        ("file='/corner.stl'", "mesh `m`: its path is not relative to the main file"),
        ("file='short.stl'", "mesh `m`: the STL file has another size than its header says"),
        ("file='square.obj'", "mesh `m`: line 5 of the OBJ file is no triangle"),
        ("file='lost.obj'", "mesh `m`: a face has a vertex that there is not"),
        ("file='flat.obj'", "mesh `m`: the mesh bounds no volume"),
        ("file='corner.ply'", "mesh `m`: cannot read"),
        ("file='corner.stl' inertia='convex'", "mesh `m`: the inertia of the convex hull"),
        ("builtin='sphere'", "mesh `m`: a mesh that MuJoCo makes is not read"),
    ] {
        let findings = refused(&text(mesh, ""));
        assert!(findings.contains(said), "{said}: {findings}");
        // Where no mass depends on it, nothing is read.
        assert!(model(&text(mesh, "mass='0'/><geom size='0.1'")).1.contains("not used for contacts"));
    }
}

/// The mass of a body that cannot move is left out where it cannot be read, as MuJoCo needs it for no motion; that of a body
/// which another one carries counts.
#[test]
fn masses_that_no_motion_depends_on() {
    let text = |compiler: &str, outer: &str, inner: &str, geom: &str| {
        format!(
            "<compiler meshdir='meshes' {compiler}/><asset><mesh name='none' file='none.stl'/><mesh name='m' file='corner.stl'/>\
             </asset><worldbody><body name='table' {outer}>{BALL}<body name='top'>{inner}{geom}<geom size='0.1' mass='2'/></body>\
             </body><body name='arm'><joint name='j' axis='0 1 0'/><geom size='0.1' mass='3' pos='1 0 0'/></body></worldbody>"
        )
    };
    let left_out = "notice: the mass of a body that cannot move is left out";
    let geoms = [
        (
            "<geom type='mesh' mesh='none'/>",
            "mesh `none`: cannot read `none.stl`: no such file; the mass of body `top` depends",
        ),
        ("<geom type='hfield' hfield='h' contype='0' conaffinity='0'/>", "body `top`: the mass of a height field"),
        ("<geom type='box' mesh='m'/>", "body `top`: the mass of a primitive that is fitted to a mesh is not read"),
    ];
    for (geom, said) in geoms {
        for outer in ["", "mocap='true'"] {
            let (m, findings) = model(&text("", outer, "", geom));
            let masses: Vec<_> = m.bodies.iter().map(|b| x(b.mass)).collect();
            // That of the ball is known.
            assert!(masses[0] > 4.0 && masses[1..] == [0.0, 3.0], "{masses:?}");
            assert!(findings.contains(left_out), "{findings}");
        }
        // A joint moves the body, or the mass in total is stated.
        for (compiler, inner) in [("", "<joint name='k'/>"), ("settotalmass='9'", "")] {
            let findings = refused(&text(compiler, "", inner, geom));
            assert!(findings.contains(said) && !findings.contains(left_out), "{findings}");
        }
        let carried = text("", "", "", geom).replace("<body name='top'>", "<joint name='l'/><body name='top'>");
        assert!(refused(&carried).contains(said));
    }
    // What can be read is there.
    let (m, findings) = model(&text("", "", "", "<geom type='mesh' mesh='m' mass='5'/>"));
    assert!(x(m.bodies[1].mass) == 7.0 && !findings.contains(left_out), "{findings}");
    // The mesh of a body that stands and of one that moves behind it.
    let two = text("", "", "", geoms[0].0).replace("<geom size='0.1' mass='3'", "<geom type='mesh' mesh='none'");
    let findings = refused(&two);
    assert!(findings.contains("no such file; the mass of body `arm` depends on it"), "{findings}");
    assert_eq!(findings.matches("cannot read `none.stl`").count(), 1, "{findings}");
    // A name that there is not is an error wherever it stands.
    let findings = refused(&text("", "", "", "<geom type='mesh' mesh='nine'/>"));
    assert!(findings.contains("error: `nine` is not a mesh"), "{findings}");
}

/// Bodies that are not read are there: a file whose bodies are all copies is refused for these alone, and for what else is wrong
/// beside them.
#[test]
fn bodies_that_are_not_read_are_not_missed() {
    let body = "<body name='b'><freejoint name='f'/><geom size='.1'/></body>";
    let others = "<equality><weld body1='b0'/></equality><actuator><motor joint='f0' armature='1'/></actuator>";
    for (bodies, said) in [
        (format!("<replicate count='3' offset='1 0 0'>{body}</replicate>"), "error: `replicate` is not read"),
        (format!("<frame><replicate count='3'>{body}</replicate></frame>"), "error: `replicate` is not read"),
        ("<attach model='other' prefix='x'/>".into(), "error: `attach` is not read"),
    ] {
        let findings = refused(&format!("<worldbody>{bodies}</worldbody>{others}"));
        assert!(findings.contains(said), "{findings}");
        assert_eq!(findings.matches("error").count(), 1, "{findings}");
        let findings = refused(&format!("<worldbody><geom name='g' type='ball'/>{bodies}</worldbody>{others}"));
        assert!(findings.contains(said) && findings.contains("error: geom `g`: `type` is `ball`"), "{findings}");
    }
    let findings = refused("<worldbody><geom size='1'/></worldbody>");
    assert!(findings.contains("error: a model without bodies"), "{findings}");
    assert!(refused("").contains("error: a model without bodies"));
}

/// A model with a ball and a height field of these attributes, its findings, and those with a floor.
fn on_field(attributes: &str) -> [(Option<Model>, String); 2] {
    let text = format!(
        "<mujoco><compiler meshdir='ground'/><asset><hfield name='h' size='2 1.5 0.5 0.1' {attributes}/></asset><worldbody>\
         <geom name='hills' type='hfield' hfield='h' pos='1 2 3'/><geom type='hfield' hfield='h' contype='0' conaffinity='0'/>\
         <body name='b'><freejoint/><geom name='ball' size='0.05'/><geom name='drum' type='cylinder' size='0.1 0.1'/></body>\
         </worldbody></mujoco>"
    );
    let floor = Some(Floor { height: -1.0, friction: 0.5 });
    [None, floor].map(|floor| load("robots/m.xml", &text, &ImportOptions { floor, ..ImportOptions::default() }))
}

/// Height fields have the heights of MuJoCo, from 0 to the third number of `size`, and where there is a floor, shapes touch them
/// too.
#[cfg(feature = "height_fields")]
#[test]
fn height_fields_are_ground() {
    let level = |model: &Model| {
        let field = model.shapes.iter().find(|shape| shape.name == "hills").expect("a field");
        let ShapeKind::HeightField { heights, field: surface } = &field.kind else { panic!("no height field") };
        assert_eq!((field.mount.body, field.mount.placement.xyz.map(x)), (None, [1.0, 2.0, 3.0]));
        (surface.spacing, heights.clone())
    };
    // Of a file, the first row is that of the least y; of a list, that of the greatest.
    let part = |k: u8| f64::from(f32::from(k) / 19.0_f32) * 0.5;
    let rows: Vec<Vec<f64>> = (0..4_u8).map(|j| (0..5).map(|i| part(5 * j + i)).collect()).collect();
    let listed = "0 0 0 0 0  0 0 0 0 1  0 0 2 0 0  3 0 0 0 0";
    for (attributes, wanted) in [
        ("file='steps.hf'", rows.clone()),
        ("file='steps.hf' nrow='9' ncol='9' content_type='image/vnd.mujoco.hfield'", rows),
        (
            &format!("nrow='4' ncol='5' elevation='{listed}'"),
            vec![
                vec![0.5, 0.0, 0.0, 0.0, 0.0],
                vec![0.0, 0.0, f64::from(2.0_f32 / 3.0) * 0.5, 0.0, 0.0],
                vec![0.0, 0.0, 0.0, 0.0, f64::from(1.0_f32 / 3.0) * 0.5],
                vec![0.0; 5],
            ],
        ),
        (&format!("nrow='4' ncol='5' elevation='{}'", "7 ".repeat(20)), vec![vec![0.0; 5]; 4]),
    ] {
        let [(free, findings), (standing, others)] = on_field(attributes);
        let (free, standing) = (free.expect(&findings), standing.expect(&others));
        assert_eq!(level(&free), ([1.0, 1.0], wanted.clone()), "{attributes}");
        assert_eq!(level(&standing), level(&free));
        assert_eq!((free.contacts.len(), free.shapes.len()), (0, 3));
        // The ball on the floor and the field, the rims of the drum on the floor; the drum cannot touch the field.
        let names: Vec<&str> = standing.contacts.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["floor/ball", "hills/ball", "floor/drum/1", "floor/drum/2"], "{others}");
        assert!(others.contains("warning: 1 pair of shapes cannot touch: `hills/drum`"), "{others}");
        let text =
            "<compiler strippath='true' meshdir='ground'/><asset><hfield file='C/steps.hf' size='1 1 1 1'/></asset>\
                    <worldbody><geom type='hfield' hfield='steps'/><body><joint/><geom size='0.1'/></body></worldbody>";
        assert_eq!(model(text).0.shapes.len(), 2);
    }
}

/// A field that is not read is a warning where nothing touches it, and an error where there is a floor.
#[cfg(feature = "height_fields")]
#[test]
fn height_fields_that_are_not_read() {
    for (attributes, said) in [
        (
            "file='hills.png'",
            "`hills.png` is a PNG file, which is not read; its geoms touch nothing\n  help: write the heights",
        ),
        ("file='a.PNG'", "`a.PNG` is a PNG file"),
        ("file='steps.hf' content_type='image/png'", "`image/png` is not read"),
        ("file='steps.hf' content_type='text/plain'", "`text/plain` is no height field"),
        (
            "file='lost.hf'",
            "cannot read `lost.hf`: no such file; its geoms touch nothing\n  help: write its path relative",
        ),
        ("file='/steps.hf'", "its path is not relative to the main file"),
        ("file='short.hf'", "`short.hf`: it has 50 bytes, and 4 rows of 5 heights take 88"),
        ("file='none.hf'", "`none.hf`: it does not begin with the numbers of its rows and columns"),
        (
            "file='few.hf'",
            "3 rows of 5 heights are too few; its geoms touch nothing\n  help: give it at least 4 rows of 4",
        ),
        ("file='many.hf'", "300 rows of 300 heights are too many"),
        ("file='odd.hf'", "1 of its heights are not finite"),
        ("nrow='1' ncol='2' elevation='1 2'", "1 rows of 2 heights are too few"),
    ] {
        let [(free, findings), (standing, others)] = on_field(attributes);
        assert_eq!(free.expect(&findings).shapes.len(), 2);
        assert!(standing.is_none() && findings.contains(&format!("warning: height field `h`: {said}")), "{findings}");
        assert!(others.contains(&format!("error: height field `h`: {said}")), "{others}");
    }
    // Heights that are written at run time are none here.
    for (model, findings) in on_field("nrow='4' ncol='5'") {
        assert!(model.expect(&findings).shapes.iter().all(|shape| shape.name != "hills"));
        assert!(findings.contains("notice: height field `h`: its heights are not in the file"), "{findings}");
    }
}
