//! Generates the rates of legged robots and of mechanisms side by side, like branches together and apart.

use mbd_codegen::model::{ConstraintKind, Model};
use mbd_codegen::modes::ModeChoice;
use mbd_codegen::options::LikeBranches;
use mbd_codegen::read::{self, Base, ImportOptions};
use mbd_codegen::{generate::generate_from, search, Arithmetic, Options, Output, RolledCode};
use mbd_runtime::contact::Mode;

/// Files of `models` (none: [`five_bar_legs`] or [`pinned_feet`]), how their roots are connected, and how many of them stand side by
/// side on the ground.
const SCENES: [(&str, &str, Base, usize); 6] = [
    ("solo12", "solo12.urdf", Base::Floating, 1),
    ("g1", "g1.urdf", Base::Floating, 1),
    ("arms", "ur5.urdf", Base::Fixed, 2),
    ("four_bars", "mechanisms/fourbar.toml", Base::Fixed, 50),
    ("five_bars", "", Base::Fixed, 1),
    ("feet", "", Base::Fixed, 1),
];

fn main() {
    let out = std::env::var("OUT_DIR").expect("cargo sets it");
    quadruped(&out);
    chain_with_legs(&out);
    for (name, file, base, count) in SCENES {
        let (path, text) = match file {
            "" if name == "feet" => ("pinned_feet.toml".to_string(), pinned_feet()),
            "" => ("five_bar_legs.toml".to_string(), five_bar_legs()),
            file => {
                let path = format!("../../models/{file}");
                println!("cargo:rerun-if-changed={path}");
                let text = std::fs::read_to_string(&path).expect("the model");
                (path, text)
            }
        };
        let model = read::model(&path, &text, &ImportOptions { base, ..ImportOptions::default() });
        let model = side_by_side(&model.unwrap_or_else(|findings| panic!("{findings}")).model, count);
        let mut options = Options { outputs: vec![Output::Rates], ..Options::default() };
        let plan = search::plan(&model, options.searches());
        for arithmetic in [Arithmetic::Exact, Arithmetic::Fast] {
            for branches in [LikeBranches::Apart, LikeBranches::Together] {
                options.arithmetic = arithmetic;
                options.plan.branches = branches;
                let code = generate_from(&plan, &options).expect("code").source;
                let file = format!("{out}/{name}_{}_{}.rs", arithmetic.name(), branches.name());
                std::fs::write(file, code).expect("written");
            }
        }
    }
}

/// Where the legs of a quadruped begin on its trunk.
const LEGS: [(&str, [f64; 2]); 4] =
    [("lf", [0.2, 0.1]), ("rf", [0.2, -0.1]), ("lh", [-0.2, 0.1]), ("rh", [-0.2, -0.1])];

fn body(name: &str, mass: f64, com: f64, size: f64) -> String {
    format!("[[body]]\nname = \"{name}\"\nmass = {mass}\ncom = [{com}, 0, 0]\ninertia = [{size}, {size}, {size}]\n\n")
}

fn revolute(child: &str, parent: &str, at: [f64; 3], axis: [u8; 3]) -> String {
    format!(
        "[[joint]]\nname = \"j_{child}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \"{child}\"\nxyz = {at:?}\n\
         axis = {axis:?}\n\n"
    )
}

/// A trunk that moves freely.
fn trunk(name: &str) -> String {
    let trunk = body("trunk", 5.0, 0.01, 0.1);
    let joint = "[[joint]]\nname = \"j_trunk\"\ntype = \"floating\"\nchild = \"trunk\"\n\n";
    format!("name = \"{name}\"\ngravity = [0, 0, -9.81]\n\n{trunk}{joint}")
}

/// The quadruped of `models/contacts` in sets of modes: with all feet in the air, standing, trotting, and sliding. The stops of its
/// knees are open.
fn quadruped(out: &str) {
    let path = "../../models/contacts/quadruped.toml";
    println!("cargo:rerun-if-changed={path}");
    let text = std::fs::read_to_string(path).expect("the model");
    let model = read::model(path, &text, &ImportOptions::default());
    let model = model.unwrap_or_else(|findings| panic!("{findings}")).model;
    let model = Model { name: "model".to_string(), ..model };
    let (o, x, s) = (Mode::Open, Mode::Stick, Mode::Slide);
    let sets = [[o, o, o, o], [x, x, x, x], [x, o, o, x], [s, s, s, s]].map(|feet| [&feet[..], &[o; 8]].concat());
    let mut options = Options { modes: Some(ModeChoice::Listed(sets.to_vec())), ..Options::default() }.of_model(true);
    let plan = search::plan(&model, options.searches());
    for branches in [LikeBranches::Apart, LikeBranches::Together] {
        options.plan.branches = branches;
        let code = generate_from(&plan, &options).expect("code").source;
        std::fs::write(format!("{out}/quadruped_{}.rs", branches.name()), code).expect("written");
    }
}

/// A quadruped each of whose legs is a planar five-bar: two motors on the trunk, whose links meet in the foot.
fn five_bar_legs() -> String {
    let mut text = trunk("five_bar_legs");
    for (leg, [x, y]) in LEGS {
        for (side, dx) in [("front", 0.02), ("back", -0.02)] {
            let (upper, lower) = (format!("{leg}_{side}_upper"), format!("{leg}_{side}_lower"));
            text += &(body(&upper, 0.1, 0.05, 1e-4) + &body(&lower, 0.12, 0.1, 4e-4));
            text += &revolute(&upper, "trunk", [x + dx, y, 0.0], [0, 1, 0]);
            text += &revolute(&lower, &upper, [0.1, 0.0, 0.0], [0, 1, 0]);
            text += &format!("[[frame]]\nname = \"{lower}_end\"\nbody = \"{lower}\"\nxyz = [0.2, 0, 0]\n\n");
        }
        text += &format!(
            "[[loop]]\nname = \"{leg}_foot\"\ntype = \"revolute\"\nbetween = [\"{leg}_front_lower_end\", \
             \"{leg}_back_lower_end\"]\naxis = [0, 1, 0]\n\n"
        );
    }
    text
}

/// A quadruped with legs of three joints, whose feet are pinned to the ground.
fn pinned_feet() -> String {
    let mut text = trunk("pinned_feet");
    for (leg, [x, y]) in LEGS {
        let [hip, upper, lower] = ["hip", "upper", "lower"].map(|part| format!("{leg}_{part}"));
        text += &(body(&hip, 0.15, 0.0, 1e-4) + &body(&upper, 0.15, 0.05, 4e-4) + &body(&lower, 0.03, 0.05, 1e-4));
        text += &revolute(&hip, "trunk", [x, y, 0.0], [1, 0, 0]);
        let start = |joint: String, angle: f64| joint.trim_end().to_string() + &format!("\nstart = {angle}\n\n");
        text += &start(revolute(&upper, &hip, [0.0, 0.02_f64.copysign(y), 0.0], [0, 1, 0]), 0.7);
        text += &start(revolute(&lower, &upper, [0.16, 0.01, 0.0], [0, 1, 0]), 1.4);
        text += &format!(
            "[[frame]]\nname = \"{leg}_foot\"\nbody = \"{lower}\"\nxyz = [0.16, 0, 0]\n\n[[loop]]\nname = \"{leg}_pin\"\n\
             type = \"spherical\"\nbetween = [\"ground\", \"{leg}_foot\"]\n\n"
        );
    }
    text
}

/// The rates of a centipede: its legs one after the other, computed together, and in loops over its links.
fn chain_with_legs(out: &str) {
    let model = read::model("centipede.toml", &centipede(), &ImportOptions::default());
    let model = model.unwrap_or_else(|findings| panic!("{findings}")).model;
    let model = Model { name: "model".to_string(), ..model };
    let kinds = [
        ("apart", RolledCode::Never, LikeBranches::Apart),
        ("together", RolledCode::Never, LikeBranches::Together),
        ("rolled", RolledCode::Always, LikeBranches::Apart),
    ];
    for (name, rolled, branches) in kinds {
        let mut options = Options { outputs: vec![Output::Rates], ..Options::default() };
        (options.plan.rolled, options.plan.branches) = (rolled, branches);
        let plan = search::plan(&model, options.searches());
        let code = generate_from(&plan, &options).expect("code").source;
        std::fs::write(format!("{out}/centipede_{name}.rs"), code).expect("written");
    }
}

/// A trunk and a chain of 24 links behind it, which bend up and to the sides in turn, each with a leg of three joints on either side.
fn centipede() -> String {
    let mut text = trunk("centipede");
    let mut behind = "trunk".to_string();
    for link in 0..24 {
        let name = format!("link{link}");
        text += &body(&name, 0.9, -0.11, 0.012);
        text += &revolute(&name, &behind, [-0.2, 0.0, 0.0], if link % 2 == 0 { [0, 1, 0] } else { [0, 0, 1] });
        for (side, y) in [("left", 0.05), ("right", -0.05)] {
            let [hip, upper, lower] = ["hip", "upper", "lower"].map(|part| format!("{part}{link}_{side}"));
            text += &(body(&hip, 0.15, 0.0, 1e-4) + &body(&upper, 0.14, 0.05, 4e-4) + &body(&lower, 0.03, 0.06, 2e-4));
            text += &revolute(&hip, &name, [-0.1, y, 0.0], [0, 0, 1]);
            text += &revolute(&upper, &hip, [0.0, 0.6 * y, 0.0], [1, 0, 0]);
            text += &revolute(&lower, &upper, [0.0, 3.0 * y, 0.0], [1, 0, 0]);
        }
        behind = name;
    }
    text
}

/// Several of a mechanism on the ground, all in the same place: they do not touch.
fn side_by_side(one: &Model, count: usize) -> Model {
    let mut all = Model { name: "model".to_string(), ..one.clone() };
    for k in 1..count {
        let (bodies, joints) = (k * one.bodies.len(), k * one.joints.len());
        let mut next = one.clone();
        for name in next.bodies.iter_mut().map(|body| &mut body.name) {
            *name = format!("{name}_{k}");
        }
        for joint in &mut next.joints {
            joint.name = format!("{}_{k}", joint.name);
            joint.parent = joint.parent.map(|body| body + bodies);
            joint.child += bodies;
        }
        for constraint in &mut next.constraints {
            constraint.name = format!("{}_{k}", constraint.name);
            match &mut constraint.kind {
                ConstraintKind::Loop { first, second, .. } => {
                    [first, second].into_iter().filter_map(|end| end.body.as_mut()).for_each(|body| *body += bodies);
                }
                ConstraintKind::Coupling { terms, .. } => terms.iter_mut().for_each(|(joint, _)| *joint += joints),
            }
        }
        next.starts.iter_mut().for_each(|start| start.joint += joints);
        all.bodies.extend(next.bodies);
        all.joints.extend(next.joints);
        all.constraints.extend(next.constraints);
        all.starts.extend(next.starts);
    }
    all
}
