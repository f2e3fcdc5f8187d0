//! Every method on the same random mechanisms: its order, found by halving the step, and the drift of conserved
//! quantities.
//!
//! A new method gets a row in [`methods`].

use mbd_codegen::model::{Gravity, Value};
use mbd_codegen::search;
use mbd_runtime::integrate::{
    Ab4, Ab6, Abm4, Abm6, Abm8, BackwardEuler, CashKarp, Dop853, Euler, Gauss12FixedPoint, Gauss16, Gauss4, Gauss6,
    ImplicitMidpoint, Midpoint, Radau5, Rk4, Rkf45, Rodas5P, SemiImplicitEuler, StepDoubling, StepError, Stepper,
    Tsit5, Verner9,
};
use mbd_runtime::wide::Wide;
use mbd_runtime::{AccelerationForm, Energetic, Interpreter, Real, Scalar, System};
use mbd_testing::largest_difference;
use mbd_testing::random::{random_model, Distribution};
use mbd_testing::state::random_state;

type Any<Y> = Box<dyn Stepper<Y>>;

/// A method, and the step with which its order shows.
struct Row<Y> {
    name: &'static str,
    order: f64,
    make: fn(&Y) -> Any<Y>,
    /// Factor on the scene's step. With the step of RK4, errors of methods of high order would be round-off.
    coarse: f64,
}

const fn row<Y>(name: &'static str, order: u32, coarse: f64, make: fn(&Y) -> Any<Y>) -> Row<Y> {
    Row { name, order: order as f64, make, coarse }
}

/// Methods with name, order, factor on the step, and constructor. Orders from 5 on are tested in double-double numbers,
/// where errors are above round-off.
fn methods<S: Real + 'static>() -> Vec<Row<Interpreter<S>>> {
    vec![
        row("Euler", 1, 0.125, |i| Box::new(Euler::new(i))),
        row("semi-implicit Euler", 1, 0.125, |i| Box::new(SemiImplicitEuler::new(i))),
        row("midpoint", 2, 0.5, |i| Box::new(Midpoint::new(i))),
        row("RK4", 4, 1.0, |i| Box::new(Rk4::new(i))),
        row("RKF45", 5, 1.0, |i| Box::new(Rkf45::new(i))),
        row("Cash-Karp", 5, 1.0, |i| Box::new(CashKarp::new(i))),
        row("Tsit5", 5, 1.0, |i| Box::new(Tsit5::new(i))),
        row("DOP853", 8, 4.0, |i| Box::new(Dop853::new(i))),
        row("Verner 9", 9, 4.0, |i| Box::new(Verner9::new(i))),
        row("backward Euler", 1, 0.125, |i| Box::new(BackwardEuler::new(i))),
        row("implicit midpoint", 2, 0.5, |i| Box::new(ImplicitMidpoint::new(i))),
        row("Gauss 4", 4, 1.0, |i| Box::new(Gauss4::new(i))),
        row("Gauss 6", 6, 2.0, |i| Box::new(Gauss6::new(i))),
        row("Gauss 12", 12, 16.0, |i| Box::new(Gauss12FixedPoint::new(i))),
        row("Gauss 16", 16, 64.0, |i| Box::new(Gauss16::new(i))),
        row("Radau 5", 5, 1.0, |i| Box::new(Radau5::new(i))),
        // The coefficients of Rodas5P are doubles, so that smaller errors than with this step would be those of
        // coefficients.
        row("Rodas5P", 5, 4.0, |i| Box::new(Rodas5P::new(i))),
        row("Adams-Bashforth 4", 4, 0.25, |i| Box::new(Ab4::new(i))),
        row("Adams-Bashforth 6", 6, 0.25, |i| Box::new(Ab6::new(i))),
        row("Adams-Bashforth-Moulton 4", 4, 0.5, |i| Box::new(Abm4::new(i))),
        row("Adams-Bashforth-Moulton 6", 6, 0.25, |i| Box::new(Abm6::new(i))),
        row("Adams-Bashforth-Moulton 8", 8, 0.25, |i| Box::new(Abm8::new(i))),
        row("RK4 doubled", 4, 2.0, |i| Box::new(StepDoubling::over(i, Rk4::new(i)))),
        row("RK4 doubled, extrapolated", 5, 1.0, |i| Box::new(StepDoubling::extrapolated(i, Rk4::new(i)))),
        row("midpoint doubled, extrapolated", 3, 1.0, |i| Box::new(StepDoubling::extrapolated(i, Midpoint::new(i)))),
    ]
}

/// Methods for the acceleration form of the equations.
fn methods_of_velocities() -> Vec<Row<AccelerationForm<Interpreter<f64>>>> {
    vec![
        row("semi-implicit Euler, one evaluation", 1, 0.125, |i| Box::new(SemiImplicitEuler::of_velocities(i))),
        row("semi-implicit Euler, two", 1, 0.125, |i| Box::new(SemiImplicitEuler::new(i))),
        row("RK4", 4, 1.0, |i| Box::new(Rk4::new(i))),
        row("RK4 doubled, extrapolated", 5, 4.0, |i| Box::new(StepDoubling::extrapolated(i, Rk4::new(i)))),
    ]
}

pub(super) struct Scene {
    pub name: &'static str,
    pub i: Interpreter<f64>,
    wide: Interpreter<Wide>,
    pub q: Vec<f64>,
    pub p: Vec<f64>,
    v: Vec<f64>,
    /// Step that resolves the motion, s. It is small compared with the periods, but errors of RK4 are well above
    /// round-off.
    pub h: f64,
}

impl Scene {
    /// A mechanism of three or four bodies with springs and gravity, whose energy is conserved.
    fn new(name: &'static str, seed: u64, steps: u16, kinds: [f64; 9]) -> Scene {
        let distribution =
            Distribution { bodies: (3, 4), kinds, springs: 1.0, armature: 0.5, ..Distribution::default() };
        let mut model = random_model(seed, &distribution);
        model.gravity = Gravity::Constant([Value::ZERO, Value::ZERO, Value::Const(-9.81)]);
        let plan = search::plan(&model, Default::default());
        let mut s = random_state(&plan, seed);
        s.tau.fill(0.0);
        let mut i = s.interpreter(&plan);
        let mut p = vec![0.0; s.v.len()];
        i.momenta(&s.q, &s.v, &mut p);
        let wide = s.interpreter_of(&plan, |x, _| Wide::constant(x));
        Scene { name, i, wide, q: s.q, p, v: s.v, h: 1.0 / f64::from(steps) }
    }

    /// State after `time` s in steps of `h` s, and the largest drift of the energy relative to the largest kinetic
    /// energy.
    fn run(&self, row: &Row<Interpreter<f64>>, time: f64, h: f64) -> (Vec<f64>, f64) {
        let start = (self.q.clone(), self.p.clone());
        run(&self.i, row, start, time, h).unwrap_or_else(|e| panic!("{}, {}: {e}", self.name, row.name))
    }

    /// State after `time` s in steps of `h` s, in double-double numbers.
    fn run_wide(&self, row: &Row<Interpreter<Wide>>, time: f64, h: f64) -> Vec<Wide> {
        let start = (lifted(&self.q), lifted(&self.p));
        run(&self.wide, row, start, time, h).unwrap_or_else(|e| panic!("{}, {}: {e}", self.name, row.name)).0
    }

    fn run_velocities(&self, row: &Row<AccelerationForm<Interpreter<f64>>>, time: f64, h: f64) -> (Vec<f64>, f64) {
        let start = (self.q.clone(), self.v.clone());
        let system = AccelerationForm::new(self.i.clone());
        run(&system, row, start, time, h).unwrap_or_else(|e| panic!("{}, {}: {e}", self.name, row.name))
    }
}

fn lifted<S: Real>(x: &[f64]) -> Vec<S> {
    x.iter().map(|x| S::constant(*x)).collect()
}

fn run<S, Y>(
    system: &Y,
    row: &Row<Y>,
    (mut q, mut p): (Vec<S>, Vec<S>),
    time: f64,
    h: f64,
) -> Result<(Vec<S>, f64), StepError>
where
    S: Real,
    Y: Energetic<Scalar = S, Coordinates = Vec<S>, Momenta = Vec<S>> + Clone,
{
    let (mut system, mut energy) = (system.clone(), system.clone());
    let mut method = (row.make)(&system);
    assert_eq!(f64::from(method.order()), row.order, "{}", row.name);
    let (kinetic, potential) = energy.energies(&q, &p);
    let (start, mut size, mut drift) = (kinetic + potential, kinetic.to_f64(), 0.0_f64);
    for k in 0..(time / h).round() as usize {
        method.step(&mut system, S::constant(k as f64 * h), S::constant(h), &mut q, &mut p)?;
        let (kinetic, potential) = energy.energies(&q, &p);
        size = size.max(kinetic.to_f64());
        drift = drift.max((kinetic + potential - start).abs().to_f64());
    }
    Ok(([q, p].concat(), drift / size))
}

pub(super) fn scenes() -> [Scene; 3] {
    [
        Scene::new("revolute and prismatic joints", 21, 256, [3.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        Scene::new("planar, helical, universal", 22, 2048, [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
        Scene::new("spherical and floating", 23, 512, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 1.0, 0.0]),
    ]
}

/// Measures the order by three runs, each with half the step of the one before. Adds a line to `wrong` if it is not
/// `expected`.
fn check<S: Real>(scene: &str, name: &str, expected: f64, runs: [Vec<S>; 3], wrong: &mut Vec<String>) {
    let off = |a: &[S], b: &[S]| a.iter().zip(b).map(|(a, b)| (*a - *b).to_f64().powi(2)).sum::<f64>().sqrt();
    let [a, b, c] = runs;
    let (order, error) = ((off(&a, &b) / off(&b, &c)).log2(), off(&b, &c));
    println!("{scene}: {name}: order {order:.3}, error {error:.1e}");
    // Errors of the next order contribute, more so for high orders; they dominate where the leading error happens to be
    // small.
    let margin = 0.06 * (expected + 1.0);
    let near = order > expected - margin && order < expected + 1.0 + margin;
    if !near {
        wrong.push(format!("{scene}: {name}: order {order} instead of {expected}"));
    }
    if error <= 500.0 * S::epsilon() {
        wrong.push(format!("{scene}: {name}: the error is round-off and tells nothing"));
    }
}

#[test]
fn orders() {
    let mut wrong = Vec::new();
    for scene in scenes() {
        for row in methods() {
            if row.order < 5.0 {
                let runs = [1.0, 2.0, 4.0].map(|k| scene.run(&row, 0.25, row.coarse * scene.h / k).0);
                check(scene.name, row.name, row.order, runs, &mut wrong);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn high_orders() {
    let mut wrong = Vec::new();
    for scene in scenes() {
        for row in methods() {
            if row.order >= 5.0 {
                let h = row.coarse * scene.h;
                let runs = [1.0, 2.0, 4.0].map(|k| scene.run_wide(&row, (16.0 * h).min(h.max(0.0625)), h / k));
                check(scene.name, row.name, row.order, runs, &mut wrong);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn orders_in_acceleration_form() {
    let mut wrong = Vec::new();
    for scene in scenes() {
        for row in methods_of_velocities() {
            let runs = [1.0, 2.0, 4.0].map(|k| scene.run_velocities(&row, 0.25, row.coarse * scene.h / k).0);
            check(scene.name, row.name, row.order, runs, &mut wrong);
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

fn rk4() -> Row<Interpreter<f64>> {
    row("RK4", 4, 1.0, |i| Box::new(Rk4::new(i)))
}

#[test]
fn both_forms_of_the_equations_give_one_motion() {
    let accelerations = row("RK4", 4, 1.0, |i| Box::new(Rk4::new(i)) as Any<AccelerationForm<Interpreter<f64>>>);
    for scene in scenes() {
        let h = scene.h / 4.0;
        let (state, _) = scene.run(&rk4(), 0.25, h);
        let (other, _) = scene.run_velocities(&accelerations, 0.25, h);
        let (q, p) = state.split_at(scene.q.len());
        let mut v = vec![0.0; p.len()];
        scene.i.clone().velocities(q, p, &mut v);
        let off = largest_difference(&[q, &v].concat(), &other);
        println!("{}: {off:.1e}", scene.name);
        assert!(off < 1e-7, "{}: {off:e}", scene.name);
    }
}

#[test]
fn energy_drifts_with_the_fourth_power_of_the_step() {
    for scene in scenes() {
        let [coarse, fine] = [2.0, 1.0].map(|k| scene.run(&rk4(), 1.0, k * scene.h).1);
        println!("{}: drift {coarse:.1e}, with half the step {fine:.1e}", scene.name);
        assert!(fine < 1e-6, "{}: {fine:e}", scene.name);
        // Fourth order means a factor of sixteen for short steps; the energy often converges faster.
        assert!(coarse / fine > 11.0, "{}: {coarse:e} {fine:e}", scene.name);
    }
}

#[test]
fn quaternions_stay_on_the_sphere() {
    let [_, _, scene] = scenes();
    assert!(scene.i.quaternions().count() > 0);
    for row in methods() {
        let (state, _) = scene.run(&row, 0.25, scene.h / 2.0);
        for k in scene.i.quaternions() {
            let norm: f64 = state[k..k + 4].iter().map(|x| x * x).sum();
            assert!((norm - 1.0).abs() < 4.0 * f64::EPSILON, "{}: {norm}", row.name);
        }
    }
}

#[test]
fn steps_that_are_too_long_are_refused() {
    let [_, _, scene] = scenes();
    let mut refused = Vec::new();
    for row in methods() {
        let (mut i, mut q, mut p) = (scene.i.clone(), scene.q.clone(), scene.p.clone());
        let mut method = (row.make)(&i);
        let result = (0..200).try_for_each(|k| method.step(&mut i, f64::from(k), 1.0, &mut q, &mut p));
        println!("{}: {result:?}", row.name);
        if let Err(e) = &result {
            use StepError::{NoConvergence, NotFinite, Singular};
            assert!(matches!(e, NotFinite { .. } | NoConvergence { .. } | Singular { .. }), "{}: {e:?}", row.name);
            refused.push(row.name);
        } else {
            assert!(q.iter().chain(&p).all(|x| x.is_finite()), "{}", row.name);
        }
    }
    // All of them: no step of a second follows this motion.
    assert!(refused.len() >= 20, "{refused:?}");
}
