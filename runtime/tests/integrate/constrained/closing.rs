//! Consistent states.

use super::systems::*;
use mbd_runtime::constrained::{close, complete, Closing, ConstraintError};
use mbd_runtime::Constrained;

const BAR: [f64; 4] = [1.0, 2.0, 2.0, 2.5];

/// The angle of the crank is held by holding both coordinates of its tip; the start chooses the side of the coupler.
#[test]
fn branches_follow_the_start() {
    let mut y = Closed::new(Sticks::four_bar(BAR));
    for (guess, side) in [([0.0, 1.0, 1.5, 2.5], 1.0), ([0.0, 1.0, 1.0, -2.0], -1.0)] {
        let mut q = guess.to_vec();
        let closing = Closing::holding(&[true, true]);
        let closed = close(&mut y, &mut q, &closing).unwrap();
        assert_eq!((q[0], q[1]), (0.0, 1.0));
        // Round-off of a residual of numbers of size 10.
        assert!(closed.residual < 1e-14 && closed.iterations < 10, "{closed:?}");
        // Row 0 has no free columns.
        assert_eq!(closed.rank, 2);
        assert!(q[3] * side > 0.0, "{q:?}");
    }
}

/// The step of least norm moves the four coordinates together: nothing else is as near, to first order.
#[test]
fn nothing_is_moved_in_vain() {
    let mut y = Closed::new(Sticks::double());
    let start = vec![0.6, -0.8, 1.2, -1.6];
    let mut q = start.clone();
    let closed = close(&mut y, &mut q, &Closing::default()).unwrap();
    assert_eq!((q.clone(), closed.iterations, closed.rank), (start, 0, 2));
    let mut q = vec![0.61, -0.8, 1.2, -1.61];
    close(&mut y, &mut q, &Closing::default()).unwrap();
    assert!(y.off(&q, &[0.0; 4]).0 < 1e-15);
}

/// Lengths that cannot meet: 5 m of ground, 1 + 1 + 1 m of links. What is left is the gap, shared: the sum of squares of `φ` at its
/// least, which the error reports.
#[test]
fn what_cannot_close_says_how_far_off_it_is() {
    let mut y = Closed::new(Sticks::four_bar([1.0, 1.0, 1.0, 5.0]));
    let mut q = vec![1.0, 0.2, 2.0, 0.1];
    let error = close(&mut y, &mut q, &Closing::default()).unwrap_err();
    let ConstraintError::NotClosed { constraint, residual, rank, rows: 3, .. } = error else { panic!("{error:?}") };
    // Stretched out, each link of 5/3: φ = (25/9 − 1)/2 = 8/9; rows that pull along one line are dependent.
    assert!((residual - 8.0 / 9.0).abs() < 0.05 && constraint < 3, "{error}");
    assert!(rank <= 3, "{error}");
    assert!(q.iter().all(|x| x.is_finite()));
}

/// The same stick twice: one row is redundant, and both are closed.
#[test]
fn redundant_rows_are_counted() {
    let mut y = Closed::new(Sticks::pendulum(2));
    let mut q = vec![0.5, -0.5];
    let closed = close(&mut y, &mut q, &Closing::default()).unwrap();
    assert!(closed.residual < 1e-15 && closed.rank == 1, "{closed:?}");
}

/// On a circle of no radius the rows are zero: no way is known from there.
#[test]
fn a_singular_start_is_named() {
    let mut y = Closed::new(Sticks::pendulum(1));
    let error = close(&mut y, &mut vec![0.0, 0.0], &Closing::default()).unwrap_err();
    assert!(matches!(error, ConstraintError::NotClosed { constraint: 0, rank: 0, rows: 1, .. }), "{error:?}");
    let error = close(&mut y, &mut vec![f64::NAN, 0.0], &Closing::default()).unwrap_err();
    assert!(matches!(error, ConstraintError::NotFinite { index: 0 }), "{error:?}");
}

/// A body turned and shifted far from its pin comes back on its group.
#[test]
fn bodies_are_moved_on_their_group() {
    let mut y = Closed::new(Top::new());
    let mut q = y.model.leaning(0.7);
    q[0] += 0.2;
    q[2] -= 0.1;
    let held = [true, true, true, false, false, false];
    // The centre of mass lies in a distance that the pin cannot have; free, it is brought nearer.
    assert!(close(&mut y, &mut q.clone(), &Closing::holding(&held)).is_err());
    let closed = close(&mut y, &mut q, &Closing::default()).unwrap();
    assert!(closed.residual < 1e-15 && closed.rank == 3, "{closed:?}");
    let norm: f64 = q[3..].iter().map(|x| x * x).sum();
    assert!((norm - 1.0).abs() < 1e-15);
    // The centre of mass held where it can be: the body turns alone.
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
    // The crank's tip cannot leave its circle.
    let mut v = vec![-3.0, 1.0, 0.0, 0.0];
    let error = complete(&mut y, 0.0, &q, &mut v, &[true, true], 1e-12).unwrap_err();
    let ConstraintError::Incompatible { constraint: 0, residual, rows: 3, .. } = error else { panic!("{error:?}") };
    assert!((residual - 1.0).abs() < 1e-12);
    // Momenta alone: settling is the projection.
    let (mut p, mut v, mut sigma) = (vec![1.0, 2.0, 3.0, 4.0], vec![0.0; 4], vec![0.0; 3]);
    y.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
    assert!(y.off(&q, &p).1 < 1e-14);
}
