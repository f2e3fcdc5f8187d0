//! The corners of the hull of points, the farthest ones first where there are too many; [`faces`] has its faces and edges.
//!
//! Corners are found from inside: the point that is farthest from the hull of those that were taken is taken next. Distances
//! are those of the algorithm of Gilbert, Johnson and Keerthi, which needs no faces, so that points in a plane, on a line or
//! twice in the list are no special cases. They only fall while points are taken: most points are looked at a few times.
//! (parry3d-f64 was tried: it keeps points of flat faces in single precision, so that it does not save this, and brings 46
//! crates.) Arithmetic is that of IEEE alone, in an order that depends on nothing but the points, so that every host finds
//! the same corners.

mod faces;

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::inertia::{cross, dot};
pub(crate) use faces::polyhedron;

type Vec3 = [f64; 3];

/// Points nearer to the hull of others than this are no corners, in units of the longest extent along an axis. Vertices of
/// meshes in single precision on a flat face are apart from it by a tenth of that.
const TOLERANCE: f64 = 1e-6;

/// Distances are known to this, in the same unit.
const EXACT: f64 = 1e-10;

/// What a hull was reduced to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hull {
    /// Indices of its corners, in the order of the points.
    pub corners: Vec<usize>,
    /// How far the other points lie outside of the hull of the corners at most, in the unit of the points; 0 where none lies
    /// farther out than the tolerance.
    pub depth: f64,
    /// Whether all points lie in a plane, to the tolerance.
    pub flat: bool,
}

/// The corners of the hull of finite points, at most `most` of them.
pub(crate) fn hull(points: &[Vec3], most: usize) -> Hull {
    let order = distinct(points);
    let (scaled, size) = scaled(points, &order);
    let Some(first) = scaled.first() else { return Hull { corners: Vec::new(), depth: 0.0, flat: true } };
    // The first of points in lexicographic order is a corner.
    let mut taken = vec![0];
    let mut chosen = vec![*first];
    let mut left: BinaryHeap<Candidate> =
        (1..scaled.len()).map(|at| Candidate { distance: f64::INFINITY, at, known: 0 }).collect();
    loop {
        while chosen.len() < most {
            let Some(next) = farthest(&mut left, &scaled, &chosen) else { break };
            taken.push(next.at);
            chosen.push(scaled[next.at]);
        }
        // Of points at the same distance, one within the hull of the others may have been taken.
        let before = chosen.len();
        let mut k = 0;
        while k < chosen.len() && chosen.len() > 1 {
            let (at, point) = (taken.remove(k), chosen.remove(k));
            if distance(&point, &chosen) > TOLERANCE {
                taken.insert(k, at);
                chosen.insert(k, point);
                k += 1;
            }
        }
        if chosen.len() == before {
            break;
        }
        // Distances were those from a hull that is smaller now, by less than the tolerance.
        left = left.into_iter().map(|c| Candidate { distance: c.distance + TOLERANCE, known: 0, ..c }).collect();
    }
    let depth = farthest(&mut left, &scaled, &chosen).map_or(0.0, |candidate| candidate.distance * size);
    let mut corners: Vec<usize> = taken.into_iter().map(|k| order[k]).collect();
    corners.sort_unstable();
    Hull { corners, depth, flat: is_flat(&chosen) }
}

/// Indices of points in lexicographic order, of equal ones the first.
fn distinct(points: &[Vec3]) -> Vec<usize> {
    let compare = |a: &Vec3, b: &Vec3| {
        let each = a.iter().zip(b).map(|(x, y)| x.partial_cmp(y).unwrap_or(Ordering::Equal));
        each.fold(Ordering::Equal, Ordering::then)
    };
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| compare(&points[*a], &points[*b]));
    order.dedup_by(|b, a| points[*a] == points[*b]);
    order
}

/// The points about their middle in units of their longest extent, and that.
fn scaled(points: &[Vec3], order: &[usize]) -> (Vec<Vec3>, f64) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for k in order {
        for (axis, x) in points[*k].iter().enumerate() {
            low[axis] = low[axis].min(*x);
            high[axis] = high[axis].max(*x);
        }
    }
    let size = (0..3).fold(0.0, |most: f64, k| most.max(high[k] - low[k])).max(f64::MIN_POSITIVE);
    let scale = |p: &Vec3| [0, 1, 2].map(|k| (p[k] - 0.5 * (low[k] + high[k])) / size);
    (order.iter().map(|k| scale(&points[*k])).collect(), size)
}

/// A point that was not taken.
struct Candidate {
    /// From the hull of the first `known` points that were taken, or less where more were taken since.
    distance: f64,
    at: usize,
    known: usize,
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.distance.total_cmp(&other.distance).then(other.at.cmp(&self.at))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Eq for Candidate {}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

/// Takes the farthest point out; `None` where none is farther than the tolerance. Those within are left out for good.
fn farthest(left: &mut BinaryHeap<Candidate>, scaled: &[Vec3], chosen: &[Vec3]) -> Option<Candidate> {
    while let Some(candidate) = left.pop() {
        if candidate.known == chosen.len() {
            return Some(candidate);
        }
        let distance = distance(&scaled[candidate.at], chosen);
        if distance > TOLERANCE {
            left.push(Candidate { distance, known: chosen.len(), ..candidate });
        }
    }
    None
}

fn minus(a: &Vec3, b: &Vec3) -> Vec3 {
    [0, 1, 2].map(|k| a[k] - b[k])
}

/// Up to four points.
#[derive(Clone, Copy)]
struct Simplex {
    all: [Vec3; 4],
    len: usize,
}

impl Simplex {
    fn of(point: Vec3) -> Simplex {
        Simplex { all: [point; 4], len: 1 }
    }

    fn points(&self) -> &[Vec3] {
        &self.all[..self.len]
    }

    fn with(mut self, point: Vec3) -> Simplex {
        self.all[self.len] = point;
        self.len += 1;
        self
    }

    /// Those of its points whose bits are set; at least one is.
    fn some(&self, set: usize) -> Simplex {
        let mut some = Simplex { len: 0, ..*self };
        (0..self.len).filter(|k| set >> k & 1 == 1).for_each(|k| some = some.with(self.all[k]));
        some
    }
}

/// Distance of a point from the hull of others, at least one.
fn distance(from: &Vec3, points: &[Vec3]) -> f64 {
    let least = |measure: &dyn Fn(&Vec3) -> f64| {
        let best = points.iter().map(|p| minus(p, from)).min_by(|a, b| measure(a).total_cmp(&measure(b)));
        best.unwrap_or_default()
    };
    let mut at = least(&|p| dot(*p, *p));
    let mut simplex = Simplex::of(at);
    // Every turn comes nearer, and a few are enough.
    for _ in 0..100 {
        let size = dot(at, at).sqrt();
        if size <= EXACT {
            return 0.0;
        }
        let next = least(&|p| dot(*p, at));
        // No point lies farther in than the plane across `at` through `next`.
        if size - dot(next, at) / size <= EXACT || simplex.points().contains(&next) {
            break;
        }
        let (nearer, between) = nearest(&simplex.with(next));
        if dot(nearer, nearer) >= dot(at, at) {
            break;
        }
        (at, simplex) = (nearer, between);
        if simplex.len == 4 {
            break;
        }
    }
    dot(at, at).sqrt()
}

/// The point of a simplex that is nearest to the origin, and the corners between which it lies.
fn nearest(simplex: &Simplex) -> (Vec3, Simplex) {
    let mut best = (simplex.all[0], Simplex::of(simplex.all[0]));
    for set in 2_usize..1 << simplex.len {
        let some = simplex.some(set);
        if let Some(at) = foot(some.points()) {
            if dot(at, at) < dot(best.0, best.0) {
                best = (at, some);
            }
        }
    }
    best
}

/// The foot of the perpendicular from the origin to the point, line, plane or space of up to four points; `None` where it
/// does not lie between them.
fn foot(points: &[Vec3]) -> Option<Vec3> {
    let first = *points.first()?;
    let edge = |k: usize| minus(&points[k], &first);
    let weights = match points.len() {
        1 => [0.0; 3],
        2 => [-dot(edge(1), first) / dot(edge(1), edge(1)), 0.0, 0.0],
        3 => {
            let (e, f) = (edge(1), edge(2));
            let normal = cross(e, f);
            let square = dot(normal, normal);
            [-dot(cross(first, f), normal) / square, -dot(cross(e, first), normal) / square, 0.0]
        }
        _ => {
            let (e, f, g) = (edge(1), edge(2), edge(3));
            let volume = dot(e, cross(f, g));
            [cross(f, g), cross(g, e), cross(e, f)].map(|area| -dot(first, area) / volume)
        }
    };
    let rest = 1.0 - weights.iter().sum::<f64>();
    // Not a number where the points are not apart.
    if !(rest >= 0.0 && weights.iter().all(|w| *w >= 0.0)) {
        return None;
    }
    let others = weights.iter().zip(&points[1..]);
    Some(others.fold(first.map(|x| rest * x), |sum, (w, p)| [0, 1, 2].map(|k| sum[k] + w * p[k])))
}

/// Whether points lie in a plane: that of the longest distance, and of the point that is farthest from its line.
fn is_flat(points: &[Vec3]) -> bool {
    let far = |measure: &dyn Fn(&Vec3) -> f64| {
        points.iter().copied().max_by(|a, b| measure(a).total_cmp(&measure(b))).unwrap_or_default()
    };
    let a = points.first().copied().unwrap_or_default();
    let b = far(&|p| dot(minus(p, &a), minus(p, &a)));
    let line = minus(&b, &a);
    let c = far(&|p| dot(cross(minus(p, &a), line), cross(minus(p, &a), line)));
    let normal = cross(minus(&c, &a), line);
    let size = dot(normal, normal).sqrt();
    points.iter().all(|p| dot(minus(p, &a), normal).abs() <= TOLERANCE * size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers from −1 to 1.
    pub(super) struct Draw(pub u64);

    impl Draw {
        fn next(&mut self) -> f64 {
            // Knuth's generator; the upper half of its states is random enough.
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 32) as f64 / f64::from(u32::MAX) * 2.0 - 1.0
        }

        pub fn point(&mut self) -> Vec3 {
            [0; 3].map(|_| self.next())
        }
    }

    /// Corners by definition: those of the triangles that have all points on one side.
    fn corners(points: &[Vec3]) -> Vec<usize> {
        let n = points.len();
        let mut is = vec![false; n];
        for a in 0..n {
            for b in a + 1..n {
                for c in b + 1..n {
                    let normal = cross(minus(&points[b], &points[a]), minus(&points[c], &points[a]));
                    let side = |k: usize| dot(minus(&points[k], &points[a]), normal);
                    let others = || (0..n).filter(|k| ![a, b, c].contains(k));
                    if others().all(|k| side(k) < 0.0) || others().all(|k| side(k) > 0.0) {
                        [a, b, c].iter().for_each(|k| is[*k] = true);
                    }
                }
            }
        }
        (0..n).filter(|k| is[*k]).collect()
    }

    #[test]
    fn corners_are_those_of_all_triangles_with_the_points_on_one_side() {
        let mut draw = Draw(1);
        for n in 4..40 {
            let points: Vec<Vec3> = (0..n).map(|_| draw.point()).collect();
            let found = hull(&points, usize::MAX);
            assert_eq!(found, Hull { corners: corners(&points), depth: 0.0, flat: false }, "{n}");
        }
    }

    /// A grid has eight corners, however it is turned, moved, stretched and shuffled, and however many points lie on its
    /// edges and faces.
    #[test]
    fn a_grid_has_eight_corners() {
        let mut draw = Draw(2);
        for n in [2, 3, 5] {
            for _ in 0..20 {
                let (axes, at) = ([0; 3].map(|_| draw.point()), draw.point());
                let volume = dot(axes[0], cross(axes[1], axes[2]));
                if volume.abs() < 0.05 {
                    continue;
                }
                let mut points = Vec::new();
                for k in 0..n * n * n {
                    let steps = [k % n, k / n % n, k / n / n].map(|x| x as f64);
                    points.push([0, 1, 2].map(|i| at[i] + (0..3).map(|j| axes[j][i] * steps[j]).sum::<f64>()));
                }
                let last = n - 1;
                let wanted: Vec<usize> =
                    (0..8).map(|k| (k & 1) * last + (k >> 1 & 1) * last * n + (k >> 2) * last * n * n).collect();
                let found = hull(&points, 8);
                assert_eq!(found, Hull { corners: wanted, depth: 0.0, flat: false });
                // In another order, and each of them twice.
                let twice: Vec<Vec3> = points.iter().rev().chain(&points).copied().collect();
                let other = hull(&twice, 32).corners;
                let back: Vec<usize> = other.iter().rev().map(|k| points.len() - 1 - k).collect();
                assert_eq!(back, found.corners);
            }
        }
    }

    /// On a ball, the depth of the hull of some points is what its farthest plane leaves out, and falls as they grow.
    #[test]
    fn the_depth_is_how_far_planes_come_inside() {
        let mut draw = Draw(3);
        let points: Vec<Vec3> = (0..2000)
            .map(|_| {
                let p = draw.point();
                p.map(|x| 0.7 * x / dot(p, p).sqrt())
            })
            .collect();
        let mut last = f64::INFINITY;
        for most in [4, 8, 16, 32, 64, 128] {
            let found = hull(&points, most);
            assert_eq!(found.corners.len(), most);
            let chosen: Vec<Vec3> = found.corners.iter().map(|k| points[*k]).collect();
            let reach = |all: &[Vec3], way: &Vec3| all.iter().map(|p| dot(*p, *way)).fold(f64::MIN, f64::max);
            let ways = points.iter().map(|p| p.map(|x| x / 0.7));
            let inside = ways.map(|way| reach(&points, &way) - reach(&chosen, &way)).fold(0.0, f64::max);
            // The farthest direction is near those of the 2000 points, not among them.
            assert!(inside <= found.depth + 1e-9 && inside > 0.8 * found.depth, "{most}: {inside}, {}", found.depth);
            assert!(found.depth < last);
            last = found.depth;
        }
        // The same points again.
        let chosen: Vec<Vec3> = hull(&points, 32).corners.iter().map(|k| points[*k]).collect();
        assert_eq!(hull(&chosen, 32).corners, (0..32).collect::<Vec<_>>());
    }

    #[test]
    fn points_without_a_volume() {
        let corners = |points: &[Vec3]| hull(points, 32).corners;
        assert_eq!(corners(&[]), []);
        assert_eq!(corners(&[[1.0; 3]; 5]), [0]);
        assert_eq!(corners(&[[0.0; 3], [1.0; 3], [0.3; 3], [2.0; 3], [0.0; 3]]), [0, 3]);
        let square = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.5], [0.5, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| [x, y, x]);
        assert_eq!(corners(&square), [0, 1, 4, 5]);
        assert!(hull(&square, 32).flat && hull(&[[1.0; 3]; 2], 4).flat);
        // As large and as small as numbers of models can be.
        for size in [1e30, 1e-30] {
            let cube: Vec<Vec3> = (0..27).map(|k| [k % 3, k / 3 % 3, k / 9].map(|x| f64::from(x) * size)).collect();
            assert_eq!(corners(&cube), [0, 2, 6, 8, 18, 20, 24, 26]);
        }
    }
}
