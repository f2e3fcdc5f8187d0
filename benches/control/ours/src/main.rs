//! Solves a problem of `scenes.py` with the solver of the example `mpc`, and times it within this process, on one thread.
//!
//! usage: control-ours SCENE PROBLEM SOLVES
//!
//! Prints one JSON object: the cost after every iteration and how many trajectories it tried, the processor seconds of every
//! solve, those of one direction and one short step at the solution (as much work as a full one), and the last trajectory in
//! `(q, v)`.

use cpu_time::ThreadTime;
use ilqr::{Ilqr, Problem, Progress};
use multibody::runtime::{Conjugate, Differentiable, Real, Scalar};
use steps::{Dynamics, Steps};
use velocities::Velocities;

#[path = "../../../../examples/mpc/box_minimum.rs"]
mod box_minimum;
#[path = "../../../../examples/mpc/ilqr.rs"]
#[allow(dead_code)]
mod ilqr;
#[path = "../../../../examples/mpc/steps.rs"]
mod steps;
#[path = "../../../../examples/mpc/velocities.rs"]
mod velocities;

multibody::mbd_model! {
    path = "../../../models/double_pendulum.toml",
    name = Acrobot,
    outputs = [rates, derivatives, momenta],
}

multibody::mbd_model! {
    path = "../../../models/ur5.urdf",
    name = Ur5,
    outputs = [rates, derivatives, momenta],
}

type Failed = Box<dyn std::error::Error>;

/// The most iterations of a solve.
const MOST: usize = 500;

/// Numbers of a problem's file.
struct Numbers(std::vec::IntoIter<f64>);

impl Numbers {
    fn one(&mut self) -> Result<f64, Failed> {
        self.0.next().ok_or_else(|| "the problem's file ends early".into())
    }

    fn row<const N: usize>(&mut self) -> Result<[f64; N], Failed> {
        let mut row = [0.0; N];
        for x in &mut row {
            *x = self.one()?;
        }
        Ok(row)
    }
}

/// A problem of a mechanism.
struct Task<Y, const NX: usize, const NU: usize> {
    dynamics: Velocities<Y, f64, NX, NU>,
    problem: Problem<f64, NX, NU>,
    start: [f64; NX],
    guess: [f64; NU],
}

impl<Y, const NV: usize, const NX: usize, const NU: usize> Task<Y, NX, NU>
where
    Y: Differentiable<Scalar = f64, Coordinates = [f64; NV], Momenta = [f64; NV], Square = [[f64; NV]; NV]> + Conjugate,
{
    fn read(path: &str, nodes: usize, mut system: Y, drive: fn(&mut Y, &[f64; NU])) -> Result<Self, Failed> {
        let words: Result<Vec<f64>, _> = std::fs::read_to_string(path)?.split_whitespace().map(str::parse).collect();
        let mut numbers = Numbers(words?.into_iter());
        let [count, length, nx, nu] = numbers.row()?;
        if [count, nx, nu] != [nodes as f64, NX as f64, NU as f64] {
            return Err("the problem's sizes are not those that this program is compiled for".into());
        }
        let start: [f64; NX] = numbers.row()?;
        let (goal, running, end, effort) = (numbers.row()?, numbers.row()?, numbers.row()?, numbers.row()?);
        let (bounds, guess) = ([numbers.row()?, numbers.row()?], numbers.row()?);
        let driven: [f64; NU] = numbers.row()?;
        let (q, v): ([f64; NV], [f64; NV]) =
            (core::array::from_fn(|i| start[i]), core::array::from_fn(|i| start[NV + i]));
        let mut p = [0.0; NV];
        system.conjugate_momenta(&q, &v, &mut p);
        Ok(Task {
            dynamics: Velocities::new(Steps { system, drive, joints: driven.map(|j| j as usize), length }),
            problem: Problem { goal, running, end, effort, bounds },
            start: core::array::from_fn(|i| if i < NV { q[i] } else { p[i - NV] }),
            guess,
        })
    }

    /// Solves it; `see` is shown the cost and the number of trajectories tried after every iteration.
    fn solve<const N: usize>(&mut self, plan: &mut Ilqr<f64, NX, NU, N>, mut see: impl FnMut(f64, u32)) {
        *plan = Ilqr::new(&mut self.dynamics, &self.problem, &self.start, &self.guess);
        for _ in 0..MOST {
            let progress = plan.iterate(&mut self.dynamics, &self.problem);
            see(plan.cost, plan.tried);
            match progress {
                Progress::Improved(part) if part < 1e-9 => return,
                Progress::Converged => return,
                _ => {}
            }
        }
    }

    fn run<const N: usize>(&mut self, solves: usize) {
        let mut plan =
            Box::new(Ilqr::<f64, NX, NU, N>::new(&mut self.dynamics, &self.problem, &self.start, &self.guess));
        let (first, mut costs, mut tried) = (plan.cost, Vec::new(), Vec::new());
        self.solve(&mut plan, |cost, count| {
            costs.push(cost);
            tried.push(count);
        });
        let (mut seconds, mut steps) = (Vec::new(), Vec::new());
        for _ in 0..solves {
            let clock = ThreadTime::now();
            self.solve(&mut plan, |_, _| {});
            seconds.push(clock.elapsed().as_secs_f64());
        }
        for _ in 0..20 * solves {
            let clock = ThreadTime::now();
            let direction = plan.direction(&mut self.dynamics, &self.problem);
            let cost = plan.try_step(&mut self.dynamics, &self.problem, 1.0 / 512.0);
            steps.push(clock.elapsed().as_secs_f64());
            std::hint::black_box((direction, cost));
        }
        let x: Vec<f64> = plan.x.iter().flat_map(|x| self.dynamics.weighed(x)).collect();
        let u: Vec<f64> = plan.u[..N - 1].iter().flatten().copied().collect();
        print!("{{\"first\": {first:?}, \"costs\": {costs:?}, \"tried\": {tried:?}, ");
        println!("\"seconds\": {seconds:?}, \"full\": {steps:?}, \"x\": {x:?}, \"u\": {u:?}}}");
    }
}

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, problem, solves] = &arguments[..] else {
        return Err("usage: control-ours SCENE PROBLEM SOLVES".into());
    };
    let solves = solves.parse()?;
    match scene.as_str() {
        "acrobot" => {
            let drive = |arm: &mut Acrobot, u: &[f64; 1]| arm.tau = [0.0, u[0]];
            Task::<_, 4, 1>::read(problem, 201, Acrobot::new(), drive)?.run::<201>(solves);
        }
        "ur5" => {
            let drive = |arm: &mut Ur5, u: &[f64; 6]| arm.tau = *u;
            Task::<_, 12, 6>::read(problem, 101, Ur5::new(), drive)?.run::<101>(solves);
        }
        _ => return Err(format!("no scene is named {scene}").into()),
    }
    Ok(())
}
