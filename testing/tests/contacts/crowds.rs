//! Time steps of mechanisms with many contacts, of which few are near: gaps of the others are not computed,
//! and what does not feel each other is solved for together.

use std::time::Instant;

use mbd_codegen::plan::Plan;
use mbd_codegen::Options;
use mbd_runtime::contact::{HybridError, ModeTable, Reducible, SteppingStatistics, TimeStepping, WithContacts};
use mbd_runtime::Conjugate;
use mbd_testing::random::{with_contacts, Rng};
use mbd_testing::state::random_state;

use super::far::Counted;
use super::scene::model;

/// Balls that float freely, each of which can touch each other and a floor where `pairs` is `all`, with a rod that slides out of
/// the last ball if `rod`.
fn balls(n: usize, rod: bool, pairs: &str) -> Plan {
    let mut text = format!(
        "name = \"balls\"\ngravity = [0, 0, -9.81]\n\
         contacts = {{ pairs = \"{pairs}\", friction = 0.4, restitution = 0.3 }}\n\
         [[shape]]\nname = \"floor\"\ntype = \"plane\"\n",
    );
    for k in 0..n {
        text += &format!(
            "[[body]]\nname = \"b{k}\"\nmass = 0.5\ninertia = [0.002, 0.002, 0.002]\n\
             [[joint]]\nname = \"j{k}\"\ntype = \"floating\"\nchild = \"b{k}\"\n\
             [[shape]]\nname = \"s{k}\"\nbody = \"b{k}\"\ntype = \"sphere\"\nradius = 0.1\n"
        );
    }
    if rod {
        let last = n - 1;
        text += &format!("[[body]]\nname = \"rod\"\nmass = 0.1\ninertia = [0.001, 0.001, 0.001]\n\
                 [[joint]]\nname = \"slide\"\ntype = \"prismatic\"\nparent = \"b{last}\"\nchild = \"rod\"\naxis = [1, 0, 0]\n\
                 [[shape]]\nname = \"tip\"\nbody = \"rod\"\ntype = \"sphere\"\nradius = 0.02\nxyz = [0.2, 0, 0]\n");
    }
    Plan::new(&model(&text), 1e-9)
}

/// Balls on a grid `apart` m from one another, the lowest at a height, with random velocities up to `speed`.
fn state(plan: &Plan, [apart, height, speed]: [f64; 3]) -> (Vec<f64>, Vec<f64>) {
    let (mut q, mut rng) = (plan.start(), Rng::new(5, 1));
    for (k, place) in q.chunks_exact_mut(7).enumerate() {
        let [x, y, z] = [k % 4, k / 4 % 4, k / 16].map(|i| apart * i as f64);
        place.copy_from_slice(&[x, y, z + height, 0.0, 0.0, 0.0, 1.0]);
    }
    let v = (0..plan.dims.nv).map(|_| rng.around(speed)).collect();
    (q, v)
}

/// Coordinates after `n` time steps of `h` s, what happened, and the numbers of gaps' rows that were computed and of sweeps.
/// A mechanism that is silent does not say what would save work.
fn stepped(
    plan: &Plan,
    (q, v): &(Vec<f64>, Vec<f64>),
    (h, n): (f64, u32),
    silent: bool,
) -> Result<(Vec<f64>, SteppingStatistics, [u64; 2]), HybridError> {
    let mut full = Counted::new(plan.with_contacts().interpreter(&plan.default_params()));
    full.silent = silent;
    let counts = [full.rows.clone(), full.sweeps.clone()];
    let mut mechanism = ModeTable::new(full, plan.contacts());
    let (mut q, mut p) = (q.clone(), v.clone());
    mechanism.conjugate_momenta(&q, v, &mut p);
    let mut system = WithContacts::new(mechanism);
    let mut motion = TimeStepping::new(&mut system, ());
    for k in 0..n {
        motion.step(&mut system, f64::from(k) * h, h, &mut q, &mut p)?;
    }
    let statistics = *motion.statistics();
    Ok((q, statistics, counts.map(|count| count.get())))
}

#[test]
fn time_steps_leave_out_what_is_far() {
    for (rod, start, steps, least) in [
        // What flies without touching anything.
        (false, [3.0, 10.0, 0.5], (1e-3, 500), 40),
        (true, [3.0, 10.0, 0.5], (1e-3, 500), 10),
        // Balls that meet while others roll on the floor.
        (false, [0.4, 0.3, 1.0], (1e-3, 600), 3),
        (true, [0.5, 0.3, 1.0], (2e-3, 300), 2),
    ] {
        let plan = balls(20, rod, "all");
        let start = state(&plan, start);
        let [a, b] = [false, true].map(|silent| stepped(&plan, &start, steps, silent).unwrap());
        let ([rows, sweeps], [all, many]) = (a.2, b.2);
        println!("{rows} rows of {all}, {sweeps} sweeps of {many}, {} steps touched", a.1.touched);
        assert_eq!((&a.0, a.1), (&b.0, b.1));
        assert!(least * rows < all, "{rows} of {all}");
        // Rows of one contact after the other, and of few that touch the same ball.
        assert!(a.1.touched == 0 || 2 * sweeps < many, "{sweeps} of {many}");
    }
}

#[test]
fn what_time_steps_leave_out_changes_no_random_mechanism() {
    let (mut compared, mut saved, mut touched) = (0, 0, 0);
    for seed in 0..12 {
        let Some(plan) = with_contacts(seed).map(|model| Plan::new(&model, 1e-9)) else { continue };
        if plan.contacts::<f64>().len() <= 8 {
            continue;
        }
        let state = random_state(&plan, seed);
        let start = (state.q, state.v);
        let [a, b] = [false, true].map(|silent| stepped(&plan, &start, (3e-4, 30), silent));
        let (Ok(a), Ok(b)) = (&a, &b) else {
            assert_eq!(a, b, "{seed}");
            continue;
        };
        assert_eq!((&a.0, a.1), (&b.0, b.1), "{seed}");
        (compared, saved, touched) = (compared + 1, saved + b.2[0] - a.2[0], touched + a.1.touched);
    }
    println!("{compared} mechanisms, {saved} rows saved, {touched} steps touched");
    assert!(compared > 4 && saved > 400 && touched > 40, "{compared} {saved} {touched}");
}

/// Least time of a step of `h` s, s, of `n` that begin at a state.
fn time_of_steps<
    Y: Reducible<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>, Rows = Vec<f64>> + Conjugate,
>(
    mut mechanism: ModeTable<Y>,
    (q, v): &(Vec<f64>, Vec<f64>),
    (h, n): (f64, u32),
) -> f64 {
    let (q, mut p) = (q.clone(), v.clone());
    mechanism.conjugate_momenta(&q, v, &mut p);
    let mut system = WithContacts::new(mechanism);
    let mut least = f64::INFINITY;
    for _ in 0..5 {
        let (mut q, mut p) = (q.clone(), p.clone());
        let mut motion = TimeStepping::new(&mut system, ());
        let clock = Instant::now();
        for k in 0..n {
            motion.step(&mut system, f64::from(k) * h, h, &mut q, &mut p).unwrap();
        }
        least = least.min(clock.elapsed().as_secs_f64() / f64::from(n));
    }
    least
}

/// What a time step of 1 ms takes with and without contacts (`--ignored --nocapture`, optimised).
#[test]
#[ignore = "a report of wall times"]
fn times_of_crowds() {
    for n in [10, 20, 60] {
        let [plan, free] = ["all", "listed"].map(|pairs| balls(n, false, pairs));
        for (name, of, steps) in [
            ("far", [3.0, 30.0, 0.5], (1e-3, 1000)),
            ("flying by", [0.4, 10.0, 1.0], (1e-3, 300)),
            ("on the floor", [0.4, 0.1, 0.0], (1e-3, 300)),
        ] {
            let start = state(&plan, of);
            let by = |plan: &Plan| {
                let interpreted = time_of_steps(plan.default_contact_interpreter::<f64>(), &start, steps);
                let code = plan.compiled_with_contacts::<f64>(&Options::default(), 10).unwrap();
                [interpreted, time_of_steps(code, &start, steps)].map(|s| 1e6 * s)
            };
            let ([a, b], [c, d]) = (by(&plan), by(&free));
            println!(
                "{n} balls {name}: interpreted {a:.1} µs ({c:.1} without contacts), machine code {b:.1} µs ({d:.1})"
            );
        }
    }
}
