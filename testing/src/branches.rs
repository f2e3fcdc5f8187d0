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

const KINDS: [&str; 4] = ["revolute", "prismatic", "spherical", "universal"];

/// One body with its joint.
fn body(text: &mut String, name: &str, parent: &str, kind: &str, rng: &mut Rng, scale: [f64; 3]) {
    let mut vector = |size: f64| scale.map(|s| s * (size + rng.around(0.5 * size)));
    let (xyz, com) = (vector(0.3), vector(0.1));
    let mass = 1.0 + 0.5 * scale[1].abs();
    let axis = match kind {
        "revolute" | "prismatic" => "axis = [0, 1, 0]\n".to_string(),
        _ => String::new(),
    };
    let _ = writeln!(
        text,
        "[[body]]\nname = \"{name}\"\nmass = {mass}\ncom = {com:?}\ninertia = [0.02, 0.03, 0.04]\n\n[[joint]]\nname = \
         \"j_{name}\"\ntype = \"{kind}\"\nparent = \"{parent}\"\nchild = \"{name}\"\nxyz = {xyz:?}\n{axis}"
    );
}

/// A floating body with two to six like branches, a branch that is like none, and branches on branches.
///
/// # Panics
/// If the reader refuses the text.
pub fn tree(seed: u64, numbers: Numbers) -> Model {
    let mut rng = Rng::new(seed, 3);
    let mut text =
        "name = \"tree\"\ngravity = [0, 0, -9.81]\n\n[[body]]\nname = \"trunk\"\nmass = 5.0\ncom = [0.1, 0, \
                    0.02]\ninertia = [0.2, 0.3, 0.4]\n\n[[joint]]\nname = \"base\"\ntype = \"floating\"\nchild = \
                    \"trunk\"\n\n"
            .to_string();
    let (branches, length) = (2 + rng.below(5), 1 + rng.below(4));
    let kinds: Vec<&str> = (0..length).map(|_| if rng.chance(0.7) { "revolute" } else { rng.pick(&KINDS) }).collect();
    let fingers = rng.chance(0.3);
    for branch in 0..branches {
        let mut own = match numbers {
            Numbers::Different => Rng::new(seed, 20 + branch as u64),
            _ => Rng::new(seed, 20),
        };
        let scale = match numbers {
            Numbers::Mirrored if branch % 2 == 1 => [1.0, -1.0, 1.0],
            Numbers::ZerosInOne if branch == 1 => [1.0, 0.0, 1.0],
            Numbers::Same | Numbers::Mirrored | Numbers::Different | Numbers::ZerosInOne => [1.0; 3],
        };
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
