//! Motions that start again, motions that go on after an error, and what is kept of sets of modes.

use mbd_codegen::plan::Plan;
use mbd_runtime::contact::{Effort, HybridError, Mode, Touching};
use mbd_runtime::integrate::StepError;
use mbd_runtime::Constrained;

use super::known::{ball, free_box};
use super::scene::{apart, Mechanism, Scene};

/// The bits of a state.
fn bits(scene: &Scene) -> Vec<u64> {
    scene.q.iter().chain(&scene.p).map(|x| x.to_bits()).collect()
}

/// Nothing is left of what a motion went through before it starts again: a ball that lands without a bounce does so the same way
/// every time, and its landings are not counted as events at one instant.
#[test]
fn a_motion_that_starts_again_is_a_new_one() {
    let mut scene = Scene::new(ball(0.0), &[0.3], &[0.0]);
    let (q, p) = (scene.q.clone(), scene.p.clone());
    scene.run(0.5);
    let first = bits(&scene);
    if let Some(motion) = &mut scene.motion {
        motion.rules.events = 3;
    }
    for round in 0..30 {
        let Some(motion) = &mut scene.motion else { panic!("no motion") };
        motion.restart(&mut scene.system, 0.0, &q, &p).unwrap();
        scene.run(0.5);
        assert_eq!(bits(&scene), first, "{round}");
    }
    assert_eq!(scene.motion.as_ref().unwrap().contact_statistics().events, 31);
}

/// An event that is not resolved leaves the state and the modes before it. With more work allowed, the motion goes on as if nothing
/// had happened.
#[test]
fn a_motion_goes_on_after_an_event_that_was_not_resolved() {
    let start = [0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0];
    let velocity = [0.3, 0.1, 0.0, 0.0, 0.0, 0.0];
    let mut whole = Scene::new(free_box(0.3, 0.0), &start, &velocity);
    whole.run(1.0);

    let mut scene = Scene::new(free_box(0.3, 0.0), &start, &velocity);
    scene.start();
    let Some(motion) = &mut scene.motion else { panic!("no motion") };
    let effort = motion.rules.effort;
    motion.rules.effort = Effort::ToTolerance { tolerance: 1e-11, rounds: 0 };
    // It falls for 0.143 s. The second attempt fails as the first one does.
    for _ in 0..2 {
        let Err(HybridError::Contact { time, .. }) = scene.try_run(1.0) else { panic!("no error") };
        assert!((time - (0.2_f64 / 9.81).sqrt()).abs() < 1e-9, "{time}");
        assert!((scene.q[2] - 0.1).abs() < 1e-9 && scene.p[5].abs() < 1e-9, "{:?}", scene.q);
    }
    let Some(motion) = &mut scene.motion else { panic!("no motion") };
    motion.rules.effort = effort;
    scene.run(1.0);
    assert!(apart(&scene.q, &whole.q) < 1e-9 && apart(&scene.p, &whole.p) < 1e-9, "{:?} {:?}", scene.q, whole.q);
}

/// A run to a time that is not a number is an error; one to a time that has passed takes no step.
#[test]
fn ends_that_are_not_ahead_take_no_step() {
    let mut scene = Scene::new(ball(0.5), &[0.3], &[0.0]);
    assert_eq!(scene.try_run(f64::NAN), Err(HybridError::Step(StepError::InvalidEnd { time: 0.0 })));
    scene.run(0.1);
    let here = bits(&scene);
    scene.run(0.05);
    scene.advance(0.05);
    assert_eq!((bits(&scene), scene.motion.as_ref().unwrap().time()), (here, 0.1));
}

/// A mechanism that visits many sets of modes forgets those that it has not used for longest. What it computes is the same, and its
/// inputs stay: a box of eight contacts has 6,561 sets.
#[test]
fn many_sets_of_modes_are_not_all_kept() {
    let plan = Plan::new(&free_box(0.5, 0.0), 1e-9);
    let new = || -> Mechanism { plan.default_contact_interpreter() };
    let sets = (0..6561).map(|set: u32| {
        let mode = |k: u32| [Mode::Open, Mode::Slide, Mode::Stick][(set / 3_u32.pow(k) % 3) as usize];
        (0..8).map(mode).collect::<Vec<_>>()
    });
    let sets: Vec<Vec<Mode>> = sets.collect();
    let (q, v) = (vec![0.1, 0.2, 0.3, 0.0, 0.0, 0.6, 0.8], vec![0.3, -0.2, 0.1, 0.4, 0.5, -0.6]);
    let multipliers = |mechanism: &mut Mechanism, modes: &[Mode]| {
        mechanism.act(modes);
        let mut lambda = mechanism.zero_rows();
        Constrained::multipliers(mechanism, 0.0, &q, &v, &mut lambda);
        lambda
    };
    let mut table = new();
    table.tau[1] = 2.0;
    for modes in &sets {
        table.act(modes);
    }
    assert_eq!(table.sets_of_modes().len(), 4096);
    for modes in [&sets[1], &sets[40], &sets[6000]] {
        let mut fresh = new();
        fresh.tau[1] = 2.0;
        let expected = multipliers(&mut fresh, modes);
        assert!(expected.iter().any(|x| *x != 0.0));
        assert_eq!(multipliers(&mut table, modes), expected, "{modes:?}");
    }
    assert_eq!(table.sets_of_modes().len(), 4096);
}
