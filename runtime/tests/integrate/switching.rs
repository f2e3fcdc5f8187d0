//! The method that changes between an explicit and an implicit one, through a phase in which the motion is stiff.

use std::cell::Cell;

use super::solver::goes_on_as_new;
use super::systems::*;
use mbd_runtime::integrate::{AutoSwitch, Dop853, Radau5, Rodas5P};
use mbd_runtime::system::{LieJoint, StateDerivatives};
use mbd_runtime::{Differentiable, System};

/// A drag of rate `λ(t)` pulls a mass to the motion `q = 1 − cos t`, `p = sin t`, whatever the rate: `q̇ = p`,
/// `ṗ = cos t − λ (p − sin t)`.
#[derive(Clone, Debug)]
struct Pulled<F>(F);

impl<F: Fn(f64) -> f64> System for Pulled<F> {
    type Scalar = f64;
    type Coordinates = [f64; 1];
    type Momenta = [f64; 1];

    fn neutral(&self) -> [f64; 1] {
        [0.0]
    }
    fn zero_momenta(&self) -> [f64; 1] {
        [0.0]
    }
    fn lie_joints(&self) -> &[LieJoint] {
        &[]
    }
    fn rates_at(&mut self, t: f64, _q: &[f64; 1], p: &[f64; 1], qd: &mut [f64; 1], pd: &mut [f64; 1]) {
        *qd = *p;
        *pd = [t.cos() - (self.0)(t) * (p[0] - t.sin())];
    }
    fn coordinate_rates(&self, _q: &[f64; 1], v: &[f64; 1], qd: &mut [f64; 1]) {
        *qd = *v;
    }
}

impl<F: Fn(f64) -> f64> Differentiable for Pulled<F> {
    type Square = [[f64; 1]; 1];

    fn square(&self) -> [[f64; 1]; 1] {
        [[0.0]]
    }
    fn depends_on_time(&self) -> bool {
        true
    }
    fn rate_derivatives(
        &mut self,
        t: f64,
        q: &[f64; 1],
        p: &[f64; 1],
        out: &mut StateDerivatives<[f64; 1], [[f64; 1]; 1]>,
    ) {
        self.rates_at(t, q, p, &mut out.v, &mut out.pd);
        (out.dv_dq, out.dv_dp) = ([[0.0]], [[1.0]]);
        (out.dpd_dq, out.dpd_dp) = ([[0.0]], [[-(self.0)(t)]]);
    }
}

/// From 0.1 to a hundred thousand 1/s and back, within half a second at 2 s and at 6 s.
fn stiff_for_a_while(t: f64) -> f64 {
    let up = |t: f64| 0.5 * (1.0 + (8.0 * t).tanh());
    10.0_f64.powf(-1.0 + 6.0 * up(t - 2.0) * up(6.0 - t))
}

#[test]
fn a_stiff_phase_is_left_to_the_implicit_method() {
    let tolerance = 1e-10;
    let mut y = Pulled(stiff_for_a_while as fn(f64) -> f64);
    let method = AutoSwitch::new(&y, Dop853::new(&y), Radau5::new(&y));
    let mut solver = adaptive(&mut y, method, tolerance, (&[0.0], &[0.0]));
    let (end, mut last, mut implicit) = (60.0, [0.0; 2], 0);
    // Times at which the implicit method took over and gave back, and the steps of the explicit one since.
    let (mut changes, mut worst, mut explicit) = (Vec::new(), 0.0_f64, 0);
    while solver.time() < end {
        solver.advance(&mut y, end).expect("a step");
        let (t, h) = solver.last_step();
        let mut at = |theta: f64| {
            let (mut q, mut p) = ([f64::NAN], [f64::NAN]);
            solver.dense(&mut y, theta, &mut q, &mut p);
            [q[0], p[0]]
        };
        // Where a step begins, whichever method takes it, the one before has ended.
        assert_eq!(at(0.0), last, "at {t}");
        for k in 0..=8 {
            let theta = f64::from(k) / 8.0;
            let (now, t) = (at(theta), t + theta * h);
            worst = largest([worst, apart(&now, &[1.0 - t.cos(), t.sin()])]);
        }
        last = at(1.0);
        // A step counts where the next one begins.
        let taken = solver.method().implicit_steps();
        let is_implicit = taken > implicit;
        if is_implicit != (changes.len() % 2 == 1) {
            changes.push(t);
            explicit = 0;
        }
        (implicit, explicit) = (taken, explicit + u64::from(!is_implicit));
    }
    println!(
        "changes at {changes:.3?}, {implicit} implicit steps, then {explicit}; {worst:e}; {:?}",
        solver.statistics()
    );
    // Errors of the momentum decay, those of the coordinate add up: 0.4 tolerances, the points within steps among them.
    assert!(worst < 10.0 * tolerance, "{worst:e}");
    // It takes over at the ramp, tries the explicit method after 500 steps, and leaves the rest of the motion to it.
    assert!(changes.len() >= 2 && changes.len().is_multiple_of(2), "{changes:?}");
    let (first, back) = (changes[0], changes[changes.len() - 1]);
    assert!((1.8..2.5).contains(&first) && back > 6.0 && back < 20.0, "{changes:?}");
    assert!(implicit >= 500 && explicit >= 100, "{implicit} {explicit}");
    // By the explicit method alone, which takes steps of some 6/λ, it would be 60,000.
    let steps = solver.statistics().steps;
    assert!(steps < 3000, "{steps}");
}

#[test]
fn a_motion_by_implicit_methods_goes_on_after_a_kick() {
    let force = Cell::new(0.0);
    let y = || Pulled(|_: f64| 1.0 + force.get());
    goes_on_as_new("radau5", y(), &force, Radau5::new, 100.0);
    goes_on_as_new("rodas5p", y(), &force, Rodas5P::new, 100.0);
    goes_on_as_new("switching", y(), &force, |y| AutoSwitch::new(y, Dop853::new(y), Radau5::new(y)), 100.0);
}

/// A kick comes with a drag that makes the motion stiff, and the implicit method takes over once the kick has decayed. The next
/// kick comes with the weak drag of before, and the motion goes on by the explicit method. With a constant rate `λ`, a kick of
/// `δ` adds `δ exp(−λ s)` to the momentum after `s` seconds, and `δ (1 − exp(−λ s))/λ` to the coordinate.
#[test]
fn a_kick_that_makes_the_motion_stiff_leads_to_the_implicit_method() {
    let (tolerance, rate) = (1e-10, Cell::new(1.0));
    let mut y = Pulled(|_: f64| rate.get());
    let method = AutoSwitch::new(&y, Dop853::new(&y), Radau5::new(&y));
    let mut solver = adaptive(&mut y, method, tolerance, (&[0.0], &[0.0]));
    // By how much coordinate and momentum are away from the motion without kicks.
    let (mut start, mut off) = (0.0, [0.0, 0.0]);
    let mut implicit = 0;
    for (k, (end, kick, drag)) in [(1.0, 0.0, 1.0), (3.0, 0.5, 1e5), (5.0, -0.7, 1.0)].into_iter().enumerate() {
        let [q, p] = state(&mut solver, &y)[..] else { panic!("a coordinate and a momentum") };
        rate.set(drag);
        solver.resume(&mut y, start, &[q], &[p + kick]).expect("a state");
        let steps = solver.statistics().steps;
        let found = run(&mut solver, &mut y, end).expect("a run");
        let steps = solver.statistics().steps - steps;

        let (kicked, decay) = (off[1] + kick, (-drag * (end - start)).exp());
        off = [off[0] + kicked * (1.0 - decay) / drag, kicked * decay];
        let error = apart(&found, &[1.0 - end.cos() + off[0], end.sin() + off[1]]);
        let taken = solver.method().implicit_steps() - implicit;
        println!("until {end}: {steps} steps, {taken} of them implicit; {error:e}");
        // As in the motion above; the errors of all three parts add up.
        assert!(error < 10.0 * tolerance, "until {end}: {error:e}");
        if k == 1 {
            // The explicit method alone takes 89,000.
            assert!(taken > 0 && steps < 3000, "{taken} of {steps} steps");
        } else {
            assert_eq!(taken, 0, "until {end}");
        }
        (start, implicit) = (end, implicit + taken);
    }
}
