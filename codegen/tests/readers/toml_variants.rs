//! Variants of valid TOML models.

use mbd_codegen::model::{ConstraintKind, JointKind, JointMotion, Model};
use mbd_codegen::read::{self, ImportOptions, Reading};

const ALL: &str = include_str!("variants.toml");

fn read() -> Reading {
    let reading = read::model("m.toml", ALL, &ImportOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(reading.findings.0.is_empty(), "{}", reading.findings);
    reading
}

fn variant(name: &str) -> Model {
    read().into_variant(name).unwrap_or_else(|(message, help)| panic!("{message}: {help}"))
}

/// Names of the joints with their parents and kinds.
fn joints(model: &Model) -> Vec<String> {
    let parent = |parent: Option<usize>| parent.map_or("ground", |b| &model.bodies[b].name);
    let joint = |j: &mbd_codegen::model::Joint| format!("{} {} {}", j.name, j.kind.word(), parent(j.parent));
    model.joints.iter().map(joint).collect()
}

#[test]
fn the_file_is_the_model_without_its_variants() {
    let base = read().model;
    let (plain, _) = ALL.split_once("[[variant]]").expect("variants");
    // There the parameter of a variant is one that nothing uses.
    let (model, findings) = read::load("m.toml", plain, &ImportOptions::default());
    assert_eq!(model.as_ref(), Some(&base));
    assert!(findings.to_string().contains("`box_mass` is not used"), "{findings}");
    let names: Vec<String> = read().variants.into_iter().map(|v| v.name).collect();
    assert_eq!(names, ["dropped", "held", "regrasped", "loaded", "empty"]);
    assert_eq!(joints(&base), ["shoulder revolute ground", "elbow revolute upper", "grip fixed lower"]);
}

#[test]
fn a_cut_joint_floats_and_a_cut_loop_is_left_out() {
    let dropped = variant("dropped");
    assert_eq!(joints(&dropped), ["shoulder revolute ground", "elbow revolute upper", "grip floating ground"]);
    assert_eq!((dropped.constraints.len(), dropped.name.as_str()), (0, "gripper_dropped"));
    assert!(matches!(read().model.constraints[0].kind, ConstraintKind::Loop { .. }));
    // It is what the change of the model gives.
    let cut = read().model.cut("grip").expect("a cut");
    assert_eq!(
        cut.joints.iter().map(|j| j.kind).collect::<Vec<_>>(),
        dropped.joints.iter().map(|j| j.kind).collect::<Vec<_>>()
    );
}

#[test]
fn a_locked_joint_is_prescribed_without_what_acts_on_it() {
    let held = variant("held");
    let [base, locked] = [&read().model.joints[1], &held.joints[1]].map(Clone::clone);
    assert_eq!((base.motion, locked.motion), (JointMotion::Free, JointMotion::Prescribed));
    assert_eq!((base.kind, base.placement), (locked.kind, locked.placement));
    assert!(base.damping[0].constant() == Some(0.5) && locked.damping[0].constant() == Some(0.0));
    assert_eq!(held.starts.iter().filter(|s| s.joint == 1).count(), 0);
}

#[test]
fn joints_are_replaced_and_bodies_come_and_go() {
    let regrasped = variant("regrasped");
    assert_eq!(joints(&regrasped), ["shoulder revolute ground", "elbow revolute upper", "hinge revolute upper"]);
    assert_eq!(regrasped.joints[2].kind, JointKind::Revolute { axis: [0.0, 1.0, 0.0] });
    let loaded = variant("loaded");
    assert_eq!(joints(&loaded)[3], "tray fixed box");
    assert_eq!((loaded.bodies.len(), loaded.frames.len()), (4, 2));
    let empty = variant("empty");
    assert_eq!((joints(&empty).len(), empty.bodies.len(), empty.frames.len()), (2, 2, 1));
}

#[test]
fn a_file_gives_a_variant() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/readers/variants.toml");
    assert_eq!(Model::load_variant(path, "held").expect("a model").name, "gripper_held");
    let error = Model::load_variant(path, "hold").expect_err("no variant").to_string();
    assert!(error.contains("no variant `hold`") && error.contains("did you mean `held`?"), "{error}");
    let (model, findings) =
        read::load_variant("m.toml", ALL, &ImportOptions::default(), &|path| std::fs::read(path), Some("xyz"));
    assert!(model.is_none() && findings.to_string().contains("the variants are `dropped`"), "{findings}");
}
