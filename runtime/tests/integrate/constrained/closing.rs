//! Computation of consistent states: `close` for positions, `complete` for velocities.

use super::systems::*;
use mbd_runtime::constrained::{close, complete, Closing, ConstraintError};
use mbd_runtime::Constrained;

const BAR: [f64; 4] = [1.0, 2.0, 2.0, 2.5];

/// Both coordinates of the crank's tip are held, and with them its angle. The start decides on which side the coupler
/// lies.
#[test]
fn branches_follow_the_start() {
    let mut y = Closed::new(Sticks::four_bar(BAR));
    for (guess, side) in [([0.0, 1.0, 1.5, 2.5], 1.0), ([0.0, 1.0, 1.0, -2.0], -1.0)] {
        let mut q = guess.to_vec();
        let closing = Closing::holding(&[true, true]);
        let closed = close(&mut y, &mut q, &closing).unwrap();
        assert_eq!((q[0], q[1]), (0.0, 1.0));
        // The bound is round-off of a residual of numbers of size 10.
        assert!(closed.residual < 1e-14 && closed.iterations < 10, "{closed:?}");
        // Row 0 is that of the crank, and all its columns are held.
        assert_eq!(closed.rank, 2);
        assert!(q[3] * side > 0.0, "{q:?}");
    }
}

/// A closed state is not changed, and a state nearby is closed.
#[test]
fn closed_states_are_not_changed() {
    let mut y = Closed::new(Sticks::double());
    let start = vec![0.6, -0.8, 1.2, -1.6];
    let mut q = start.clone();
    let closed = close(&mut y, &mut q, &Closing::default()).unwrap();
    assert_eq!((q.clone(), closed.iterations, closed.rank), (start, 0, 2));
    let mut q = vec![0.61, -0.8, 1.2, -1.61];
    close(&mut y, &mut q, &Closing::default()).unwrap();
    assert!(y.off(&q, &[0.0; 4]).0 < 1e-15);
}

/// Links of 1 + 1 + 1 m cannot span a ground of 5 m. The iteration ends at the least sum of squares of `φ`, where the
/// links share the gap. The error reports the largest residual there.
#[test]
fn a_loop_that_cannot_close_reports_its_residual() {
    let mut y = Closed::new(Sticks::four_bar([1.0, 1.0, 1.0, 5.0]));
    let mut q = vec![1.0, 0.2, 2.0, 0.1];
    let error = close(&mut y, &mut q, &Closing::default()).unwrap_err();
    let ConstraintError::NotClosed { constraint, residual, rank, rows: 3, .. } = error else { panic!("{error:?}") };
    // The links are in one line, each stretched to 5/3 m: φ = (25/9 − 1)/2 = 8/9. Rows of links in one line are
    // dependent.
    assert!((residual - 8.0 / 9.0).abs() < 0.05 && constraint < 3, "{error}");
    assert!(rank <= 3, "{error}");
    assert!(q.iter().all(|x| x.is_finite()));
}

/// The same stick is present twice: one row is redundant, and both residuals are zero.
#[test]
fn redundant_rows_are_counted() {
    let mut y = Closed::new(Sticks::pendulum(2));
    let mut q = vec![0.5, -0.5];
    let closed = close(&mut y, &mut q, &Closing::default()).unwrap();
    assert!(closed.residual < 1e-15 && closed.rank == 1, "{closed:?}");
}

/// At the centre of the circle on which the point must lie, the row is zero and gives no direction.
#[test]
fn a_singular_start_is_named() {
    let mut y = Closed::new(Sticks::pendulum(1));
    let error = close(&mut y, &mut vec![0.0, 0.0], &Closing::default()).unwrap_err();
    assert!(matches!(error, ConstraintError::NotClosed { constraint: 0, rank: 0, rows: 1, .. }), "{error:?}");
    let error = close(&mut y, &mut vec![f64::NAN, 0.0], &Closing::default()).unwrap_err();
    assert!(matches!(error, ConstraintError::NotFinite { index: 0 }), "{error:?}");
}

/// A body that is rotated and displaced far from its spherical joint is closed by displacements on its Lie group.
#[test]
fn bodies_are_moved_on_their_lie_group() {
    let mut y = Closed::new(Top::new());
    let mut q = y.model.leaning(0.7);
    q[0] += 0.2;
    q[2] -= 0.1;
    let held = [true, true, true, false, false, false];
    // The distance of the centre of mass from the joint is wrong, so the loop cannot close while the centre is held.
    assert!(close(&mut y, &mut q.clone(), &Closing::holding(&held)).is_err());
    let closed = close(&mut y, &mut q, &Closing::default()).unwrap();
    assert!(closed.residual < 1e-15 && closed.rank == 3, "{closed:?}");
    let norm: f64 = q[3..].iter().map(|x| x * x).sum();
    assert!((norm - 1.0).abs() < 1e-15);
    // The centre of mass is held at the right distance, so only the orientation changes.
    let mut q = y.model.leaning(0.7);
    let centre = [0.0, 0.3, 0.0];
    q[..3].copy_from_slice(&centre);
    let closed = close(&mut y, &mut q, &Closing::holding(&held)).unwrap();
    assert!(closed.residual < 1e-12 && closed.rank == 2, "{closed:?}");
    assert_eq!(&q[..3], &centre);
}

#[test]
fn velocities_are_completed() {
    let mut y = Closed::new(Sticks::four_bar(BAR));
    let q = y.closed(&[0.0, 1.0, 1.5, 2.5], &[true, true]).unwrap();
    let mut v = vec![-3.0, 0.0, 0.0, 0.0];
    let done = complete(&mut y, 0.0, &q, &mut v, &[true, true], 1e-12).unwrap();
    assert!(done.residual < 1e-14 && done.rank == 2, "{done:?}");
    assert_eq!((v[0], v[1]), (-3.0, 0.0));
    // The crank's tip must move along its circle, so this held velocity contradicts the constraint.
    let mut v = vec![-3.0, 1.0, 0.0, 0.0];
    let error = complete(&mut y, 0.0, &q, &mut v, &[true, true], 1e-12).unwrap_err();
    let ConstraintError::Incompatible { constraint: 0, residual, rows: 3, .. } = error else { panic!("{error:?}") };
    assert!((residual - 1.0).abs() < 1e-12);
    // Momentum projection gives velocities that satisfy the constraints.
    let (mut p, mut v, mut sigma) = (vec![1.0, 2.0, 3.0, 4.0], vec![0.0; 4], vec![0.0; 3]);
    y.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
    assert!(y.off(&q, &p).1 < 1e-14);
}
