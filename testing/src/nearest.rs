//! The places where two bodies are nearest, by trying all pairs of their features (ends and mantles of capsules; faces,
//! edges and corners of boxes) and keeping the nearest pair that is on both bodies.

use mbd_runtime::spatial::{add3, dot3, scale3, Vec3};
use mbd_runtime::Real;

/// From the nearest point of the first body to that of the second, and the latter from the second origin, both m, in
/// ground axes.
#[derive(Clone, Copy, Debug)]
pub struct Nearest<S> {
    /// Between the two points.
    pub apart: Vec3<S>,
    /// The second point.
    pub arm: Vec3<S>,
}

impl<S: Real> Nearest<S> {
    fn distance(&self) -> f64 {
        dot3(self.apart, self.apart).to_f64()
    }
}

fn nearest<S: Real>(all: impl Iterator<Item = Nearest<S>>) -> Nearest<S> {
    all.min_by(|a, b| a.distance().total_cmp(&b.distance())).expect("a pair of corners is always possible")
}

/// A coordinate on a feature: free inside its ends, or one of them. What has no length has ends only.
fn choices<S: Real>(half: S) -> impl Iterator<Item = Option<S>> {
    let none = half.to_f64() == 0.0;
    [None, Some(-half), Some(half)].into_iter().skip(usize::from(none))
}

fn within<S: Real>(x: S, half: S) -> bool {
    x.to_f64().abs() <= half.to_f64()
}

/// Segments along the unit vectors `axes` of the given half lengths, the middle of the second at `d` from that of the
/// first.
pub fn segments<S: Real>(axes: [Vec3<S>; 2], half: [S; 2], d: Vec3<S>) -> Nearest<S> {
    let [a, b] = axes;
    let (da, db, c) = (dot3(a, d), dot3(b, d), dot3(a, b));
    let at = |s: S, t: S| Nearest { apart: add3(add3(d, scale3(t, b)), scale3(-s, a)), arm: scale3(t, b) };
    let pairs = choices(half[0]).flat_map(|s| choices(half[1]).map(move |t| (s, t)));
    nearest(pairs.filter_map(|(s, t)| {
        let (s, t) = match (s, t) {
            (Some(s), Some(t)) => (s, t),
            (Some(s), None) => (s, c * s - db),
            (None, Some(t)) => (da + c * t, t),
            (None, None) => {
                let denominator = S::one() - c * c;
                if denominator.to_f64() < 1e-9 {
                    return None;
                }
                ((da - c * db) / denominator, (c * da - db) / denominator)
            }
        };
        (within(s, half[0]) && within(t, half[1])).then(|| at(s, t))
    }))
}

/// A point at `d` from the middle of a box with the given unit vectors along its edges and half lengths, outside of it.
pub fn on_box<S: Real>(axes: [Vec3<S>; 3], half: [S; 3], d: Vec3<S>) -> Nearest<S> {
    let features = (0..27).map(|n| [n % 3, n / 3 % 3, n / 9]).filter(|f| *f != [0; 3]);
    nearest(features.filter_map(|feature| {
        let mut apart = [S::zero(); 3];
        for k in 0..3 {
            let x = dot3(axes[k], d);
            let on = choices(half[k]).nth(feature[k]).flatten().unwrap_or(x);
            if !within(on, half[k]) {
                return None;
            }
            apart = add3(apart, scale3(x - on, axes[k]));
        }
        Some(Nearest { apart, arm: [S::zero(); 3] })
    }))
}

/// A point at `d` from the middle of a cylinder about a unit vector, outside of it.
pub fn on_cylinder<S: Real>(axis: Vec3<S>, half: S, radius: S, d: Vec3<S>) -> Nearest<S> {
    let along = dot3(axis, d);
    let across = add3(d, scale3(-along, axis));
    let distance = dot3(across, across).sqrt();
    let features = choices(half).flat_map(|z| [None, Some(radius)].map(|r| (z, r)));
    nearest(features.filter(|(z, r)| z.is_some() || r.is_some()).filter_map(|(z, r)| {
        let (z, r) = (z.unwrap_or(along), r.unwrap_or(distance));
        if !within(z, half) || !within(r, radius) {
            return None;
        }
        let apart = add3(scale3(along - z, axis), scale3((distance - r) / distance, across));
        Some(Nearest { apart, arm: [S::zero(); 3] })
    }))
}
