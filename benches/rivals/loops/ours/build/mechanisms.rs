//! The mechanisms of the comparison: some of `models/`, closed chains, and the Delta robot with its rods as bodies.

use std::fmt::Write as _;

use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::model::{Constraint, ConstraintKind, JointKind, LoopKind, Model, Value};

use crate::rods::with_rods;

pub struct Mechanism {
    pub name: &'static str,
    pub ours: Model,
    /// The model for Pinocchio, if it differs from ours.
    pub theirs: Option<Model>,
    /// Largest distance of coordinates of random states from the start, rad and m.
    pub far: f64,
}

pub fn all() -> Vec<Mechanism> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../../models");
    let read = |file: &str| {
        let path = format!("{root}/{file}.toml");
        println!("cargo:rerun-if-changed={path}");
        model(&path, &std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}")))
    };
    let same = |name, ours, far| Mechanism { name, ours, theirs: None, far };
    let delta = read("mechanisms/delta");
    let rods = with_rods(&delta);
    vec![
        same("fourbar", read("mechanisms/fourbar"), 0.3),
        same("biped", read("biped"), 0.3),
        same("closed20", model("closed20.toml", &closed_chain(20)), 0.1),
        same("closed100", model("closed100.toml", &closed_chain(100)), 0.1),
        same("stewart", read("mechanisms/stewart"), 0.05),
        same("delta_rods", rods.clone(), 0.05),
        Mechanism { name: "delta", ours: delta, theirs: Some(rods), far: 0.05 },
    ]
}

/// A model without springs and dampers, which Pinocchio's algorithm does not have. Joint axes that point against a
/// coordinate axis are reversed, because Pinocchio has fast joints for coordinate axes only; the coordinates of these
/// joints change sign.
fn model(path: &str, text: &str) -> Model {
    let mut model = read::model(path, text, &ImportOptions::default()).unwrap_or_else(|findings| panic!("{findings}")).model;
    for (k, joint) in model.joints.iter_mut().enumerate() {
        joint.damping.fill(Value::ZERO);
        joint.stiffness.fill(Value::ZERO);
        if let JointKind::Revolute { axis } | JointKind::Prismatic { axis } = &mut joint.kind {
            if backwards(axis) {
                let start = model.starts.iter_mut().filter(|s| s.joint == k);
                start.for_each(|s| s.q.iter_mut().for_each(|q| *q = -*q));
            }
        }
    }
    for Constraint { kind, .. } in &mut model.constraints {
        if let ConstraintKind::Loop { kind: LoopKind::Revolute { axis }, .. } = kind {
            backwards(axis);
        }
    }
    model
}

/// Reverses an axis if it points against a coordinate axis. Returns whether it did.
fn backwards(axis: &mut [f64; 3]) -> bool {
    let found = axis.iter().filter(|x| **x != 0.0).count() == 1 && axis.iter().sum::<f64>() < 0.0;
    if found {
        *axis = axis.map(f64::abs);
    }
    found
}

/// Planar chain of equal slender links (thesis 7.2: 10 g, 50 mm) in an arc. A revolute joint connects its tip to the
/// ground at the tip's position at the start.
fn closed_chain(n: usize) -> String {
    let (mut text, mut tip, mut before) = (format!("name = \"closed{n}\"\ngravity = [0, -9.81, 0]\n"), [0.0; 2], 0.0);
    let across = 0.01 * 0.05 * 0.05 / 12.0;
    for k in 1..=n {
        let angle: f64 = 1.2 - 2.0 * (k as f64 - 0.5) / n as f64;
        let (parent, x) = if k > 1 { (format!("link{}", k - 1), 0.05) } else { ("ground".to_string(), 0.0) };
        let _ = write!(
            text,
            "
[[body]]
name = \"link{k}\"
mass = 0.01
com = [0.025, 0, 0]
inertia = [0, {across:?}, {across:?}]

[[joint]]
name = \"pin{k}\"
type = \"revolute\"
parent = \"{parent}\"
child = \"link{k}\"
xyz = [{x}, 0, 0]
axis = [0, 0, 1]
start = {:?}
",
            angle - before
        );
        before = angle;
        tip = [tip[0] + 0.05 * angle.cos(), tip[1] + 0.05 * angle.sin()];
    }
    let [x, y] = tip;
    let _ = write!(
        text,
        "
[[frame]]
name = \"tip\"
body = \"link{n}\"
xyz = [0.05, 0, 0]

[[frame]]
name = \"end\"
body = \"ground\"
xyz = [{x:?}, {y:?}, 0]

[[loop]]
name = \"closing\"
type = \"revolute\"
between = [\"tip\", \"end\"]
axis = [0, 0, 1]
"
    );
    text
}
