//! Motion in minimal coordinates.

use super::holding::{apart, held, march};
use super::systems::*;
use mbd_runtime::constrained::{ConstraintError, CoordinatePartition, Repartition, Stabilisation, WithPostStep};
use mbd_runtime::integrate::{Abm4, Dop853, Rk4, Solver, Step, StepError, Stepper, Tolerances, Verner9};
use mbd_runtime::{Energetic, System};

type State = (Vec<f64>, Vec<f64>);

fn minimal<T: Model + Clone>(y: &Closed<T>, (q, p): &State) -> (CoordinatePartition<Closed<T>>, State) {
    let (mut q, mut p) = (q.clone(), p.clone());
    let y = CoordinatePartition::new(y.clone(), &mut q, &mut p).unwrap();
    (y, (q, p))
}

/// A crank-rocker linkage whose crank rotates all the way round, starting with 5 rad/s.
fn crank() -> (Closed<Sticks>, State) {
    let mut y = Closed::new(Sticks::four_bar([1.0, 2.0, 2.0, 2.5]));
    let q = y.closed(&[0.0, 1.0, 1.5, 2.5], &[true, true]).unwrap();
    let mut p = vec![-8.0, 0.0, -4.0, 0.0];
    let (mut v, mut sigma) = (vec![0.0; 4], vec![0.0; 3]);
    mbd_runtime::Constrained::project_momenta(&mut y, 0.0, &q, &mut p, &mut v, &mut sigma);
    (y, (q, p))
}

/// The momenta `p⁺ + Φᵀ δ` have the same velocities as `p⁺` for any `δ`, to round-off.
#[test]
fn multipliers_are_a_gauge() {
    let (mut y, (q, p)) = crank();
    let (v, sigma, phi) = y.velocities(&q, &p);
    let delta = [0.7, -1.3, 2.1];
    let moved: Vec<f64> = (0..4).map(|k| p[k] + (0..3).map(|i| phi[i][k] * delta[i]).sum::<f64>()).collect();
    let (w, tau, _) = y.velocities(&q, &moved);
    assert!(apart(&v, &w) < 1e-14);
    assert!((0..3).all(|i| (tau[i] - sigma[i] - delta[i]).abs() < 1e-13));
    // The momenta of minimal coordinates are one choice of `δ`: the one with zero dependent momenta.
    let (y_min, (q_min, p_min)) = minimal(&y, &(q, p.clone()));
    assert_eq!(y_min.dependents().count(), 3);
    assert!(y_min.dependents().all(|d| p_min[d] == 0.0));
    assert!(apart(&v, &y.velocities(&q_min, &p_min).0) < 1e-14);
}

/// With every method, the motion is that of redundant coordinates with projection, to the tolerance. The energy is
/// conserved, and every step ends closed.
#[test]
fn the_same_motion_as_with_projection() {
    fn check<M: Stepper<CoordinatePartition<Closed<Sticks>>>>(
        name: &str,
        make: impl Fn(&CoordinatePartition<Closed<Sticks>>) -> M,
    ) {
        let (mut y, start) = crank();
        let fine = Verner9::new(&y);
        let mut fine = held(&y, fine, Stabilisation::Mass);
        let reference = march(&mut y, &mut fine, 4000, 4.0, &start).unwrap();
        let energy = y.energy(&start.0, &start.1);
        let (mut m, (q, p)) = minimal(&y, &start);
        let method = WithPostStep::new(&m, make(&m), Repartition::default());
        let mut solver = Solver::new(&mut m, method, Step::Adaptive(Tolerances::new(1e-10)), 0.0, &q, &p).unwrap();
        let (mut q, mut p) = (q, p);
        while solver.time() < 4.0 {
            solver.advance(&mut m, 4.0).unwrap_or_else(|e| panic!("{e}: {:?}", m.trouble()));
            solver.dense(&mut m, 0.5, &mut q, &mut p);
            assert!(y.off(&q, &p).0 < 1e-14);
            solver.state(&m, &mut q, &mut p);
            assert!(y.off(&q, &p).0 < 1e-14);
        }
        let (error, drift) = (apart(&q, &reference.0), (y.energy(&q, &p) - energy).abs());
        let (switches, record) = m.switches();
        println!(
            "{name}: {error:.1e}, energy {drift:.1e}, {switches} switches, {:?}, {:?}",
            record.first(),
            solver.statistics()
        );
        println!("{:.2} closures an evaluation", m.closures() as f64 / solver.statistics().evaluations as f64);
        // The crank makes four turns, over which the errors of steps add up.
        assert!(error < 1e-7 && drift < 5e-7, "{name}");
        assert!(switches > 5 && record.iter().all(|s| s.pivot > 2.0), "{name}: {switches}");
    }
    check("dop853", Dop853::new);
    check("verner9", Verner9::new);
}

/// With fixed steps, RK4 has order 4, and so has a multistep method, which must restart after a switch of the
/// partition.
#[test]
fn orders() {
    let (mut y, start) = crank();
    let fine = Verner9::new(&y);
    let mut fine = held(&y, fine, Stabilisation::Mass);
    let reference = march(&mut y, &mut fine, 2000, 1.0, &start).unwrap();
    fn error<M: Stepper<CoordinatePartition<Closed<Sticks>>>>(
        y: &Closed<Sticks>,
        start: &State,
        reference: &State,
        steps: u32,
        make: impl Fn(&CoordinatePartition<Closed<Sticks>>) -> M,
    ) -> f64 {
        let (mut m, start) = minimal(y, start);
        let mut method = WithPostStep::new(&m, make(&m), Repartition::default());
        let end = march(&mut m, &mut method, steps, 1.0, &start).unwrap();
        assert!(m.switches().0 > 0);
        apart(&end.0, &reference.0)
    }
    let errors = [100, 200].map(|n| error(&y, &start, &reference, n, Rk4::new));
    assert!((errors[0] / errors[1]).log2() > 3.6, "{errors:?}");
    let errors = [400, 800].map(|n| error(&y, &start, &reference, n, Abm4::new));
    assert!((errors[0] / errors[1]).log2() > 3.4, "{errors:?}");
}

/// At the dead point crank and coupler are in one line, and the position of the rocker does not determine that of the
/// crank. With switching of the partition the energy is conserved to 1e-9. Without switching the run fails there.
#[test]
fn through_the_dead_point() {
    let (y, start) = crank();
    let run = |ratio: f64| {
        let (m, (mut q, mut p)) = minimal(&y, &start);
        let mut m = m.with_ratio(ratio);
        // The x coordinate of the rocker's tip is the independent one.
        m.choose_among(&[0, 1, 3], &mut q, &mut p).unwrap();
        let method = WithPostStep::new(&m, Dop853::new(&m), Repartition::default());
        let mut solver = Solver::new(&mut m, method, Step::Adaptive(Tolerances::new(1e-10)), 0.0, &q, &p).unwrap();
        let (t, v) = m.energies(&q, &p);
        let before = t + v;
        let result = solver.run(&mut m, 3.0);
        solver.state(&m, &mut q, &mut p);
        let (t, v) = m.energies(&q, &p);
        (result, (t + v - before).abs(), m.switches().0)
    };
    let (result, off, switches) = run(2.0);
    assert!(result.is_ok() && off < 1e-9 && switches > 5, "{result:?} {off} {switches}");
    let (result, _, switches) = run(f64::INFINITY);
    assert!(result.is_err() && switches == 0, "{result:?}");
}

/// The same stick is present twice: one row is redundant, so the partition has one dependent coordinate.
#[test]
fn redundant_rows() {
    let mut y = Closed::new(Sticks::pendulum(2));
    let start = (vec![1.0, 0.0], vec![0.0; 2]);
    let (mut m, from) = minimal(&y, &start);
    assert_eq!(m.dependents().count(), 1);
    let mut method = WithPostStep::new(&m, Rk4::new(&m), Repartition::default());
    let end = march(&mut m, &mut method, 2000, 2.0, &from).unwrap();
    let energy = y.energy(&end.0, &end.1) - y.energy(&start.0, &start.1);
    // The measured errors are 1.5e-8 with steps of 1 ms and 2.4e-7 with 2 ms. The motion in x is less smooth than in
    // the angle.
    assert!(m.switches().0 >= 2 && energy.abs() < 5e-8, "{energy:e}, {:?}", m.switches());
    assert!(y.off(&end.0, &end.1).0 < 1e-15);
}

/// Loops without common coordinates choose and switch their dependent coordinates independently of each other.
#[test]
fn many_loops() {
    let n = 12;
    let one = Sticks::double();
    let mut all = Sticks { masses: vec![], sticks: vec![], gravity: G };
    let shift = |end: End, k: usize| match end {
        Point(i) => Point(i + 2 * k),
        fixed => fixed,
    };
    let (mut q, mut p) = (vec![], vec![]);
    for k in 0..n {
        all.masses.extend(&one.masses);
        all.sticks.extend(one.sticks.iter().map(|(a, b, l)| (shift(*a, k), shift(*b, k), *l)));
        q.extend([0.8, -0.6, 1.4, 0.2]);
        p.extend([0.0; 4]);
    }
    let (mut m, from) = minimal(&Closed::new(all), &(q, p));
    let mut method = WithPostStep::new(&m, Rk4::new(&m), Repartition::default());
    let end = march(&mut m, &mut method, 500, 1.0, &from).unwrap();
    let (mut m1, from) = minimal(&Closed::new(one), &(vec![0.8, -0.6, 1.4, 0.2], vec![0.0; 4]));
    let mut method = WithPostStep::new(&m1, Rk4::new(&m1), Repartition::default());
    let single = march(&mut m1, &mut method, 500, 1.0, &from).unwrap();
    for k in 0..n {
        assert!(apart(&end.0[4 * k..4 * k + 4], &single.0) < 1e-11);
    }
    assert_eq!(m.switches().0, n as u64 * m1.switches().0);
}

/// A top as a free body: some freedoms of its pose depend on the others.
#[test]
fn a_body_on_its_lie_group() {
    let mut y = Closed::new(Top::new());
    let q = y.model.leaning(0.3);
    let mut p = vec![0.0, 0.0, 0.0, 0.02 * 2.0, 0.0, 0.01 * 30.0];
    let (mut v, mut sigma) = (vec![0.0; 6], vec![0.0; 3]);
    mbd_runtime::Constrained::project_momenta(&mut y, 0.0, &q, &mut p, &mut v, &mut sigma);
    let start = (q, p);
    let fine = Dop853::new(&y);
    let mut fine = held(&y, fine, Stabilisation::Mass);
    let reference = march(&mut y, &mut fine, 1000, 0.5, &start).unwrap();
    for dependents in [[0, 1, 2], [2, 3, 4]] {
        let (mut m, (mut q, mut p)) = minimal(&y, &start);
        m.choose_among(&dependents, &mut q, &mut p).unwrap();
        let mut error = |steps| {
            let mut method = WithPostStep::new(&m, Rk4::new(&m), Repartition::default());
            let end = march(&mut m, &mut method, steps, 0.5, &(q.clone(), p.clone())).unwrap();
            assert!(y.off(&end.0, &end.1).0 < 1e-14);
            apart(&end.0, &reference.0)
        };
        let errors = [error(250), error(500)];
        println!("{errors:?} {:?}", m.switches().0);
        assert!((errors[0] / errors[1]).log2() > 3.6, "{errors:?}");
    }
}

/// A choice of dependent coordinates that do not follow from the others is refused with the rank.
#[test]
fn impossible_partitions_are_refused() {
    let (y, start) = crank();
    let (mut m, (mut q, mut p)) = minimal(&y, &start);
    // The crank is upright: its tip cannot move in y, so y cannot be independent.
    let error = m.choose_among(&[0, 2, 3], &mut q, &mut p).unwrap_err();
    assert!(matches!(error, ConstraintError::RankLoss { rank: 2, before: 3, .. }), "{error:?}");
    let error = m.choose_among(&[0, 1], &mut q, &mut p).unwrap_err();
    assert!(matches!(error, ConstraintError::RankLoss { rank: 2, before: 3, .. }), "{error:?}");
    m.choose_among(&[1, 2, 3], &mut q, &mut p).unwrap();
    // A crank of 1 m cannot reach x = 5 m: the rates are NaN, and `trouble` gives the reason.
    let mut far = vec![5.0, 1.0, 1.5, 2.5];
    let (mut qd, mut pd) = (m.neutral(), m.zero_momenta());
    m.rates_at(0.0, &far, &p, &mut qd, &mut pd);
    assert!(qd.iter().chain(&pd).all(|x| x.is_nan()) && m.trouble().is_some(), "{qd:?}");
    let mut method = WithPostStep::new(&m, Rk4::new(&m), Repartition::default());
    let error = method.step(&mut m, 0.0, 0.1, &mut far, &mut p).unwrap_err();
    assert!(matches!(error, StepError::NotFinite { .. }), "{error:?}");
    m.rates_at(0.0, &q, &p, &mut qd, &mut pd);
    assert!(m.trouble().is_none());
}
