//! Rows that are kept, and the ends of columns.

use super::*;

#[test]
fn rows_are_read_as_they_were_pushed() {
    let mut rows = PushedRows::<f64, 2, 3, 4>::new();
    for k in 0..4 {
        let x = f64::from(k);
        rows.push([[x, -x], [10.0 + x, 0.5], [1.0, 2.0]]);
        assert_eq!(rows.row(k as usize)[1], [10.0 + x, 0.5]);
    }
    assert_eq!(rows.row(0)[0], [0.0, -0.0]);
    assert_eq!(rows.row(3)[0], [3.0, -3.0]);
}

#[test]
#[should_panic(expected = "written before it is read")]
fn a_row_that_is_not_there() {
    let mut rows = PushedRows::<f64, 1, 1, 2>::default();
    rows.push([[1.0]]);
    rows.row(1);
}

#[test]
#[should_panic(expected = "out of bounds")]
fn more_rows_than_there_is_room_for() {
    let mut rows = PushedRows::<f32, 1, 1, 1>::new();
    rows.push([[1.0]]);
    rows.push([[1.0]]);
}

/// `a b + c` in the arithmetic of the call, and in plain arithmetic.
struct Twice;

impl Kernel<0, 1, (&[f64; 3], &mut [f64; 2])> for Twice {
    #[inline(always)]
    fn run<A: Arithmetic>(([a, b, c], out): (&[f64; 3], &mut [f64; 2])) {
        *out = [A::fma_f64(*a, *b, *c), Plain::fma_f64(*a, *b, *c)];
    }
}

/// Long kernels have the arithmetic of others, with the instructions of every level; exact ones are plain.
#[test]
fn long_kernels_have_the_bits_of_others() {
    let small = f64::powi(2.0, -30);
    let numbers = [1.0 + small, 1.0 - small, -1.0];
    let [mut short, mut long, mut wide, mut exact, mut exact_long] = [[f64::NAN; 2]; 5];
    call::<Twice, 0, _>((&numbers, &mut short));
    call_long::<Twice, 0, _>((&numbers, &mut long));
    processor::call::<Twice, 0, 1, _, true>((&numbers, &mut wide));
    call_exact::<Twice, 0, false, _>((&numbers, &mut exact));
    call_exact::<Twice, 0, true, _>((&numbers, &mut exact_long));
    let fused = if level() == Level::Plain { 0.0 } else { -small * small };
    assert_eq!([short, long, wide], [[fused, 0.0]; 3]);
    assert_eq!([exact[1], exact_long[1]], [0.0; 2]);
}
