//! Wrenches in the joints of mechanisms with loops. The reference takes, body by body, the wrenches that Newton's and
//! Euler's laws require and subtracts those of the constraints, which follow from the definitions of their rows.

use mbd_codegen::model::{ConstraintKind, LoopKind};
use mbd_runtime::spatial::{add3, cross};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::System;
use mbd_testing::closed::LoopSystem;
use mbd_testing::kkt::{mounted, rates, Pose};
use mbd_testing::newton;

use crate::dense::case::{plan_of, Case, Errors, SYSTEMS};
use crate::dense::Vector;

/// For each row of a loop, the force and the moment about the frame's origin, in ground axes, that a unit multiplier
/// exerts on the first frame, or on the second if `first` is false. Their power is the rate of the row.
fn directions(kind: &LoopKind, params: &[f64], at: &[Pose<f64>; 2], first: bool) -> Vec<[f64; 6]> {
    let still = at.map(|pose| Pose { lin: [0.0; 3], ang: [0.0; 3], ..pose });
    let mut rows: Vec<[f64; 6]> = Vec::new();
    for k in 0..6 {
        let mut moved = still;
        let pose = &mut moved[usize::from(!first)];
        let part = if k < 3 { &mut pose.lin } else { &mut pose.ang };
        part[k % 3] = 1.0;
        let column = rates(kind, params, &moved[0], &moved[1]);
        rows.resize(column.len(), [0.0; 6]);
        rows.iter_mut().zip(column).for_each(|(row, x)| row[k] = x);
    }
    rows
}

/// Force on every body, and moment about the origin of the ground, that the multipliers `λ` of the reference exert.
fn on_bodies(s: &LoopSystem, lambda: &Vector) -> Vec<[[f64; 3]; 2]> {
    let mut frames = vec![FrameState::ground(); s.open.frames.len()];
    s.state.interpreter(&s.open).frames(&s.state.q, &s.state.v, &mut frames);
    let params = &s.state.params;
    let mut sums = vec![[[0.0; 3]; 2]; s.model.bodies.len()];
    let mut row = 0;
    for constraint in &s.model.constraints {
        let ConstraintKind::Loop { kind, first, second } = &constraint.kind else {
            row += 1;
            continue;
        };
        let at = [first, second].map(|mount| mounted(&s.open, params, &frames, mount));
        let mut count = 0;
        for (mount, pose, is_first) in [(first, at[0], true), (second, at[1], false)] {
            let rows = directions(kind, params, &at, is_first);
            count = rows.len();
            let Some(body) = mount.body else { continue };
            for (k, direction) in rows.iter().enumerate() {
                let [f, n] = [0, 3].map(|i| [0, 1, 2].map(|j| -lambda[row + k] * direction[i + j]));
                let sum = &mut sums[body];
                *sum = [add3(sum[0], f), add3(sum[1], add3(n, cross(pose.origin, f)))];
            }
        }
        row += count;
    }
    sums
}

#[test]
fn reactions_are_what_is_left_for_the_joints() {
    let mut errors = Errors::new("reactions", 1e-10);
    for seed in 0..SYSTEMS {
        let Some(mut c) = Case::new(seed) else { continue };
        let coupled = c.system.model.constraints.iter().any(|c| matches!(c.kind, ConstraintKind::Coupling { .. }));
        // Redundant rows can share their loads in many ways, and the forces of a coupling are part of the joints'
        // wrenches.
        if c.truth.dense.rank < c.truth.dense.phi.nrows() || coupled {
            continue;
        }
        let closed = plan_of(&c.system, seed);
        let mut s = c.system.state.clone();
        s.v = c.truth.v.as_slice().to_vec();
        c.system.state.v = s.v.clone();
        let mut ours = vec![[0.0; 6]; closed.joint_nodes.len()];
        let mut a = c.i.zero_momenta();
        c.i.reactions(&s.q, &s.v, &mut a, &mut ours);
        let mut motion = crate::cases::Case::of(seed, c.system.open.clone(), s);
        motion.a = c.truth.motion.x.as_slice().to_vec();
        let bodies = motion.bodies();
        let needed = crate::cases::needed(&motion, &bodies);
        let given = on_bodies(&c.system, &c.truth.motion.y);
        let model = &c.system.model;
        let mut theirs = Vec::new();
        for slot in &motion.plan.slots {
            let carried = newton::subtree(model, slot.joint);
            let sum =
                |part: usize, i: usize| carried.iter().map(|&b| needed[b][part][i] - given[b][part][i]).sum::<f64>();
            let f: [f64; 3] = std::array::from_fn(|i| sum(0, i));
            let at = &bodies[model.joints[slot.joint].child];
            let arm = cross(at.position.map(|x| x.re), f);
            let n: [f64; 3] = std::array::from_fn(|i| sum(1, i) - arm[i]);
            theirs.extend([crate::cases::turn_back(at, f), crate::cases::turn_back(at, n)].concat());
        }
        let theirs = Vector::from(theirs);
        let largest = given.iter().flatten().flatten().fold(theirs.amax(), |m, x| m.max(x.abs()));
        errors.add(&c, &Vector::from(ours.concat()), &theirs, largest.max(1.0));
    }
    errors.done();
}
