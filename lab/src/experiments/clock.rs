//! Timing of calls.

use std::time::Instant;

/// Shortest time of a call of each function, s, over interleaved rounds, so that a disturbance affects all functions
/// alike.
pub fn least(calls: &mut [&mut dyn FnMut()], rounds: u32, round: f64) -> Vec<f64> {
    let counts: Vec<u32> = calls.iter_mut().map(|call| count(call, round)).collect();
    let mut best = vec![f64::INFINITY; calls.len()];
    for _ in 0..rounds {
        for ((call, &count), best) in calls.iter_mut().zip(&counts).zip(&mut best) {
            *best = best.min(time(call, count) / f64::from(count));
        }
    }
    best
}

fn time(call: &mut dyn FnMut(), count: u32) -> f64 {
    let start = Instant::now();
    (0..count).for_each(|_| call());
    start.elapsed().as_secs_f64()
}

/// Number of calls that fill a round of a given length, s. Counting them also warms up the caches.
fn count(call: &mut dyn FnMut(), round: f64) -> u32 {
    let mut count = 1;
    while count < 1 << 24 && time(call, count) < 0.5 * round {
        count *= 2;
    }
    count
}

/// A straight line through points, by least squares.
pub struct Line {
    /// Value at zero.
    pub start: f64,
    /// Slope.
    pub slope: f64,
    /// Largest distance of a point from the line, relative to the line there.
    pub farthest: f64,
}

impl Line {
    /// The line through points, with distances relative to their values.
    pub fn through(points: &[(f64, f64)]) -> Line {
        // With weights 1/y², small values count as much as large ones.
        let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|&(x, y)| f(x, y) / (y * y)).sum::<f64>();
        let (w, x, y) = (sum(&|_, _| 1.0), sum(&|x, _| x), sum(&|_, y| y));
        let (xx, xy) = (sum(&|x, _| x * x), sum(&|x, y| x * y));
        let slope = (w * xy - x * y) / (w * xx - x * x);
        let start = (y - slope * x) / w;
        let apart = |&(x, y): &(f64, f64)| (y / (start + slope * x) - 1.0).abs();
        Line { start, slope, farthest: points.iter().map(apart).fold(0.0, f64::max) }
    }
}
