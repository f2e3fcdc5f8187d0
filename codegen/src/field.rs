//! Height fields: the spline through given heights, its bounds, and whether a ball fits into its hollows.

use mbd_runtime::field::{Ball, Field, Foot};

use crate::known::Known;

/// Most heights of a field.
pub(crate) const MOST: usize = 65_536;

/// Fewest heights along an axis: as many as determine a polynomial of third degree.
pub(crate) const FEWEST: usize = 4;

/// The field through heights in rows along x, the first one at the least y: rows of the same length, at least [`FEWEST`] along
/// both axes, and finite.
///
/// Along both axes it is the cubic spline whose first two and last two cells are one polynomial each: heights of a polynomial
/// of third degree give that polynomial.
pub(crate) fn field(spacing: [f64; 2], heights: &[Vec<f64>]) -> &'static Field {
    let points = [heights.first().map_or(0, Vec::len), heights.len()];
    let rows: Vec<Vec<f64>> = heights.iter().map(|row| controls(row)).collect();
    let width = points[0] + 8;
    let mut net = vec![0.0; width * (points[1] + 8)];
    for x in 0..width {
        let column: Vec<f64> = rows.iter().map(|row| row[x]).collect();
        for (y, number) in controls(&column).into_iter().enumerate() {
            net[y * width + x] = number;
        }
    }
    let slope = steepest(&net, width, spacing);
    // The last four of the control numbers begin no cell.
    let cells = points.map(|n| n + 5);
    let cell = |n: usize| kept((0..n).map(|k| k as f64).collect());
    let inside = |n: usize| kept((0..n).map(|k| if k == 0 || k + 1 == n { 0.0 } else { 1.0 }).collect());
    let all = Field { spacing, points, net: kept(net), cells: cells.map(cell), inside: cells.map(inside), slope };
    // As the tables, equal fields exist once.
    static ALL: Known<(usize, [usize; 2], [u64; 2]), &Field> = Known::new();
    let key = (all.net.as_ptr() as usize, all.points, all.spacing.map(f64::to_bits));
    ALL.get(key, || Box::leak(Box::new(all)))
}

/// Control numbers of the spline through numbers that are one apart, with three more like the first one in front of it, and
/// three like the last one behind the last.
fn controls(through: &[f64]) -> Vec<f64> {
    let n = through.len();
    // Where the third derivative goes on, the fourth differences of the control numbers are zero; with the equations
    // `c₋ + 4 c + c₊ = 6 h` this one remains.
    let near = |k: usize| through[k] - (through[k - 1] - 2.0 * through[k] + through[k + 1]) / 6.0;
    let mut c = vec![0.0; n];
    (c[1], c[n - 2]) = (near(1), near(n - 2));
    // Those between them, by elimination from the first to the last.
    let mut factors = vec![0.0; n];
    for k in 2..n.saturating_sub(2) {
        let pivot = 1.0 / (4.0 - factors[k - 1]);
        let known = 6.0 * through[k] - c[k - 1] - if k + 3 == n { c[n - 2] } else { 0.0 };
        (factors[k], c[k]) = (pivot, pivot * known);
    }
    for k in (2..n.saturating_sub(3)).rev() {
        c[k] -= factors[k] * c[k + 1];
    }
    let next = |h: f64, c: f64, before: f64| 6.0 * h - 4.0 * c - before;
    c[0] = next(through[1], c[1], c[2]);
    c[n - 1] = next(through[n - 2], c[n - 2], c[n - 3]);
    let first = next(through[0], c[0], c[1]);
    let last = next(through[n - 1], c[n - 1], c[n - 2]);
    [vec![first; 4], c, vec![last; 4]].concat()
}

/// A bound of the slope: derivatives of a spline are means of the differences of its control numbers.
fn steepest(net: &[f64], width: usize, [dx, dy]: [f64; 2]) -> f64 {
    let most = |step: usize, spacing: f64, along: bool| {
        let pairs = (step..net.len()).filter(|k| along || k % width != 0).map(|k| (net[k] - net[k - step]).abs());
        pairs.fold(0.0, f64::max) / spacing
    };
    length(most(1, dx, false), most(width, dy, true))
}

/// Length of a vector: a root, which is rounded the same on every host.
fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// A table that stays for as long as the program runs: code that was made at run time reads it, and the operations of the
/// symbolic core name it by its place. Equal tables exist once.
fn kept(table: Vec<f64>) -> &'static [f64] {
    static ALL: Known<Vec<u64>, &[f64]> = Known::new();
    let bits = table.iter().map(|x| x.to_bits()).collect();
    ALL.get(bits, || Box::leak(table.into_boxed_slice()))
}

/// A place where a ball does not follow the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Narrow {
    /// The place in the axes of the field, m.
    pub at: [f64; 2],
    /// Least radius of curvature of the ground there where it is hollow, m; infinite where it is not.
    pub radius: f64,
}

/// How a ball fits on a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fit {
    /// Steps with which the place is found where it touches.
    pub steps: usize,
    /// The narrowest of the places on the grid, and of those beside it, that are not found with as many.
    pub narrow: [Option<Narrow>; 2],
}

/// Most steps.
const STEPS: usize = 6;

/// How near a step has to come, in units of the radius, before the last one, which squares that: the place is found to
/// rounding errors then.
const NEAR: f64 = 1e-6;

/// Tries a ball on the heights, on the middles of the cells and of their edges, also where the ground becomes level beside the
/// grid.
pub(crate) fn fit(field: &'static Field, radius: f64) -> Fit {
    static ALL: Known<(usize, u64), Fit> = Known::new();
    ALL.get((std::ptr::from_ref(field) as usize, radius.to_bits()), || tried(field, radius))
}

fn tried(field: &Field, radius: f64) -> Fit {
    let mut fit = Fit { steps: 1, narrow: [None; 2] };
    let places = |k: usize| {
        let last = 2 * (field.points[k] as i64 - 1);
        (-4..=last + 4).map(move |n| (n < 0 || n > last, (0.5 * n as f64 - 0.25 * last as f64) * field.spacing[k]))
    };
    for (beside_x, x) in places(0) {
        for (beside_y, y) in places(1) {
            // Beside the origin: where the middle of a ball is that touches here.
            let foot = field.foot([x, y], [0.0; 2], Some(radius));
            let middle = foot.off;
            let near = |steps: usize| {
                let found = field.under(middle, Some(Ball { radius, steps })).place;
                length(found[0] - x, found[1] - y) <= NEAR * radius
            };
            // As many as were enough elsewhere, mostly.
            if near(fit.steps - 1) {
                continue;
            }
            match (fit.steps..STEPS).find(|steps| near(*steps)) {
                Some(steps) => fit.steps = steps + 1,
                None => {
                    let here = Narrow { at: [x, y], radius: hollow(&foot) };
                    let narrowest = &mut fit.narrow[usize::from(beside_x || beside_y)];
                    if narrowest.is_none_or(|other| here.radius < other.radius) {
                        *narrowest = Some(here);
                    }
                }
            }
        }
    }
    fit
}

/// The smallest radius of a hollow, m.
fn hollow(foot: &Foot<f64>) -> f64 {
    let m = foot.curvature();
    let (half, difference) = (0.5 * (m[0][0] + m[1][1]), 0.5 * (m[0][0] - m[1][1]));
    let most = half + (difference * difference + m[0][1] * m[1][0]).max(0.0).sqrt();
    if most > 0.0 {
        1.0 / (foot.cosine * most)
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use mbd_runtime::field::Ground;

    use super::*;

    fn rows(points: [usize; 2], spacing: [f64; 2], h: impl Fn(f64, f64) -> f64) -> Vec<Vec<f64>> {
        let at = |k: usize, axis: usize| (k as f64 - 0.5 * (points[axis] - 1) as f64) * spacing[axis];
        (0..points[1]).map(|j| (0..points[0]).map(|i| h(at(i, 0), at(j, 1))).collect()).collect()
    }

    /// Polynomials of third degree along both axes are what they are, with their derivatives, from the fewest heights on.
    #[test]
    fn cubic_polynomials_are_exact() {
        let h = |x: f64, y: f64| 0.3 + 0.2 * x - 0.4 * y + x * x * y - 0.5 * x * x * x + 0.7 * x * y * y * y;
        let spacing = [0.31, 0.17];
        for points in [[4, 4], [5, 4], [4, 7], [6, 5], [20, 31]] {
            let field = field(spacing, &rows(points, spacing, h));
            for k in 0..100 {
                let place = |axis: usize, step: usize| {
                    let part = (k * step % 100) as f64 / 99.0 - 0.5;
                    part * (points[axis] - 1) as f64 * spacing[axis]
                };
                let (x, y) = (place(0, 1), place(1, 37));
                let got = field.at([x, y]);
                let slope = [0.2 + 2.0 * x * y - 1.5 * x * x + 0.7 * y * y * y, -0.4 + x * x + 2.1 * x * y * y];
                let bend = [2.0 * y - 3.0 * x, 2.0 * x + 2.1 * y * y, 4.2 * x * y];
                // Rounding of sums of sixteen products; derivatives divide it by the lesser spacing.
                let size = 1.0 + field.net.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                let near = |a: f64, b: f64, order: usize| {
                    let tolerance = [1e-14, 6e-14, 4e-13][order] * size;
                    assert!((a - b).abs() <= tolerance, "{points:?} at {x} {y}: {a} {b}");
                };
                near(got.height, h(x, y), 0);
                (0..2).for_each(|k| near(got.slope[k], slope[k], 1));
                (0..3).for_each(|k| near(got.bend[k], bend[k], 2));
                assert!(length(got.slope[0], got.slope[1]) <= field.slope);
            }
        }
    }

    /// The surface goes through its heights and is smooth everywhere, also over the edge, behind which it becomes level.
    #[test]
    fn the_surface_is_smooth_and_becomes_level() {
        let spacing = [0.5, 0.25];
        let sin = libm::sin;
        let h = |x: f64, y: f64| sin(3.0 * x) * libm::cos(5.0 * y) + sin(17.0 * x * y);
        let points = [9, 12];
        let heights = rows(points, spacing, h);
        let field = field(spacing, &heights);
        for (j, row) in heights.iter().enumerate() {
            for (i, wanted) in row.iter().enumerate() {
                let place = [(i as f64 - 4.0) * spacing[0], (j as f64 - 5.5) * spacing[1]];
                assert!((field.at(place).height - wanted).abs() < 1e-13, "{i} {j}");
            }
        }
        // Over more than the grid, on lines along both axes and across: values and derivatives against differences.
        let step = 1e-5;
        for k in -400..400 {
            let at = f64::from(k) * 0.0137 + 0.0003;
            for place in [[at, 0.1], [0.7, at], [at, -at], [at, 1.4]] {
                let here = field.at(place);
                for axis in 0..2 {
                    let moved = |by: f64| {
                        let mut other = place;
                        other[axis] += by;
                        field.at(other)
                    };
                    let (more, less) = (moved(step), moved(-step));
                    let rate = |f: fn(&Ground<f64>) -> f64| (f(&more) - f(&less)) / (2.0 * step);
                    // The second derivatives have kinks of the third ones, about 1e3.
                    assert!((rate(|g| g.height) - here.slope[axis]).abs() < 1e-6, "{place:?}");
                    assert!((rate(|g| g.slope[0]) - here.bend[axis]).abs() < 1e-1, "{place:?}");
                    assert!((rate(|g| g.slope[1]) - here.bend[1 + axis]).abs() < 1e-1, "{place:?}");
                }
                assert!(length(here.slope[0], here.slope[1]) <= field.slope);
                if place[0].abs() > 3.0 {
                    assert_eq!((here.slope[0], here.bend[0]), (0.0, 0.0));
                }
            }
        }
        let far = [[3.0, 0.1], [1e6, 0.1]].map(|place| field.at(place).height);
        assert_eq!(far[0], far[1]);
    }

    /// In a hollow of radius 1 m, balls fit that are smaller, with more steps for larger ones.
    #[test]
    fn balls_fit_into_hollows_that_are_wider() {
        let heights = rows([21, 21], [0.05; 2], |x, y| 1.0 - (1.0 - x * x - y * y).sqrt());
        let bowl = field([0.05; 2], &heights);
        let found = [0.02, 0.3, 0.6].map(|radius| fit(bowl, radius));
        assert_eq!(found.map(|fit| fit.narrow[0]), [None; 3]);
        assert!(found[0].steps < found[1].steps && found.iter().all(|fit| fit.steps <= STEPS), "{found:?}");
        let narrow = fit(bowl, 1.1).narrow[0].expect("the ball is too large");
        assert!((0.8..1.1).contains(&narrow.radius), "{narrow:?}");
    }
}
