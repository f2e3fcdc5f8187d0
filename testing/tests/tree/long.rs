//! Long chains: the interpreter runs them in a time proportional to the number of links.

use std::time::Instant;

use mbd_codegen::model::Model;
use mbd_codegen::plan::Plan;
use mbd_runtime::System;
use mbd_testing::chains::general_tapered;
use mbd_testing::state::random_state;

/// Velocities from momenta that were made of them: the sweeps undo each other, up to rounding errors times a condition
/// that grows with the square of the number of links (differences here are of the size of `ε n²`).
#[test]
fn ten_thousand_links_run() {
    let n = 10_000;
    let plan = Plan::new(&chain(n), 1e-9);
    let s = random_state(&plan, 1);
    let mut i = s.interpreter(&plan);
    let (mut p, mut v, mut qd, mut pd) = (i.zero_momenta(), i.zero_momenta(), i.neutral(), i.zero_momenta());
    i.momenta(&s.q, &s.v, &mut p);
    i.rates(&s.q, &p, &mut v, &mut qd, &mut pd);
    let largest = s.v.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let within = 100.0 * f64::EPSILON * (n * n) as f64 * largest;
    for (k, (a, b)) in v.iter().zip(&s.v).enumerate() {
        assert!((a - b).abs() < within, "link {k}: {a:e}, not {b:e}, of {largest:e}");
    }
    assert!(pd.iter().all(|x| x.is_finite()));
}

/// A chain of links that repeat after a thousand. (Random models take a time that grows with the square of their bodies.)
fn chain(n: usize) -> Model {
    let mut model = general_tapered(1, n.min(1000), 1.0);
    for k in model.bodies.len()..n {
        let (mut body, mut joint) = (model.bodies[k % 1000].clone(), model.joints[k % 1000].clone());
        (body.name, joint.name) = (format!("link {k}"), format!("joint {k}"));
        (joint.parent, joint.child) = (Some(k - 1), k);
        model.bodies.push(body);
        model.joints.push(joint);
    }
    model
}

/// Time of an evaluation of the rates for each link, ns, up to a hundred thousand links (`--ignored --nocapture`).
#[test]
#[ignore = "a report of wall times"]
fn times_of_long_chains() {
    for n in [100, 1_000, 10_000, 100_000] {
        let clock = Instant::now();
        let plan = Plan::new(&chain(n), 1e-9);
        let planned = clock.elapsed().as_secs_f64();
        let s = random_state(&plan, 1);
        let mut i = s.interpreter(&plan);
        let p = i.zero_momenta();
        let (mut v, mut qd, mut pd) = (i.zero_momenta(), i.neutral(), i.zero_momenta());
        let mut least = f64::INFINITY;
        for _ in 0..(1_000_000 / n).min(1000) {
            let clock = Instant::now();
            i.rates(&s.q, &p, &mut v, &mut qd, &mut pd);
            least = least.min(clock.elapsed().as_secs_f64());
        }
        println!("{n} links: planned in {planned:.2} s, {:.0} ns a link", 1e9 * least / n as f64);
    }
}
