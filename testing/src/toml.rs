//! A writer of the TOML format. It prints failing cases and tests the reader.

mod constraints;
mod contacts;

use std::fmt::Write;

use mbd_codegen::model::{
    Coordinate, Gravity, Joint, JointKind, JointMotion, Model, Placement, Rotation, Unit, Value, WrenchAxes,
};

/// Order in which joints are written; the reader sorts them depth first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The order of the model.
    DepthFirst,
    /// Breadth first: all joints of one depth, then those of the next.
    BreadthFirst,
}

/// The model as TOML, with joints and bodies in the model's order.
pub fn to_toml(model: &Model) -> String {
    to_toml_in(model, Order::DepthFirst)
}

/// The model as TOML.
pub fn to_toml_in(model: &Model, order: Order) -> String {
    let mut out = String::new();
    line(&mut out, "name", quoted(&model.name));
    let w = Writer { model };
    line(
        &mut out,
        "gravity",
        match model.gravity {
            Gravity::Input => "\"input\"".to_string(),
            Gravity::Constant(g) => w.list(&g, false),
        },
    );
    if !model.params.is_empty() {
        out.push_str("\n[params]\n");
    }
    for p in &model.params {
        line(&mut out, &quoted(&p.name), format!("{:?}", p.default));
    }
    for body in &model.bodies {
        out.push_str("\n[[body]]\n");
        line(&mut out, "name", quoted(&body.name));
        w.unless_zero(&mut out, "mass", body.mass);
        w.vector(&mut out, "com", &body.com, false);
        let [xx, yy, zz, xy, xz, yz] = body.inertia.map(|v| w.number(v, false));
        if body.inertia[3..].iter().any(|v| *v != Value::ZERO) {
            let all = format!("{{ xx = {xx}, yy = {yy}, zz = {zz}, xy = {xy}, xz = {xz}, yz = {yz} }}");
            line(&mut out, "inertia", all);
        } else {
            line(&mut out, "inertia", format!("[{xx}, {yy}, {zz}]"));
        }
        if let Rotation::Rpy(rpy) = body.inertia_axes {
            w.vector(&mut out, "inertia_rpy", &rpy, true);
        }
    }
    for j in w.order(order) {
        w.joint(&mut out, &model.joints[j]);
        w.limits(&mut out, j);
        w.start(&mut out, j);
    }
    for frame in &model.frames {
        out.push_str("\n[[frame]]\n");
        line(&mut out, "name", quoted(&frame.name));
        line(&mut out, "body", quoted(frame.body.map_or("ground", |b| &model.bodies[b].name)));
        w.placement(&mut out, &frame.placement);
    }
    for wrench in &model.wrenches {
        out.push_str("\n[[wrench]]\n");
        line(&mut out, "name", quoted(&wrench.name));
        line(&mut out, "body", quoted(&model.bodies[wrench.body].name));
        if wrench.axes == WrenchAxes::World {
            line(&mut out, "frame", quoted("world"));
        }
    }
    w.constraints(&mut out);
    w.shapes(&mut out);
    w.contacts(&mut out);
    out
}

fn line(out: &mut String, key: &str, value: String) {
    let _ = writeln!(out, "{key} = {value}");
}

/// A name as a basic TOML string; the names of the tests need no escapes.
fn quoted(text: &str) -> String {
    format!("\"{text}\"")
}

/// Whether the only coordinate of a joint is an angle.
fn turns(kind: &JointKind) -> bool {
    matches!(kind.spec().coordinates, [Coordinate { unit: Unit::Radian, .. }])
}

struct Writer<'m> {
    model: &'m Model,
}

impl Writer<'_> {
    /// A number. An angle is written in degrees where the reader converts that back to the same number.
    fn number(&self, v: Value, angle: bool) -> String {
        match v {
            Value::Param(k) => format!("{{ param = {} }}", quoted(&self.model.params[k].name)),
            Value::Const(x) => {
                let degrees = x.to_degrees().round();
                match angle && degrees != 0.0 && degrees.to_radians() == x {
                    true => format!("{{ deg = {degrees} }}"),
                    false => format!("{x:?}"),
                }
            }
        }
    }

    fn list(&self, values: &[Value], angle: bool) -> String {
        format!("[{}]", values.iter().map(|v| self.number(*v, angle)).collect::<Vec<_>>().join(", "))
    }

    fn unless_zero(&self, out: &mut String, key: &str, v: Value) {
        if v != Value::ZERO {
            line(out, key, self.number(v, false));
        }
    }

    fn vector(&self, out: &mut String, key: &str, values: &[Value], angle: bool) {
        if values.iter().any(|v| *v != Value::ZERO) {
            line(out, key, self.list(values, angle));
        }
    }

    fn placement(&self, out: &mut String, p: &Placement) {
        self.vector(out, "xyz", &p.xyz, false);
        match &p.rotation {
            Rotation::Rpy(rpy) => self.vector(out, "rpy", rpy, true),
            Rotation::AxisAngle { axis, angle } => {
                let angle = self.number(*angle, true);
                line(out, "rotate", format!("{{ axis = {axis:?}, angle = {angle} }}"));
            }
        }
    }

    /// Writes one number where all are the same, a list otherwise.
    fn freedoms(&self, out: &mut String, key: &str, values: &[Value], angle: bool) {
        let Some(first) = values.first() else { return };
        if values.iter().all(|v| v == first) {
            if *first != Value::ZERO {
                line(out, key, self.number(*first, angle));
            }
        } else {
            line(out, key, self.list(values, false));
        }
    }

    fn joint(&self, out: &mut String, joint: &Joint) {
        out.push_str("\n[[joint]]\n");
        line(out, "name", quoted(&joint.name));
        let spec = joint.kind.spec();
        line(out, "type", quoted(spec.word()));
        if let Some(parent) = joint.parent {
            line(out, "parent", quoted(&self.model.bodies[parent].name));
        }
        line(out, "child", quoted(&self.model.bodies[joint.child].name));
        self.placement(out, &joint.placement);
        for ((key, axis), default) in ["axis", "axis2"].into_iter().zip(joint.kind.axes()).zip(spec.axes) {
            if axis != default {
                line(out, key, format!("{axis:?}"));
            }
        }
        if let Some(pitch) = { joint.kind }.pitch_mut() {
            line(out, "pitch", self.number(*pitch, false));
        }
        self.freedoms(out, "damping", &joint.damping, false);
        self.freedoms(out, "stiffness", &joint.stiffness, false);
        let turns = turns(&joint.kind);
        self.freedoms(out, "rest", &joint.rest, turns);
        self.freedoms(out, "armature", &joint.armature, false);
        match joint.motion {
            JointMotion::Free => {}
            JointMotion::Prescribed => line(out, "motion", quoted("prescribed")),
            JointMotion::Mimic { leader, ratio, offset } => {
                let leader = quoted(&self.model.joints[leader].name);
                let (ratio, offset) = (self.number(ratio, false), self.number(offset, turns));
                line(out, "mimic", format!("{{ joint = {leader}, ratio = {ratio}, offset = {offset} }}"));
            }
        }
    }

    fn order(&self, order: Order) -> Vec<usize> {
        let joints = &self.model.joints;
        if order == Order::DepthFirst {
            return (0..joints.len()).collect();
        }
        let mut list: Vec<usize> = (0..joints.len()).filter(|&j| joints[j].parent.is_none()).collect();
        let mut at = 0;
        while at < list.len() {
            let body = joints[list[at]].child;
            list.extend((0..joints.len()).filter(|&j| joints[j].parent == Some(body)));
            at += 1;
        }
        list
    }
}
