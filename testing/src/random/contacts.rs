//! Random mechanisms with contacts.

use mbd_codegen::model::{Body, Joint, JointKind, Model, Placement, Rotation, Value};
use mbd_codegen::read;

use super::{random_model, Distribution, Rng};
use crate::toml::to_toml;

/// Text of a shape on a body, or on the ground where there is none.
fn shape(rng: &mut Rng, name: &str, body: Option<&str>, kind: usize) -> String {
    let kind = match kind {
        0 => "type = \"point\"".to_string(),
        1 => "type = \"sphere\"\nradius = 0.1".to_string(),
        2 => "type = \"capsule\"\nradius = 0.05\nlength = 0.4".to_string(),
        3 => "type = \"box\"\nsize = [0.3, 0.2, 0.5]\nrounding = 0.02".to_string(),
        4 => "type = \"cylinder\"\nradius = 0.15\nlength = 0.3".to_string(),
        5 => "type = \"ellipsoid\"\nsemi_axes = [0.1, 0.2, 0.3]".to_string(),
        _ => "type = \"plane\"".to_string(),
    };
    let body = body.map_or(String::new(), |body| format!("body = \"{body}\"\n"));
    let [xyz, rpy] = [0.3, 2.0].map(|size| [0; 3].map(|_| rng.around(size)));
    format!("\n[[shape]]\nname = \"{name}\"\n{body}{kind}\nxyz = {xyz:?}\nrpy = {rpy:?}\n")
}

/// A random mechanism of up to six bodies with some contacts between them and with the ground; `None` where no pair
/// fits.
pub fn with_contacts(seed: u64) -> Option<Model> {
    let distribution = Distribution {
        kinds: [1.0; 9],
        prescribed: 0.0,
        params: 0.0,
        wrenches: 0.0,
        ..Distribution::everything(seed, 6)
    };
    let plain = random_model(seed, &distribution);
    let mut rng = Rng::new(seed, 71);
    let names: Vec<&str> = plain.bodies.iter().map(|body| body.name.as_str()).collect();
    let mut text = to_toml(&plain);
    // A pair that the description does not take is left out.
    for k in 0..8 {
        let second = rng.below(names.len());
        let first = Some(rng.below(names.len() + 1)).filter(|i| *i < names.len());
        if first == Some(second) {
            continue;
        }
        let kinds = rng.pick(&[[6, 0], [6, 1], [6, 2], [6, 3], [6, 4], [6, 5], [1, 1], [2, 2], [3, 1], [3, 2], [4, 0]]);
        let more = [
            shape(&mut rng, &format!("s{k}a"), first.map(|i| names[i]), kinds[0]),
            shape(&mut rng, &format!("s{k}b"), Some(names[second]), kinds[1]),
            format!("\n[[contact]]\nname = \"c{k}\"\nbetween = [\"s{k}a\", \"s{k}b\"]\n"),
        ]
        .concat();
        let tried = format!("{text}{more}");
        if read::model("random.toml", &tried, &Default::default()).is_ok() {
            text = tried;
        }
    }
    read::model("random.toml", &text, &Default::default())
        .ok()
        .map(|read| read.model)
        .filter(|m| !m.contacts.is_empty())
}

/// A random mechanism of three to eight bodies that hang on a floating trunk, with a foot on up to three of those on which no other
/// hangs, which touch one floor; `None` where the description does not take it.
pub fn with_feet(seed: u64) -> Option<Model> {
    let distribution = Distribution {
        bodies: (3, 8),
        roots: 0.3,
        branching: 0.2,
        kinds: [6.0, 3.0, 1.0, 1.0, 2.0, 1.0, 1.0, 0.0, 0.5],
        prescribed: 0.0,
        params: 0.0,
        wrenches: 0.0,
        gravity: [1.0, 0.0, 0.0],
        ..Distribution::everything(seed, 8)
    };
    let mut plain = random_model(seed, &distribution);
    let (mut rng, trunk) = (Rng::new(seed, 74), plain.bodies.len());
    plain.joints.iter_mut().for_each(|joint| joint.parent = joint.parent.or(Some(trunk)));
    plain.bodies.push(Body {
        name: "trunk".into(),
        mass: Value::Const(2.0),
        com: [0.02, -0.01, 0.03].map(Value::Const),
        inertia: [0.05, 0.06, 0.07, 0.0, 0.0, 0.0].map(Value::Const),
        inertia_axes: Rotation::NONE,
    });
    plain.joints.push(Joint::new("flies", JointKind::Floating, None, trunk, Placement::IDENTITY));
    let is_tip = |body: &usize| plain.joints.iter().all(|joint| joint.parent != Some(*body));
    let tips: Vec<usize> = (0..trunk).filter(is_tip).take(3).collect();
    let mut text = to_toml(&plain) + "\n[[shape]]\nname = \"floor\"\ntype = \"plane\"\n";
    for (k, tip) in tips.into_iter().enumerate() {
        let kind = rng.below(2);
        text += &shape(&mut rng, &format!("foot{k}"), Some(&plain.bodies[tip].name), kind);
        text += &format!("[[contact]]\nname = \"sole{k}\"\nbetween = [\"floor\", \"foot{k}\"]\nfriction = 0.7\n");
    }
    read::model("feet.toml", &text, &Default::default()).ok().map(|read| read.model)
}

/// A random robot: a floating trunk with one to four legs of two to five joints, with a foot on each that touches one floor.
pub fn legged(seed: u64) -> Model {
    let mut rng = Rng::new(seed, 73);
    let mut text = String::from("name = \"legged\"\n[[shape]]\nname = \"floor\"\ntype = \"plane\"\n");
    let mut bodies = 0;
    let mut body = |rng: &mut Rng, text: &mut String, joint: &str, parent: Option<&str>| {
        let name = format!("b{bodies}");
        bodies += 1;
        let [com, xyz, rpy] = [0.05, 0.2, 1.5].map(|size| [0; 3].map(|_| rng.around(size)));
        let (mass, inertia) = (rng.range(0.2, 1.5), [0; 3].map(|_| rng.range(0.004, 0.006)));
        *text += &format!("[[body]]\nname = \"{name}\"\nmass = {mass:?}\ncom = {com:?}\ninertia = {inertia:?}\n");
        *text += &format!("[[joint]]\nname = \"j{name}\"\ntype = \"{joint}\"\nchild = \"{name}\"\n");
        if let Some(parent) = parent {
            *text += &format!("parent = \"{parent}\"\nxyz = {xyz:?}\nrpy = {rpy:?}\n");
        }
        name
    };
    let trunk = body(&mut rng, &mut text, "floating", None);
    for leg in 0..1 + rng.below(4) {
        let mut last = trunk.clone();
        for _ in 0..2 + rng.below(4) {
            let joint = rng.pick(&["revolute", "revolute", "revolute", "prismatic", "spherical"]);
            last = body(&mut rng, &mut text, joint, Some(&last));
        }
        let kind = rng.below(2);
        text += &shape(&mut rng, &format!("foot{leg}"), Some(&last), kind);
        text += &format!("[[contact]]\nname = \"sole{leg}\"\nbetween = [\"floor\", \"foot{leg}\"]\nfriction = 0.7\n");
    }
    read::model("legged.toml", &text, &Default::default()).unwrap_or_else(|e| panic!("{e}\n{text}")).model
}
