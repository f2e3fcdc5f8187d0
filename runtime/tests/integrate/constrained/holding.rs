//! Stabilisation after the steps of every kind of method.

use super::systems::*;
use crate::systems::largest;
pub use crate::systems::largest_difference as apart;
use mbd_runtime::constrained::{ConstraintError, Effort, Projection, Stabilisation, WithPostStep};
use mbd_runtime::integrate::{
    Abm4, Dop853, Euler, Gauss12FixedPoint, Rk4, Solver, Step, StepDoubling, StepError, Stepper,
};
use mbd_runtime::integrate::{SemiImplicitEuler, Tolerances, Tsit5, VariableAdams, Verner9};
use mbd_runtime::{Constrained, System};

const ALL: [Stabilisation; 5] = [
    Stabilisation::None,
    Stabilisation::Momenta,
    Stabilisation::Mass,
    Stabilisation::Gradient,
    Stabilisation::Partition,
];

pub type State = (Vec<f64>, Vec<f64>);

pub fn march<Y, M>(y: &mut Y, method: &mut M, steps: u32, end: f64, (q, p): &State) -> Result<State, StepError>
where
    Y: System<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>>,
    M: Stepper<Y>,
{
    let (h, mut q, mut p) = (end / f64::from(steps), q.clone(), p.clone());
    for k in 0..steps {
        method.step(y, f64::from(k) * h, h, &mut q, &mut p)?;
    }
    Ok((q, p))
}

pub fn held<Y, M>(y: &Y, method: M, policy: Stabilisation) -> WithPostStep<Y, M, Projection<Y>>
where
    Y: Constrained<Scalar = f64>,
    M: Stepper<Y>,
{
    WithPostStep::new(y, method, Projection::new(y, policy, Effort::default()))
}

fn double() -> (Closed<Sticks>, State) {
    (Closed::new(Sticks::double()), (vec![0.8, -0.6, 1.4, 0.2], vec![0.0; 4]))
}

/// Without position projection, positions drift by the method's error. With any of the three position projections they
/// stay closed. With momentum projection, momenta have no part `Φᵀσ`.
#[test]
fn drift() {
    for policy in ALL {
        let (mut y, start) = double();
        let method = Rk4::new(&y);
        let mut method = held(&y, method, policy);
        let (q, p) = march(&mut y, &mut method, 400, 2.0, &start).unwrap();
        let (position, velocity) = y.off(&q, &p);
        let (_, sigma, _) = y.velocities(&q, &p);
        let sigma = largest(sigma);
        let energy = (y.energy(&q, &p) - y.energy(&start.0, &start.1)).abs();
        println!("{policy:?}: drift {position:.1e}, velocities {velocity:.1e}, σ {sigma:.1e}, energy {energy:.1e}");
        assert!(velocity < 1e-13, "{policy:?}");
        assert!(energy < 2e-4, "{policy:?}: {energy}");
        match policy {
            Stabilisation::None => assert!(sigma > 1.0 && position > 1e-9),
            Stabilisation::Momenta => assert!(sigma < 1e-13 && position > 1e-9),
            _ => assert!(sigma < 1e-7 && position < 1e-14, "{policy:?}: {position}"),
        }
    }
}

/// Each method keeps its order: halving the step divides the error by about `2^order`.
#[test]
fn orders() {
    fn check<M: Stepper<Closed<Sticks>>>(name: &str, order: i32, steps: u32, make: impl Fn(&Closed<Sticks>) -> M) {
        for policy in ALL {
            let (mut y, start) = double();
            let fine = Verner9::new(&y);
            let mut fine = held(&y, fine, Stabilisation::Mass);
            let reference = march(&mut y, &mut fine, 400, 0.5, &start).unwrap();
            let mut error = |steps| {
                let mut method = held(&y, make(&y), policy);
                apart(&march(&mut y, &mut method, steps, 0.5, &start).unwrap().0, &reference.0)
            };
            let (coarse, fine) = (error(steps), error(2 * steps));
            let found = (coarse / fine).log2();
            println!("{name} {policy:?}: order {found:.2} ({coarse:.1e}, {fine:.1e})");
            assert!(found > f64::from(order) - 0.4, "{name} {policy:?}: {found}");
        }
    }
    check("euler", 1, 200, Euler::new);
    check("semi-implicit", 1, 200, SemiImplicitEuler::new);
    check("rk4", 4, 25, Rk4::new);
    check("rk4 doubled", 4, 15, |y| StepDoubling::over(y, Rk4::new(y)));
    check("tsit5", 5, 20, Tsit5::new);
    check("dop853", 8, 5, Dop853::new);
    check("abm4", 4, 100, Abm4::new);
    // Order 12 shows only where the error is round-off, so the test requires less.
    check("gauss12", 8, 2, Gauss12FixedPoint::new);
}

/// Steps by error control, also for methods that reuse a stage of the last step; states are closed in dense output and
/// at the end.
#[test]
fn adaptive_steps() {
    fn check<M: Stepper<Closed<Sticks>>>(name: &str, factor: f64, make: impl Fn(&Closed<Sticks>) -> M) {
        let (mut y, start) = double();
        let fine = Verner9::new(&y);
        let mut fine = held(&y, fine, Stabilisation::Mass);
        let reference = march(&mut y, &mut fine, 2000, 2.0, &start).unwrap();
        for policy in ALL {
            let method = held(&y, make(&y), policy);
            let step = Step::Adaptive(Tolerances::new(1e-10));
            let mut solver = Solver::new(&mut y, method, step, 0.0, &start.0, &start.1).unwrap();
            let (mut q, mut p) = start.clone();
            let closes = !matches!(policy, Stabilisation::None | Stabilisation::Momenta);
            while solver.time() < 2.0 {
                solver.advance(&mut y, 2.0).unwrap();
                solver.dense(&mut y, 0.4, &mut q, &mut p);
                assert!(!closes || y.off(&q, &p).0 < 1e-13, "{name} {policy:?}: {:?}", y.off(&q, &p));
                solver.state(&y, &mut q, &mut p);
                assert!(!closes || y.off(&q, &p).0 < 1e-13, "{name} {policy:?}: {:?}", y.off(&q, &p));
            }
            let error = apart(&q, &reference.0);
            println!("{name} {policy:?}: {error:.1e} {:?}", solver.statistics());
            assert!(error < factor * 1e-10, "{name} {policy:?}: {error}");
        }
    }
    check("tsit5", 200.0, Tsit5::new);
    check("dop853", 200.0, Dop853::new);
    check("adams", 200.0, VariableAdams::new);
}

/// A redundant row does not change the motion.
#[test]
fn redundant_rows() {
    let end = [1, 2].map(|n| {
        let mut y = Closed::new(Sticks::pendulum(n));
        let method = Rk4::new(&y);
        let mut method = held(&y, method, Stabilisation::Mass);
        march(&mut y, &mut method, 200, 2.0, &(vec![1.0, 0.0], vec![0.0; 2])).unwrap()
    });
    assert!(apart(&end[0].0, &end[1].0) < 1e-13 && apart(&end[0].1, &end[1].1) < 1e-13, "{end:?}");
}

/// A top, described as a free body with a spherical joint as constraint. Projection changes positions and momenta in
/// the chart of the quaternion.
#[test]
fn a_body_on_its_lie_group() {
    for policy in ALL {
        let mut y = Closed::new(Top::new());
        let q = y.model.leaning(0.3);
        // The top rotates with 100 rad/s about its axis, and slowly about x.
        let mut p = vec![0.0, 0.0, 0.0, 0.02 * 2.0, 0.0, 0.01 * 100.0];
        let (mut v, mut sigma) = (vec![0.0; 6], vec![0.0; 3]);
        y.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
        let start = (q, p);
        let fine = Dop853::new(&y);
        let mut fine = held(&y, fine, Stabilisation::Mass);
        let reference = march(&mut y, &mut fine, 1000, 0.5, &start).unwrap();
        let mut error = |steps| {
            let method = Rk4::new(&y);
            let mut method = held(&y, method, policy);
            let (q, p) = march(&mut y, &mut method, steps, 0.5, &start).unwrap();
            let closed = y.off(&q, &p).0;
            let vertical = y.model.vertical(&q, &p) - y.model.vertical(&start.0, &start.1);
            println!(
                "{policy:?} {steps}: {:.1e}, drift {closed:.1e}, vertical {vertical:.1e}",
                apart(&q, &reference.0)
            );
            assert!(matches!(policy, Stabilisation::None | Stabilisation::Momenta) || closed < 1e-14);
            apart(&q, &reference.0)
        };
        let found = (error(250) / error(500)).log2();
        assert!(found > 3.6, "{policy:?}: {found}");
    }
}

/// In ten thousand steps of 1 ms with two iterations each, the drift is round-off.
#[test]
fn long_drift() {
    let (mut y, start) = double();
    let hold = Projection::new(&y, Stabilisation::Mass, Effort { iterations: 2, tolerance: 0.0, ..Effort::default() });
    let method = Rk4::new(&y);
    let mut method = WithPostStep::new(&y, method, hold);
    let ((mut q, mut p), mut worst) = (start, 0.0_f64);
    for k in 0..10_000 {
        method.step(&mut y, 1e-3 * f64::from(k), 1e-3, &mut q, &mut p).unwrap();
        worst = largest([worst, y.off(&q, &p).0]);
    }
    assert!(worst < 1e-15, "{worst}");
    assert_eq!(method.post_step.rank(), Some(2));
    assert_eq!(method.post_step.singular_positions(), (0, None));
}

/// A step whose positions three iterations cannot close is refused with residual and rank, and the state does not
/// change.
#[test]
fn positions_that_cannot_be_closed_are_refused() {
    let mut y = Closed::new(Sticks::pendulum(1));
    let method = Euler::new(&y);
    let mut method = held(&y, method, Stabilisation::Mass);
    let start = (vec![1.0, 0.0], vec![0.0, -30.0]);
    let error = march(&mut y, &mut method, 1, 10.0, &start).unwrap_err();
    let StepError::Constraint { time: 0.0, error: ConstraintError::NotClosed { residual, rank, .. } } = error else {
        panic!("{error:?}")
    };
    // The step ends 300 m from the pivot, and each iteration halves the distance.
    assert!(residual > 100.0 && rank == 1, "{error}");
    let (mut q, mut p) = start.clone();
    assert!(method.step(&mut y, 0.0, 10.0, &mut q, &mut p).is_err());
    assert_eq!((q, p), start);
}

/// A motion that begins again at an earlier time is judged by itself: a step that takes too large a part of its kinetic energy is
/// refused, however large that of the motion before was.
#[test]
fn a_projection_judges_each_motion_by_its_own_energy() {
    let (mut y, (q, _)) = double();
    // Both masses turn about the origin, with 2 rad/s and with 100 rad/s.
    let [slow, fast] = [2.0, 100.0].map(|rate| (q.clone(), [0.6, 0.8, -0.2, 1.4].map(|r| rate * r).to_vec()));
    for policy in [Stabilisation::Momenta, Stabilisation::Mass] {
        let mut new = held(&y, Euler::new(&y), policy);
        let refused = march(&mut y, &mut new, 1, 0.2, &slow).unwrap_err();
        let StepError::Constraint { error: ConstraintError::Energy { taken, kinetic, .. }, .. } = refused else {
            panic!("{policy:?}: {refused:?}")
        };
        println!("{policy:?}: {taken:.1e} J of {kinetic:.1e} J");
        let mut used = held(&y, Euler::new(&y), policy);
        march(&mut y, &mut used, 20_000, 0.4, &fast).unwrap();
        assert_eq!(march(&mut y, &mut used, 1, 0.2, &slow).unwrap_err(), refused, "{policy:?}");
    }
}
