//! Random trees that are cut and put together again.

use mbd_codegen::model::{Gravity, JointKind, JointMotion, Placement, Value};
use mbd_codegen::transfer::RejoinError;
use mbd_testing::random::{random_model, Distribution, Rng};
use mbd_testing::state::random_state;

use super::{near, same_motion, Machine};

#[test]
fn a_cut_joint_that_is_welded_again_gives_the_same_state() {
    let mut done = 0;
    for seed in 0..400 {
        // A massless body that floats has no velocity of its own.
        let distribution = Distribution { prescribed: 0.0, massless: 0.0, ..Distribution::everything(seed, 8) };
        let mut model = random_model(seed, &distribution);
        let joint = Rng::new(seed, 9).below(model.joints.len());
        // A rotor would be lost with its joint.
        model.joints[joint].armature.fill(Value::ZERO);
        let joint = model.joints[joint].clone();
        let mut whole = Machine::new(model);
        let cut = match whole.model.cut(&joint.name) {
            Ok(model) => model,
            Err(RejoinError::Used { .. }) => continue,
            Err(error) => panic!("{seed}: {error}"),
        };
        if matches!(joint.motion, JointMotion::Mimic { .. }) {
            continue;
        }
        let mut cut = Machine::new(cut);
        let state = random_state(&whole.plan, seed);
        let out = whole.transfer(&state.q, &state.v, &mut cut).unwrap_or_else(|e| panic!("{seed}: {e}"));
        same_motion((&mut whole, &state.q, &state.v), (&mut cut, &out.q, &out.v), 1e-11);
        let back = cut.transfer(&out.q, &out.v, &mut whole).unwrap_or_else(|e| panic!("{seed}: {e}"));
        same_motion((&mut cut, &out.q, &out.v), (&mut whole, &back.q, &back.v), 1e-11);
        near(&format!("{seed}: velocities"), &back.v, &state.v, 1e-10);
        assert!(out.lost().abs() <= 1e-12 * out.before[0], "{seed}: {}", out.lost());
        done += 1;
    }
    assert!(done > 200, "{done}");
}

#[test]
fn a_floating_tree_keeps_its_momentum_whatever_locks() {
    let mut lost = 0.0;
    for seed in 0..100 {
        let distribution = Distribution {
            bodies: (2, 8),
            kinds: [3.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0],
            branching: 0.4,
            ..Distribution::default()
        };
        let mut model = random_model(seed, &distribution);
        model.gravity = Gravity::Constant([Value::ZERO; 3]);
        // The root floats.
        let model = model.cut(&model.joints[0].name).expect("a root");
        let mut free = Machine::new(model);
        let state = random_state(&free.plan, seed);
        let before = free.momentum(&state.q, &state.v);
        let size = before.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        let mut rng = Rng::new(seed, 9);
        let locked = free.model.joints.iter().filter(|_| rng.chance(0.5)).map(|j| j.child).collect::<Vec<_>>();
        let mut model = free.model.clone();
        for child in locked {
            let joint = free.model.joints.iter().find(|j| j.child == child).expect("a joint");
            let Some(parent) = joint.parent else { continue };
            let [parent, child] = [parent, child].map(|b| free.model.bodies[b].name.clone());
            let [a, b] = [&parent, &child].map(|name| super::pose(&free.body(name, &state.q, &state.v)));
            let held = Placement::of_pose(&a.inverse().then(&b));
            model = model.rejoined(&child, Some(&parent), JointKind::Fixed, held).expect("a weld");
        }
        let mut stiff = Machine::new(model);
        let out = free.transfer(&state.q, &state.v, &mut stiff).unwrap_or_else(|e| panic!("{seed}: {e}"));
        near(&format!("{seed}"), &stiff.momentum(&out.q, &out.v), &before, 1e-13 * size);
        assert!(out.lost() >= -1e-13 * out.before[0], "{seed}: {}", out.lost());
        lost += out.lost();
    }
    assert!(lost > 1.0);
}
