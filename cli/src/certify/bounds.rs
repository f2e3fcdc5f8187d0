//! Enclosures of the outputs over a box: intervals, mean value forms, and subdivision.

use std::collections::VecDeque;
use std::time::Instant;

use multibody::codegen::plan::Plan;
use multibody::runtime::interval::{mean_value, Interval};
use multibody::runtime::{Dual, Interpreter, Scalar};

use super::input::Region;
use super::outputs::evaluate;
use crate::args::Quantity;
use crate::motion::interpreter;

/// Enclosures of all outputs.
pub struct Enclosure {
    /// One for each output.
    pub outputs: Vec<Interval>,
    /// Number of parts into which the box was divided.
    pub parts: usize,
    /// Evaluations in intervals, and in intervals with derivatives.
    pub evaluations: [u64; 2],
    /// Computing time, s.
    pub seconds: f64,
}

/// A side of the box that is wider than a number: which of the lists of the state, and where in it.
type Side = (usize, usize);

struct Bounds<'a> {
    wanted: &'a [Quantity],
    sides: Vec<Side>,
    plain: Interpreter<Interval>,
    /// For mean value forms. Models with loops and couplings have none: where it is undecided whether a row is
    /// redundant, outputs are not differentiable.
    dual: Option<Interpreter<Dual<Interval>>>,
    evaluations: [u64; 2],
}

/// Encloses the outputs over a box, divided into at most `parts` parts.
///
/// The part that is divided is the one that has waited longest. It is halved along the side that the outputs depend on
/// most, relative to their widths; without derivatives along the side that is widest in parts of the side of the box.
pub fn enclose(plan: &Plan, region: &Region, wanted: &[Quantity], parts: usize) -> Enclosure {
    let clock = Instant::now();
    let lists = region.lists().into_iter().enumerate();
    let sides: Vec<Side> =
        lists.flat_map(|(l, list)| (0..list.len()).filter(|k| list[*k].width() > 0.0).map(move |k| (l, k))).collect();
    let smooth = plan.dims.rows == 0 && !sides.is_empty();
    let mut bounds = Bounds {
        wanted,
        plain: interpreter(plan),
        dual: smooth.then(|| interpreter(plan)),
        sides,
        evaluations: [0; 2],
    };
    let mut waiting = VecDeque::from([region.values(|x| x)]);
    let mut found = VecDeque::from([bounds.over(&waiting[0])]);
    while waiting.len() < parts.max(1) {
        let (Some(part), Some((_, influence))) = (waiting.pop_front(), found.pop_front()) else { break };
        let width = |side: &Side| part.lists()[side.0][side.1].width() / region.lists()[side.0][side.1].width();
        let measure: Vec<f64> = match influence.iter().all(|x| x.is_finite()) && influence.iter().any(|x| *x > 0.0) {
            true => influence,
            false => bounds.sides.iter().map(width).collect(),
        };
        let widest = measure.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(k, _)| k);
        let (list, k) = bounds.sides[widest];
        for half in part.lists()[list][k].halves() {
            let mut next = part.values(|x| x);
            next.lists_mut()[list][k] = half;
            found.push_back(bounds.over(&next));
            waiting.push_back(next);
        }
    }
    let hull = |all: Vec<Interval>, one: &[Interval]| all.into_iter().zip(one).map(|(a, b)| a.hull(*b)).collect();
    let parts = found.len();
    let mut enclosures = found.into_iter().map(|(outputs, _)| outputs);
    let first = enclosures.next().unwrap_or_default();
    let outputs = enclosures.fold(first, |all, one| hull(all, &one));
    Enclosure { outputs, parts, evaluations: bounds.evaluations, seconds: clock.elapsed().as_secs_f64() }
}

impl Bounds<'_> {
    fn plain(&mut self, region: &Region) -> Vec<Interval> {
        self.evaluations[0] += 1;
        evaluate(&mut self.plain, region, self.wanted)
    }

    /// Enclosures over a part of the box, and how much they depend on each of its sides.
    fn over(&mut self, part: &Region) -> (Vec<Interval>, Vec<f64>) {
        let mut outputs = self.plain(part);
        let Some(mut dual) = self.dual.take() else { return (outputs, vec![0.0; self.sides.len()]) };
        let center = part.values(|x| Interval::point(x.middle()));
        let at_center = self.plain(&center);
        let columns: Vec<(Vec<Interval>, Interval)> = self
            .sides
            .iter()
            .map(|&(list, k)| {
                self.evaluations[1] += 1;
                let mut moved = part.values(|x| Dual::new(x, Interval::zero()));
                moved.lists_mut()[list][k].du = Interval::one();
                let slopes = evaluate(&mut dual, &moved, self.wanted).into_iter().map(|x| x.du).collect();
                (slopes, part.lists()[list][k] - center.lists()[list][k])
            })
            .collect();
        for (i, output) in outputs.iter_mut().enumerate() {
            let mean = mean_value(at_center[i], columns.iter().map(|(slopes, offset)| (slopes[i], *offset)));
            *output = output.intersection(mean).unwrap_or(*output);
        }
        let influence = columns.iter().map(|(slopes, offset)| {
            let parts = slopes.iter().zip(&outputs).filter(|(_, output)| output.width() > 0.0);
            parts.map(|(slope, output)| slope.magnitude() * offset.width() / output.width()).sum()
        });
        let influence = influence.collect();
        self.dual = Some(dual);
        (outputs, influence)
    }
}
