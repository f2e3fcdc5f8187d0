//! Real robots, read by this crate and by `urdf-rs`, must have the same numbers. Both convert decimal text to the
//! nearest `f64`, so the comparison is exact.

use mbd_codegen::model::{Body, Joint, JointKind, JointMotion, Model, Placement, Rotation, Value};
use mbd_codegen::read::{self, Base, ImportOptions};
use std::path::{Path, PathBuf};
use urdf_rs::JointType;

/// Folders with robots, relative to this crate. The environment variable `URDF_ROBOTS` can name further folders,
/// separated as in `PATH`; they are searched with their subfolders.
const FOLDERS: [&str; 2] = ["../models", "../tests/reference/robots"];

#[test]
fn real_robots_are_read_as_urdf_rs_reads_them() {
    let mut files = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/broken/urdf/unused.urdf")];
    FOLDERS.iter().for_each(|f| collect(&Path::new(env!("CARGO_MANIFEST_DIR")).join(f), &mut files));
    let more = std::env::var_os("URDF_ROBOTS").unwrap_or_default();
    std::env::split_paths(&more).for_each(|f| collect(&f, &mut files));
    files.sort();
    let (mut compared, mut refused) = (0, Vec::new());
    for path in &files {
        let text = std::fs::read_to_string(path).expect("a readable file");
        let name = path.to_string_lossy();
        let (model, findings) = read::load(&name, &text, &ImportOptions { base: Base::Floating, ..Default::default() });
        match (model, urdf_rs::read_from_string(&text)) {
            (Some(model), Ok(robot)) => {
                compare(&name, &model, &robot);
                compared += 1;
            }
            (None, _) => refused.push(format!("refused here: {findings}")),
            (_, Err(error)) => refused.push(format!("refused by urdf-rs: {name}: {error}")),
        }
    }
    println!("{compared} of {} robots compared", files.len());
    // Robots of other folders may be broken, but not those of this project.
    refused.iter().for_each(|r| println!("{r}"));
    assert!(refused.is_empty() || !more.is_empty(), "robots of this project are refused");
    assert_eq!(compared, 14, "a robot was lost");
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|e| e == "urdf") {
            files.push(path);
        }
    }
}

fn compare(file: &str, model: &Model, robot: &urdf_rs::Robot) {
    assert_eq!(model.bodies.len(), robot.links.len(), "{file}");
    assert_eq!(model.joints.len(), robot.joints.len() + 1, "{file}: the base joint is an additional joint");
    for (body, link) in model.bodies.iter().zip(&robot.links) {
        compare_body(&format!("{file}: link {}", link.name), body, link);
    }
    for joint in &robot.joints {
        let ours = model.joints.iter().find(|j| j.name == joint.name);
        compare_joint(&format!("{file}: joint {}", joint.name), ours.expect("the joint of that name"), joint, model);
    }
}

fn compare_body(what: &str, body: &Body, link: &urdf_rs::Link) {
    assert_eq!(body.name, renamed(&link.name));
    let i = &link.inertial.inertia;
    assert_eq!(body.mass, Value::Const(link.inertial.mass.value), "{what}");
    assert_eq!(body.inertia, [i.ixx, i.iyy, i.izz, i.ixy, i.ixz, i.iyz].map(Value::Const), "{what}");
    compare_pose(what, &Placement { xyz: body.com, rotation: body.inertia_axes }, &link.inertial.origin);
}

/// The name that the reader gives a link: `ground` is reserved for the fixed world of a model.
fn renamed(link: &str) -> &str {
    if link == "ground" {
        "ground_link"
    } else {
        link
    }
}

fn compare_pose(what: &str, ours: &Placement, pose: &urdf_rs::Pose) {
    assert_eq!(ours.xyz, pose.xyz.0.map(Value::Const), "{what}");
    assert_eq!(ours.rotation, Rotation::Rpy(pose.rpy.0.map(Value::Const)), "{what}");
}

fn compare_joint(what: &str, ours: &Joint, joint: &urdf_rs::Joint, model: &Model) {
    let axis = joint.axis.xyz.0;
    let kind = match joint.joint_type {
        JointType::Revolute | JointType::Continuous => JointKind::Revolute { axis },
        JointType::Prismatic => JointKind::Prismatic { axis },
        JointType::Planar => JointKind::Planar { normal: axis },
        JointType::Floating => JointKind::Floating,
        JointType::Spherical => JointKind::Spherical,
        JointType::Fixed => JointKind::Fixed,
    };
    assert_eq!(ours.kind, kind, "{what}");
    compare_pose(what, &ours.placement, &joint.origin);
    let parent = ours.parent.map(|b| model.bodies[b].name.as_str());
    assert_eq!(parent, Some(renamed(&joint.parent.link)), "{what}");
    assert_eq!(model.bodies[ours.child].name, renamed(&joint.child.link), "{what}");
    // For joints with more than one freedom URDF does not define damping, and this reader warns.
    let damping = joint.dynamics.as_ref().map_or(0.0, |d| d.damping);
    if kind.nv() == 1 {
        assert_eq!(ours.damping, [Value::Const(damping)], "{what}");
    }
    let motion = match &joint.mimic {
        Some(mimic) if kind.nv() == 1 => JointMotion::Mimic {
            leader: model.joints.iter().position(|j| j.name == mimic.joint).expect("the leader"),
            ratio: Value::Const(mimic.multiplier.unwrap_or(1.0)),
            offset: Value::Const(mimic.offset.unwrap_or(0.0)),
        },
        _ => JointMotion::Free,
    };
    assert_eq!(ours.motion, motion, "{what}");
}
