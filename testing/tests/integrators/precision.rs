//! The sweeps and the explicit methods in double-double numbers have the accuracy of these numbers, so they can be
//! references.

use mbd_codegen::plan::Plan;
use mbd_codegen::read::Base;
use mbd_codegen::search;
use mbd_runtime::integrate::{Dop853, Point, Rk4, Stepper, Tsit5, Verner9};
use mbd_runtime::wide::Wide;
use mbd_runtime::{Interpreter, Real, Scalar};
use mbd_testing::random::{random_model, Distribution};
use mbd_testing::state::{random_state, State};

type Number = Wide<false>;

fn numbers(list: &[f64]) -> Vec<Number> {
    list.iter().map(|x| Number::constant(*x)).collect()
}

fn size(list: &[Number]) -> f64 {
    list.iter().fold(0.0, |m, x| x.to_f64().abs().max(m))
}

fn off(a: &[Number], b: &[Number]) -> f64 {
    size(&a.iter().zip(b).map(|(a, b)| *a - *b).collect::<Vec<Number>>())
}

fn dot(a: &[Number], b: &[Number]) -> Number {
    a.iter().zip(b).fold(Number::zero(), |sum, (a, b)| sum + *a * *b)
}

/// A tree with a state in both kinds of numbers.
struct Scene {
    plan: Plan,
    state: State,
    i: Interpreter<Number>,
    q: Vec<Number>,
    v: Vec<Number>,
    p: Vec<Number>,
}

impl Scene {
    fn new(plan: Plan, seed: u64) -> Scene {
        let state = random_state(&plan, seed);
        let mut i = state.interpreter_of(&plan, |x, _| Number::constant(x));
        let (q, v) = (numbers(&state.q), numbers(&state.v));
        let mut p = vec![Number::zero(); v.len()];
        i.momenta(&q, &v, &mut p);
        Scene { plan, state, i, q, v, p }
    }

    /// A UR5, and trees of revolute and prismatic joints with inertias of every kind. Joint axes are axes of frames:
    /// for other directions, cosine and sine of constant rotations would be doubles, whose squares add up to one to 53
    /// bits only.
    fn all() -> Vec<Scene> {
        let ur5 = search::plan(&crate::wide::model("ur5.urdf", Base::Fixed), Default::default());
        let random = |seed| {
            let kinds = [3.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            let model = random_model(
                seed,
                &Distribution { bodies: (4, 7), branching: 0.3, skew: 0.0, kinds, ..Distribution::default() },
            );
            Scene::new(search::plan(&model, Default::default()), seed)
        };
        std::iter::once(Scene::new(ur5, 0)).chain((1..16).map(random)).collect()
    }

    /// The scene without joint forces, so that the energy is conserved.
    fn conservative(mut self) -> Scene {
        self.state.tau.fill(0.0);
        self.i.tau.fill(Number::zero());
        self
    }

    /// Velocities and rates.
    fn rates(&mut self) -> [Vec<Number>; 3] {
        let zeros = |n: usize| vec![Number::zero(); n];
        let (mut v, mut qd, mut pd) = (zeros(self.v.len()), zeros(self.q.len()), zeros(self.p.len()));
        self.i.rates(&self.q, &self.p, &mut v, &mut qd, &mut pd);
        [v, qd, pd]
    }

    fn energy(&mut self, q: &[Number], p: &[Number]) -> Number {
        let (kinetic, potential) = self.i.energy(q, p);
        kinetic + potential
    }
}

#[test]
fn doubles_agree() {
    for (k, mut scene) in Scene::all().into_iter().enumerate() {
        let [_, _, right] = scene.rates();
        let mut i = scene.state.interpreter(&scene.plan);
        let n = scene.p.len();
        let (mut p, mut v, mut qd, mut pd) = (vec![0.0; n], vec![0.0; n], vec![0.0; scene.q.len()], vec![0.0; n]);
        i.momenta(&scene.state.q, &scene.state.v, &mut p);
        i.rates(&scene.state.q, &p, &mut v, &mut qd, &mut pd);
        let off = off(&numbers(&pd), &right) / size(&right);
        assert!(off < 1e-13, "{k}: {off:e}");
        assert!(off > 1e-18, "{k}: they are the same numbers");
    }
}

/// Momenta give back the velocities from which they were computed. Twice the kinetic energy, from another sweep, is
/// `p·v`.
#[test]
fn the_algebra_is_good_to_its_last_bits() {
    for (k, mut scene) in Scene::all().into_iter().enumerate() {
        let [v, _, _] = scene.rates();
        let off = off(&v, &scene.v) / size(&scene.v);
        assert!(off < 1e-28, "{k}: velocities {off:e}");
        let (kinetic, _) = scene.i.energy(&scene.q, &scene.p);
        let off = (dot(&scene.p, &scene.v) / (kinetic + kinetic) - Number::one()).to_f64().abs();
        assert!(off < 1e-28, "{k}: energy {off:e}");
    }
}

/// Along the rates, the energy changes by the power of the joint forces. Its derivative is taken by differences of
/// eighth order with steps of 1e-5 of the time in which the state changes by itself. Their truncation error is below
/// round-off, which is 1e-31 divided by the step. Sines of 53 bits would cause an error of 1e-12.
#[test]
fn power_is_the_rate_of_energy() {
    // The weights of f(h) - f(-h), f(2h) - f(-2h), … in h times the derivative.
    const DIFFERENCES: [(i64, i64); 4] = [(4, 5), (-1, 5), (4, 105), (-1, 280)];
    for (k, mut scene) in Scene::all().into_iter().enumerate() {
        let [v, qd, pd] = scene.rates();
        let h = Number::constant(1e-5 / size(&qd).max(size(&pd) / size(&scene.p)));
        let mut slope = Number::zero();
        for (m, (n, d)) in DIFFERENCES.into_iter().enumerate() {
            let mut at = |side: f64| {
                let step = Number::constant(side * (m + 1) as f64) * h;
                let moved = |x: &[Number], rate: &[Number]| -> Vec<Number> {
                    x.iter().zip(rate).map(|(x, r)| *x + step * *r).collect()
                };
                let (q, p) = (moved(&scene.q, &qd), moved(&scene.p, &pd));
                scene.energy(&q, &p)
            };
            let weight: Number = mbd_runtime::integrate::ratio(n, d).get();
            slope = slope + (at(1.0) - at(-1.0)) * weight;
        }
        let slope = slope / h;
        let power = dot(&v, &numbers(&scene.state.tau));
        let scale = size(&v) * size(&scene.p) * size(&qd);
        let off = (slope - power).to_f64().abs() / scale;
        println!("{k}: {off:e}");
        assert!(off < 1e-24, "{k}: {off:e}");
    }
}

/// Halving the step divides the error by two to the order, also for errors far below the precision of doubles.
#[test]
fn methods_converge_far_below_doubles() {
    let scene = Scene::all().swap_remove(0).conservative();
    let [nine, eight] = [true, false].map(|verner| {
        let run = |steps: u32| {
            let (mut i, mut q, mut p) = (scene.i.clone(), scene.q.clone(), scene.p.clone());
            let h = Number::constant(1.0 / (256.0 * f64::from(steps)));
            let (mut verner9, mut dop853) = (Verner9::new(&i), Dop853::new(&i));
            for k in 0..steps {
                let t = h * Number::constant(f64::from(k));
                match verner {
                    true => verner9.step(&mut i, t, h, &mut q, &mut p),
                    false => dop853.step(&mut i, t, h, &mut q, &mut p),
                }
                .unwrap_or_else(|e| panic!("{e}"));
            }
            [q, p].concat()
        };
        let [a, b, c] = [1, 2, 4].map(run);
        let order = (off(&a, &b) / off(&b, &c)).log2();
        println!("order {order:.2}, error {:.1e}", off(&b, &c));
        (order, off(&b, &c))
    });
    assert!((nine.0 - 9.0).abs() < 0.25 && (eight.0 - 8.0).abs() < 0.25, "{nine:?} {eight:?}");
    assert!(nine.1 < 1e-24 && eight.1 < 1e-21, "{nine:?} {eight:?}");
}

/// A point within a step, from dense output, is compared with a step that ends there. The difference falls with the
/// order of the interpolant plus one.
#[test]
fn points_within_a_step_have_their_order() {
    fn order(scene: &Scene, mut method: impl Stepper<Interpreter<Number>>) -> f64 {
        let mut i = scene.i.clone();
        let [coarse, fine] = [256.0, 512.0].map(|steps| {
            let (t, h) = (Number::zero(), Number::constant(1.0 / steps));
            let (mut off, mut within) = (0.0_f64, Point::zero(&i));
            for theta in [0.25, 0.5, 0.875].map(Number::constant) {
                method.begin(&mut i, t, &scene.q, &scene.p).unwrap();
                method.attempt(&mut i, t, h, None).unwrap();
                method.interpolate(&mut i, t, h, theta, &mut within);
                method.attempt(&mut i, t, theta * h, None).unwrap();
                off = off.max(self::off(&within.x, &method.parts().1.x));
            }
            off
        });
        (coarse / fine).log2()
    }
    let scene = Scene::all().swap_remove(0);
    let i = &scene.i;
    let orders = [
        (4.0, order(&scene, Rk4::new(i))),
        (5.0, order(&scene, Tsit5::new(i))),
        (8.0, order(&scene, Dop853::new(i))),
        (9.0, order(&scene, Verner9::new(i))),
    ];
    println!("{orders:?}");
    assert!(orders.iter().all(|(right, found)| (found - right).abs() < 0.2), "{orders:?}");
}
