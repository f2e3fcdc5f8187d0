//! Every feature occurs often among the random trees of the other tests.

use std::collections::BTreeMap;

use mbd_codegen::model::{Gravity, Joint, JointKind, JointMotion, Model, Rotation, Value, WrenchAxes};
use mbd_testing::random::{random_model, Distribution};

/// The joints on the path from a joint to the ground; the joint itself comes first.
fn path<'m>(model: &'m Model, joint: &'m Joint) -> Vec<&'m Joint> {
    let above = |j: &&'m Joint| j.parent.and_then(|p| model.joints.iter().find(|j| j.child == p));
    std::iter::successors(Some(joint), above).collect()
}

/// The places of a mimic joint and its leader in the tree, relative to each other.
fn position(model: &Model, a: &Joint, b: &Joint) -> &'static str {
    let (a_path, b_path) = (path(model, a), path(model, b));
    if a_path.contains(&b) || b_path.contains(&a) {
        "mimic on one path"
    } else if a_path.last() == b_path.last() {
        "mimic across branches"
    } else {
        "mimic across roots"
    }
}

/// Features of a model, each once.
fn features(model: &Model) -> Vec<&'static str> {
    let mut found = vec![match model.gravity {
        Gravity::Input => "gravity given",
        Gravity::Constant(g) if g == [Value::ZERO; 3] => "no gravity",
        Gravity::Constant(_) => "gravity",
    }];
    let mut note = |yes: bool, what: &'static str| found.extend(yes.then_some(what));
    let is_param = |v: &Value| v.constant().is_none();
    let turned = |r: &Rotation| match r {
        Rotation::Rpy(rpy) => rpy.iter().any(is_param),
        Rotation::AxisAngle { angle, .. } => is_param(angle),
    };
    for joint in &model.joints {
        note(true, joint.kind.word());
        note(joint.motion == JointMotion::Prescribed && joint.kind.nq() > 1, "prescribed, several coordinates");
        note(joint.motion == JointMotion::Prescribed && joint.kind.nq() == 1, "prescribed");
        note(joint.placement.xyz.iter().any(is_param), "parameter in a displacement");
        note(turned(&joint.placement.rotation), "parameter in an angle");
        note(joint.damping.iter().any(is_param), "parameter in damping");
        note(joint.stiffness.iter().any(|k| *k != Value::ZERO), "spring");
        note(joint.armature.iter().any(|k| *k != Value::ZERO) && joint.kind.nv() > 1, "armature on several freedoms");
        note(matches!(joint.kind, JointKind::Helical { pitch: Value::Param(_), .. }), "parameter in a pitch");
        if let JointMotion::Mimic { leader, ratio, offset } = joint.motion {
            let leader = &model.joints[leader];
            note(true, "mimic");
            note(matches!(leader.motion, JointMotion::Mimic { .. }), "mimic of a mimic");
            note(true, position(model, joint, leader));
            let (a, b) = (path(model, joint), path(model, leader));
            let between = a.iter().filter(|j| !b.contains(j)).chain(b.iter().filter(|j| !a.contains(j)));
            let others = between.filter(|j| **j != joint && **j != leader);
            let others: Vec<_> = others.filter(|j| j.kind != JointKind::Fixed).collect();
            note(others.iter().any(|j| j.motion == JointMotion::Free), "mimic around another joint");
            note(others.iter().any(|j| matches!(j.motion, JointMotion::Mimic { .. })), "mimic around another mimic");
            note(leader.motion == JointMotion::Prescribed, "mimic of a drive");
            note(is_param(&ratio) || is_param(&offset), "parameter in a mimic");
        }
    }
    for body in &model.bodies {
        note(body.mass == Value::ZERO, "massless body");
        note(body.mass != Value::ZERO && body.inertia == [Value::ZERO; 6], "point mass");
        note(is_param(&body.mass), "parameter in a mass");
        note(body.com.iter().any(is_param), "parameter in a mass centre");
        note(body.inertia.iter().any(is_param), "parameter in an inertia");
        note(body.inertia_axes != Rotation::NONE, "own axes of inertia");
    }
    note(model.joints.iter().filter(|j| j.parent.is_none()).count() > 1, "several roots");
    note(model.wrenches.iter().any(|w| w.axes == WrenchAxes::Body), "wrench in body axes");
    note(model.wrenches.iter().any(|w| w.axes == WrenchAxes::World), "wrench in ground axes");
    note(!model.frames.is_empty(), "named frame");
    found.sort_unstable();
    found.dedup();
    found
}

#[test]
fn every_feature_is_among_the_trees() {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for seed in 0..1000 {
        // The sizes of `bitwise.rs`.
        let size = [2, 3, 4, 5, 6, 8, 12][(seed % 7) as usize];
        let model = random_model(seed, &Distribution::everything(seed, size));
        for feature in features(&model) {
            *counts.entry(feature).or_default() += 1;
        }
    }
    for (feature, count) in &counts {
        println!("{feature}: {count}");
        assert!(*count >= 15, "{feature}: in {count} trees only");
    }
    assert_eq!(counts.len(), 39, "{:?}", counts.keys());
}
