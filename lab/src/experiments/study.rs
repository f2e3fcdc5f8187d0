//! The runs behind the tables and figures of the biped.

use multibody::runtime::integrate::tableau::{DORMAND_PRINCE, RK4, RKF45, VERNER9};

use super::forms::{Closed, Kind, Minimal, Whole};
use super::plain::{controlled, Controlled, Walk};

/// End of the motion, s.
pub const END: f64 = 0.85;
/// Both formulations, in the order of the thesis's columns.
pub const KINDS: [Kind; 2] = [Kind::Velocities, Kind::Momenta];
/// The coordinates of the minimal states.
pub const INDEPENDENT: [usize; 3] = [0, 1, 2];
/// Length of an interval in which steps are counted, s.
const INTERVAL: f64 = 0.01;
/// Length of the links and distance of the feet, m.
const LENGTH: f64 = 0.25;
const FOOT: f64 = 0.25;

/// The mechanism and its start.
pub struct Study<Y> {
    /// Mechanism with one closed loop.
    pub system: Y,
    /// Closed coordinates at the start, where it is at rest.
    pub start: Vec<f64>,
}

/// Coordinates at the end, and the largest change of the energy.
pub struct Ended {
    /// Coordinates.
    pub q: Vec<f64>,
    /// Largest change of the energy, J.
    pub energy: f64,
}

/// Method with fixed steps.
#[derive(Clone, Copy)]
pub enum Method {
    /// The classical method of order 4.
    Classical,
    /// Fehlberg's pair.
    Fehlberg {
        /// Whether the run continues with its result of order 4 instead of 5.
        lower: bool,
    },
}

/// A run with steps of one size.
pub struct Fixed {
    /// Mean error of the coordinates at the end.
    pub end: f64,
    /// Mean estimated error of a step: of the coordinates, and of the momenta or velocities.
    pub truncation: [f64; 2],
}

/// A run with control of the absolute errors of every step.
pub struct Adaptive {
    /// Mean error of the coordinates at the end.
    pub end: f64,
    /// Mean estimated error of the coordinates in a step.
    pub truncation: f64,
    /// Evaluations.
    pub evaluations: u64,
    /// Attempted steps in every interval.
    pub tried: Vec<u64>,
    /// For each component of the state, the number of intervals in which it had the largest error most often.
    pub wins: Vec<u64>,
}

/// Values that are drawn over time.
#[derive(Default)]
pub struct Traces {
    /// Times, s.
    pub t: Vec<f64>,
    /// One row of values for every line.
    pub lines: Vec<Vec<f64>>,
}

impl Traces {
    /// Least and largest value.
    pub fn range(&self) -> [f64; 2] {
        let all = self.lines.iter().flatten();
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], &x| [a.min(x), b.max(x)])
    }

    /// Largest absolute value.
    pub fn size(&self) -> f64 {
        self.lines.iter().fold(0.0, |m, line| size(line).max(m))
    }

    fn push(&mut self, t: f64, values: impl IntoIterator<Item = f64>) {
        self.t.push(t);
        for (k, value) in values.into_iter().enumerate() {
            if self.lines.len() <= k {
                self.lines.push(Vec::new());
            }
            self.lines[k].push(value);
        }
    }
}

/// Displacement of the second foot from its place, along x and y, m.
fn gap(q: &[f64]) -> [f64; 2] {
    let (mut angle, mut place) = (0.0, [-FOOT, 0.0]);
    for joint in [0, 1, 3, 4] {
        angle += q[joint];
        place[0] += LENGTH * angle.cos();
        place[1] += LENGTH * angle.sin();
    }
    place
}

fn size(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| x.abs().max(m))
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0_f64), |(s, n), x| (s + x.abs(), n + 1.0));
    sum / count.max(1.0)
}

/// Mean distance of the coordinates from those of the reference.
fn distance(y: &[f64], reference: &[f64]) -> f64 {
    mean(INDEPENDENT.iter().zip(y).map(|(&i, y)| y - reference[i]))
}

impl<Y: Closed> Study<Y> {
    /// A mechanism whose loop is closed from coordinates nearby.
    pub fn new(mut system: Y, near: &[f64]) -> Self {
        let start: Vec<f64> = INDEPENDENT.iter().map(|&i| near[i]).chain([0.0; 3]).collect();
        let start = Minimal::new(&mut system, Kind::Velocities, &INDEPENDENT, near).coordinates(&start);
        Study { system, start }
    }

    fn minimal(&mut self, kind: Kind) -> Minimal<'_, Y> {
        Minimal::new(&mut self.system, kind, &INDEPENDENT, &self.start)
    }

    fn minimal_start(&self) -> Vec<f64> {
        INDEPENDENT.iter().map(|&i| self.start[i]).chain([0.0; 3]).collect()
    }

    fn whole_start(&self) -> Vec<f64> {
        self.start.iter().copied().chain(self.start.iter().map(|_| 0.0)).collect()
    }

    /// The motion in minimal coordinates, by steps of `h` s of order 9.
    pub fn minimal_end(&mut self, kind: Kind, h: f64) -> Ended {
        let (y, mut states) = (self.minimal_start(), Vec::new());
        Walk::new(&mut self.minimal(kind), &VERNER9, &y).all(h, END, &mut states);
        // The states are evaluated from the start on, so that the loop stays in its branch.
        let mut equations = self.minimal(kind);
        let start = equations.energy(&y);
        let energy = states.iter().fold(0.0_f64, |m, y| m.max((equations.energy(y) - start).abs()));
        Ended { q: equations.coordinates(states.last().unwrap_or(&y)), energy }
    }

    /// The motion with all coordinates, by the same steps.
    pub fn whole_end(&mut self, kind: Kind, h: f64) -> Ended {
        let (y, mut states) = (self.whole_start(), Vec::new());
        let end = Walk::new(&mut Whole::new(&mut self.system, kind), &VERNER9, &y).all(h, END, &mut states);
        let start = self.energy(kind, &y);
        let energy = states.iter().fold(0.0_f64, |m, y| m.max((self.energy(kind, y) - start).abs()));
        Ended { q: end[..self.start.len()].to_vec(), energy }
    }

    /// Energy of a state with all coordinates, J.
    fn energy(&mut self, kind: Kind, y: &[f64]) -> f64 {
        let (q, p) = y.split_at(self.start.len());
        let (q, mut p) = (q.to_vec(), p.to_vec());
        if kind == Kind::Velocities {
            let v = p.clone();
            self.system.conjugate_momenta(&q, &v, &mut p);
        }
        let (kinetic, potential) = self.system.energies(&q, &p);
        kinetic + potential
    }

    /// Table 7.1.
    pub fn fixed(&mut self, kind: Kind, h: f64, reference: &[f64]) -> Fixed {
        let y = self.minimal_start();
        let mut equations = self.minimal(kind);
        let mut walk = Walk::new(&mut equations, &RKF45, &y);
        let (mut sums, mut steps) = ([0.0; 2], 0.0_f64);
        walk.fixed(h, END, |_, walk| {
            for (sum, half) in sums.iter_mut().zip(walk.error.chunks(INDEPENDENT.len())) {
                *sum += mean(half.iter().copied());
            }
            steps += 1.0;
        });
        Fixed { end: distance(&walk.y, reference), truncation: sums.map(|s| s / steps) }
    }

    /// Table 7.2: mean error at the end, evaluations; `None` if the steps became too small.
    pub fn ode45(&mut self, kind: Kind, tolerance: f64, reference: &[f64]) -> Option<(f64, u64)> {
        let y = self.minimal_start();
        let Controlled { y, evaluations } = controlled(&mut self.minimal(kind), &DORMAND_PRINCE, &y, END, tolerance)?;
        Some((distance(&y, reference), evaluations))
    }

    /// Tables 7.3 and 7.4, figures 7.14 and 7.15: an absolute tolerance for all components or for the coordinates
    /// alone.
    pub fn adaptive(&mut self, kind: Kind, tolerance: f64, partial: bool, reference: &[f64]) -> Adaptive {
        let y = self.minimal_start();
        let mut equations = self.minimal(kind);
        let mut walk = Walk::new(&mut equations, &RKF45, &y);
        let watched = if partial { INDEPENDENT.len() } else { y.len() };
        let (mut tried, mut wins) = (Vec::new(), vec![0; y.len()]);
        let (mut sum, mut steps, mut step) = (0.0, 0.0_f64, INTERVAL);
        for _ in 0..(END / INTERVAL).round() as u64 {
            let (mut left, mut count, mut largest) = (INTERVAL, 0, vec![0_u64; y.len()]);
            while left > 1e-12 * INTERVAL {
                let h = step.min(left);
                walk.attempt(h);
                count += 1;
                let errors = walk.error[..watched].iter().map(|e| e.abs()).enumerate();
                let (winner, error) = errors.fold((0, 0.0), |best, e| if e.1 > best.1 { e } else { best });
                largest[winner] += 1;
                let factor = (0.9 * (tolerance / error.max(1e-300)).powf(0.2)).clamp(0.1, 5.0);
                if error > tolerance {
                    step = h * factor;
                    continue;
                }
                sum += mean(walk.error[..INDEPENDENT.len()].iter().copied());
                steps += 1.0;
                walk.accept();
                left -= h;
                // The end of an interval shortens a step; the longer step is kept for the next one.
                step = (h * factor).max(if h < step { step } else { 0.0 }).min(INTERVAL);
            }
            tried.push(count);
            let most = (0..largest.len()).rev().max_by_key(|&k| largest[k]).unwrap_or(0);
            wins[most] += 1;
        }
        let evaluations = walk.evaluations;
        Adaptive { end: distance(&walk.y, reference), truncation: sum / steps, evaluations, tried, wins }
    }

    /// Figures 7.9 to 7.11: coordinates, velocities, momenta.
    pub fn motion(&mut self, h: f64) -> [Traces; 3] {
        let y = self.minimal_start();
        let mut traces = [Traces::default(), Traces::default(), Traces::default()];
        for kind in KINDS {
            let mut equations = self.minimal(kind);
            let mut put = |t: f64, y: &[f64]| {
                let (q, p) = y.split_at(INDEPENDENT.len());
                match kind {
                    Kind::Velocities => {
                        traces[0].push(t, q.iter().copied());
                        traces[1].push(t, p.iter().copied());
                    }
                    Kind::Momenta => traces[2].push(t, p.iter().copied()),
                }
            };
            put(0.0, &y);
            Walk::new(&mut equations, &RKF45, &y).fixed(h, END, |t, walk| put(t, &walk.y));
        }
        traces
    }

    /// Figures 7.12 and 7.13 with steps of `h` s and all coordinates: errors of the loop along x and y and of the
    /// energy.
    pub fn drift(&mut self, kind: Kind, h: f64, method: Method) -> [Traces; 2] {
        let y = self.whole_start();
        let mut states = vec![(0.0, y.clone())];
        let mut equations = Whole::new(&mut self.system, kind);
        let mut keep = |t: f64, y: &[f64]| states.push((t, y.to_vec()));
        match method {
            Method::Classical => Walk::new(&mut equations, &RK4, &y).fixed(h, END, |t, w| keep(t, &w.y)),
            Method::Fehlberg { lower } => {
                let mut walk = Walk::new(&mut equations, &RKF45, &y);
                walk.lower = lower;
                walk.fixed(h, END, |t, w| keep(t, &w.y));
            }
        }
        let start = self.energy(kind, &y);
        let mut traces = [Traces::default(), Traces::default()];
        for (t, y) in states {
            traces[0].push(t, gap(&y));
            traces[1].push(t, [self.energy(kind, &y) - start]);
        }
        traces
    }

    /// `steps` classical steps of `h` s, with position correction after each: largest residual after and before it, and
    /// the largest change of the energy, J.
    pub fn projected(&mut self, h: f64, steps: u64, mut tell: impl FnMut(u64)) -> [f64; 3] {
        let y = self.whole_start();
        let (n, start) = (self.start.len(), self.energy(Kind::Momenta, &y));
        let (mut y, mut worst) = (y, [0.0_f64; 3]);
        for step in 1..=steps {
            let mut equations = Whole::new(&mut self.system, Kind::Momenta);
            let mut walk = Walk::new(&mut equations, &RK4, &y);
            walk.attempt(h);
            walk.accept();
            y = std::mem::take(&mut walk.y);
            worst[1] = worst[1].max(size(&gap(&y)));
            self.project(&mut y[..n]);
            worst[0] = worst[0].max(size(&gap(&y)));
            worst[2] = worst[2].max((self.energy(Kind::Momenta, &y) - start).abs());
            tell(step);
        }
        worst
    }

    fn project(&mut self, q: &mut [f64]) {
        let mut at = q.to_vec();
        let (mut residual, mut pivots) = (self.system.zero_rows(), self.system.zero_rows());
        let mut dq = self.system.zero_momenta();
        for _ in 0..3 {
            self.system.position_correction(&at, &mut residual, &mut dq, &mut pivots);
            at.iter_mut().zip(&dq).for_each(|(q, d)| *q += d);
            if residual.iter().all(|r| r.abs() < 1e-9) {
                break;
            }
        }
        q.copy_from_slice(&at);
    }
}

impl<const S: usize> Walk<'_, S> {
    /// Makes all steps to the end and adds the state after every step to `states`.
    fn all(mut self, h: f64, end: f64, states: &mut Vec<Vec<f64>>) -> Vec<f64> {
        self.fixed(h, end, |_, walk| states.push(walk.y.clone()));
        self.y
    }
}
