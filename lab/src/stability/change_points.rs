//! Energy of mechanisms that pass singular positions: how much is lost, and whether a run that loses it says so.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;

use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::codegen::read::{self, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::catalogue;
use multibody::runtime::constrained::{close, complete, Closing, Effort, Projection, Stabilisation, WithPostStep};
use multibody::runtime::integrate::{Solver, Step, StepError, Tolerances};
use multibody::runtime::{Constrained, System};

use super::mechanisms::Mechanism;

/// A run is given up after so many evaluations of the rates.
const MOST_EVALUATIONS: u64 = 640_000;

/// A mechanism that has been read.
pub struct Subject {
    /// The mechanism.
    pub mechanism: Mechanism,
    plan: Plan,
    start: Vec<f64>,
}

/// How runs are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Way {
    /// Name of the method.
    pub method: &'static str,
    /// Tolerance of its steps.
    pub tolerance: f64,
    /// What is done at the ends of steps.
    pub hold: Stabilisation,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// It reached its end.
    Whole,
    /// It stopped with an error.
    Error(StepError),
    /// It took more evaluations than are allowed here.
    GivenUp,
}

/// One run.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Velocity of the driver at the start.
    pub speed: f64,
    /// Largest change of the energy relative to the largest kinetic energy, at any step before the end.
    pub energy: f64,
    /// Steps.
    pub steps: u64,
    /// Singular positions that were met or passed, as far as the stabilisation sees them.
    pub positions: u32,
    /// How it ended.
    pub end: End,
}

/// What runs of one way lost.
#[derive(Clone, Copy, Debug)]
pub struct Judged {
    /// Number of runs that reached their end, and whose energy errs by more than it may.
    pub lost: usize,
    /// Number of runs that stopped with an error.
    pub refused: usize,
    /// Number of runs that were given up.
    pub capped: usize,
    /// Largest error of the energy of the runs that reached their end, relative to the largest kinetic energy.
    pub error: f64,
    /// Mean number of steps of those.
    pub steps: u64,
    /// Number of singular positions that all runs met or passed.
    pub positions: u32,
}

impl Subject {
    /// Runs at all speeds, and compares the energy with the tolerance and with `smooth`, what the same method loses on a
    /// mechanism without singular positions.
    pub fn judged(&self, way: Way, speeds: &[f64], smooth: f64) -> Judged {
        let allowed = (100.0 * way.tolerance).max(10.0 * smooth);
        let runs = self.runs(way, speeds);
        let whole: Vec<&Run> = runs.iter().filter(|run| run.end == End::Whole).collect();
        Judged {
            // An error that is not a number is lost too.
            lost: whole.iter().filter(|run| run.energy.is_nan() || run.energy > allowed).count(),
            refused: runs.iter().filter(|run| matches!(run.end, End::Error(_))).count(),
            capped: runs.iter().filter(|run| run.end == End::GivenUp).count(),
            error: whole.iter().fold(0.0, |most, run| run.energy.max(most)),
            steps: whole.iter().map(|run| run.steps).sum::<u64>() / whole.len().max(1) as u64,
            positions: runs.iter().map(|run| run.positions).sum(),
        }
    }

    /// Reads a mechanism and closes it at its start.
    pub fn new(mechanism: Mechanism) -> Subject {
        let read = read::model("model.toml", &mechanism.text, &ImportOptions::default());
        let model = read.unwrap_or_else(|e| panic!("{}: {e}", mechanism.name)).model;
        let plan = search::plan(&model, PlanOptions::default());
        let mut start = plan.start();
        let held = plan.held();
        let closed = close(&mut plan.default_interpreter(), &mut start, &Closing::holding(&held));
        closed.unwrap_or_else(|e| panic!("{}: {e}", mechanism.name));
        Subject { mechanism, plan, start }
    }

    /// `n` velocities of the driver, spread over the range of the mechanism.
    pub fn speeds(&self, n: usize) -> Vec<f64> {
        let [least, most] = self.mechanism.speeds;
        (0..n).map(|k| least + (most - least) * (k as f64 + 0.5) / n as f64).collect()
    }

    /// Makes a run for every speed, on all processors.
    pub fn runs(&self, way: Way, speeds: &[f64]) -> Vec<Run> {
        let (next, runs) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    while let Some(speed) = speeds.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let run = self.run(way, *speed);
                        runs.lock().expect("no run panics").push(run);
                    }
                });
            }
        });
        let mut runs = runs.into_inner().expect("no run panics");
        runs.sort_by(|a: &Run, b: &Run| a.speed.total_cmp(&b.speed));
        runs
    }

    /// Runs once.
    pub fn run(&self, way: Way, speed: f64) -> Run {
        let mut system = self.plan.default_interpreter();
        let mut q = self.start.clone();
        let (mut v, mut p) = (system.zero_momenta(), system.zero_momenta());
        v[self.mechanism.driver] = speed;
        let mut held = vec![false; v.len()];
        held[self.mechanism.driver] = true;
        complete(&mut system, 0.0, &q, &mut v, &held, 1e-9).expect("the driver can move");
        system.momenta(&q, &v, &mut p);
        let mut sigma = system.zero_rows();
        system.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
        let mut observer = system.clone();
        let (kinetic, potential) = observer.energy(&q, &p);
        let begun = kinetic + potential;
        let projection = Projection::new(&system, way.hold, Effort::within(way.tolerance));
        let method = catalogue::any(way.method, &system, false).expect("a method of the catalogue");
        let method = WithPostStep::new(&system, method, projection);
        let step = Step::Adaptive(Tolerances::new(way.tolerance));
        let mut solver = Solver::new(&mut system, method, step, 0.0, &q, &p).expect("a start that is closed");
        let mut run = Run { speed, energy: 0.0, steps: 0, positions: 0, end: End::Whole };
        let (mut worst, mut most) = (0.0_f64, kinetic);
        while solver.time() < self.mechanism.time {
            if let Err(error) = solver.advance(&mut system, self.mechanism.time) {
                run.end = End::Error(error);
                break;
            }
            run.steps += 1;
            if solver.statistics().evaluations > MOST_EVALUATIONS {
                run.end = End::GivenUp;
                break;
            }
            solver.state(&system, &mut q, &mut p);
            let (kinetic, potential) = observer.energy(&q, &p);
            (worst, most) = (worst.max((kinetic + potential - begun).abs()), most.max(kinetic));
        }
        run.energy = worst / most;
        run.positions = solver.method().post_step.singular_positions().0;
        run
    }
}
