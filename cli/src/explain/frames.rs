//! The tree on which the sweeps run.

use std::io::Write;

use multibody::codegen::model::Value;
use multibody::codegen::plan::{Plan, PlanNode, PoseStep};
use multibody::runtime::spatial::Axis;
use multibody::runtime::tree::{Kind, Source};

use crate::Outcome;

/// Prints every node: its place, its joint, and the zeros of its inertia.
pub fn print(plan: &Plan, out: &mut dyn Write) -> Outcome {
    let d = plan.dims;
    writeln!(
        out,
        "{}: {} bodies and {} joints make {} nodes, nq {}, nv {}",
        plan.model.name,
        plan.model.bodies.len(),
        plan.model.joints.len(),
        plan.nodes.len(),
        d.nq,
        d.nv
    )?;
    writeln!(out, "A node is a joint and all bodies that move with it. Its frame turns about, or slides along, z.")?;
    writeln!(out, "Along the way to it stand turns Rx, Ry, Rz and displacements x, y, z in m, outermost first.")?;
    for (k, node) in plan.nodes.iter().enumerate() {
        writeln!(out)?;
        one(plan, k, node, out)?;
    }
    let turns = plan.nodes.iter().flat_map(|n| &n.place).filter(|s| matches!(s, PoseStep::Turn { .. }));
    let (right, all) = turns.fold((0, 0), |(r, a), s| (r + usize::from(is_right(s)), a + 1));
    let zeros = plan.nodes.iter().flat_map(|n| n.inertia).filter(|x| *x == 0.0).count();
    writeln!(
        out,
        "\nVanished: {right} of {all} constant turns are right angles; {zeros} of {} inertia numbers are zero.",
        10 * plan.nodes.len()
    )?;
    Ok(())
}

fn one(plan: &Plan, k: usize, node: &PlanNode, out: &mut dyn Write) -> Outcome {
    let joint = &plan.model.joints[node.joint.0];
    let parent = node.parent.map_or("the ground".to_string(), |p| format!("`{}`", plan.nodes[p].name));
    writeln!(out, "{k} `{}` on {parent}, by {} joint `{}`", node.name, joint.kind.word(), joint.name)?;
    let way: Vec<String> = node.place.iter().map(|s| step(plan, s)).collect();
    writeln!(out, "    way: {}", if way.is_empty() { "none".to_string() } else { way.join("  ") })?;
    writeln!(out, "    joint: {}", motion(plan, node))?;
    if node.elimination.deferred {
        writeln!(out, "    solved further inboard, in one block with other joints: fewer operations")?;
    } else if node.elimination.unknown.is_some() {
        writeln!(out, "    shares its coordinate with other joints: solved where all of them have met")?;
    }
    inertia(plan, node, out)
}

/// Description of a joint's motion by its coordinates.
fn motion(plan: &Plan, node: &PlanNode) -> String {
    let (letter, at) = match node.source {
        Source::State { q, .. } => ("q", q),
        Source::Drive { q, .. } => ("drive_q", q),
    };
    let mut coordinate = format!("{letter}[{at}]");
    for &(ratio, offset) in &node.follow {
        if ratio != Value::ONE {
            coordinate = format!("{} {coordinate}", value(plan, ratio));
        }
        if offset != Value::ZERO {
            coordinate = format!("({coordinate} + {})", value(plan, offset));
        }
    }
    let mut angle = coordinate.clone();
    if node.phase != 0.0 {
        let sign = if node.phase < 0.0 { '-' } else { '+' };
        angle += &format!(" {sign} {}", degrees(node.phase.abs()));
    }
    if node.quarter != 0 {
        angle += &format!(" + {}°", 90 * u32::from(node.quarter));
    }
    let slide = if node.slide == 0.0 { String::new() } else { format!(", then z {}", node.slide) };
    match node.kind {
        Kind::Revolute => format!("Rz({angle}){slide}"),
        Kind::Prismatic => {
            // The constant part of the angle comes from the placement.
            let turn = angle[coordinate.len()..].trim_start_matches(" + ");
            let turn = if turn.is_empty() { String::new() } else { format!(", Rz({})", turn.trim_start()) };
            format!("z {coordinate}{turn}{slide}")
        }
        Kind::Helical { pitch } => format!("Rz({angle}) with z {} per radian{slide}", value(plan, pitch)),
        Kind::Planar => format!("x {letter}[{at}], y {letter}[{}], Rz({letter}[{}])", at + 1, at + 2),
        Kind::Spherical => format!("turn by the quaternion {letter}[{at}..{}]", at + 4),
        Kind::Floating => {
            format!("displacement {letter}[{at}..{}], turn by the quaternion {letter}[{}..{}]", at + 3, at + 3, at + 7)
        }
    }
}

fn inertia(plan: &Plan, node: &PlanNode, out: &mut dyn Write) -> Outcome {
    const NAMES: [&str; 10] = ["m", "mx", "my", "mz", "xx", "xy", "xz", "yy", "yz", "zz"];
    let (zero, some): (Vec<_>, Vec<_>) = NAMES.iter().zip(node.inertia).partition(|(_, x)| *x == 0.0);
    let shown: Vec<String> = some.iter().map(|(n, x)| format!("{n} {x:.6}")).collect();
    let zero: Vec<&str> = zero.iter().map(|(n, _)| **n).collect();
    match shown.is_empty() {
        true => writeln!(out, "    inertia: none")?,
        false => writeln!(out, "    inertia: {}", shown.join(", "))?,
    }
    if !zero.is_empty() && !shown.is_empty() {
        writeln!(out, "    zero in it: {}", zero.join(", "))?;
    }
    if !node.variable.is_empty() {
        let names: Vec<&str> = node.variable.iter().map(|(b, _)| plan.model.bodies[*b].name.as_str()).collect();
        writeln!(out, "    with run-time parameters: {}", names.join(", "))?;
    }
    Ok(())
}

fn letter(axis: Axis) -> &'static str {
    match axis {
        Axis::X => "x",
        Axis::Y => "y",
        Axis::Z => "z",
    }
}

fn is_right(step: &PoseStep) -> bool {
    matches!(step, PoseStep::Turn { c, s, .. } if *c == 0.0 || *s == 0.0)
}

fn step(plan: &Plan, step: &PoseStep) -> String {
    match step {
        PoseStep::Turn { axis, c, s } => format!("R{}({})", letter(*axis), degrees(s.atan2(*c))),
        PoseStep::TurnBy { axis, angle } => format!("R{}({})", letter(*axis), value(plan, *angle)),
        PoseStep::Shift { axis, r } => format!("{} {}", letter(*axis), value(plan, *r)),
        PoseStep::Rotate(_) => "R(full matrix)".to_string(),
    }
}

fn value(plan: &Plan, value: Value) -> String {
    match value {
        Value::Const(x) if x != 0.0 && x.abs() < 1e-6 => format!("{x:e}"),
        Value::Const(x) => format!("{x}"),
        Value::Param(k) => format!("`{}`", plan.model.params[k].name),
    }
}

/// An angle in degrees, short where it is a round number.
fn degrees(angle: f64) -> String {
    let degrees = (angle.to_degrees() * 1e6).round() / 1e6;
    format!("{degrees}°")
}
