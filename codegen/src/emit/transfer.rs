//! States carried over from another generated type.

use std::fmt::Write as _;

use mbd_runtime::tree::Source;

use super::fields::neutral;
use super::names::constant;
use crate::options::Options;
use crate::plan::Plan;
use crate::transfer::moves::{Move, Origin};

/// The implementation of `TransferFrom<OLD>` for a type.
pub fn implementation(from: &Plan, old: &str, to: &Plan, options: &Options, moves: &[Move]) -> String {
    let (rt, new, t) = (&options.runtime, &options.type_name, options.precision.name());
    let [old_q, old_v] = [from.dims.nq, from.dims.nv].map(|n| format!("[{t}; {n}]"));
    let [new_q, new_v] = [to.dims.nq, to.dims.nv].map(|n| format!("[{t}; {n}]"));
    let mut body = String::new();
    let mut line = |text: String| {
        let _ = writeln!(body, "        {text}");
    };
    line("let mut next = self.clone();".into());
    line(format!("let mut new_q: {new_q} = {:?};", neutral(to, false)));
    line(format!("let (mut new_v, mut new_p) = ([0.0; {0}], [0.0; {0}]);", to.dims.nv));
    if !to.model.params.is_empty() {
        line("next.params = old.params;".into());
    }
    if moves.iter().any(|m| matches!(m.from, Origin::Bodies(..))) {
        line(format!(
            "let frames = {rt}::transfer::frames(|turn, place, rate| {old}::frames(old, q, v, turn, place, rate));"
        ));
        line(format!("let ground = {rt}::transfer::FrameMotion::<{t}>::ground();"));
    }
    for Move { to: goal, from: origin, sizes: (nq, nv) } in moves {
        let (coordinates, rates) = match *goal {
            Source::State { q, v } => (format!("new_q[{q}..{}]", q + nq), format!("new_v[{v}..{}]", v + nv)),
            Source::Drive { q, v } => {
                (format!("next.drive_q[{q}..{}]", q + nq), format!("next.drive_v[{v}..{}]", v + nv))
            }
        };
        match *origin {
            Origin::Joint(source) => {
                let (a, b) = match source {
                    Source::State { q, v } => (format!("q[{q}..{}]", q + nq), format!("v[{v}..{}]", v + nv)),
                    Source::Drive { q, v } => {
                        (format!("old.drive_q[{q}..{}]", q + nq), format!("old.drive_v[{v}..{}]", v + nv))
                    }
                };
                line(format!("{coordinates}.copy_from_slice(&{a});"));
                line(format!("{rates}.copy_from_slice(&{b});"));
            }
            Origin::Bodies(parent, child) => {
                let frame = |body: usize| format!("frames[{old}::FRAME_{}]", constant(&to.model.bodies[body].name));
                let parent = parent.map_or("ground".to_string(), frame);
                line(format!("let (pose, twist) = {parent}.floating(&{});", frame(child)));
                line(format!("{coordinates}.copy_from_slice(&pose);"));
                line(format!("{rates}.copy_from_slice(&twist);"));
            }
        }
    }
    line("next.momenta(&new_q, &new_v, &mut new_p);".into());
    // The impact: what has been locked stands still.
    for Move { to: goal, from: origin, sizes: (_, nv) } in moves {
        match (*goal, *origin) {
            (Source::Drive { .. }, Origin::Joint(Source::Drive { .. })) | (Source::State { .. }, _) => {}
            (Source::Drive { v, .. }, _) => line(format!("next.drive_v[{v}..{}].fill(0.0);", v + nv)),
        }
    }
    line(format!("{rt}::transfer::finite(&new_q, &new_p)?;"));
    line("*self = next;".into());
    line("::core::result::Result::Ok((new_q, new_p))".into());
    format!(
        "#[allow(clippy::all, clippy::pedantic, unused_variables, unused_mut)]\n#[rustfmt::skip]\n\
         impl {rt}::transfer::TransferFrom<{old}> for {new} {{\n    fn transfer_from(\n        &mut self,\n        old: &{old},\n        \
         q: &{old_q},\n        v: &{old_v},\n    ) -> ::core::result::Result<({new_q}, {new_v}), {rt}::transfer::NotFinite> {{\n{body}    \
         }}\n}}\n"
    )
}
