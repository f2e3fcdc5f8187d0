//! From a model as read to a checked one: names, tree, physics. The same for every format.

mod bodies;
mod contacts;
mod couplings;
mod elementary;
mod joints;
mod loops;
mod massless;
mod merged;
mod names;
mod numbers;
mod overlaps;
mod pairs;
mod shapes;
mod starts;
mod stops;
mod tree;
mod variants;

use self::names::Names;
use self::numbers::{Numbers, Quantity};
pub(crate) use self::variants::changed;
use crate::import::raw::{RawConstraint, RawGravity, RawModel, RawNumber, RawValue};
use crate::import::source::{Findings, Span};
use crate::import::words::quote;

use crate::model::{Constraint, ConstraintKind, Frame, Gravity, Joint, JointMotion, Model, Param, Value, Wrench};

/// Checks `raw`; a model only where no error was found, neither here nor before. The model takes its name from the file
/// of the findings if it states none.
///
/// Joints come out depth first from the ground, the children of a body in file order; all else keeps the order of the
/// file.
pub fn check(raw: &RawModel, findings: &mut Findings) -> Option<Model> {
    let name = names::model_name(raw, findings);
    let names = Names::collect(raw, findings);
    let mut numbers = Numbers::new(raw, findings);
    let gravity = gravity(raw, &mut numbers);
    let bodies: Vec<_> = raw.bodies.iter().map(|b| bodies::body(b, &mut numbers)).collect();
    let joints: Vec<_> = raw.joints.iter().map(|j| joints::joint(j, &mut numbers)).collect();
    let leaders = joints::leaders(raw, &names, numbers.findings);
    let frames = frames(raw, &names, &mut numbers);
    let wrenches = wrenches(raw, &names, numbers.findings);
    let constraints = constraints(raw, &names, &frames, &mut numbers);
    let shapes = shapes::shapes(raw, &names, &mut numbers);
    let surfaces = contacts::Surfaces::new(raw, &mut numbers);
    let stops = stops::stops(raw, &mut numbers);
    let starts = starts::starts(raw, &mut numbers);
    let links = tree::links(raw, &names, numbers.findings);
    let order = tree::order(raw, &names, &links, numbers.findings);
    bodies::sizes(raw, &bodies, &joints, &mut numbers);
    let params: Vec<Param> = numbers.params();
    numbers.report_unused();
    let joints = order.as_ref().map(|order| assemble(joints, &links, &leaders, order, &inverse(order)));
    bodies::inertias(raw, &bodies, joints.as_deref().unwrap_or(&[]), &params, findings);
    // With a broken tree there is no model to go on with.
    let (order, joints) = order.zip(joints)?;
    let place = inverse(&order);
    loops::rigid(raw, &constraints, &joints, &bodies, findings);
    let constraints = constraints.into_iter().flatten().map(|c| placed(c, &place)).collect();
    let starts = starts::placed(starts, &place);
    stops::starts_between(raw, &order, &starts, findings);
    let mut contacts = contacts::between(raw, &shapes, &surfaces, &joints, &bodies, findings);
    contacts.extend(stops::placed(stops, &place));
    contacts::distinct(raw, &contacts, findings);
    let shapes = shapes.into_iter().flatten().collect();
    let mut model =
        Model { name, params, gravity, bodies, joints, frames, wrenches, constraints, shapes, contacts, starts };
    massless::leaves(raw, &order, &model, findings);
    moving(&model, findings);
    if cfg!(feature = "self_contact") {
        pairs::add(raw, &surfaces, &mut model, findings);
    }
    (!findings.has_errors()).then_some(model)
}

/// Final index of each joint of the file.
fn inverse(order: &[usize]) -> Vec<usize> {
    let mut place = vec![0; order.len()];
    for (k, &j) in order.iter().enumerate() {
        place[j] = k;
    }
    place
}

/// Puts the joints in their final order, with indices instead of names.
fn assemble(
    joints: Vec<Joint>,
    links: &[tree::Link],
    leaders: &[Option<usize>],
    order: &[usize],
    place: &[usize],
) -> Vec<Joint> {
    let finished = order.iter().map(|&j| {
        let mut joint = joints[j].clone();
        joint.parent = links[j].parent.unwrap_or(None);
        joint.child = links[j].child.unwrap_or(0);
        if let (JointMotion::Mimic { leader, .. }, Some(l)) = (&mut joint.motion, leaders[j]) {
            *leader = place[l];
        }
        joint
    });
    finished.collect()
}

fn gravity(raw: &RawModel, numbers: &mut Numbers) -> Gravity {
    match &raw.gravity {
        None => Gravity::Constant([Value::ZERO, Value::ZERO, Value::Const(-9.81)]),
        Some(RawGravity::Input) => Gravity::Input,
        Some(RawGravity::Constant(g)) => {
            let g_si = numbers.vec3(g, Quantity::Plain, "`gravity`");
            let largest = g_si.iter().filter_map(|v| v.constant()).fold(0.0, |a: f64, x| a.max(x.abs()));
            if largest > 100.0 {
                let message = format!("gravity of {largest} m/s² is ten times that of the Earth or more");
                numbers.findings.warning(g.span, message, "gravity is in m/s², not mm/s²: `[0, 0, -9.81]`");
            }
            Gravity::Constant(g_si)
        }
    }
}

fn frames(raw: &RawModel, names: &Names, numbers: &mut Numbers) -> Vec<Frame> {
    let one = |f: &crate::import::raw::RawFrame| {
        let what = format!("frame {}", quote(&f.name.value));
        let body = f.body.as_ref().and_then(|b| names.body(b, "", &what, numbers.findings)).unwrap_or(None);
        Frame { name: f.name.value.clone(), body, placement: numbers.placement(&f.placement, &what) }
    };
    raw.frames.iter().map(one).collect()
}

/// Loops and couplings, with joints by their index in the file; `None` for what was reported.
fn constraints(raw: &RawModel, names: &Names, frames: &[Frame], numbers: &mut Numbers) -> Vec<Option<Constraint>> {
    let one = |c: &RawConstraint| match c {
        RawConstraint::Loop(l) => loops::constraint(l, raw, names, frames, numbers),
        RawConstraint::Coupling(c) => couplings::constraint(c, raw, names, numbers),
    };
    raw.constraints.iter().map(one).collect()
}

/// Rate of decay, which only brakes.
fn decay(raw: Option<&RawNumber>, what: &str, numbers: &mut Numbers) -> Value {
    let decay = numbers.or_zero(raw, Quantity::Plain, &format!("{what}: `decay`"));
    if let (Some(at), true) = (raw, numbers.at_default(decay) < 0.0) {
        let help = "write how fast they decay, in 1/s: 0, or about a tenth of the number of steps in a second";
        numbers.findings.error(at.span, format!("{what}: with a negative `decay` errors of the positions grow"), help);
    }
    decay
}

/// With final joint indices.
fn placed(mut constraint: Constraint, place: &[usize]) -> Constraint {
    if let ConstraintKind::Coupling { terms, .. } = &mut constraint.kind {
        for (joint, _) in terms {
            *joint = place[*joint];
        }
    }
    constraint
}

fn wrenches(raw: &RawModel, names: &Names, findings: &mut Findings) -> Vec<Wrench> {
    let mut out = Vec::new();
    for w in &raw.wrenches {
        let name = w.name.as_ref().unwrap_or(&w.body).value.clone();
        match names.body(&w.body, "", &format!("wrench {}", quote(&name)), findings) {
            Some(Some(body)) => out.push(Wrench { name, body, axes: w.axes }),
            Some(None) => {
                let message = format!("wrench {} acts on the ground, which does not move", quote(&name));
                findings.error(w.body.span, message, "name the body it acts on, or remove it");
            }
            None => {}
        }
    }
    out
}

/// A mechanism without freedom is no error, but seldom meant.
fn moving(model: &Model, findings: &mut Findings) {
    // What is missing may be among what could not be read.
    if findings.has_errors() {
        return;
    }
    if model.bodies.is_empty() {
        findings.error(Span::FILE, "the model has no bodies", "add at least one body and the joint that carries it");
    } else if model.joints.iter().all(|j| j.kind.nv() == 0) {
        let help = "give at least one joint a type other than `fixed`; for a free body use a `floating` joint";
        findings.warning(Span::FILE, "nothing can move: every joint is fixed", help);
    }
}

/// Whether a number was left out or is the constant zero.
fn is_zero(value: Option<&RawValue>) -> bool {
    matches!(value, None | Some(RawValue::Const(0.0)))
}
