//! Shapes, contacts and stops of valid TOML models.

use mbd_codegen::model::{ConstraintKind, LoopKind, Model, Value};
use mbd_codegen::read;
use mbd_runtime::contact::RestitutionLaw;

const ALL: &str = include_str!("contacts.toml");

fn clean(text: &str) -> Model {
    let (model, findings) = read::load("m.toml", text, &Default::default());
    assert!(findings.0.is_empty(), "{findings}");
    model.expect("a model where nothing was found")
}

#[test]
fn pairs_become_contacts_in_file_order_and_stops_follow() {
    let names: Vec<String> = clean(ALL).contacts.into_iter().map(|c| c.name).collect();
    let listed = "foot rod/1 rod/2 wheel can/1 can/2";
    let pairs = (1..=8).map(|k| format!("floor/crate/{k}"));
    let wanted: Vec<String> = listed.split(' ').map(String::from).chain(pairs).collect();
    assert_eq!(names[..14], wanted[..]);
    assert_eq!(names[14..], ["elbow/lower", "elbow/upper", "slide/upper"]);
}

/// The plane is the first frame, whichever shape is named first.
#[test]
fn planes_come_first() {
    let swapped = ALL.replace("[\"sole\", \"floor\"]", "[\"floor\", \"sole\"]");
    assert_ne!(swapped, ALL);
    assert_eq!(clean(&swapped), clean(ALL));
    let m = clean(ALL);
    let ConstraintKind::Loop { kind, first, second } = &m.contacts[0].kind else { panic!("no loop") };
    assert_eq!(*kind, LoopKind::RollingBall { normal: [0.0, 0.0, 1.0], radius: Value::Const(0.02) });
    assert_eq!((first.body, second.body), (None, Some(1)));
    assert_eq!(second.placement.xyz, [Value::ZERO, Value::ZERO, Value::Const(-0.2)]);
    assert_eq!(m.contacts[0].shapes, Some([0, 1]));
    assert_eq!((m.contacts[0].friction, m.contacts[0].restitution), (0.8, 0.25));
    assert_eq!((m.contacts[0].law, m.contacts[1].law), (RestitutionLaw::Stronge, RestitutionLaw::Poisson));
    assert_eq!((m.contacts[1].friction, m.contacts[1].restitution), (0.5, 0.25));
}

/// Gaps q - lower and upper - q.
#[test]
fn stops_are_couplings_of_one_joint() {
    let m = clean(ALL);
    let stop = |name: &str| m.contacts.iter().find(|c| c.name == name).map(|c| (c.kind.clone(), c.restitution));
    let coupling = |joint, ratio: f64, offset: f64| {
        let terms = vec![(joint, Value::Const(ratio))];
        ConstraintKind::Coupling { terms, offset: Value::Const(offset) }
    };
    assert_eq!(stop("elbow/lower"), Some((coupling(1, 1.0, -1.0), 0.1)));
    assert_eq!(stop("elbow/upper"), Some((coupling(1, -1.0, -90f64.to_radians()), 0.1)));
    assert_eq!(stop("slide/upper"), Some((coupling(2, -1.0, -0.3), 0.0)));
}
