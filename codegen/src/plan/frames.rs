//! Choice of the node frames.
//!
//! The frame of a revolute joint may be rotated about its axis and displaced along it. Both are chosen so that the
//! transform to the next joint (the one with the largest subtree) is a screw along x alone, `X(α, a)`, in the manner of
//! Denavit, Hartenberg and Khalil. Constants vanish, and the rest of the rotation is added to the joint angle.

use mbd_runtime::spatial::Vec3;
use mbd_runtime::tree::{Elimination, Kind, Source};

use super::elements::{Carried, Elements};
use super::instantiate::body_inertia;
use super::placement::constant;
use super::rigid::{all_steps, screws, Rigid, Screws, ROUND_OFF};
use super::structure::{PlanFrame, PlanNode, PoseStep, Slot};
use crate::model::{JointMotion, Model, Value};
use crate::rounded_once::{atan2, hypot};

/// Nodes with their frames chosen.
pub struct Framed {
    /// Nodes.
    pub nodes: Vec<PlanNode>,
    /// Named frames.
    pub frames: Vec<PlanFrame>,
    /// Last node of each moving joint.
    pub joint_nodes: Vec<usize>,
    /// Frames of the loops, two for each.
    pub mounts: Vec<Option<[PlanFrame; 2]>>,
}

/// Chooses frames and expresses every body in them.
pub fn choose(model: &Model, elements: &Elements, slots: &[Slot], mounts: &[Option<[Carried; 2]>]) -> Framed {
    let primary = primary_children(elements);
    let bodies = bodies_of_elements(elements);
    let mut nodes: Vec<PlanNode> = Vec::new();
    // Element frame in the node frame.
    let mut inside: Vec<Rigid> = Vec::new();
    for (k, element) in elements.list.iter().enumerate() {
        let align = element.axis.map_or(Rigid::IDENTITY, Rigid::align_z);
        let mut pose: Vec<PoseStep> = element.parent.map_or(Vec::new(), |p| all_steps(&inside[p]));
        pose.extend(&element.pose);
        pose.push(PoseStep::Rotate(align.rot));
        let way = factored(&pose);
        let line = primary[k].and_then(|c| line_of(elements, c, &align));
        let turns = element.kind.nv() == 1;
        let ((c, s), h) = match (turns, primary[k]) {
            (false, _) => ((1.0, 0.0), 0.0),
            (true, None) => tip(&way, element.kind, centre(model, elements, &bodies[k], &align)),
            (true, Some(_)) => freedom(&way, line),
        };
        inside.push(Rigid::screw_z(c, s, h).inverse().then(&align.inverse()));
        nodes.push(node(model, elements, slots, k, way, (c, s), h));
    }
    add_inertias(model, elements, &inside, &mut nodes);
    let mut last = vec![None; model.joints.len()];
    (0..nodes.len()).filter(|&k| elements.list[k].last).for_each(|k| last[elements.list[k].joint.0] = Some(k));
    let joint_nodes: Vec<usize> = last.into_iter().flatten().collect();
    let frames = named_frames(model, elements, &inside, &joint_nodes);
    let mounts = mounts.iter().map(|m| m.as_ref().map(|m| m.each_ref().map(|c| carried_frame("", c, &inside))));
    let mounts = mounts.collect();
    Framed { nodes, frames, joint_nodes, mounts }
}

/// The child of every element that has the largest subtree, the first one among equals.
fn primary_children(elements: &Elements) -> Vec<Option<usize>> {
    let mut weights = vec![1; elements.list.len()];
    let mut primary: Vec<Option<usize>> = vec![None; elements.list.len()];
    for k in (0..weights.len()).rev() {
        if let Some(p) = elements.list[k].parent {
            weights[p] += weights[k];
            if primary[p].is_none_or(|other| weights[k] >= weights[other]) {
                primary[p] = Some(k);
            }
        }
    }
    primary
}

/// The bodies that every element carries.
fn bodies_of_elements(elements: &Elements) -> Vec<Vec<usize>> {
    let mut bodies = vec![Vec::new(); elements.list.len()];
    for (b, (element, _)) in elements.bodies.iter().enumerate() {
        if let Some(k) = element {
            bodies[*k].push(b);
        }
    }
    bodies
}

/// Transform to the axis of an element: constants are factored into screws, parameters are left unchanged.
fn factored(pose: &[PoseStep]) -> Screws {
    let lengths = |pose: &[PoseStep]| {
        let shifts = pose.iter().map(|step| if let PoseStep::Shift { r, .. } = step { r.constant() } else { None });
        shifts.flatten().fold(0.0, |sum, r| sum + r.abs())
    };
    if let Some(t) = constant(pose) {
        return screws(&t, lengths(pose));
    }
    // Each constant part between parameters is factored separately.
    let mut steps = Vec::new();
    let mut stretch: Vec<PoseStep> = Vec::new();
    for step in pose {
        if constant(&[*step]).is_some() {
            stretch.push(*step);
            continue;
        }
        steps.extend(constant(&stretch).iter().flat_map(all_steps));
        stretch.clear();
        steps.push(*step);
    }
    let rest = screws(&constant(&stretch).unwrap_or(Rigid::IDENTITY), lengths(&stretch));
    steps.extend(rest.steps);
    Screws { steps, turn: rest.turn, slide: rest.slide }
}

/// Point on, and direction of, the axis of element `c` in the aligned frame of its parent.
fn line_of(elements: &Elements, c: usize, align: &Rigid) -> Option<(Vec3<f64>, Option<Vec3<f64>>)> {
    let child = &elements.list[c];
    let pose = align.inverse().then(&constant(&child.pose)?);
    Some((pose.pos, child.axis.map(|a| pose.turn(a))))
}

type Turn = (f64, f64);

/// First moment of some bodies of an element in its aligned frame, if it is constant.
fn centre(model: &Model, elements: &Elements, bodies: &[usize], align: &Rigid) -> Option<Vec3<f64>> {
    let mut sum = [0.0; 3];
    for &b in bodies {
        let body = &model.bodies[b];
        let pose = align.inverse().then(&constant(&elements.bodies[b].1)?);
        let (mass, com) = (body.mass.constant()?, [body.com[0], body.com[1], body.com[2]]);
        let com = [com[0].constant()?, com[1].constant()?, com[2].constant()?];
        let at = pose.turn(com);
        for (sum, (at, pos)) in sum.iter_mut().zip(at.iter().zip(pose.pos)) {
            *sum += mass * (at + pos);
        }
    }
    Some(sum)
}

/// At a tip, the rotation either makes the joint angle the coordinate itself, or points x at the centre of mass. One
/// more zero in the first moment is worth the addition to the angle.
fn tip(way: &Screws, kind: Kind<Value>, centre: Option<Vec3<f64>>) -> (Turn, f64) {
    let (c, s) = way.turn;
    let undo = (c, -s);
    let turn = match centre {
        Some([x, y, _]) if kind == Kind::Revolute && hypot(x, y) > 0.0 => {
            let ahead = unit(x, y);
            // Against the parent's axes: already zero there?
            let y = c * y + s * x;
            let aligned = y.abs() <= ROUND_OFF * hypot(x, y);
            if aligned {
                undo
            } else {
                ahead
            }
        }
        _ => undo,
    };
    (turn, -way.slide)
}

/// A direction across the axis. Both signs are possible; the one closer to the present frame is chosen.
fn unit(x: f64, y: f64) -> Turn {
    let n = hypot(x, y);
    let snap = |x: f64| if (x / n).abs() < ROUND_OFF { 0.0 } else { x / n };
    let (x, y) = (snap(x), snap(y));
    if x < 0.0 || (x == 0.0 && y < 0.0) {
        (-x, -y)
    } else {
        (x, y)
    }
}

/// Rotation about and displacement along a joint's own axis that make the transform to the next axis simple.
fn freedom(way: &Screws, line: Option<(Vec3<f64>, Option<Vec3<f64>>)>) -> (Turn, f64) {
    let (c, s) = way.turn;
    let undo = ((c, -s), -way.slide);
    let Some((point, axis)) = line else { return ((1.0, 0.0), 0.0) };
    let size = point.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let Some([ux, uy, uz]) = axis else {
        let off = hypot(point[0], point[1]) > ROUND_OFF * size;
        return (if off { unit(point[0], point[1]) } else { undo.0 }, point[2]);
    };
    let sine = hypot(ux, uy);
    if sine < ROUND_OFF {
        let off = hypot(point[0], point[1]) > ROUND_OFF * size;
        return (if off { unit(point[0], point[1]) } else { undo.0 }, undo.1);
    }
    let along = point[0] * ux + point[1] * uy + point[2] * uz;
    let h = (point[2] - along * uz) / (sine * sine);
    if sine < 1e-6 || h.abs() > 20.0 * size {
        // The axes are nearly parallel: their common normal is too far away to be useful, but its direction is useful.
        return (unit(-uy, ux), point[2]);
    }
    (unit(-uy, ux), if h.abs() <= ROUND_OFF * size { 0.0 } else { h })
}

fn node(model: &Model, elements: &Elements, slots: &[Slot], k: usize, way: Screws, (c, s): Turn, h: f64) -> PlanNode {
    let element = &elements.list[k];
    let (joint, first) = element.joint;
    let description = &model.joints[joint];
    let name = match element.last {
        true => model.bodies[description.child].name.clone(),
        false => description.name.clone(),
    };
    let (source, follow) = source(model, slots, joint, first);
    let mut place = way.steps;
    let (phase, quarter, slide) = match element.kind.nv() {
        1 => {
            let (c0, s0) = way.turn;
            let angle = atan2(s0 * c + c0 * s, c0 * c - s0 * s);
            let quarters = (angle / std::f64::consts::FRAC_PI_2).round();
            let rest = angle - quarters * std::f64::consts::FRAC_PI_2;
            let slide = way.slide + h;
            let size = way.slide.abs().max(h.abs());
            let slide = if slide.abs() <= ROUND_OFF * size { 0.0 } else { slide };
            match rest.abs() < ROUND_OFF {
                true => (0.0, (quarters as i64).rem_euclid(4) as u8, slide),
                false => (angle, 0, slide),
            }
        }
        _ => {
            let last = Rigid::screw_z(way.turn.0, way.turn.1, way.slide);
            place.extend(all_steps(&last));
            (0.0, 0, 0.0)
        }
    };
    PlanNode {
        name,
        parent: element.parent,
        place,
        kind: element.kind,
        joint: element.joint,
        source,
        follow,
        phase,
        quarter,
        slide,
        inertia: [0.0; 10],
        variable: Vec::new(),
        elimination: Elimination::default(),
        rolled: false,
    }
}

/// Coordinates of a joint's freedom; those of a mimic joint are the coordinates of the joint at the end of its chain of
/// leaders.
fn source(model: &Model, slots: &[Slot], joint: usize, first: usize) -> (Source, Vec<(Value, Value)>) {
    let mut follow = Vec::new();
    let mut at = joint;
    while let JointMotion::Mimic { leader, ratio, offset } = model.joints[at].motion {
        follow.insert(0, (ratio, offset));
        at = leader;
    }
    let source = match Slot::of_joint(slots, at).and_then(|s| s.at) {
        Some(Source::State { q, v }) => Source::State { q: q + first, v: v + first },
        Some(Source::Drive { q, v }) => Source::Drive { q: q + first, v: v + first },
        None => unreachable!("a checked model's mimic chains end at a joint with coordinates"),
    };
    (source, follow)
}

/// Inertia of every body at its node.
fn add_inertias(model: &Model, elements: &Elements, inside: &[Rigid], nodes: &mut [PlanNode]) {
    for (b, body) in model.bodies.iter().enumerate() {
        let (Some(k), pose) = &elements.bodies[b] else { continue };
        let mut steps = all_steps_exact(&inside[*k]);
        steps.extend(pose);
        let numbers = body.com.iter().chain(&body.inertia).chain([&body.mass]);
        let constants = numbers.map(|v| v.constant()).collect::<Option<Vec<f64>>>();
        match (constants, constant(&steps), constant(&elements.inertia_axes[b])) {
            (Some(x), Some(pose), Some(axes)) => {
                let inertia: [f64; 6] = std::array::from_fn(|i| x[3 + i]);
                let body = body_inertia(x[9], [x[0], x[1], x[2]], inertia, &axes.rot, &pose.rot, pose.pos);
                let sum = &mut nodes[*k].inertia;
                sum[0] += body.mass;
                for (i, x) in body.moment.iter().chain(&body.inertia).enumerate() {
                    sum[1 + i] += x;
                }
            }
            _ => nodes[*k].variable.push((b, steps)),
        }
    }
    for node in nodes {
        clean_inertia(&mut node.inertia);
    }
}

/// Restores zeros that rotations have changed to round-off.
fn clean_inertia(x: &mut [f64; 10]) {
    for range in [1..4, 4..10] {
        let size = x[range.clone()].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for x in &mut x[range] {
            if x.abs() < ROUND_OFF * size {
                *x = 0.0;
            }
        }
    }
}

fn all_steps_exact(t: &Rigid) -> Vec<PoseStep> {
    use mbd_runtime::spatial::Axis;
    let shifts = [Axis::X, Axis::Y, Axis::Z].into_iter().zip(t.pos);
    let mut steps: Vec<PoseStep> =
        shifts.filter(|(_, r)| *r != 0.0).map(|(axis, r)| PoseStep::Shift { axis, r: Value::Const(r) }).collect();
    if t.rot != Rigid::IDENTITY.rot {
        steps.push(PoseStep::Rotate(t.rot));
    }
    steps
}

/// A frame on an element in the node's frame.
fn carried_frame(name: &str, (node, pose): &Carried, inside: &[Rigid]) -> PlanFrame {
    let mut steps = node.map_or(Vec::new(), |k| all_steps_exact(&inside[k]));
    steps.extend(pose);
    if let Some(t) = constant(&steps) {
        steps = all_steps_exact(&t);
    }
    PlanFrame { name: name.to_string(), node: *node, pose: steps }
}

/// Frames of the joints' children first, then all other bodies, then the model's frames.
fn named_frames(model: &Model, elements: &Elements, inside: &[Rigid], joint_nodes: &[usize]) -> Vec<PlanFrame> {
    let frame = |name: &str, carried: &Carried| carried_frame(name, carried, inside);
    let children: Vec<usize> = joint_nodes.iter().map(|&k| model.joints[elements.list[k].joint.0].child).collect();
    let mut carried = vec![false; model.bodies.len()];
    children.iter().for_each(|&b| carried[b] = true);
    let others = (0..model.bodies.len()).filter(|b| !carried[*b]);
    let bodies = children.iter().copied().chain(others).map(|b| frame(&model.bodies[b].name, &elements.bodies[b]));
    let named = model.frames.iter().zip(&elements.frames).map(|(f, carried)| frame(&f.name, carried));
    bodies.chain(named).collect()
}
