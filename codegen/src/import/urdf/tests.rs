use crate::diag::{Diagnostics, Severity};
use crate::import::{Base, Floor, ImportOptions};
use crate::model::{Gravity, JointBounds, JointKind, JointMotion, Model, Rotation, ShapeKind, Value};
use crate::read::load;
use std::fmt::Write;

const SOLID: &str =
    r#"<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"#;

fn import(text: &str, base: Base) -> (Option<Model>, Diagnostics) {
    load("robot.urdf", text, &ImportOptions { base, ..ImportOptions::default() })
}

/// The model of a file without errors, and its findings as text.
fn model(text: &str, base: Base) -> (Model, String) {
    let (model, findings) = import(text, base);
    (model.unwrap_or_else(|| panic!("{findings}")), findings.to_string())
}

fn consts<const N: usize>(values: [Value; N]) -> [f64; N] {
    values.map(|v| v.constant().expect("URDF has no parameters"))
}

fn link(name: &str) -> String {
    format!(r#"<link name="{name}">{SOLID}</link>"#)
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, rest: &str) -> String {
    let ends = format!(r#"<parent link="{parent}"/><child link="{child}"/>"#);
    format!(r#"<joint name="{name}" type="{kind}">{ends}{rest}</joint>"#)
}

#[test]
fn every_number_arrives_in_its_place() {
    let text = r#"<robot name="arm" version="1.0">
      <link name="base"/>
      <link name="upper"><inertial>
        <origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><mass value="1.5e0"/>
        <inertia ixx="11" ixy="0.4" ixz="0.5" iyy="12" iyz="0.6" izz="13"/>
      </inertial></link>
      <link name="slide"><inertial>
        <mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
      </inertial></link>
      <joint name="shoulder" type="revolute">
        <parent link="base"/><child link="upper"/><origin xyz=" 4 5	6 " rpy="0.4 0.5 0.6"/><axis xyz="0 3 4"/>
        <dynamics damping="0.7"/>
      </joint>
      <joint name="rail" type="prismatic">
        <parent link="upper"/><child link="slide"/><axis xyz="0 0 -1"/>
        <mimic joint="shoulder" multiplier="-2" offset="0.25"/>
      </joint>
    </robot>"#;
    let (m, findings) = model(text, Base::Fixed);
    assert_eq!(findings, "");
    assert_eq!(m.name, "arm");
    assert_eq!(m.gravity, Gravity::Constant([Value::ZERO, Value::ZERO, Value::Const(-9.81)]));
    let upper = &m.bodies[1];
    assert_eq!((upper.name.as_str(), upper.mass), ("upper", Value::Const(1.5)));
    assert_eq!(consts(upper.com), [1.0, 2.0, 3.0]);
    assert_eq!(consts(upper.inertia), [11.0, 12.0, 13.0, 0.4, 0.5, 0.6]);
    assert_eq!(upper.inertia_axes, Rotation::Rpy([0.1, 0.2, 0.3].map(Value::Const)));
    let shoulder = &m.joints[1];
    assert_eq!((shoulder.parent, shoulder.child), (Some(0), 1));
    assert_eq!(consts(shoulder.placement.xyz), [4.0, 5.0, 6.0]);
    assert_eq!(shoulder.placement.rotation, Rotation::Rpy([0.4, 0.5, 0.6].map(Value::Const)));
    assert_eq!(shoulder.kind, JointKind::Revolute { axis: [0.0, 3.0, 4.0] });
    assert_eq!(shoulder.damping, [Value::Const(0.7)]);
    let rail = &m.joints[2];
    assert_eq!(rail.kind, JointKind::Prismatic { axis: [0.0, 0.0, -1.0] });
    assert_eq!(rail.motion, JointMotion::Mimic { leader: 1, ratio: Value::Const(-2.0), offset: Value::Const(0.25) });
}

#[test]
fn what_is_left_out_takes_the_default_of_urdf() {
    let joints =
        joint("a", "continuous", "base", "one", "<mimic joint='b'/>") + &joint("b", "revolute", "base", "two", "");
    let text = format!("<robot name='r'><link name='base'/>{}{}{joints}</robot>", link("one"), link("two"));
    let (m, findings) = model(&text, Base::Fixed);
    // The default axis is x, not the z of this project's own format; it is told once.
    assert_eq!(m.joints[1].kind, JointKind::Revolute { axis: [1.0, 0.0, 0.0] });
    assert_eq!(m.joints[1].motion, JointMotion::Mimic { leader: 2, ratio: Value::ONE, offset: Value::ZERO });
    assert_eq!(consts(m.joints[1].placement.xyz), [0.0; 3]);
    assert_eq!(m.bodies[0].mass, Value::ZERO);
    assert!(findings.contains("turns about or slides along its x axis (2 times, first here)"), "{findings}");
}

#[test]
fn every_joint_type() {
    let x = [1.0, 0.0, 0.0];
    let kinds = [
        ("revolute", JointKind::Revolute { axis: x }),
        ("continuous", JointKind::Revolute { axis: x }),
        ("prismatic", JointKind::Prismatic { axis: x }),
        ("planar", JointKind::Planar { normal: x }),
        ("floating", JointKind::Floating),
        ("spherical", JointKind::Spherical),
        ("ball", JointKind::Spherical),
        ("fixed", JointKind::Fixed),
    ];
    for (name, kind) in kinds {
        let text = format!("<robot name='r'>{}{}{}</robot>", link("a"), link("b"), joint("j", name, "a", "b", ""));
        let (m, _) = model(&text, Base::Fixed);
        assert_eq!(m.joints[1].kind, kind, "{name}");
    }
}

#[test]
fn the_base_is_what_was_asked_for() {
    let text = format!(
        "<robot name='r'>{}{}{}</robot>",
        link("tip"),
        link("trunk"),
        joint("j", "revolute", "trunk", "tip", "")
    );
    for (base, kind) in [
        (Base::Fixed, JointKind::Fixed),
        (Base::Floating, JointKind::Floating),
        (Base::Planar, JointKind::Planar { normal: [0.0, 0.0, 1.0] }),
    ] {
        let (m, _) = model(&text, base);
        let root = &m.joints[0];
        assert_eq!((root.name.as_str(), root.kind, root.parent, root.child), ("root_joint", kind, None, 1));
        assert_eq!(m.joints.len(), 2);
    }
    let (m, _) = model(&text.replace("\"j\"", "\"root_joint\""), Base::Floating);
    assert_eq!([m.joints[0].name.as_str(), m.joints[1].name.as_str()], ["root_joint_", "root_joint"]);
}

#[test]
fn joints_come_depth_first_with_children_in_file_order() {
    let mut text = "<robot name='tree'>".to_string();
    for (name, parent) in [("e", "c"), ("c", "a"), ("b", "a"), ("d", "b"), ("f", "c")] {
        text += &(link(name) + &joint(&format!("to_{name}"), "revolute", parent, name, "<axis xyz='0 0 1'/>"));
    }
    let (m, findings) = model(&(text + &link("a") + "</robot>"), Base::Fixed);
    assert_eq!(findings, "");
    let names: Vec<_> = m.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["root_joint", "to_c", "to_e", "to_f", "to_b", "to_d"]);
    let bodies: Vec<_> = m.bodies.iter().map(|b| b.name.as_str()).collect();
    assert_eq!(bodies, ["e", "c", "b", "d", "f", "a"]);
}

#[test]
fn a_link_called_ground_is_renamed_and_stays_connected() {
    let parts = link("world") + &link("ground") + &link("ground_link") + &link("tip");
    let joints = joint("a", "fixed", "world", "ground", "")
        + &joint("b", "revolute", "ground", "ground_link", "")
        + &joint("c", "revolute", "ground_link", "tip", "");
    let (m, findings) = model(&format!("<robot name='r'>{parts}{joints}</robot>"), Base::Fixed);
    assert_eq!(m.bodies[1].name, "ground_link_");
    assert_eq!((m.joints[1].child, m.joints[2].parent, m.joints[2].child), (1, Some(1), 2));
    assert!(findings.contains("link `ground` is called `ground_link_` here"), "{findings}");
}

#[test]
fn gravity_comes_from_the_options() {
    let text = format!("<robot name='r'>{}</robot>", link("a"));
    let options = ImportOptions { gravity: Some([0.0, -1.62, 0.0]), base: Base::Floating, ..ImportOptions::default() };
    let (m, _) = load("r.urdf", &text, &options);
    assert_eq!(m.map(|m| m.gravity), Some(Gravity::Constant([0.0, -1.62, 0.0].map(Value::Const))));
}

#[test]
fn a_namespace_of_the_whole_file_changes_nothing() {
    let text = format!("<robot name='r' xmlns='http://www.ros.org'>{}</robot>", link("a"));
    let (m, findings) = model(&text, Base::Floating);
    assert_eq!((m.bodies.len(), findings.as_str()), (1, ""));
}

#[test]
fn invalid_numbers_are_reported_once() {
    let text = format!(
        "<robot name='r'>{}</robot>",
        link("a").replace("<mass value=\"1\"/>", "<mass value=''/>").replace("ixx=\"1\"", "ixx='x'")
    );
    let (m, findings) = import(&text, Base::Floating);
    assert!(m.is_none());
    assert_eq!(findings.0.iter().filter(|d| d.severity == Severity::Error).count(), 2, "{findings}");
}

#[test]
fn depth_is_no_danger() {
    // Elements in elements: the parser and this reader go through them without recursion.
    let deep = "<a>".repeat(200_000) + &"</a>".repeat(200_000);
    let (m, findings) = import(&format!("<robot name='r'>{}{deep}</robot>", link("x")), Base::Floating);
    assert!(m.is_some(), "{findings}");
    let (m, _) = import(&"<robot>".repeat(200_000), Base::Floating);
    assert!(m.is_none());
    // Links on links.
    let mut text = format!("<robot name='chain'>{}", link("l0"));
    for k in 1..5_000 {
        let (parent, child) = (format!("l{}", k - 1), format!("l{k}"));
        text += &(link(&child) + &joint(&format!("j{k}"), "revolute", &parent, &child, "<axis xyz='0 0 1'/>"));
    }
    let (m, _) = model(&(text + "</robot>"), Base::Fixed);
    assert_eq!(m.joints.len(), 5_000);
}

/// Files cut off and changed at every place: some error or other, but never a panic.
#[test]
fn no_bytes_make_it_panic() {
    let text = include_str!("../../../tests/broken/urdf/unused.urdf");
    let spoilt = ["<", ">", "\"", "&", "&#0;", "ä", "-", "x", " ", "<a:b", "${", "]]>", "9e999"];
    let mut models = 0;
    for k in (0..text.len()).filter(|&k| text.is_char_boundary(k)) {
        let _ = import(&text[..k], Base::Fixed);
        let word = spoilt[k % spoilt.len()];
        let next = text[k..].chars().next().map_or(k, |c| k + c.len_utf8());
        let changed = format!("{}{word}{}", &text[..k], &text[next..]);
        models += usize::from(import(&changed, Base::Planar).0.is_some());
    }
    assert!(models > 100, "the changes should be small enough that some leave a model: {models}");
    // Names longer than the parser keeps lengths for.
    let mut long = String::from("<robot name='r'><link name='a'><inertial><mass ");
    write!(long, "{0}='1' value{1}={1}'ä'/></inertial></link></robot>", "ä".repeat(40_000), " ".repeat(300)).unwrap();
    let (m, findings) = import(&long, Base::Floating);
    assert!(m.is_none() && findings.0.len() >= 3, "{findings}");
}

/// What `limit` says of the motion that a joint is made for: files state zeros, huge numbers and one end for what they do not
/// know.
#[test]
fn limits_bound_motion_where_they_say_something() {
    let range = |lower: f64, upper: f64| Some([lower, upper]);
    let mimic = "<mimic joint='leader'/>";
    for (kind, more, limit, range, velocity, effort) in [
        ("revolute", "", "lower='-1' upper='2' velocity='3' effort='4'", range(-1.0, 2.0), Some(3.0), Some(4.0)),
        (
            "prismatic",
            "",
            " lower=' -0.5 ' upper='1e-1' velocity='1e29' effort='1e-3'",
            range(-0.5, 0.1),
            Some(1e29),
            Some(1e-3),
        ),
        // Zeros, and what is less, are no bounds of speeds and efforts.
        ("revolute", "", "lower='0' upper='0' velocity='0' effort='0'", None, None, None),
        ("revolute", "", "lower='-1' upper='1' velocity='-3' effort='0.0'", range(-1.0, 1.0), None, None),
        // One end that is not stated is zero.
        ("revolute", "", "upper='2'", range(0.0, 2.0), None, None),
        ("revolute", "", "lower='-2' effort='5'", range(-2.0, 0.0), None, Some(5.0)),
        ("revolute", "", "lower='2'", None, None, None),
        ("revolute", "", "upper='-2'", None, None, None),
        ("revolute", "", "velocity='1'", None, Some(1.0), None),
        ("revolute", "", "", None, None, None),
        // Ends in the wrong order, or equal ones.
        ("revolute", "", "lower='2' upper='-1' velocity='3'", None, Some(3.0), None),
        ("revolute", "", "lower='1' upper='1' effort='3'", None, None, Some(3.0)),
        // Numbers that are meant as none, and what is no number.
        ("revolute", "", "lower='-1e30' upper='1e30' velocity='1e30' effort='1e31'", None, None, None),
        ("revolute", "", "lower='-1' upper='1e30' velocity='2'", None, Some(2.0), None),
        ("revolute", "", "lower='-9.9e29' upper='9.9e29'", range(-9.9e29, 9.9e29), None, None),
        ("revolute", "", "lower='-inf' upper='inf' velocity='inf' effort='inf'", None, None, None),
        ("revolute", "", "lower='-1' upper='nan' velocity='nan' effort='nan'", None, None, None),
        ("revolute", "", "lower='-1' upper='far' velocity='fast' effort=''", None, None, None),
        // A joint that follows another has no range of its own, and one that turns freely has none.
        ("revolute", mimic, "lower='-1' upper='2' velocity='3' effort='4'", None, Some(3.0), Some(4.0)),
        ("continuous", "", "lower='-1' upper='2' velocity='3' effort='4'", None, Some(3.0), Some(4.0)),
        // Of several freedoms each has these bounds of speed and effort; of none, none.
        ("spherical", "", "lower='-1' upper='2' velocity='3' effort='4'", None, Some(3.0), Some(4.0)),
        ("fixed", "", "lower='-1' upper='2' velocity='3' effort='4'", None, None, None),
    ] {
        let links = ["base", "one", "two"].map(link).concat();
        let leader = joint("leader", "revolute", "base", "one", "");
        let bounded = joint("bounded", kind, "base", "two", &format!("{more}<limit {limit}/>"));
        let (m, _) = model(&format!("<robot name='r'>{links}{leader}{bounded}</robot>"), Base::Fixed);
        let bounded = m.joints.iter().find(|joint| joint.name == "bounded").expect("the joint");
        assert_eq!(bounded.bounds, JointBounds { range, velocity, effort }, "{kind} {more} {limit}");
    }
}

/// What is wrong with a limit is told once, whether stops are asked for or not.
#[test]
fn limits_without_sense_are_told_once() {
    let told = |limit: &str, limits: bool| {
        let limited = |name: &str, child: &str| joint(name, "revolute", "base", child, &format!("<limit {limit}/>"));
        let links = ["base", "one", "two"].map(link).concat();
        let text = format!("<robot name='r'>{links}{}{}</robot>", limited("a", "one"), limited("b", "two"));
        let (_, findings) = load("r.urdf", &text, &ImportOptions { limits, ..ImportOptions::default() });
        let warnings = findings.0.into_iter().filter(|d| d.severity == Severity::Warning);
        warnings.map(|d| d.message).collect::<Vec<_>>()
    };
    for limits in [false, true] {
        for (limit, wanted) in [
            ("lower='2' upper='-1'", "joint `a`: `limit` from 2 to -1 is not used (2 times, first here)"),
            ("upper='-1'", "joint `a`: `limit` from 0 to -1 is not used (2 times, first here)"),
            (
                "velocity='-3'",
                "joint `a`: `velocity` -3 of `limit` is not used: it is less than 0 (2 times, first here)",
            ),
            ("effort='-4'", "joint `a`: `effort` -4 of `limit` is not used: it is less than 0 (2 times, first here)"),
        ] {
            assert_eq!(told(limit, limits), [wanted], "{limit}, {limits}");
        }
        for limit in ["lower='-1' upper='2' velocity='3' effort='4'", "velocity='0' effort='0'", "velocity='-0.0'"] {
            assert_eq!(told(limit, limits), [""; 0], "{limit}, {limits}");
        }
    }
    // A limit without a length makes no stops, and says nothing where none are asked for.
    assert_eq!(told("lower='0' upper='0'", false), [""; 0]);
    assert_eq!(told("lower='0' upper='0'", true), ["joint `a`: `limit` from 0 to 0 is not used (2 times, first here)"]);
}

/// A robot with every kind of shape, a joint with limits, and one that follows it.
const TOUCHING: &str = r#"<robot name='r'>
  <link name='base'>
    <collision><geometry><box size='1 2 3'/></geometry></collision>
    <collision name=' '><origin xyz='1 2 3' rpy='0.1 0.2 0.3'/><geometry><sphere radius='0.5'/></geometry></collision>
    <collision name='foot'><geometry><cylinder radius='0.1' length='0.4'/></geometry></collision>
    <inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>
  </link>
  <link name='ground'>
    <collision name='foot'><geometry><capsule radius='0.2' length='0.3'/></geometry></collision>
    <collision><geometry><mesh filename='a.stl'/></geometry></collision>
    <inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>
  </link>
  <link name='tip'>
    <inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>
  </link>
  <joint name='j' type='revolute'><parent link='base'/><child link='ground'/><limit lower='-1' upper='2' effort='3'/></joint>
  <joint name='k' type='prismatic'><parent link='ground'/><child link='tip'/><mimic joint='j'/><limit upper='1'/></joint>
</robot>"#;

/// Shapes act, and limits are stops, only where the options ask for it: the rest of the model is the same.
#[test]
fn shapes_are_read_and_touch_a_floor_that_is_asked_for() {
    let (free, findings) = model(TOUCHING, Base::Floating);
    let names: Vec<&str> = free.shapes.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["base", "base_shape_2", "foot", "foot_shape_2"]);
    let [radius, length] = [0.2, 0.3];
    assert_eq!(free.shapes[0].kind, ShapeKind::Box { size: [1.0, 2.0, 3.0], rounding: 0.0 });
    assert_eq!(free.shapes[1].kind, ShapeKind::Sphere { radius: 0.5 });
    assert_eq!(consts(free.shapes[1].mount.placement.xyz), [1.0, 2.0, 3.0]);
    assert_eq!(free.shapes[1].mount.placement.rotation, Rotation::Rpy([0.1, 0.2, 0.3].map(Value::Const)));
    assert_eq!(free.shapes[2].kind, ShapeKind::Cylinder { radius: 0.1, length: 0.4, sides: None, rounding: 0.0 });
    // The link `ground` is called otherwise here; its shape stays on it.
    let capsule = &free.shapes[3];
    assert_eq!((&capsule.kind, capsule.mount.body), (&ShapeKind::Capsule { radius, length }, Some(1)));
    assert!(free.contacts.is_empty());
    assert!(findings.contains("touches nothing unless that is asked for"), "{findings}");
    assert!(findings.contains("`mesh` of a `collision` is not used"), "{findings}");
    assert!(findings.contains("`limit` makes no stops"), "{findings}");
    let floor = Some(Floor { height: -0.5, friction: 0.7 });
    let options = ImportOptions { base: Base::Floating, limits: true, floor, ..ImportOptions::default() };
    let (touching, findings) = load("robot.urdf", TOUCHING, &options);
    let touching = touching.unwrap_or_else(|| panic!("{findings}"));
    let findings = findings.to_string();
    assert!(!findings.contains("touches nothing") && !findings.contains("`limit` makes no stops"), "{findings}");
    assert_eq!(consts(touching.shapes[0].mount.placement.xyz), [0.0, 0.0, -0.5]);
    assert_eq!((&touching.bodies, &touching.joints), (&free.bodies, &free.joints));
    // Corners, ball, rims, ends of the capsule, and the stops of the joint that does not follow another.
    let contacts: Vec<&str> = touching.contacts.iter().map(|c| c.name.as_str()).collect();
    let numbered = |name: &str, n: usize| (1..=n).map(|k| format!("floor/{name}/{k}")).collect::<Vec<_>>();
    let wanted = [
        numbered("base", 8),
        vec!["floor/base_shape_2".to_string()],
        numbered("foot", 2),
        numbered("foot_shape_2", 2),
        vec!["j/lower".into(), "j/upper".into()],
    ];
    assert_eq!(contacts, wanted.concat());
    assert!(touching.contacts[..13].iter().all(|c| c.friction == 0.7));
    let (fixed, _) = load("robot.urdf", TOUCHING, &ImportOptions { base: Base::Fixed, ..options });
    // The base is welded to the ground, and the next link turns about a joint on it.
    assert_eq!(fixed.map(|m| m.contacts.len()), Some(2));
}

/// What is wrong with shapes that nobody asked for is no error.
#[test]
fn shapes_that_cannot_be_read_are_left_out() {
    let collision = |inside: &str| format!("<collision>{inside}</collision>");
    let bad = [
        "",
        "<geometry/>",
        "<geometry><box size='1 2'/></geometry>",
        "<geometry><box size='1 2 x'/></geometry>",
        "<geometry><box size='1 2 3 4'/></geometry>",
        "<geometry><sphere radius='-1'/></geometry>",
        "<geometry><sphere radius='0'/></geometry>",
        "<geometry><sphere radius='1e999'/></geometry>",
        "<geometry><cylinder radius='1'/></geometry>",
        "<geometry><plane normal='0 0 1'/></geometry>",
        "<origin xyz='1 2'/><geometry><sphere radius='1'/></geometry>",
    ];
    for bad in bad {
        let link = link("a").replace("<inertial>", &format!("{}<inertial>", collision(bad)));
        let text = format!("<robot name='r'>{link}</robot>");
        let (m, findings) = model(&text, Base::Floating);
        assert!(m.shapes.is_empty() && findings.contains("a `collision` is not used"), "{bad}: {findings}");
    }
}

/// Many shapes of one name do not take long.
#[test]
fn many_thousand_shapes_have_names() {
    let shapes = "<collision><geometry><sphere radius='1'/></geometry></collision>".repeat(30_000);
    let text = format!("<robot name='r'>{}</robot>", link("a").replace("<inertial>", &format!("{shapes}<inertial>")));
    assert_eq!(model(&text, Base::Floating).0.shapes.len(), 30_000);
}
