//! Control of a simulated mechanism: efforts and wrenches from tables, set-points that gains follow, and compensation of
//! gravity.

mod driven;
mod loads;
mod table;

use std::cell::{Cell, RefCell};
use std::path::Path;
use std::rc::Rc;

use multibody::codegen::jit::Compiled;
use multibody::codegen::plan::{JointAxis, Plan};
use multibody::codegen::words::{did_you_mean, list, quote};
use multibody::runtime::StateDerivatives;

use super::args::{ControlArgs, Gain, Interpolation};
use super::{Failure, Outcome};

pub use driven::Driven;
pub use loads::Loads;
pub use table::Table;

/// One freedom on which the controller acts: a coordinate whose rate is a velocity.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Indices into `q` and `v`.
    q: usize,
    v: usize,
    /// Stiffness, N m/rad or N/m, and damping, N m s/rad or N s/m, of the controller.
    gains: [f64; 2],
    /// Position where no table says another, rad or m.
    rest: f64,
}

/// What a column of set-points is for an axis: its position or its velocity.
const POSITION: usize = 0;
const VELOCITY: usize = 1;

/// What sets joint forces and wrenches during a motion.
///
/// Joint forces are the sum of those of the table, of `kp (q* - q) + kd (v* - v)`, and of those that hold the mechanism at
/// rest against gravity and springs; each is then limited to the effort of its joint.
#[derive(Debug)]
pub struct Controller {
    efforts: Option<Table>,
    /// Columns are `2 axis + part`.
    set_points: Option<Table>,
    /// Columns are `6 wrench + component`.
    wrenches: Option<Table>,
    interpolation: Interpolation,
    axes: Vec<Axis>,
    follows: bool,
    compensates: bool,
    /// Largest effort of every velocity; infinite where there is no limit.
    limits: Vec<f64>,
    /// Start of the interval between two rows of the tables that the motion is in, s.
    now: Cell<f64>,
    work: RefCell<Work>,
}

/// Working memory.
#[derive(Debug, Default)]
struct Work {
    zero: Vec<f64>,
    bias: Vec<f64>,
    /// Joint forces before they are limited.
    demand: Vec<f64>,
}

/// The axes of a plan, without gains.
fn axes(plan: &Plan, start: &[f64]) -> Vec<Axis> {
    plan.axes().map(|JointAxis { q, v, .. }| Axis { q, v, gains: [0.0; 2], rest: start[q] }).collect()
}

/// Names of columns: with the letter of a quantity, as the tables of `mbd simulate` have them, and without it.
fn columns(letter: &str, names: impl Iterator<Item = (String, usize)>, bare: bool) -> Vec<table::Name> {
    let both = |(name, what): (String, usize)| {
        let letter = (format!("{letter}.{name}"), what);
        [bare.then_some((name, what)), Some(letter)]
    };
    names.flat_map(both).flatten().collect()
}

/// Sets gains: the one for all joints, then those by name, in whatever order they are given.
fn set_gains(axes: &mut [Axis], names: &[String], which: usize, option: &str, gains: &[Gain]) -> Outcome {
    for (k, gain) in gains.iter().enumerate() {
        if gains[..k].iter().any(|other| other.name == gain.name) {
            let whose = gain.name.as_deref().map_or("all joints".to_string(), quote);
            return Err(Failure::new(
                format!("--{option}: a second gain for {whose}"),
                "give one number for all joints, and JOINT=NUMBER for those with another one",
            ));
        }
    }
    let (of_all, of_one): (Vec<&Gain>, Vec<&Gain>) = gains.iter().partition(|gain| gain.name.is_none());
    for Gain { name, value } in of_all.into_iter().chain(of_one) {
        match name {
            None => axes.iter_mut().for_each(|axis| axis.gains[which] = *value),
            Some(name) => match axes.iter_mut().find(|axis| names[axis.v] == *name) {
                Some(axis) => axis.gains[which] = *value,
                None => return Err(unknown(option, name, axes, names)),
            },
        }
    }
    Ok(())
}

/// A joint on which a controller does not act.
fn unknown(option: &str, name: &str, axes: &[Axis], names: &[String]) -> Failure {
    let known = || axes.iter().map(|axis| names[axis.v].as_str());
    let help = did_you_mean(name, known(), || format!("a controller acts on {}", list(known())));
    Failure::new(format!("--{option}: no joint that a controller acts on is named {}", quote(name)), help)
}

impl Controller {
    /// The controller that the arguments describe, for a motion that starts at `q`; `None` where they describe none.
    pub fn new(plan: &Plan, args: &ControlArgs, q: &[f64], beside: &[String]) -> Outcome<Option<Rc<Controller>>> {
        if !args.any() {
            let alone = [("--actuated", !args.actuated.is_empty()), ("--unlimited", args.unlimited)];
            return match alone.into_iter().find(|(_, given)| *given) {
                Some((option, _)) => Err(Failure::new(
                    format!("{option}: nothing is controlled"),
                    "leave it out, or give --efforts, --kp, --kd or --gravity-compensation",
                )),
                None => Ok(None),
            };
        }
        let names = plan.velocity_names();
        let mut axes = axes(plan, q);
        if !args.actuated.is_empty() {
            for name in &args.actuated {
                if !axes.iter().any(|axis| names[axis.v] == *name) {
                    return Err(unknown("actuated", name, &axes, &names));
                }
            }
            axes.retain(|axis| args.actuated.contains(&names[axis.v]));
        }
        for (which, option, gains) in [(0, "kp", &args.kp), (1, "kd", &args.kd)] {
            set_gains(&mut axes, &names, which, option, gains)?;
        }
        let read = |file: &Option<_>, names: Vec<table::Name>| {
            file.as_ref().map(|path: &std::path::PathBuf| Table::read(path, &names, beside)).transpose()
        };
        let all = || names.iter().cloned().zip(0..);
        let efforts = read(&args.efforts, columns("tau", all(), true))?;
        let of_axes = |part| axes.iter().enumerate().map(move |(k, axis)| (axis.v, 2 * k + part));
        let named = |part| of_axes(part).map(|(v, what)| (names[v].clone(), what)).collect::<Vec<_>>();
        let mut points = columns("q", named(POSITION).into_iter(), true);
        points.extend(columns("v", named(VELOCITY).into_iter(), false));
        let set_points = read(&args.set_points, points)?;
        const PARTS: [&str; 6] = ["fx", "fy", "fz", "mx", "my", "mz"];
        let components = plan.model.wrenches.iter().enumerate().flat_map(|(k, wrench)| {
            PARTS.iter().enumerate().map(move |(c, part)| (format!("{}.{part}", wrench.name), 6 * k + c))
        });
        if args.wrench_table.is_some() && plan.model.wrenches.is_empty() {
            return Err(Failure::new(
                "--wrenches: no external wrench acts on the model",
                "name the bodies on which wrenches act: --wrench LIST, or [[wrench]] in the model",
            ));
        }
        let wrenches = read(&args.wrench_table, columns("wrench", components, true))?;
        let follows = axes.iter().any(|axis| axis.gains != [0.0; 2]);
        if set_points.is_some() && !follows {
            return Err(Failure::new("--set-points without gains moves nothing", "give --kp, and --kd as damping"));
        }
        if axes.is_empty() && args.gravity_compensation {
            return Err(Failure::new(
                "--gravity-compensation: there is no joint on which a controller acts",
                "a controller acts on revolute, prismatic, helical, universal and cylindrical joints",
            ));
        }
        let limits = match args.unlimited {
            true => vec![f64::INFINITY; names.len()],
            false => plan.effort_limits(),
        };
        let zeros = || vec![0.0; names.len()];
        Ok(Some(Rc::new(Controller {
            efforts,
            set_points,
            wrenches,
            interpolation: args.interpolation,
            axes,
            follows,
            compensates: args.gravity_compensation,
            limits,
            now: Cell::new(0.0),
            work: RefCell::new(Work { zero: zeros(), bias: zeros(), demand: zeros() }),
        })))
    }

    /// What the controller does, for the report.
    pub fn summary(&self, args: &ControlArgs) -> String {
        let mut parts = Vec::new();
        let between = match self.interpolation {
            Interpolation::Hold => "held between rows",
            Interpolation::Linear => "linear between rows",
        };
        let file = |path: &Option<std::path::PathBuf>| path.as_deref().unwrap_or(Path::new("")).display().to_string();
        if self.follows {
            let count = self.axes.iter().filter(|axis| axis.gains != [0.0; 2]).count();
            let points = match self.set_points {
                Some(_) => format!("set-points of {} ({between})", file(&args.set_points)),
                None => "the start".to_string(),
            };
            parts.push(format!("gains on {count} axes, to {points}"));
        }
        if self.compensates {
            parts.push(format!("gravity compensated on {} axes", self.axes.len()));
        }
        if self.efforts.is_some() {
            parts.push(format!("efforts of {} ({between})", file(&args.efforts)));
        }
        if self.wrenches.is_some() {
            parts.push(format!("wrenches of {} ({between})", file(&args.wrench_table)));
        }
        parts.join("; ")
    }

    /// Times within `(0, end)` at which a table has a row, s: the motion is smooth between them.
    pub fn instants(&self, end: f64) -> Vec<f64> {
        let tables = [&self.efforts, &self.set_points, &self.wrenches];
        let times = tables.into_iter().flatten().flat_map(|table| table.times.iter().copied());
        let mut times: Vec<f64> = times.filter(|t| *t > 0.0 && *t < end).collect();
        times.sort_unstable_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// Whether joint forces or wrenches jump at these times.
    pub fn jumps(&self) -> bool {
        self.interpolation == Interpolation::Hold || self.set_points.is_some()
    }

    /// From now on, rows of the tables that are not later than `t` (s) count.
    pub fn enter(&self, t: f64) {
        self.now.set(t);
    }

    /// Does something behind the rows of the tables at time `t` (s), and comes back.
    pub fn behind<R>(&self, t: f64, work: impl FnOnce() -> R) -> R {
        let now = self.now.replace(t + 1e-12 * (1.0 + t.abs()));
        let result = work();
        self.now.set(now);
        result
    }

    /// Whether efforts depend on velocities.
    fn feels(&self) -> bool {
        self.follows
    }

    /// Whether wrenches act.
    fn pushes(&self) -> bool {
        self.wrenches.is_some()
    }

    /// Whether efforts or wrenches change with time between two rows.
    fn depends_on_time(&self) -> bool {
        self.interpolation == Interpolation::Linear
    }

    /// Lines go on beyond the ends of the interval that the motion is in: methods look a little to both sides of a time.
    /// Calls `set` with what each column of a table is, its value, and its slope.
    fn look(&self, table: &Table, t: f64, mut set: impl FnMut(usize, f64, f64)) {
        let row = table.row(self.now.get());
        let linear = self.interpolation == Interpolation::Linear;
        let next = (linear && table.times[row] <= self.now.get()).then(|| table.times.get(row + 1)).flatten();
        for (what, values) in &table.columns {
            match next {
                Some(next) => {
                    let slope = (values[row + 1] - values[row]) / (next - table.times[row]);
                    set(*what, values[row] + slope * (t - table.times[row]), slope);
                }
                None => set(*what, values[row], 0.0),
            }
        }
    }

    /// Sets the inputs of a mechanism in a state, given by coordinates and velocities.
    fn set(&self, mechanism: &mut Compiled, t: f64, q: &[f64], v: &[f64]) {
        let Work { zero, bias, demand } = &mut *self.work.borrow_mut();
        demand.fill(0.0);
        if let Some(table) = &self.efforts {
            self.look(table, t, |what, value, _| demand[what] = value);
        }
        if self.follows {
            for axis in &self.axes {
                let [kp, kd] = axis.gains;
                demand[axis.v] += kp * (axis.rest - q[axis.q]) - kd * v[axis.v];
            }
        }
        if let Some(table) = &self.set_points {
            let stated = |k| table.columns.iter().any(|(what, _)| *what == 2 * k + VELOCITY);
            self.look(table, t, |what, value, slope| {
                let (k, part) = (what / 2, what % 2);
                let Axis { v, gains: [kp, kd], rest, .. } = self.axes[k];
                demand[v] += match part {
                    POSITION if stated(k) => kp * (value - rest),
                    POSITION => kp * (value - rest) + kd * slope,
                    _ => kd * value,
                };
            });
        }
        if self.compensates {
            mechanism.inputs().wrenches.fill([0.0; 6]);
            mechanism.bias(q, zero, bias);
            self.axes.iter().for_each(|axis| demand[axis.v] += bias[axis.v]);
        }
        let inputs = mechanism.inputs();
        for ((tau, demand), limit) in inputs.tau.iter_mut().zip(&*demand).zip(&self.limits) {
            *tau = demand.clamp(-limit, *limit);
        }
        if let Some(table) = &self.wrenches {
            self.look(table, t, |what, value, _| inputs.wrenches[what / 6][what % 6] = value);
        }
    }

    /// Adds what gains make of the derivatives of the rates: `∂ṗ/∂q -= kp + kd ∂v/∂q`, `∂ṗ/∂p -= kd ∂v/∂p`.
    fn add_derivatives(&self, out: &mut StateDerivatives<Vec<f64>, Vec<Vec<f64>>>) {
        let work = self.work.borrow();
        for Axis { v, gains: [kp, kd], .. } in &self.axes {
            // An effort at its limit stays there.
            if work.demand[*v].abs() > self.limits[*v] {
                continue;
            }
            out.dpd_dq[*v][*v] -= kp;
            for (to, from) in [(&mut out.dpd_dq, &out.dv_dq), (&mut out.dpd_dp, &out.dv_dp)] {
                to[*v].iter_mut().zip(&from[*v]).for_each(|(to, from)| *to -= kd * from);
            }
        }
    }

    /// Whether the effort of a velocity was limited when the inputs were last set.
    pub fn limited(&self, v: usize) -> bool {
        self.work.borrow().demand[v].abs() > self.limits[v]
    }

    /// Whether derivatives of the rates are complete: implicit methods need them.
    pub fn has_derivatives(&self) -> bool {
        !self.compensates
    }
}
