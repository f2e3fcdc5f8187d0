//! The methods of diffsol (feature `diffsol`) against a method of order 9 with tight tolerances.

use multibody::codegen::read;
use multibody::codegen::search;
use multibody::diffsol::{Diffsol, Failure, Stiff};
use multibody::runtime::integrate::{Solver, Statistics, Step, Tolerances, Verner9};
use multibody::runtime::{Interpreter, System};

struct Scene {
    i: Interpreter<f64>,
    q: Vec<f64>,
    p: Vec<f64>,
    time: f64,
}

impl Scene {
    fn new(text: &str, q: &[f64], v: &[f64], time: f64) -> Scene {
        let read = read::model("scene.toml", text, &Default::default()).unwrap_or_else(|findings| panic!("{findings}"));
        let plan = search::plan(&read.model, Default::default());
        let mut i: Interpreter<f64> = plan.interpreter(&[]);
        let mut p = i.zero_momenta();
        i.momenta(q, v, &mut p);
        Scene { i, q: q.to_vec(), p, time }
    }

    fn reference(&self) -> Vec<f64> {
        let (mut i, mut q, mut p) = (self.i.clone(), self.q.clone(), self.p.clone());
        let method = Verner9::new(&i);
        let mut solver = Solver::new(&mut i, method, Step::Adaptive(Tolerances::new(1e-12)), 0.0, &q, &p).unwrap();
        solver.run(&mut i, self.time).unwrap();
        solver.state(&i, &mut q, &mut p);
        println!("reference: {} steps", solver.statistics().steps);
        [q, p].concat()
    }

    fn run(&self, solver: Diffsol) -> Result<(Vec<f64>, Statistics), Failure> {
        let (mut i, mut q, mut p) = (self.i.clone(), self.q.clone(), self.p.clone());
        let mut last = 0.0;
        let statistics = solver.run(&mut i, 0.0, self.time, &mut q, &mut p, |t, _, _| {
            assert!(t > last);
            last = t;
        })?;
        assert_eq!(last, self.time);
        Ok(([q, p].concat(), statistics))
    }

    /// Checks for every method that the error at the end is at most `factor` times the tolerance.
    fn check(&self, name: &str, tolerances: &[(Stiff, &[f64])], factor: f64) {
        let exact = self.reference();
        for (method, tolerances) in tolerances {
            for &tolerance in *tolerances {
                let solver =
                    Diffsol { method: *method, absolute: tolerance, relative: tolerance, ..Diffsol::default() };
                let (state, statistics) = self.run(solver).unwrap_or_else(|e| panic!("{name}: {method:?}: {e}"));
                let error = state.iter().zip(&exact).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs() / b.abs().max(1.0)));
                println!("{name}: {method:?} {tolerance:e}: error {error:.1e}, {statistics:?}");
                assert!(error < factor * tolerance, "{name}: {method:?} {tolerance:e}: {error:e}");
                assert!(statistics.jacobians > 0 && statistics.evaluations > statistics.steps);
            }
        }
    }
}

const ALL: [(Stiff, &[f64]); 3] =
    [(Stiff::Bdf, &[1e-4, 1e-6, 1e-8]), (Stiff::TrBdf2, &[1e-3, 1e-5]), (Stiff::Esdirk34, &[1e-4, 1e-6])];

/// Limit of the error in multiples of the tolerance. Errors of steps add up, and the motion doubles them some ten times
/// in two seconds.
const FACTOR: f64 = 300.0;

#[test]
fn double_pendulum() {
    let text = include_str!("../models/double_pendulum.toml");
    Scene::new(text, &[1.0, -0.5], &[0.0, 0.0], 2.0).check("double pendulum", &ALL, FACTOR);
}

/// A pendulum on a prismatic joint with a spring of 1e8 N/m. The spring is damped almost critically, so that deviations
/// decay with rates of 1e4 1/s.
const STIFF: &str = r#"
gravity = [0, 0, -9.81]
[[body]]
name = "carriage"
mass = 0.5
[[body]]
name = "bar"
mass = 1.0
com = [0, 0, -0.5]
inertia = [0.08, 0.08, 0.001]
[[joint]]
name = "mount"
type = "prismatic"
child = "carriage"
axis = [1, 0, 0]
stiffness = 1e8
damping = 1.5e4
[[joint]]
name = "swing"
type = "revolute"
parent = "carriage"
child = "bar"
axis = [0, 1, 0]
"#;

#[test]
fn stiff_spring() {
    let scene = Scene::new(STIFF, &[0.0, 1.0], &[0.0, 0.0], 1.0);
    scene.check("stiff spring", &ALL, FACTOR);
    // An explicit method would need far more steps for stability.
    let solver = Diffsol { absolute: 1e-6, relative: 1e-6, ..Diffsol::default() };
    let (_, statistics) = scene.run(solver).unwrap();
    assert!(statistics.steps < 1000, "{statistics:?}");
}

/// The solver integrates components of quaternions.
#[test]
fn tumbling_body() {
    let text = r#"
        gravity = [0, 0, -9.81]
        [[body]]
        name = "body"
        mass = 2.0
        com = [0.1, 0, 0.05]
        inertia = [0.1, 0.2, 0.25]
        [[joint]]
        name = "free"
        type = "floating"
        child = "body"
    "#;
    let scene = Scene::new(text, &[0.0, 0.0, 1.0, 0.5, -0.5, 0.1, 0.7], &[0.3, 0.0, 0.5, 0.1, 4.0, 0.2], 1.0);
    scene.check("tumbling body", &ALL, FACTOR);
}

#[test]
fn the_limit_of_steps_is_kept() {
    let scene = Scene::new(STIFF, &[0.0, 1.0], &[0.0, 0.0], 1.0);
    let result = scene.run(Diffsol { steps: 10, ..Diffsol::default() });
    assert!(matches!(result, Err(Failure::TooManySteps { steps: 10, time }) if time > 0.0 && time < 1.0), "{result:?}");
}
