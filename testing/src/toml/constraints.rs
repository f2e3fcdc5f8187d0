//! Writes loops, couplings and starts in the TOML format.

use mbd_codegen::model::{Constraint, ConstraintKind, Joint, LoopKind, Mount, NumberKey, Placement, Start, Value};

use super::{line, quoted, turns, Writer};

impl Writer<'_> {
    /// Writes every constraint, preceded by frames for those ends of loops that are neither bodies nor frames of the
    /// model.
    pub(super) fn constraints(&self, out: &mut String) {
        for constraint in &self.model.constraints {
            if let ConstraintKind::Loop { first, second, .. } = &constraint.kind {
                self.missing_frame(out, first, &format!("{} first", constraint.name));
                self.missing_frame(out, second, &format!("{} second", constraint.name));
            }
        }
        for constraint in &self.model.constraints {
            self.constraint(out, constraint);
        }
    }

    /// Name of an end of a loop, if it is a body or a frame of the model.
    fn end(&self, mount: &Mount) -> Option<&str> {
        if mount.placement == Placement::IDENTITY {
            return Some(mount.body.map_or("ground", |b| &self.model.bodies[b].name));
        }
        let frames = &self.model.frames;
        let at = frames.iter().find(|f| f.body == mount.body && f.placement == mount.placement)?;
        Some(&at.name)
    }

    fn missing_frame(&self, out: &mut String, mount: &Mount, name: &str) {
        if self.end(mount).is_none() {
            out.push_str("\n[[frame]]\n");
            line(out, "name", quoted(name));
            line(out, "body", quoted(mount.body.map_or("ground", |b| &self.model.bodies[b].name)));
            self.placement(out, &mount.placement);
        }
    }

    fn constraint(&self, out: &mut String, constraint: &Constraint) {
        let name = &constraint.name;
        match &constraint.kind {
            ConstraintKind::Loop { kind, first, second } => {
                out.push_str("\n[[loop]]\n");
                line(out, "name", quoted(name));
                let end = |mount, which: &str| {
                    quoted(self.end(mount).map_or(format!("{name} {which}"), str::to_string).as_str())
                };
                line(out, "between", format!("[{}, {}]", end(first, "first"), end(second, "second")));
                self.loop_kind(out, kind);
            }
            ConstraintKind::Coupling { terms, offset } => {
                out.push_str("\n[[coupling]]\n");
                line(out, "name", quoted(name));
                let joints: Vec<&Joint> = terms.iter().map(|(j, _)| &self.model.joints[*j]).collect();
                let names: Vec<String> = joints.iter().map(|j| quoted(&j.name)).collect();
                line(out, "joints", format!("[{}]", names.join(", ")));
                let ratios: Vec<Value> = terms.iter().map(|(_, ratio)| *ratio).collect();
                line(out, "ratios", self.list(&ratios, false));
                let turns = joints.iter().all(|j| turns(&j.kind));
                if *offset != Value::ZERO {
                    line(out, "offset", self.number(*offset, turns));
                }
            }
        }
        self.unless_zero(out, "decay", constraint.decay);
    }

    fn loop_kind(&self, out: &mut String, kind: &LoopKind) {
        let spec = kind.spec();
        line(out, "type", quoted(spec.word()));
        for (direction, value) in spec.directions.iter().zip(kind.directions()) {
            if value != direction.default {
                line(out, direction.key, format!("{value:?}"));
            }
        }
        let mut kind = *kind;
        let mut values = kind.numbers_mut().into_iter().map(|x| *x);
        for NumberKey { key, count } in spec.numbers {
            let list: Vec<Value> = values.by_ref().take(*count).collect();
            let value = match list[..] {
                [single] => self.number(single, false),
                _ => self.list(&list, false),
            };
            line(out, key, value);
        }
    }

    /// Writes the start of a joint, if it has one.
    pub(super) fn start(&self, out: &mut String, joint: usize) {
        let Some(Start { q, v, held, .. }) = self.model.starts.iter().find(|s| s.joint == joint) else { return };
        let turns = turns(&self.model.joints[joint].kind);
        match q[..] {
            [x] => line(out, "start", self.number(Value::Const(x), turns)),
            _ => line(out, "start", format!("{q:?}")),
        }
        if v.iter().any(|x| *x != 0.0) {
            line(out, "start_velocity", format!("{v:?}"));
        }
        if *held {
            line(out, "held", "true".to_string());
        }
    }
}
