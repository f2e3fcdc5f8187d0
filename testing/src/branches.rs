//! Random trees with like branches.

use std::fmt::Write;

use mbd_codegen::model::Model;
use mbd_codegen::read::{self, ImportOptions};

use crate::random::Rng;

/// How the numbers of the branches of a body differ.
#[derive(Clone, Copy, Debug)]
pub enum Numbers {
    /// Not at all.
    Same,
    /// The second is the mirror image of the first, and so on.
    Mirrored,
    /// Every branch has its own.
    Different,
    /// Some of one branch's are zero.
    ZerosInOne,
}

/// All of them.
pub const NUMBERS: [Numbers; 4] = [Numbers::Same, Numbers::Mirrored, Numbers::Different, Numbers::ZerosInOne];

/// A floating body on which branches hang.
const TRUNK: &str = r#"[[body]]
name = "trunk"
mass = 5.0
com = [0.1, 0, 0.02]
inertia = [0.2, 0.3, 0.4]

[[joint]]
name = "base"
type = "floating"
child = "trunk"

"#;

const KINDS: [&str; 4] = ["revolute", "prismatic", "spherical", "universal"];

/// One body with its joint; without a parent it hangs on the ground.
fn body(text: &mut String, name: &str, parent: &str, kind: &str, rng: &mut Rng, scale: [f64; 3]) {
    let mut vector = |size: f64| scale.map(|s| s * (size + rng.around(0.5 * size)));
    let (xyz, com) = (vector(0.3), vector(0.1));
    let mass = 1.0 + 0.5 * scale[1].abs();
    let axis = match kind {
        "revolute" | "prismatic" => "axis = [0, 1, 0]\n".to_string(),
        _ => String::new(),
    };
    let parent = if parent.is_empty() { String::new() } else { format!("parent = \"{parent}\"\n") };
    let _ = writeln!(
        text,
        "[[body]]\nname = \"{name}\"\nmass = {mass}\ncom = {com:?}\ninertia = [0.02, 0.03, 0.04]\n\n[[joint]]\nname = \
         \"j_{name}\"\ntype = \"{kind}\"\n{parent}child = \"{name}\"\nxyz = {xyz:?}\n{axis}"
    );
}

/// What branches hang on, and their rods.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum On {
    /// Branches hang on a floating body, rods on the first body of a branch.
    Trunk,
    /// Both hang on the ground.
    Ground,
    /// Both hang on a floating body.
    TrunkBoth,
}

/// Two to six like branches with loops and couplings inside of each: a chain of revolute joints, and a rod beside it
/// with its end bound to that of the chain. Where both hang on the same body or on the ground, some are also bound to it.
///
/// # Panics
/// If the reader refuses the text.
pub fn with_loops(seed: u64, numbers: Numbers, on: On) -> Model {
    let mut rng = Rng::new(seed, 4);
    let mut text = "name = \"loops\"\ngravity = [0, 0, -9.81]\n\n".to_string();
    let parent = match on {
        On::Trunk | On::TrunkBoth => {
            text += TRUNK;
            "trunk"
        }
        On::Ground => "",
    };
    let (branches, length) = (2 + rng.below(5), 3 + rng.below(2));
    let (kind, coupled, held) =
        (rng.pick(&["distance", "point_on_plane", "point_on_line"]), rng.chance(0.5), rng.chance(0.5));
    for branch in 0..branches {
        let (mut own, scale) = of_branch(seed, branch, numbers);
        let names: Vec<String> = (0..length).map(|k| format!("b{branch}_{k}")).collect();
        for (k, name) in names.iter().enumerate() {
            body(&mut text, name, if k == 0 { parent } else { &names[k - 1] }, "revolute", &mut own, scale);
        }
        let rod = format!("rod{branch}");
        let root = if on == On::Trunk { names[0].as_str() } else { parent };
        body(&mut text, &rod, root, "spherical", &mut own, scale);
        let size = 0.4 + own.around(0.1);
        let number = match kind {
            "distance" => format!("length = {size}\n"),
            "point_on_line" => "axis = [0, 0, 1]\n".to_string(),
            _ => "normal = [0, 0, 1]\n".to_string(),
        };
        let _ = writeln!(
            text,
            "[[frame]]\nname = \"end{branch}\"\nbody = \"{}\"\nxyz = [{size}, 0, 0]\n\n[[loop]]\nname = \
             \"loop{branch}\"\ntype = \"{kind}\"\nbetween = [\"{rod}\", \"end{branch}\"]\n{number}",
            names[length - 1]
        );
        if coupled {
            let _ = writeln!(
                text,
                "[[coupling]]\nname = \"gears{branch}\"\njoints = [\"j_{}\", \"j_{}\"]\nratios = [1, {size}]\n",
                names[1], names[2]
            );
        }
        if held && on != On::Trunk {
            let to = if parent.is_empty() { "ground" } else { parent };
            let _ = writeln!(
                text,
                "[[loop]]\nname = \"held{branch}\"\ntype = \"distance\"\nbetween = [\"{to}\", \"{}\"]\nlength = \
                 {size}\n",
                names[1]
            );
        }
    }
    let options = ImportOptions::default();
    read::model("loops.toml", &text, &options).unwrap_or_else(|findings| panic!("{findings}\n{text}")).model
}

/// A floating body on two to five like legs, whose feet constraints bind to the ground: points, points on planes, or points that
/// keep a distance and have a frame of their own on the ground.
///
/// # Panics
/// If the reader refuses the text.
pub fn on_feet(seed: u64, numbers: Numbers) -> Model {
    let mut rng = Rng::new(seed, 5);
    let mut text = format!("name = \"on_feet\"\ngravity = [0, 0, -9.81]\n\n{TRUNK}");
    let legs = 2 + rng.below(4);
    let kind = rng.pick(&["spherical", "point_on_plane", "distance"]);
    let decay = if rng.chance(0.5) { "decay = 5\n" } else { "" };
    for leg in 0..legs {
        let (mut own, scale) = of_branch(seed, leg, numbers);
        let names = [format!("hip{leg}"), format!("knee{leg}")];
        body(&mut text, &names[0], "trunk", "universal", &mut own, scale);
        body(&mut text, &names[1], &names[0], "revolute", &mut own, scale);
        let size = 0.4 + own.around(0.1);
        let number = match kind {
            "distance" => format!("length = {size}\n"),
            "point_on_plane" => "normal = [0.1, 0.2, 1]\n".to_string(),
            _ => String::new(),
        };
        let _ = writeln!(
            text,
            "[[frame]]\nname = \"foot{leg}\"\nbody = \"{}\"\nxyz = [{size}, 0.1, 0]\n\n[[frame]]\nname = \
             \"print{leg}\"\nbody = \"ground\"\nxyz = [{size}, {leg}, 0.1]\nrpy = [0.3, 0.1, 0.2]\n\n[[loop]]\nname = \"pin{leg}\"\ntype = \
             \"{kind}\"\nbetween = [\"print{leg}\", \"foot{leg}\"]\n{number}{decay}",
            names[1]
        );
    }
    let options = ImportOptions::default();
    read::model("on_feet.toml", &text, &options).unwrap_or_else(|findings| panic!("{findings}\n{text}")).model
}

/// The random numbers of a branch, and factors of its vectors.
fn of_branch(seed: u64, branch: usize, numbers: Numbers) -> (Rng, [f64; 3]) {
    let own = match numbers {
        Numbers::Different => Rng::new(seed, 20 + branch as u64),
        _ => Rng::new(seed, 20),
    };
    let scale = match numbers {
        Numbers::Mirrored if branch % 2 == 1 => [1.0, -1.0, 1.0],
        Numbers::ZerosInOne if branch == 1 => [1.0, 0.0, 1.0],
        Numbers::Same | Numbers::Mirrored | Numbers::Different | Numbers::ZerosInOne => [1.0; 3],
    };
    (own, scale)
}

/// A floating body with two to six like branches, a branch that is like none, and branches on branches.
///
/// # Panics
/// If the reader refuses the text.
pub fn tree(seed: u64, numbers: Numbers) -> Model {
    let mut rng = Rng::new(seed, 3);
    let mut text = format!("name = \"tree\"\ngravity = [0, 0, -9.81]\n\n{TRUNK}");
    let (branches, length) = (2 + rng.below(5), 1 + rng.below(4));
    let kinds: Vec<&str> = (0..length).map(|_| if rng.chance(0.7) { "revolute" } else { rng.pick(&KINDS) }).collect();
    let fingers = rng.chance(0.3);
    for branch in 0..branches {
        let (mut own, scale) = of_branch(seed, branch, numbers);
        let mut parent = "trunk".to_string();
        for (k, kind) in kinds.iter().enumerate() {
            let name = format!("b{branch}_{k}");
            body(&mut text, &name, &parent, kind, &mut own, scale);
            parent = name;
        }
        for finger in 0..if fingers { 2 } else { 0 } {
            body(&mut text, &format!("f{branch}_{finger}"), &parent, "revolute", &mut own, scale);
        }
        if branch == 1 {
            body(&mut text, "odd", "trunk", "prismatic", &mut rng, [1.0; 3]);
        }
    }
    let options = ImportOptions::default();
    read::model("tree.toml", &text, &options).unwrap_or_else(|findings| panic!("{findings}\n{text}")).model
}

/// A chain of `links` links with like branches, in space: each carries `legs` legs of one to three joints, which stand before the
/// next link in the description. Numbers differ from link to link; the axes of the joints are alike in all, or in every other link.
/// A body hangs on the last link.
///
/// # Panics
/// If the reader refuses the text.
pub fn centipede(seed: u64, links: usize, legs: usize, numbers: Numbers) -> Model {
    let mut rng = Rng::new(seed, 7);
    let mut text = format!("name = \"centipede\"\ngravity = [0, 0, -9.81]\n\n{TRUNK}");
    let length = 1 + rng.below(3);
    let kinds: Vec<&str> = (0..=length).map(|_| rng.pick(&["revolute", "spherical", "universal"])).collect();
    let every_other = rng.chance(0.3);
    let mut parent = "trunk".to_string();
    for link in 0..links {
        let name = format!("link{link}");
        let kind = if every_other && link % 2 == 1 { "cylindrical" } else { kinds[0] };
        body(&mut text, &name, &parent, kind, &mut rng, [1.0; 3]);
        for leg in 0..legs {
            let (mut own, scale) = of_branch(seed + link as u64, leg, numbers);
            for k in 0..length {
                let on = if k == 0 { name.clone() } else { format!("leg{link}_{leg}_{}", k - 1) };
                body(&mut text, &format!("leg{link}_{leg}_{k}"), &on, kinds[k + 1], &mut own, scale);
            }
        }
        parent = name;
    }
    body(&mut text, "tail", &parent, "universal", &mut rng, [1.0; 3]);
    let options = ImportOptions::default();
    read::model("centipede.toml", &text, &options).unwrap_or_else(|findings| panic!("{findings}\n{text}")).model
}
