//! Contacts between the bodies of a robot, which options ask for: which pairs of shapes become contacts.

use mbd_codegen::model::Model;
use mbd_codegen::read::{load, load_with, to_toml, Base, Floor, ImportOptions};

const SOLID: &str = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>";

/// A link with collisions of these names, places and geometries.
fn link(name: &str, shapes: &[(&str, &str, &str)]) -> String {
    let collision = |(name, xyz, geometry): &(&str, &str, &str)| {
        format!("<collision name='{name}'><origin xyz='{xyz}'/><geometry><{geometry}/></geometry></collision>")
    };
    format!("<link name='{name}'>{SOLID}{}</link>", shapes.iter().map(collision).collect::<String>())
}

fn joint(child: &str, parent: &str, kind: &str, xyz: &str) -> String {
    format!(
        "<joint name='to_{child}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>\
         <origin xyz='{xyz}'/><axis xyz='0 1 0'/></joint>"
    )
}

/// A trunk with two arms, one with a hand that moves and carries a head, one with a hand that does not.
fn robot() -> String {
    let rod = "capsule radius='0.05' length='0.4'";
    let cube = "box size='0.1 0.1 0.1'";
    let parts = [
        link("base", &[("trunk", "0 0 0", "sphere radius='0.1'")]),
        link("left_arm", &[("left", "0 0 -0.25", rod)]),
        link("right_arm", &[("right", "0 0 -0.25", rod)]),
        link("left_hand", &[("left_box", "0 0 -0.1", cube)]),
        link("right_hand", &[("fist", "0 0 -0.2", "sphere radius='0.06'"), ("right_box", "0.1 0 -0.2", cube)]),
        link("head", &[("skull", "0 0 0", "sphere radius='0.05'")]),
        joint("left_arm", "base", "revolute", "-0.3 0 0"),
        joint("right_arm", "base", "revolute", "0.3 0 0"),
        joint("left_hand", "left_arm", "revolute", "0 0 -0.5"),
        joint("right_hand", "right_arm", "fixed", "0 0 -0.5"),
        joint("head", "left_hand", "revolute", "0.3 0 0.6"),
    ];
    format!("<robot name='r'>{}</robot>", parts.concat())
}

fn read(file: &str, text: &str, options: ImportOptions) -> (Model, String) {
    let (model, findings) = load(file, text, &options);
    let findings = findings.to_string();
    (model.unwrap_or_else(|| panic!("{findings}")), findings)
}

fn asked() -> ImportOptions {
    ImportOptions { self_contact: Some(0.3), ..ImportOptions::default() }
}

/// The names of the contacts, once for each pair, with the number of its contacts and the friction.
fn pairs(model: &Model) -> Vec<(String, usize, f64)> {
    let mut all: Vec<(String, usize, f64)> = Vec::new();
    for contact in &model.contacts {
        let name = contact.name.rsplit_once('/').filter(|(first, _)| first.contains('/'));
        let name = name.map_or(contact.name.as_str(), |(first, _)| first);
        match all.last_mut().filter(|(last, ..)| last == name) {
            Some((_, count, _)) => *count += 1,
            None => all.push((name.into(), 1, contact.friction)),
        }
    }
    all
}

fn named(model: &Model) -> Vec<String> {
    pairs(model).into_iter().map(|(name, ..)| name).collect()
}

const WITHOUT: &str = "without contacts, because";

#[test]
fn links_of_a_robot_touch_where_that_is_asked_for() {
    let text = robot();
    let (free, findings) = read("r.urdf", &text, ImportOptions::default());
    assert!(free.contacts.is_empty());
    assert!(findings.contains("touches nothing unless that is asked for (`--floor`, `--self-contact`"), "{findings}");
    let (model, findings) = read("r.urdf", &text, ImportOptions { base: Base::Floating, ..asked() });
    let wanted = [
        ("left/right", 1),
        ("trunk/left_box", 1),
        ("right/left_box", 14),
        ("left/fist", 1),
        ("left_box/fist", 1),
        ("left/right_box", 14),
        ("left/skull", 1),
        ("right/skull", 1),
        ("fist/skull", 1),
        ("right_box/skull", 1),
    ];
    assert_eq!(pairs(&model), wanted.map(|(name, n)| (name.to_string(), n, 0.3)), "{findings}");
    for told in [
        format!("6 pairs of shapes left {WITHOUT} one joint connects their bodies: `trunk/left`, `trunk/right`, `left/left_box`"),
        format!("1 pair of shapes left {WITHOUT} such shapes cannot touch (a sphere or"),
        format!("1 pair of shapes left {WITHOUT} they overlap at the described start, or at that within the ranges of the joints: `trunk/skull`"),
    ] {
        assert!(findings.contains(&told), "{told}\n{findings}");
    }
    assert!(!findings.contains("touches nothing"), "{findings}");
    // All but the contacts is the same.
    assert_eq!((&free.bodies, &free.shapes), (&model.bodies, &model.shapes));
    // A floor has its own friction, and touches all bodies; the other pairs stay.
    let floor = Some(Floor { height: -2.0, friction: 0.8 });
    let (both, _) = read("r.urdf", &text, ImportOptions { base: Base::Floating, floor, ..asked() });
    let on_floor = both.contacts.iter().filter(|c| c.name.starts_with("floor/")).count();
    assert_eq!((on_floor, both.contacts.len()), (23, 23 + model.contacts.len()));
    assert!(both.contacts.iter().all(|c| c.friction == if c.name.starts_with("floor/") { 0.8 } else { 0.3 }));
    let error = to_toml("r.urdf", &text, &asked(), &|_| Err(std::io::ErrorKind::NotFound.into())).expect_err("no");
    assert!(error.to_string().contains("contacts between bodies of the options are not converted"), "{error}");
}

/// A rod through a plate has its ends outside and is far from the edges; it overlaps all the same.
#[test]
fn a_rod_through_a_plate_overlaps() {
    let text = |x: &str| {
        let parts = [
            link("plate", &[("plate", "0 0 0", "box size='1 1 0.1'")]),
            link("arm", &[]),
            link("rod", &[("rod", x, "capsule radius='0.01' length='2'")]),
            joint("arm", "plate", "revolute", "0 0 0"),
            joint("rod", "arm", "revolute", "0 0 0"),
        ];
        format!("<robot name='r'>{}</robot>", parts.concat())
    };
    let (model, findings) = read("r.urdf", &text("0.1 0.1 0"), asked());
    assert!(model.contacts.is_empty());
    assert!(
        findings.contains("overlap at the described start, or at that within the ranges of the joints: `plate/rod`"),
        "{findings}"
    );
    assert!(findings.contains("warning: no contacts between bodies were found"), "{findings}");
    let (model, findings) = read("r.urdf", &text("0.52 0.1 0"), asked());
    assert_eq!(pairs(&model), [("plate/rod".to_string(), 14, 0.3)], "{findings}");
}

/// A joint with a range from 1 to 3 rad starts at 2, where the ball that it carries is in that of the base.
#[test]
fn what_overlaps_within_the_ranges_is_left_out() {
    let ball = "sphere radius='0.1'";
    let parts = [
        link("a", &[("low", "-0.416 0 -0.909", ball)]),
        link("b", &[]),
        link("c", &[("high", "1 0 0", ball)]),
        joint("b", "a", "revolute", "0 0 0"),
        joint("c", "b", "revolute", "0 0 0"),
    ];
    let text = format!("<robot name='r'>{}</robot>", parts.concat());
    let (model, findings) = read("r.urdf", &text, asked());
    assert_eq!(named(&model), ["low/high"], "{findings}");
    let limited = text.replacen(
        "<axis xyz='0 1 0'/>",
        "<axis xyz='0 1 0'/><limit lower='1' upper='3' effort='1' velocity='1'/>",
        1,
    );
    let (model, findings) = read("r.urdf", &limited, asked());
    assert!(model.contacts.is_empty(), "{findings}");
    assert!(findings.contains("within the ranges of the joints: `low/high`"), "{findings}");
}

/// Names of different shapes may come to the same; the second pair has a number.
#[test]
fn pairs_have_names_of_their_own() {
    let ball = "sphere radius='0.1'";
    let parts = [
        link("a", &[("x", "0 0 0", ball), ("x_y", "0 0 1", ball)]),
        link("b", &[]),
        link("c", &[("y_z", "2 0 0", ball), ("z", "2 0 1", ball)]),
        joint("b", "a", "revolute", "0 0 0"),
        joint("c", "b", "revolute", "0 0 0"),
    ];
    let (model, findings) = read("r.urdf", &format!("<robot name='r'>{}</robot>", parts.concat()), asked());
    assert_eq!(named(&model), ["x/y_z", "x_y/y_z", "x/z", "x_y/z_pair_2"], "{findings}");
}

/// A model of MuJoCo with four balls that float apart from each other, and more.
fn balls(geoms: [&str; 4], more: &str) -> String {
    let ball = |(k, geom): (usize, &str)| {
        format!("<body name='b{k}' pos='{k} 0 1'><freejoint/><geom name='g{k}' size='0.1' {geom}/></body>")
    };
    let bodies: String = geoms.into_iter().enumerate().map(ball).collect();
    format!("<mujoco><worldbody>{bodies}</worldbody>{more}</mujoco>")
}

#[test]
fn bits_of_geoms_say_which_can_touch() {
    let geoms = ["contype='1' conaffinity='0'", "contype='0' conaffinity='1'", "contype='2' conaffinity='2'", ""];
    let (model, findings) = read("m.xml", &balls(geoms, ""), asked());
    assert_eq!(named(&model), ["g0/g1", "g0/g3", "g1/g3"], "{findings}");
}

#[test]
fn excluded_bodies_do_not_touch_and_listed_geoms_do() {
    let none = "contype='0' conaffinity='0'";
    let contact = "<contact><exclude body1='b1' body2='b0'/><pair geom1='g3' geom2='g0' friction='0.9 0.9 0 0 0'/>\
                   <pair name='smooth' geom1='g1' geom2='g2' condim='1'/></contact>";
    let text = balls(["", "", "", none], contact);
    let (free, findings) = read("m.xml", &text, ImportOptions::default());
    // A geom that touches nothing is a shape where it stands in a pair that is used.
    assert_eq!((free.contacts.len(), free.shapes.len()), (0, 3));
    assert!(
        findings.contains("`contact` is not used: it is where contacts between bodies are asked for"),
        "{findings}"
    );
    let (model, findings) = read("m.xml", &text, asked());
    let wanted = [("g3/g0", 0.9), ("smooth", 0.0), ("g0/g2", 0.3)];
    assert_eq!(pairs(&model), wanted.map(|(name, friction)| (name.to_string(), 1, friction)), "{findings}");
    assert!(!findings.contains("`contact` is not used"), "{findings}");
    // It does not touch the floor.
    let floor = Some(Floor { height: 0.0, friction: 0.5 });
    let (model, _) = read("m.xml", &text, ImportOptions { floor, ..asked() });
    assert_eq!(named(&model)[..4], ["floor/g0", "floor/g1", "floor/g2", "g3/g0"]);
}

#[test]
fn unknown_names_in_contact_are_told() {
    let contact = "<contact>\n<exclude body1='b1' body2='b9'/>\n<pair geom1='g1' geom2='h'/>\n<pair geom1='g1'/>\n<other/></contact>";
    let (model, findings) = load("m.xml", &balls([""; 4], contact), &asked());
    let findings = findings.to_string();
    assert!(model.is_none());
    for told in [
        "m.xml:2:28: error: exclude: `b9` is not a body\n  help: did you mean `b0`?",
        "m.xml:3:25: error: pair: `h` is not a geom",
        "m.xml:4:1: error: pair: ",
    ] {
        assert!(findings.contains(told), "{told}\n{findings}");
    }
}

/// What is left out because it has many contacts, or because nothing can move it, is told, and pairs of the file have any number.
#[test]
fn many_contacts_and_rigid_pairs_are_left_out() {
    // A prism, of points on half of a circle.
    let corner = |k: u32| {
        let (t, z) = (f64::from(k / 2) / 6.0 - 1.0, [-0.1, 0.1][k as usize % 2]);
        let r = 0.1 / (1.0 + t * t);
        format!("{} {} {z}", r * (1.0 - t * t), r * 2.0 * t)
    };
    let corners: Vec<String> = (0..24).map(corner).collect();
    let text = |pairs: &str| {
        format!(
            "<mujoco><asset><mesh name='m' vertex='{}'/></asset><worldbody>\
             <body name='a'><freejoint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/><geom name='pebble' type='mesh' mesh='m'/></body>\
             <body name='b' pos='1 0 0'><freejoint/><geom name='rod' type='capsule' size='0.05 0.2'/>\
             <geom name='knob' size='0.1' pos='0 0 1'/></body></worldbody><contact>{pairs}</contact></mujoco>",
            corners.join(" ")
        )
    };
    let (model, findings) = read("m.xml", &text("<pair geom1='rod' geom2='knob'/>"), asked());
    assert_eq!(named(&model), ["pebble/knob"], "{findings}");
    for told in [
        format!("1 pair of shapes left {WITHOUT} each would be more than 32 contacts: `pebble/rod`"),
        format!("1 pair of shapes left {WITHOUT} no freedom is between their bodies: `rod/knob`"),
    ] {
        assert!(findings.contains(&told), "{told}\n{findings}");
    }
    let (model, findings) = read("m.xml", &text("<pair geom1='pebble' geom2='rod'/>"), asked());
    assert!(model.contacts.len() > 33, "{}\n{findings}", model.contacts.len());
}

#[test]
fn more_than_a_thousand_contacts_are_an_error() {
    let balls = |n: usize| {
        let ball = |k| format!("<body pos='{k} 0 1'><freejoint/><geom size='0.1'/></body>");
        format!("<mujoco><worldbody>{}</worldbody></mujoco>", (0..n).map(ball).collect::<String>())
    };
    assert_eq!(read("m.xml", &balls(45), asked()).0.contacts.len(), 990);
    let (model, findings) = load("m.xml", &balls(46), &asked());
    let told = "error: the shapes of the bodies have more than 1000 contacts with each other";
    assert!(model.is_none() && findings.to_string().contains(told), "{findings}");
}

/// Bodies with several joints are no neighbours of the bodies between these, and planes of the world are touched unless
/// there is a floor.
#[test]
fn neighbours_and_planes_of_mujoco() {
    let text =
        "<mujoco><worldbody><geom name='ground' type='plane' size='1 1 1'/><body name='a' pos='0 0 2'><freejoint/>\
        <geom name='ga' size='0.1'/><body name='b' pos='1 0 0'><joint axis='1 0 0'/><joint axis='0 1 0'/>\
        <geom name='gb' size='0.1'/><body name='c' pos='1 0 0'><geom name='gc' size='0.1'/></body></body></body>\
        </worldbody></mujoco>";
    let (model, findings) = read("m.xml", text, asked());
    assert_eq!(named(&model), ["ground/ga", "ground/gb", "ground/gc"], "{findings}");
    assert!(findings.contains("2 pairs of shapes left without contacts, because one joint connects"), "{findings}");
    let floor = Some(Floor { height: 0.0, friction: 0.5 });
    let (model, _) = read("m.xml", text, ImportOptions { floor, ..asked() });
    assert_eq!(named(&model), ["floor/ga", "floor/gb", "floor/gc"]);
}

/// A TOML model describes its own contacts; its base takes the option.
#[test]
fn a_base_takes_the_option() {
    let error = load("m.toml", "name = 'm'", &asked()).1.to_string();
    assert!(error.contains("a TOML model states its own limits and contacts"), "{error}");
    let files = |_: &std::path::Path| Ok(robot().into_bytes());
    // What a variant removes makes no contacts.
    let text = "[base]\nfile = 'r.urdf'\n[[variant]]\nname = 'headless'\nremove = ['head']\n";
    let (read, findings) = load_with("m.toml", text, &asked(), &files);
    let (model, variants) = read.unwrap_or_else(|| panic!("{findings}"));
    assert_eq!((named(&model).len(), named(&variants[0].model).len()), (10, 6), "{findings}");
}
