//! Measures of errors of lists. Differences are infinite where a number is not finite, over which a maximum passes.

/// The largest absolute value, at least `least`; NaN where a number is NaN.
pub fn largest(list: &[f64], least: f64) -> f64 {
    list.iter().map(|x| x.abs()).fold(least, |most, x| if x.total_cmp(&most).is_gt() { x } else { most })
}

/// The largest difference of two lists; infinite where a number of either is not finite.
///
/// # Panics
/// They have different lengths.
#[track_caller]
pub fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len(), "lists that are compared");
    let difference = |(a, b): (&f64, &f64)| (a - b).abs();
    // No difference of anything and NaN or an infinite number is finite.
    a.iter().zip(b).map(difference).fold(0.0, |most, x| if x.is_finite() { most.max(x) } else { f64::INFINITY })
}

/// The largest difference of a list from what it should be, as a part of the largest number of the latter, or of `least`
/// where that is larger; infinite where a number of either is not finite.
///
/// # Panics
/// They have different lengths.
#[track_caller]
pub fn relative_error(found: &[f64], expected: &[f64], least: f64) -> f64 {
    let off = largest_difference(found, expected);
    // Nothing that differs by nothing from nothing.
    if off == 0.0 || off.is_infinite() {
        return off;
    }
    off / largest(expected, least)
}
