//! The energy of a run as a measure of its errors: how much the tolerance lets it change, and what dampers take.
//!
//! The exact motion keeps the energy, or loses to dampers what their power says. An error of a step therefore changes
//! the balance once and for all, and the changes of all steps add up without growing. Where every component's error is
//! within its tolerance, one step changes the balance by at most `Σ |∂H/∂yᵢ| eᵢ`, and the sum of these bounds is what
//! the tolerance allows. A larger change proves that errors of steps are larger than estimated.

use multibody::codegen::jit::Compiled;
use multibody::codegen::model::{Model, Value};
use multibody::codegen::options::{EliminationStrategy, PlanOptions};
use multibody::codegen::plan::Plan;
use multibody::codegen::search;
use multibody::runtime::integrate::{Step, Tolerances};
use multibody::runtime::system::LieGroup;
use multibody::runtime::{Conjugate, System};

use super::motion::{mechanism, Record, Settings};
use super::Outcome;

/// Roundings of a step, as an error relative to the size of a component.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Roundings of an evaluation of the energy, relative to its terms, for each velocity.
const EVALUATION: f64 = 8.0 * f64::EPSILON;
/// Change of the energy, relative to its scale, above which a run with fixed steps is warned about.
const COARSE: f64 = 1e-2;

/// Nodes and weights of Gauss and Legendre's formula of order 8 on the unit interval.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// The balance of the energy over the steps of a run, J.
#[derive(Default)]
pub struct Balance {
    tolerances: Option<Tolerances>,
    /// The mechanism without its constraints, if it has any: `H` and its derivatives are those of the tree, and the
    /// rates of the momenta of the constrained mechanism have the forces of the constraints among them.
    tree: Option<Compiled>,
    damped: bool,
    controlled: bool,
    /// Damping of every velocity, N m s/rad or N s/m.
    damping: Vec<f64>,
    /// Energy at the start.
    start: Option<f64>,
    /// What the tolerance allows at the last end of a step.
    last: f64,
    /// What it allows for all steps together.
    allowed: f64,
    /// Work of the dampers so far, negative, and of the control.
    works: [f64; 2],
    /// How uncertain that work is.
    doubt: f64,
    /// Change of the energy minus the work at the last end of a step, and the largest one.
    defect: f64,
    worst: f64,
    /// Smallest and largest potential energy.
    potential: Option<[f64; 2]>,
    /// Largest kinetic energy, and largest sum of the sizes of both energies.
    kinetic: f64,
    size: f64,
}

impl Balance {
    /// The balance of a run that has not begun.
    pub fn new(plan: &Plan, settings: &Settings) -> Outcome<Balance> {
        let damped = plan.model.joints.iter().any(|j| j.damping.iter().any(|d| *d != Value::ZERO));
        let parameters = plan.tree(&plan.default_params()).dynamic_parameters();
        // Behind the inertias there are the dampings and the dry frictions of all velocities.
        let (end, nv) = (parameters.len(), plan.dims.nv);
        let tolerances = match settings.step {
            Step::Adaptive(tolerances) => Some(tolerances),
            Step::Fixed(_) => None,
        };
        let tree = (!plan.model.constraints.is_empty()).then(|| {
            let model = Model { constraints: Vec::new(), ..plan.model.clone() };
            // Coordinates are in the same order. No search: it is evaluated once a step.
            let options = PlanOptions { elimination: EliminationStrategy::Single, ..PlanOptions::default() };
            mechanism(&search::plan(&model, options), settings.interpreted)
        });
        let tree = tree.transpose()?;
        Ok(Balance {
            tolerances,
            tree,
            damped,
            controlled: settings.control.is_some(),
            damping: parameters[end - 2 * nv..end - nv].to_vec(),
            ..Balance::default()
        })
    }

    /// Whether dampers or control change the energy.
    pub fn changes(&self) -> bool {
        self.damped || self.controlled
    }

    /// Adds the work of dampers and control in a step of `h` s. At a part of the step, `dense` gives the state and the power
    /// of the control, which counts with a weight.
    pub fn work(
        &mut self,
        mechanism: &mut Compiled,
        h: f64,
        mut dense: impl FnMut(f64, f64) -> (Vec<f64>, Vec<f64>, f64),
    ) {
        let mut v = mechanism.zero_momenta();
        let mut half = |from: f64| -> [f64; 2] {
            let mut works = [0.0; 2];
            for (node, weight) in GAUSS {
                let (q, p, power) = dense(from + 0.5 * node, 0.5 * weight);
                mechanism.velocities(&q, &p, &mut v);
                works[0] -= 0.5 * h * weight * v.iter().zip(&self.damping).map(|(v, d)| d * v * v).sum::<f64>();
                works[1] += 0.5 * h * weight * power;
            }
            works
        };
        let (first, second) = (half(0.0), half(0.5));
        // The balance at the middle of the step shows the error of the dense output there. The power follows the
        // kinetic energy, so that the work is uncertain by that error times the part of the energy it takes.
        let (q, p, _) = dense(0.5, 0.0);
        let (kinetic, potential) = mechanism.energy(&q, &p);
        let middle = (self.defect(kinetic + potential, self.total() + first[0] + first[1]) - self.defect).abs();
        let moved = [0, 1].map(|k| (first[k] + second[k]).abs());
        let part = ((moved[0] + moved[1]) / kinetic.max(f64::MIN_POSITIVE)).min(1.0);
        self.works = [0, 1].map(|k| self.works[k] + first[k] + second[k]);
        self.doubt += part * middle;
    }

    /// Work of dampers and control, J.
    fn total(&self) -> f64 {
        self.works[0] + self.works[1]
    }

    /// Change of the energy minus work, J.
    fn defect(&self, energy: f64, work: f64) -> f64 {
        energy - self.start.unwrap_or(energy) - work
    }

    /// Adds a step of `h` s that ends at a state with given kinetic and potential energy.
    pub fn step(
        &mut self,
        mechanism: &mut Compiled,
        h: f64,
        (q, p): (&[f64], &[f64]),
        (kinetic, potential): (f64, f64),
    ) {
        let energy = kinetic + potential;
        self.start.get_or_insert(energy);
        self.defect = self.defect(energy, self.total());
        self.worst = self.worst.max(self.defect.abs());
        self.kinetic = self.kinetic.max(kinetic);
        self.size = self.size.max(kinetic.abs() + potential.abs());
        let [low, high] = self.potential.unwrap_or([potential; 2]);
        self.potential = Some([low.min(potential), high.max(potential)]);
        if let Some(tolerances) = self.tolerances {
            let mut tree = self.tree.take();
            let allowed = match &mut tree {
                None => self.one(&tolerances, mechanism, h, q, p),
                Some(tree) => {
                    let (mut v, mut p) = (p.to_vec(), p.to_vec());
                    mechanism.velocities(q, &p.clone(), &mut v);
                    tree.conjugate_momenta(&q.to_vec(), &v, &mut p);
                    self.one(&tolerances, tree, h, q, &p)
                }
            };
            self.tree = tree;
            self.allowed += if h > 0.0 { allowed.max(self.last) } else { 0.0 };
            self.last = allowed;
        }
    }

    /// What the tolerances allow in one step of `h` s at a state, J: `Σ |∂H/∂yᵢ| eᵢ`, at most
    /// `√n (Σ (∂H/∂yᵢ sᵢ)²)^½` for errors whose root mean square relative to the scales `sᵢ` is one.
    fn one(&self, tolerances: &Tolerances, mechanism: &mut Compiled, h: f64, q: &[f64], p: &[f64]) -> f64 {
        let nv = p.len();
        let (mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; q.len()], vec![0.0; nv]);
        mechanism.rates(q, p, &mut v, &mut qd, &mut pd);
        // ∂H/∂q is the rate of the momenta without the dampers' part.
        let mut by_q: Vec<f64> = (0..nv).map(|k| pd[k].abs() + self.damping[k] * v[k].abs()).collect();
        let (mut by_p, mut size) = (v.iter().map(|v| v.abs()).collect::<Vec<_>>(), p.to_vec());
        size.iter_mut().for_each(|p| *p = p.abs());
        let largest_angle = q.iter().fold(1.0_f64, |m, q| m.max(q.abs()));
        // Parts of Lie joints are compared by their length, which is the same in all axes.
        let norm = |x: &[f64]| x.iter().fold(0.0_f64, |n, x| n.hypot(*x));
        for group in mechanism.lie_joints() {
            let n = group.kind.sizes().1;
            let (linear, angular) = match group.kind {
                LieGroup::SO3 => (0, 3),
                LieGroup::SE3 => (3, 3),
                LieGroup::SE2 => (2, 1),
            };
            let parts = |x: &[f64]| (norm(&x[group.v..group.v + linear]), norm(&x[group.v + linear..group.v + n]));
            let ((v, w), (push, turn), (f, t)) = (parts(&v), parts(p), parts(&by_q));
            let (f, t) = (f + w * push, t + w * turn + v * push);
            for k in 0..linear + angular {
                let of = |pair: (f64, f64)| if k < linear { pair.0 } else { pair.1 };
                (by_q[group.v + k], by_p[group.v + k], size[group.v + k]) = (of((f, t)), of((v, w)), of((push, turn)));
            }
        }
        for (size, rate) in size.iter_mut().zip(&by_q) {
            *size += h * rate;
        }
        let least = 1e-3 * size.iter().fold(0.0_f64, |m, p| m.max(*p));
        let coordinate = tolerances.coordinates.absolute.max(tolerances.rotations) + ROUNDING * largest_angle;
        let momentum = tolerances.momenta.relative + ROUNDING;
        let squares = by_q.iter().map(|g| g * coordinate);
        let squares = squares.chain(by_p.iter().zip(&size).map(|(g, p)| g * momentum * p.max(least)));
        (2.0 * nv as f64).sqrt() * squares.map(|x| x * x).sum::<f64>().sqrt()
    }

    /// Rounding of the energies themselves, J.
    fn rounding(&self) -> f64 {
        EVALUATION * self.damping.len() as f64 * self.size
    }

    /// The energy against which a change is large, J: half of what moves between kinetic and potential energy, because
    /// energy that a run gains by its errors is among it.
    fn scale(&self) -> f64 {
        let [low, high] = self.potential.unwrap_or_default();
        0.5 * self.kinetic.max(high - low)
    }
}

/// What the energy says of a run.
pub struct Verdict {
    /// Line of the report.
    pub line: String,
    /// Warning: what is wrong, and what to do.
    pub warning: Option<(String, String)>,
    /// Whether no digit of the energy is left.
    pub lost: bool,
}

/// A factor with two or three digits.
fn number(x: f64) -> String {
    match x {
        0.0 => "0".to_string(),
        x if (0.01..1000.0).contains(&x) => format!("{x:.2}"),
        x => format!("{x:.1e}"),
    }
}

/// What a plot says of the energy where a curve would show nothing but round-off.
pub fn in_words(record: &Record) -> Option<String> {
    let (ends, balance) = (&record.ends, &record.balance);
    let largest = ends.change.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    // Runs with contacts keep no balance; the energy is a sum that is rounded in any case.
    let rounding = balance.rounding().max(EVALUATION * ends.scale);
    (largest.is_finite() && largest <= rounding).then(|| match largest == 0.0 {
        true => "The energy does not change in any digit.".to_string(),
        false => {
            let relative = ends.changes().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            format!("The energy is constant to round-off: it changes by at most {relative:.1e} of the largest kinetic energy.")
        }
    })
}

/// Change of coordinates, rad or m, and velocities, rad/s or m/s, up to which a run with fixed steps is one at rest.
const UNMOVED: f64 = 1e-12;

/// How far coordinates have moved, where no row of the table shows more than what rounding and the tolerance make of a mechanism
/// at rest. Its energies are errors then, all of them, and measure nothing.
fn at_rest(record: &Record, settings: &Settings) -> Option<f64> {
    let allowed = match settings.step {
        Step::Adaptive(tolerances) => tolerances.rotations,
        Step::Fixed(_) => UNMOVED,
    };
    let start = record.q.first()?;
    let largest = |most: f64, x: f64| if x > most || x.is_nan() { x } else { most };
    let changes = record.q.iter().flat_map(|q| q.iter().zip(start)).map(|(q, start)| (q - start).abs());
    let moved = changes.fold(0.0, largest);
    let speed = record.v.iter().flatten().map(|v| v.abs()).fold(0.0, largest);
    (moved <= allowed && speed <= allowed).then_some(moved)
}

/// Judges a run by its energy.
pub fn judge(record: &Record, settings: &Settings) -> Verdict {
    let (balance, ends, steps) = (&record.balance, &record.ends, record.statistics.steps);
    let relative = |x: f64| x / if ends.scale > 0.0 { ends.scale } else { 1.0 };
    let change = format!("{:.1e} of the largest kinetic energy, {:.3e} J", ends.worst(), ends.scale);
    if settings.project {
        let line = format!("energy error: at most {change}; --project keeps it, so that it does not measure this run");
        return Verdict { line, warning: None, lost: false };
    }
    if let Some(moved) = at_rest(record, settings) {
        let line = format!(
            "energy error: at most {:.1e} J; the mechanism is at rest, no coordinate moves by more than {moved:.1e}",
            balance.worst
        );
        return Verdict { line, warning: None, lost: false };
    }
    let [dampers, control] = balance.works;
    let mut line = match (balance.damped, balance.controlled) {
        (false, false) => format!("energy error: at most {change}"),
        (true, false) => format!(
            "energy: changes by up to {change} (the model has dampers; --no-damping leaves them out)\nenergy error: energy and \
             work of the dampers differ by at most {:.1e} of it",
            relative(balance.worst)
        ),
        (damped, true) => format!(
            "energy: changes by up to {change}; the control does {control:.6} J of work{}\nenergy error: energy and work differ \
             by at most {:.1e} of it",
            if damped { format!(", dampers take {:.6} J", -dampers) } else { String::new() },
            relative(balance.worst)
        ),
    };
    let error = (balance.worst - balance.doubt - balance.rounding()).max(0.0);
    let lost = error > 0.0 && error >= balance.scale();
    let raise = match settings.step {
        Step::Fixed(_) => "lower --step",
        Step::Adaptive(_) => "lower --tolerance, or take another --method",
    };
    let warning = match (settings.step, lost) {
        (_, true) => {
            let what = format!(
                "the energy is off by {:.1e} of the largest kinetic energy: no digit of this motion can be trusted",
                relative(balance.worst)
            );
            Some((what, raise.to_string()))
        }
        (Step::Adaptive(tolerances), false) => {
            let (tolerance, allowed) = (tolerances.rotations, balance.allowed.max(f64::MIN_POSITIVE));
            line += &format!(
                ", {} times the tolerance; errors of the tolerance in all {steps} steps allow {} times",
                number(relative(balance.worst) / tolerance),
                number(relative(allowed) / tolerance)
            );
            (error > allowed).then(|| {
                let what = format!(
                    "the energy error is {:.1} times what the tolerance allows in {steps} steps: errors of steps are larger \
                     than estimated",
                    balance.worst / allowed
                );
                (what, format!("{raise}; --trust measures the error of the motion"))
            })
        }
        (Step::Fixed(h), false) => (error > COARSE * balance.scale()).then(|| {
            let what = format!(
                "the energy is off by {:.1e} of the largest kinetic energy: steps of {h} s are too large for two digits",
                relative(balance.worst)
            );
            (what, format!("{raise}; --trust measures the error of the motion"))
        }),
    };
    if balance.changes() && balance.doubt > 0.0 {
        line += &format!(" (the work is known to {:.1e})", relative(balance.doubt));
    }
    Verdict { line, warning, lost }
}
