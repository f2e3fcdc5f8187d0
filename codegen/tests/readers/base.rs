//! Descriptions that change another one: `[base]`.

use std::io::{Error, ErrorKind};
use std::path::Path;

use mbd_codegen::diag::Severity;
use mbd_codegen::model::{JointKind, Model, Value};
use mbd_codegen::read::{load_with, to_toml, ImportOptions};

const ROBOT: &str = "<?xml version=\"1.0\"?>\n<robot name='arm'>\n<link name='base'/>\n<link name='upper'>\
<inertial><origin xyz='0 0 0.2'/><mass value='2'/><inertia ixx='0.02' iyy='0.02' izz='0.01' ixy='0' ixz='0' iyz='0'/>\
</inertial></link>\n<joint name='shoulder' type='continuous'><parent link='base'/><child link='upper'/>\
<axis xyz='0 1 0'/></joint>\n</robot>\n";

/// A ball whose contacts with a floor are those of all shapes.
const RUBS: &str = "name = 'rubs'\n[contacts]\npairs = 'all'\nfriction = 0.8\n[[body]]\nname = 'ball'\nmass = 1\n\
inertia = [1, 1, 1]\n[[joint]]\nname = 'free'\ntype = 'floating'\nchild = 'ball'\n[[shape]]\nname = 'floor'\n\
type = 'plane'\n[[shape]]\nname = 'round'\ntype = 'sphere'\nradius = 0.1\nbody = 'ball'\n";

/// Reads a text in the folder `robots`, where there are `arm.urdf` and `whole.toml`.
fn read(text: &str) -> (Option<Model>, String, Vec<Severity>) {
    let files = |path: &Path| match path.to_string_lossy().replace('\\', "/").as_str() {
        "robots/arm.urdf" => Ok(ROBOT.as_bytes().to_vec()),
        "robots/broken.urdf" => {
            Ok(ROBOT.replace("'0.02' ixy", "'-0.02' ixy").replace("mass value='2'", "mass value='x'").into_bytes())
        }
        "robots/rubs.toml" => Ok(RUBS.as_bytes().to_vec()),
        "robots/ball.xml" => {
            Ok(b"<mujoco><worldbody><body name='ball'><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"
                .to_vec())
        }
        "robots/nested.toml" => Ok(b"[base]\nfile = 'arm.urdf'\n".to_vec()),
        _ => Err(Error::new(ErrorKind::NotFound, "no such file")),
    };
    let (read, findings) = load_with("robots/changed.toml", text, &ImportOptions::default(), &files);
    let severities = findings.0.iter().map(|d| d.severity).collect();
    (read.map(|(model, _)| model), findings.to_string(), severities)
}

#[test]
fn a_base_is_changed_and_added_to() {
    let (plain, ..) = read("[base]\nfile = 'arm.urdf'\n");
    let (direct, _) =
        load_with("arm.urdf", ROBOT, &ImportOptions::default(), &|_| Err(Error::from(ErrorKind::NotFound)));
    assert_eq!(plain, direct.map(|(model, _)| model), "nothing is changed");

    let text = "[base]\nfile = 'arm.urdf'\nroot = 'floating'\n[params]\nload = 3\n\
        [[body]]\nname = 'upper'\nmass = { param = 'load' }\n\
        [[joint]]\nname = 'shoulder'\narmature = 0.1\ndamping = 0.5\nlimits = { deg = [-90, 90] }\n\
        [[body]]\nname = 'hand'\nmass = 0.5\ncom = [0, 0, 0.05]\n\
        [[joint]]\nname = 'wrist'\ntype = 'prismatic'\nparent = 'upper'\nchild = 'hand'\n\
        [[frame]]\nname = 'tip'\nbody = 'upper'\nxyz = [0, 0, 0.4]\n";
    let (model, findings, _) = read(text);
    let model = model.expect(&findings);
    assert_eq!(model.name, "arm");
    assert_eq!(model.joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>(), ["root_joint", "shoulder", "wrist"]);
    assert_eq!(model.joints[0].kind, JointKind::Floating);
    let shoulder = &model.joints[1];
    assert_eq!(shoulder.kind, JointKind::Revolute { axis: [0.0, 1.0, 0.0] });
    assert_eq!((shoulder.armature.as_slice(), shoulder.unbounded), (&[Value::Const(0.1)][..], true));
    let upper = model.bodies.iter().find(|b| b.name == "upper").expect("the body");
    assert_eq!((upper.mass, upper.com[2]), (Value::Param(0), Value::Const(0.2)));
    assert_eq!((model.frames.len(), model.contacts.len()), (1, 2));
}

/// What holds for all contacts is replaced where it is stated anew, and stays otherwise.
#[test]
fn what_holds_for_all_contacts_is_changed_where_it_is_stated() {
    let surface = |text: &str| {
        let (model, findings, _) = read(&format!("[base]\nfile = 'rubs.toml'\n{text}"));
        let model = model.expect(&findings);
        model.contacts.iter().map(|contact| (contact.friction, contact.restitution)).collect::<Vec<_>>()
    };
    assert_eq!(surface(""), [(0.8, 0.0)]);
    assert_eq!(surface("[contacts]\nrestitution = 0.1\n"), [(0.8, 0.1)]);
    assert_eq!(surface("[contacts]\nfriction = 0.2\n"), [(0.2, 0.0)]);
    assert_eq!(surface("[contacts]\npairs = 'listed'\n"), []);
}

#[test]
fn findings_name_the_file_they_are_about() {
    let (model, findings, _) = read("[base]\nfile = 'broken.urdf'\n[[frame]]\nname = 'tip'\nbody = 'uper'\n");
    assert!(model.is_none());
    for text in ["robots/changed.toml:5:8: error: frame `tip`", "robots/broken.urdf:4:6", "did you mean `upper`?"] {
        assert!(findings.contains(text), "{text}: {findings}");
    }
    for (text, expected) in [
        (
            "[base]\nfile = 'none.urdf'\n",
            "robots/changed.toml:2:8: error: cannot read the base `none.urdf`: no such file",
        ),
        ("[base]\nfile = 'arm.sdf'\n", "cannot read the base"),
        ("[base]\n", "`file`"),
        ("[base]\nfile = 'nested.toml'\n", "robots/nested.toml:1:1: error: the base of a model has a `[base]` itself"),
        ("[base]\nfile = 'arm.urdf'\nroot = 'flying'\n", "`root` cannot be `flying`"),
        (
            "[base]\nfile = 'rubs.toml'\nroot = 'floating'\n",
            "robots/changed.toml:3:1: error: `base`: `root` is for URDF files\n  \
             help: remove it: the joints to `ground` say how the model is attached in `rubs.toml`",
        ),
        (
            "[base]\nfile = 'ball.xml'\nroot = 'planar'\n",
            "robots/changed.toml:3:1: error: `base`: `root` is for URDF files\n  \
             help: remove it: the joints of the bodies say how the model is attached in `ball.xml`",
        ),
        (
            "[base]\nfile = 'rubs.toml'\nlimits = true\n",
            "robots/changed.toml:3:1: error: `base`: `limits` is for URDF and MJCF files\n  \
             help: remove it: the `limits` of joints are stops already in `rubs.toml`",
        ),
    ] {
        let (model, findings, severities) = read(text);
        assert!(model.is_none() && severities.contains(&Severity::Error), "{text}: {findings}");
        assert!(findings.contains(expected), "{expected}: {findings}");
        assert!(!findings.contains("option"), "no option was given: {findings}");
    }
    // Keys that say what is so anyway.
    for text in [
        "[base]\nfile = 'rubs.toml'\nroot = 'fixed'\nlimits = false\n",
        "[base]\nfile = 'ball.xml'\nroot = 'fixed'\nlimits = true\n",
    ] {
        let (model, findings, _) = read(text);
        assert!(model.is_some(), "{text}: {findings}");
    }
}

/// A name that the base does not have is told as that, once, and not by all that a new joint or body lacks.
#[test]
fn names_that_the_base_does_not_have_are_told() {
    for (text, expected) in [
        (
            "[[joint]]\nname = 'sholder'\ndamping = 1\n",
            "robots/changed.toml:4:8: error: joint `sholder`: no joint of the base has this name\n  \
             help: did you mean `shoulder`? a new joint needs `type` and `child`",
        ),
        (
            "[[joint]]\nname = 'wrist'\ntype = 'fixed'\n",
            "robots/changed.toml:4:8: error: joint `wrist`: no joint of the base has this name\n  \
             help: the joints of the base are `root_joint` and `shoulder`; a new joint needs `type` and `child`",
        ),
        (
            "[[body]]\nname = 'uper'\nmass = 1\n",
            "robots/changed.toml:4:8: error: body `uper`: no body of the base has this name\n  \
             help: did you mean `upper`? a new body needs a joint whose `child` it is",
        ),
        (
            "[[body]]\nname = 'hand'\nmass = 1\n",
            "robots/changed.toml:4:8: error: body `hand`: no body of the base has this name\n  \
             help: the bodies of the base are `base` and `upper`; a new body needs a joint whose `child` it is",
        ),
    ] {
        let (model, findings, _) = read(&format!("[base]\nfile = 'arm.urdf'\n{text}"));
        assert!(model.is_none() && findings.contains(expected), "{text}: {findings}");
        assert_eq!(findings.matches(": error: ").count(), 1, "{text}: {findings}");
    }
    // A joint that is named twice is no misspelt one.
    let twice = "[[joint]]\nname = 'shoulder'\ndamping = 1\n";
    let (model, findings, _) = read(&format!("[base]\nfile = 'arm.urdf'\n{twice}{twice}"));
    assert!(model.is_none() && !findings.contains("no joint of the base"), "{findings}");
}

#[test]
fn a_changed_robot_is_converted_whole() {
    let files = |_: &Path| Ok(ROBOT.as_bytes().to_vec());
    let text = "[base]\nfile = 'arm.urdf'\n[[joint]]\nname = 'shoulder'\narmature = 0.1\n";
    let (toml, _) = to_toml("changed.toml", text, &ImportOptions::default(), &files).expect("a sound model");
    assert!(toml.contains("armature = 0.1") && !toml.contains("[base]"), "{toml}");
}
