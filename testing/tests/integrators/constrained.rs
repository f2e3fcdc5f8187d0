//! Integration of interpreted mechanisms with constraints. Every stabilisation, minimal coordinates and the methods
//! with multipliers give the same motion.

use mbd_codegen::model::Model;
use mbd_codegen::read;
use mbd_codegen::search;
use mbd_runtime::catalogue;
use mbd_runtime::constrained::{
    close, complete, Closing, CoordinatePartition, Effort, OpenAndClosed, Projection, RadauIndex2, Rattle, Repartition,
    Stabilisation, WithPostStep,
};
use mbd_runtime::integrate::{Dop853, Radau5, Rk4, Solver, Step, Stepper, Tolerances};
use mbd_runtime::system::Real;
use mbd_runtime::{Conjugate, Constrained, Energetic, Interpreter, System};
use mbd_testing::{largest, largest_difference as apart};

type Mechanism = Interpreter<f64>;
type State = (Vec<f64>, Vec<f64>);

/// A four-bar linkage of crank, coupler and rocker. `closing` is the kind of the loop that connects coupler and rocker.
fn four_bar(closing: &str) -> String {
    four_bar_of([1.0, 2.0, 2.0, 2.5], closing)
}

/// A four-bar linkage with the given lengths of crank, coupler, rocker and ground, m.
fn four_bar_of([crank, coupler, rocker, ground]: [f64; 4], closing: &str) -> String {
    let bar = |name: &str, parent: &str, at: f64, length: f64, joint: &str| {
        format!(
            r#"
[[body]]
name = "{name}"
mass = {length}
com = [{}, 0, 0]
inertia = [0.001, 0.1, 0.1]
[[joint]]
name = "{joint}"
type = "revolute"
parent = "{parent}"
child = "{name}"
xyz = [{at}, 0, 0]
axis = [0, 1, 0]
"#,
            length / 2.0
        )
    };
    let bars = bar("crank", "ground", 0.0, crank, "a") + &bar("coupler", "crank", crank, coupler, "b");
    let bars = bars + &bar("rocker", "ground", ground, rocker, "d");
    format!(
        r#"name = "four_bar"
gravity = [0, 0, -9.81]
{bars}
[[frame]]
name = "coupler_end"
body = "coupler"
xyz = [{coupler}, 0, 0]
[[frame]]
name = "rocker_end"
body = "rocker"
xyz = [{rocker}, 0, 0]
[[loop]]
name = "c"
{closing}
between = ["coupler_end", "rocker_end"]
"#
    )
}

/// A floating plate on three rods.
const PLATE: &str = r#"name = "plate"
gravity = [0, 0, -9.81]
[[body]]
name = "plate"
mass = 2.0
com = [0.02, 0, 0.01]
inertia = [0.05, 0.06, 0.1]
[[joint]]
name = "free"
type = "floating"
child = "plate"
[[frame]]
name = "p0"
body = "plate"
xyz = [0.3, 0, 0]
[[frame]]
name = "p1"
body = "plate"
xyz = [-0.2, 0.3, 0]
[[frame]]
name = "p2"
body = "plate"
xyz = [-0.2, -0.3, 0]
[[frame]]
name = "g0"
body = "ground"
xyz = [0.5, 0.1, 1]
[[frame]]
name = "g1"
body = "ground"
xyz = [-0.4, 0.5, 1]
[[frame]]
name = "g2"
body = "ground"
xyz = [-0.4, -0.5, 1]
[[loop]]
name = "rod0"
type = "distance"
between = ["g0", "p0"]
length = 1.0
[[loop]]
name = "rod1"
type = "distance"
between = ["g1", "p1"]
length = 1.1
[[loop]]
name = "rod2"
type = "distance"
between = ["g2", "p2"]
length = 1.0
"#;

/// A disc of 1 kg and 0.5 m that rolls on the ground.
const DISC: &str = r#"name = "disc"
gravity = [0, 0, -9.81]
[[body]]
name = "disc"
mass = 1.0
inertia = [0.0625, 0.125, 0.0625]
[[joint]]
name = "free"
type = "floating"
child = "disc"
[[loop]]
name = "contact"
type = "rolling_disc"
between = ["ground", "disc"]
normal = [0, 0, 1]
axis = [0, 1, 0]
radius = 0.5
"#;

fn model(text: &str) -> Model {
    read::model("model.toml", text, &Default::default()).unwrap_or_else(|findings| panic!("{findings}")).model
}

fn interpreter(model: &Model) -> Mechanism {
    let plan = search::plan(model, Default::default());
    plan.interpreter(&[])
}

fn split(text: &str) -> OpenAndClosed<Mechanism, Mechanism> {
    let closed = model(text);
    let mut open = closed.clone();
    open.constraints.clear();
    OpenAndClosed { open: interpreter(&open), closed: interpreter(&closed) }
}

/// A state that satisfies the constraints, with coordinates and velocities near the given ones.
fn state(y: &mut OpenAndClosed<Mechanism, Mechanism>, q: &[f64], v: &[f64], held: &[bool]) -> State {
    let (mut q, mut v, mut p) = (q.to_vec(), v.to_vec(), vec![0.0; v.len()]);
    let closed = close(y, &mut q, &Closing::holding(held)).unwrap();
    let met = complete(y, 0.0, &q, &mut v, &[], 1e-12).unwrap();
    assert!(closed.residual < 1e-14 && met.residual < 1e-13, "{closed:?} {met:?}");
    y.open.conjugate_momenta(&q, &v, &mut p);
    (q, p)
}

fn crank(closing: &str) -> (OpenAndClosed<Mechanism, Mechanism>, State) {
    let mut y = split(&four_bar(closing));
    // The rocker is the last joint of the file and of the state.
    let start = state(&mut y, &[-1.5, 1.0, -2.0], &[5.0, 0.0, 0.0], &[true]);
    (y, start)
}

fn plate() -> (OpenAndClosed<Mechanism, Mechanism>, State) {
    let mut y = split(PLATE);
    let start = state(&mut y, &[0.1, 0.05, 0.0, 0.1, 0.0, 0.1, 1.0], &[0.5, 0.3, 0.0, 0.0, 0.2, 1.0], &[]);
    (y, start)
}

fn off<Y: Constrained<Scalar = f64>>(y: &mut Y, q: &Y::Coordinates) -> f64 {
    let (mut residual, mut entries) = (y.zero_rows(), y.zero_entries());
    y.constraint_residuals(q, &mut residual, &mut entries);
    largest(residual.as_ref(), 0.0)
}

fn energy<Y: Energetic<Scalar = f64>>(y: &mut Y, q: &Y::Coordinates, p: &Y::Momenta) -> f64 {
    let (kinetic, potential) = y.energies(q, p);
    kinetic + potential
}

fn march<Y, M>(y: &mut Y, method: &mut M, steps: u32, end: f64, (q, p): &State) -> State
where
    Y: System<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>>,
    M: Stepper<Y>,
{
    let (h, mut q, mut p) = (end / f64::from(steps), q.clone(), p.clone());
    for k in 0..steps {
        method.step(y, f64::from(k) * h, h, &mut q, &mut p).unwrap();
    }
    (q, p)
}

fn held<Y: Constrained<Scalar = f64>, M: Stepper<Y>>(
    y: &Y,
    method: M,
    policy: Stabilisation,
) -> WithPostStep<Y, M, Projection<Y>> {
    WithPostStep::new(y, method, Projection::new(y, policy, Effort::default()))
}

/// The classical method without the comparison of energies at the ends of steps.
fn unjudged<Y: Constrained<Scalar = f64>>(y: &Y, policy: Stabilisation) -> WithPostStep<Y, Rk4<Y>, Projection<Y>> {
    let effort = Effort { energy: f64::INFINITY, ..Effort::default() };
    WithPostStep::new(y, Rk4::new(y), Projection::new(y, policy, effort))
}

/// All ways to integrate with constraints converge to the same state with their orders. The mechanisms are a planar
/// one, one with redundant rows in space, and one with a quaternion.
#[test]
fn all_ways_lead_to_the_same_end() {
    let planar = "type = \"point_on_line\"\naxis = [0, 1, 0]";
    let revolute = "type = \"revolute\"\naxis = [0, 1, 0]";
    for (name, (mut y, start)) in [("planar", crank(planar)), ("redundant", crank(revolute)), ("plate", plate())] {
        let end = 1.0;
        let before = energy(&mut y, &start.0, &start.1);
        let mut fine = held(&y, Dop853::new(&y), Stabilisation::Mass);
        let reference = march(&mut y, &mut fine, 2000, end, &start);
        assert!((energy(&mut y, &reference.0, &reference.1) - before).abs() < 1e-11 * before.abs().max(10.0), "{name}");
        println!("{name}: rank {:?} of {} rows", fine.post_step.rank(), y.rows().len());
        for policy in [
            Stabilisation::None,
            Stabilisation::Momenta,
            Stabilisation::Mass,
            Stabilisation::Gradient,
            Stabilisation::Partition,
        ] {
            let errors = [200, 400].map(|steps| {
                let mut method = held(&y, Rk4::new(&y), policy);
                let state = march(&mut y, &mut method, steps, end, &start);
                let closes = !matches!(policy, Stabilisation::None | Stabilisation::Momenta);
                assert!(!closes || off(&mut y, &state.0) < 1e-13, "{name} {policy:?}");
                apart(&state.0, &reference.0)
            });
            println!("{name} {policy:?}: {errors:?}");
            assert!((errors[0] / errors[1]).log2() > 3.5, "{name} {policy:?}: {errors:?}");
        }
        // Projection with a fixed number of iterations costs four evaluations a step.
        let two = Effort { iterations: 2, tolerance: 0.0, ..Effort::default() };
        let mut fixed = WithPostStep::new(&y, Rk4::new(&y), Projection::new(&y, Stabilisation::Mass, two));
        let mut steady = WithPostStep::new(&y, Rk4::new(&y), Projection::fixed_work::<2>(&y));
        let ends = (march(&mut y, &mut fixed, 200, end, &start), march(&mut y, &mut steady, 200, end, &start));
        assert_eq!(ends.0, ends.1, "{name}");
        assert_eq!(steady.statistics().evaluations, 800, "{name}");
        let errors = [200, 400].map(|steps| {
            let (mut q, mut p) = start.clone();
            let mut m = CoordinatePartition::new(y.closed.clone(), &mut q, &mut p).unwrap();
            let mut method = WithPostStep::new(&m, Rk4::new(&m), Repartition::default());
            let state = march(&mut m, &mut method, steps, end, &(q, p));
            assert!(off(&mut y, &state.0) < 1e-13);
            println!("{name} minimal: {} switches", m.switches().0);
            apart(&state.0, &reference.0)
        });
        println!("{name} minimal: {errors:?}");
        assert!((errors[0] / errors[1]).log2() > 3.5, "{name}: {errors:?}");
        // Methods that compute multipliers themselves.
        let errors = [400, 800].map(|steps| {
            let mut method = Rattle::new(&y);
            let state = march(&mut y, &mut method, steps, end, &start);
            assert!(off(&mut y, &state.0) < 1e-13);
            apart(&state.0, &reference.0)
        });
        println!("{name} rattle: {errors:?}");
        assert!((errors[0] / errors[1] - 4.0).abs() < 0.4, "{name}: {errors:?}");
        let errors = [50, 100].map(|steps| {
            let mut method = held(&y, RadauIndex2::new(&y), Stabilisation::Mass);
            let state = march(&mut y, &mut method, steps, end, &start);
            assert!(off(&mut y, &state.0) < 1e-13);
            apart(&state.0, &reference.0)
        });
        println!("{name} radau: {errors:?}");
        assert!((errors[0] / errors[1]).log2() > 4.4, "{name}: {errors:?}");
    }
}

/// Every method of the catalogue runs with projection after its steps, with the accuracy of its order.
#[test]
fn every_method_by_its_name() {
    let (y, start) = crank("type = \"revolute\"\naxis = [0, 1, 0]");
    let mut y = y.closed;
    let end = 0.2;
    let mut fine = held(&y, Dop853::new(&y), Stabilisation::Mass);
    let reference = march(&mut y, &mut fine, 1000, end, &start);
    for entry in catalogue::entries() {
        let method = catalogue::any(entry.name, &y, false).expect(entry.name);
        let method = held(&y, method, Stabilisation::Mass);
        let made = Solver::new(&mut y, method, Step::Fixed(1e-3), 0.0, &start.0, &start.1);
        let mut solver = made.unwrap_or_else(|e| panic!("{}: {e}", entry.name));
        let (mut q, mut p) = start.clone();
        solver.run(&mut y, end).unwrap_or_else(|e| panic!("{}: {e}", entry.name));
        solver.state(&y, &mut q, &mut p);
        let (error, drift) = (apart(&q, &reference.0), off(&mut y, &q));
        println!("{}: {error:.1e}, drift {drift:.1e}", entry.name);
        // The bounds are for first order (rates change by some 30/s², over 200 steps), second order, and higher orders.
        let bound = match entry.name {
            "euler" | "semi-implicit-euler" | "backward-euler" => 2e-2,
            "midpoint" | "implicit-midpoint" => 1e-4,
            _ => 1e-7,
        };
        assert!(error < bound && drift < 1e-13, "{}: {error:e} {drift:e}", entry.name);
    }
}

/// An implicit method uses the derivatives of the constrained rates, with projection after its steps.
#[test]
fn implicit_methods() {
    let (y, start) = crank("type = \"revolute\"\naxis = [0, 1, 0]");
    let mut y = y.closed;
    let before = energy(&mut y, &start.0, &start.1);
    let method = held(&y, Radau5::new(&y), Stabilisation::Mass);
    let step = Step::Adaptive(Tolerances::new(1e-8));
    let mut solver = Solver::new(&mut y, method, step, 0.0, &start.0, &start.1).unwrap();
    solver.run(&mut y, 2.0).unwrap();
    let (mut q, mut p) = start;
    solver.state(&y, &mut q, &mut p);
    println!("{:?}", solver.statistics());
    assert!(off(&mut y, &q) < 1e-13);
    let lost = (energy(&mut y, &q, &p) - before).abs();
    // The run has a few hundred steps, each within 1e-8 of a state of size 10.
    assert!(lost < 1e-5, "{lost:e}");
}

/// RATTLE is symmetric with quaternions, too: twenty steps forward and twenty back lead to the start. Each step solves
/// its equations to some roundings of the state, which is of size one.
#[test]
fn rattle_goes_back_where_it_came_from() {
    let (mut y, start) = plate();
    let mut method = Rattle::new(&y);
    let (mut q, mut p) = start.clone();
    for h in [0.01, -0.01] {
        for _ in 0..20 {
            method.step(&mut y, 0.0, h, &mut q, &mut p).unwrap();
        }
        println!("{:.1e} {:.1e}", apart(&q, &start.0), apart(&p, &start.1));
        assert!(h < 0.0 || apart(&q, &start.0) > 0.05);
    }
    let off = apart(&q, &start.0).max(apart(&p, &start.1));
    assert!(off < 1e-12, "{off:e}");
}

/// A rolling disc: two of its three rows constrain velocities only. At the end the height holds to round-off, and the
/// energy to the tolerance.
#[test]
fn rolling() {
    let mut y = split(DISC);
    // The disc leans and rolls along x.
    let (s, c) = (0.1_f64.sin(), 0.1_f64.cos());
    let start = state(&mut y, &[0.0, 0.0, 0.49, s, 0.0, 0.0, c], &[1.5, 0.0, 0.0, 0.0, 3.0, 0.5], &[]);
    let before = energy(&mut y, &start.0, &start.1);
    for policy in [Stabilisation::Mass, Stabilisation::Gradient, Stabilisation::Partition] {
        let method = held(&y, Dop853::new(&y), policy);
        let step = Step::Adaptive(Tolerances::new(1e-11));
        let mut solver = Solver::new(&mut y, method, step, 0.0, &start.0, &start.1).unwrap();
        solver.run(&mut y, 2.0).unwrap();
        let (mut q, mut p) = start.clone();
        solver.state(&y, &mut q, &mut p);
        let lost = (energy(&mut y, &q, &p) - before).abs();
        println!("{policy:?}: {q:?}, {lost:e}");
        assert!(off(&mut y, &q) < 1e-13 && lost < 1e-8, "{policy:?} {lost:e}");
    }
    let (mut q, mut p) = start;
    let mut m = CoordinatePartition::new(y.closed.clone(), &mut q, &mut p).unwrap();
    let method = WithPostStep::new(&m, Dop853::new(&m), Repartition::default());
    let step = Step::Adaptive(Tolerances::new(1e-11));
    let mut solver = Solver::new(&mut m, method, step, 0.0, &q, &p).unwrap();
    solver.run(&mut m, 2.0).unwrap_or_else(|e| panic!("{e} {:?}", m.trouble()));
    solver.state(&m, &mut q, &mut p);
    let lost = (energy(&mut m, &q, &p) - before).abs();
    println!("minimal: {q:?}, {lost:e}, {:?}", m.switches());
    assert!(off(&mut y, &q) < 1e-13 && lost < 1e-8, "{lost:e}");
}

/// A disc rolls and tilts to and fro for a hundred thousand steps. Its velocities satisfy the rows, and its height and
/// energy keep their values.
#[test]
fn rolling_for_long() {
    let mut y = split(DISC).closed;
    let (s, c) = (0.1_f64.sin(), 0.1_f64.cos());
    let mut q = vec![0.0, 0.0, 0.49, s, 0.0, 0.0, c];
    close(&mut y, &mut q, &Closing::default()).unwrap();
    let (mut v, mut p) = (vec![1.5, 0.0, 0.0, 0.0, 3.0, 0.5], y.zero_momenta());
    y.conjugate_momenta(&q, &v, &mut p);
    let (mut sigma, mut gap, mut phi) = (y.zero_rows(), y.zero_rows(), y.zero_entries());
    y.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
    let whole = |y: &mut Interpreter<f64>, q: &Vec<f64>, p: &Vec<f64>| {
        let (kinetic, potential) = y.energies(q, p);
        kinetic + potential
    };
    let before = whole(&mut y, &q, &p);
    let mut method = held(&y, Dop853::new(&y), Stabilisation::Mass);
    let (mut off, mut lost) = (0.0_f64, 0.0_f64);
    for k in 0..100_000 {
        method.step(&mut y, f64::from(k) * 1e-3, 1e-3, &mut q, &mut p).unwrap();
        if k % 100 == 99 {
            y.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
            y.constraint_residuals(&q, &mut gap, &mut phi);
            for (row, gap) in y.rows().iter().zip(&gap) {
                let rate: f64 = (row.first..row.first + row.len).map(|k| phi[k] * v[y.entry_columns()[k]]).sum();
                off = largest(&[rate, *gap], off);
            }
            lost = largest(&[whole(&mut y, &q, &p) - before], lost);
        }
    }
    println!("{lost:e} of {before} J, rows {off:e}, at {:?}", &q[..3]);
    // The bound is round-off of positions of some metres, and of velocities of some metres a second.
    assert!(off < 1e-13 && lost < 1e-9 * before.abs(), "{off:e} {lost:e}");
}

/// In a parallelogram linkage all bars come to lie in one line, where the loop loses rank and can continue in two ways.
/// The motion passes this change point seven times in steps of 1 ms and stays on its branch. The energy is conserved;
/// with minimal coordinates less accurately without momentum projection, because their multipliers grow with one over
/// the distance from the singular position.
#[test]
fn past_the_change_point() {
    for (name, closing) in [
        ("planar", "type = \"point_on_line\"\naxis = [0, 1, 0]"),
        ("redundant", "type = \"revolute\"\naxis = [0, 1, 0]"),
    ] {
        let mut y = split(&four_bar_of([1.0, 2.0, 1.0, 2.0], closing));
        let start = state(&mut y, &[-1.5, 1.5, -1.5], &[6.0, -6.0, 6.0], &[true]);
        let before = energy(&mut y, &start.0, &start.1);
        let method = held(&y, Dop853::new(&y), Stabilisation::Mass);
        let step = Step::Fixed(1e-3);
        let mut solver = Solver::new(&mut y, method, step, 0.0, &start.0, &start.1).unwrap();
        let (mut q, mut p) = start.clone();
        let (mut worst, mut drift) = (0.0_f64, 0.0_f64);
        while solver.time() < 3.0 {
            solver.advance(&mut y, 3.0).unwrap();
            solver.state(&y, &mut q, &mut p);
            worst = largest(&[energy(&mut y, &q, &p) - before], worst);
            drift = largest(&[off(&mut y, &q)], drift);
        }
        println!("{name}: energy {worst:e}, drift {drift:e}, at {q:?}");
        // An end of a step within 6e-5 rad of the change point leaves a row out: some nJ of about 100 J.
        assert!(worst < 2e-8 && drift < 1e-13, "{name}: {worst:e} {drift:e}");
        for project_momenta in [false, true] {
            let (mut q, mut p) = start.clone();
            let mut m = CoordinatePartition::new(y.closed.clone(), &mut q, &mut p).unwrap();
            let method = WithPostStep::new(&m, Dop853::new(&m), Repartition { project_momenta });
            let mut solver = Solver::new(&mut m, method, step, 0.0, &q, &p).unwrap();
            let mut worst = 0.0_f64;
            while solver.time() < 3.0 {
                solver.advance(&mut m, 3.0).unwrap_or_else(|e| panic!("{e} {:?}", m.trouble()));
                solver.state(&m, &mut q, &mut p);
                worst = largest(&[energy(&mut m, &q, &p) - before], worst);
            }
            println!("{name} minimal, {project_momenta}: energy {worst:e}, at {q:?}");
            // Where a stage leaves a row out, its multiplier stays in the momenta: that of the whole motion without
            // projection, and of one step with it. Of about 100 J, 0.15 J and 1.9e-4 J were measured.
            assert!(worst < if project_momenta { 2e-3 } else { 0.5 }, "{name}, {project_momenta}: {worst:e}");
        }
    }
}

/// The largest error of the energy of a parallelogram over 2 s of steps of 1 ms with exactly one correction each, relative
/// to the largest kinetic energy.
fn energy_with_fixed_work<S: Real>(closing: &str, speed: f64) -> f64 {
    let mut double = split(&four_bar_of([1.0, 2.0, 1.0, 2.0], closing));
    let (q, p) = state(&mut double, &[-1.5, 1.5, -1.5], &[speed, -speed, speed], &[true]);
    let plan = search::plan(&model(&four_bar_of([1.0, 2.0, 1.0, 2.0], closing)), Default::default());
    let mut y = Interpreter::<S>::new(plan.tree(&[]), [0.0, 0.0, -9.81].map(S::constant));
    let numbers = |x: &[f64]| x.iter().map(|x| S::constant(*x)).collect::<Vec<S>>();
    let (mut q, mut p) = (numbers(&q), numbers(&p));
    let mut method = WithPostStep::new(&y, Rk4::compensated(&y), Projection::fixed_work::<1>(&y));
    let mut sum = |q: &Vec<S>, p: &Vec<S>| {
        let (kinetic, potential) =
            double.energies(&q.iter().map(|x| x.to_f64()).collect(), &p.iter().map(|x| x.to_f64()).collect());
        (kinetic, kinetic + potential)
    };
    let (mut most, before) = sum(&q, &p);
    let mut worst = 0.0_f64;
    for k in 0..2000 {
        method.step(&mut y, S::constant(f64::from(k) * 1e-3), S::constant(1e-3), &mut q, &mut p).unwrap();
        let (kinetic, total) = sum(&q, &p);
        (most, worst) = (most.max(kinetic), largest(&[total - before], worst));
    }
    worst / most
}

/// Firmware passes change points as well: no tolerance, one correction a step, in both precisions.
#[test]
fn past_the_change_point_with_fixed_work() {
    for closing in ["type = \"point_on_line\"\naxis = [0, 1, 0]", "type = \"revolute\"\naxis = [0, 1, 0]"] {
        let worst = |of: fn(&str, f64) -> f64| {
            let all: Vec<f64> = (0..10).map(|k| of(closing, 4.0 + 0.83 * f64::from(k))).collect();
            largest(&all, 0.0)
        };
        let (double, single) = (worst(energy_with_fixed_work::<f64>), worst(energy_with_fixed_work::<f32>));
        println!("{closing:?}: {double:e}, in single precision {single:e}");
        assert!(double < 1e-6, "{closing:?}: {double:e}");
        assert!(single < 1e-2, "{closing:?}: {single:e}");
    }
}

/// Single precision with exactly one correction a step, as small processors would use it.
#[test]
fn single_precision() {
    let (y, (q, p)) = crank("type = \"point_on_line\"\naxis = [0, 1, 0]");
    drop(y);
    let plan = search::plan(&model(&four_bar("type = \"point_on_line\"\naxis = [0, 1, 0]")), Default::default());
    let mut y: Interpreter<f32> = Interpreter::new(plan.tree(&[]), [0.0, 0.0, -9.81]);
    let single = |x: &[f64]| x.iter().map(|x| *x as f32).collect::<Vec<f32>>();
    let (mut q, mut p) = (single(&q), single(&p));
    let (kinetic, potential) = y.energies(&q, &p);
    let before = kinetic + potential;
    let hold = Projection::fixed_work::<1>(&y);
    let mut method = WithPostStep::new(&y, Rk4::compensated(&y), hold);
    let (mut residual, mut entries, mut worst) = (y.zero_rows(), y.zero_entries(), 0.0_f64);
    for k in 0..10_000_u16 {
        method.step(&mut y, f32::from(k) * 1e-3, 1e-3, &mut q, &mut p).unwrap();
        y.constraint_residuals(&q, &mut residual, &mut entries);
        worst = residual.iter().fold(worst, |m, x| largest(&[f64::from(*x)], m));
    }
    let (kinetic, potential) = y.energies(&q, &p);
    println!("drift {worst:e}, energy {:e} of {before}", kinetic + potential - before);
    // Angles reach 60 rad, so that their rounding is about 4e-6.
    assert!(worst < 2e-5, "{worst:e}");
    assert!((kinetic + potential - before).abs() < 2e-2, "{}", kinetic + potential - before);
}

/// Steps of 1 ms for 50 s, or as many as the environment variable `STEPS` says: positions stay closed to round-off.
#[test]
fn long_run() {
    let n = std::env::var("STEPS").ok().and_then(|n| n.parse().ok()).unwrap_or(50_000_u32);
    for closing in ["type = \"point_on_line\"\naxis = [0, 1, 0]", "type = \"revolute\"\naxis = [0, 1, 0]"] {
        // The linkage starts from rest and swings: angles that grow without bound would lose digits.
        let mut y = split(&four_bar(closing));
        let (mut q, mut p) = state(&mut y, &[1.0, 0.5, 1.5], &[0.0; 3], &[true]);
        let mut y = y.closed;
        let before = energy(&mut y, &q, &p);
        let mut method = held(&y, Rk4::new(&y), Stabilisation::Mass);
        let (mut residual, mut entries, mut worst) = (y.zero_rows(), y.zero_entries(), 0.0_f64);
        let clock = std::time::Instant::now();
        for k in 0..n {
            method.step(&mut y, f64::from(k) * 1e-3, 1e-3, &mut q, &mut p).unwrap();
            if k % 10 == 0 {
                y.constraint_residuals(&q, &mut residual, &mut entries);
                worst = largest(&residual, worst);
            }
        }
        let lost = energy(&mut y, &q, &p) - before;
        println!("{n} steps: drift {worst:e}, energy {lost:e} of {before}, at {q:?}, {:?}", clock.elapsed());
        assert!(worst < 1e-13, "{worst:e}");
    }
}

/// No step but the first allocates, with any stabilisation: at the first one the order of the rows is looked at.
#[test]
fn nothing_is_allocated() {
    let (mut y, start) = crank("type = \"revolute\"\naxis = [0, 1, 0]");
    fn check<Y, M>(name: &str, y: &mut Y, mut method: M, start: &State)
    where
        Y: System<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>>,
        M: Stepper<Y>,
    {
        let (mut q, mut p) = start.clone();
        method.step(y, 0.0, 1e-3, &mut q, &mut p).unwrap();
        let found = allocation_counter::measure(|| {
            for k in 1..1500 {
                method.step(y, f64::from(k) * 1e-3, 1e-3, &mut q, &mut p).unwrap();
            }
        });
        assert_eq!(found.count_total, 0, "{name}");
    }
    for policy in [Stabilisation::Momenta, Stabilisation::Mass, Stabilisation::Gradient, Stabilisation::Partition] {
        let method = held(&y, Rk4::new(&y), policy);
        check("held", &mut y, method, &start);
    }
    let method = Rattle::new(&y);
    check("rattle", &mut y, method, &start);
    let method = RadauIndex2::new(&y);
    check("radau", &mut y, method, &start);
    for project_momenta in [false, true] {
        let (mut q, mut p) = start.clone();
        let mut m = CoordinatePartition::new(y.closed.clone(), &mut q, &mut p).unwrap().with_ratio(1.1);
        let method = WithPostStep::new(&m, Rk4::new(&m), Repartition { project_momenta });
        check("minimal", &mut m, method, &(q, p));
        assert!(m.switches().0 > 0);
    }
}

/// Prints the time a step, the drift and the error of the energy of all ways to integrate with constraints, on the
/// four-bar linkage with redundant rows, 2 s in steps of 1 ms. It tests nothing:
/// `cargo test -p mbd-testing --test integrators comparison -- --ignored --nocapture`.
#[test]
#[ignore = "prints a comparison"]
fn comparison() {
    let (mut y, start) = crank("type = \"revolute\"\naxis = [0, 1, 0]");
    let before = energy(&mut y, &start.0, &start.1);
    let mut best = [(f64::INFINITY, 0.0, 0.0); 11];
    // The decay is a tenth of the rate of the steps. The weight of the penalties is 10⁴ kg, against bars of 1 and 2 kg.
    let text = four_bar("type = \"revolute\"\naxis = [0, 1, 0]\ndecay = 100.0");
    let mut braked = interpreter(&model(&text));
    let mut soft = Interpreter::new(y.closed.tree().penalised(1e4, 100.0), braked.gravity);
    fn timed<Y, M>(y: &mut Y, mut method: M, start: &State) -> (f64, State)
    where
        Y: System<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>>,
        M: Stepper<Y>,
    {
        let clock = std::time::Instant::now();
        let end = march(y, &mut method, 2000, 2.0, start);
        (clock.elapsed().as_secs_f64() / 2000.0, end)
    }
    let policies = [
        Stabilisation::None,
        Stabilisation::Momenta,
        Stabilisation::Mass,
        Stabilisation::Gradient,
        Stabilisation::Partition,
    ];
    for _ in 0..15 {
        let mut note = |k: usize, (time, end): (f64, State), y: &mut OpenAndClosed<Mechanism, Mechanism>| {
            let lost = (energy(y, &end.0, &end.1) - before).abs();
            best[k] = (best[k].0.min(time), off(y, &end.0), lost);
        };
        for (k, policy) in policies.into_iter().enumerate() {
            let method = unjudged(&y.closed, policy);
            let end = timed(&mut y.closed, method, &start);
            note(k, end, &mut y);
        }
        for (k, project_momenta) in [false, true].into_iter().enumerate() {
            let (mut q, mut p) = start.clone();
            let mut m = CoordinatePartition::new(y.closed.clone(), &mut q, &mut p).unwrap();
            let method = WithPostStep::new(&m, Rk4::new(&m), Repartition { project_momenta });
            let end = timed(&mut m, method, &(q, p));
            note(5 + k, end, &mut y);
        }
        for (k, system) in [&mut braked, &mut soft].into_iter().enumerate() {
            let method = unjudged(system, Stabilisation::Momenta);
            let end = timed(system, method, &start);
            note(9 + k, end, &mut y);
        }
        let method = Rattle::new(&y);
        let end = timed(&mut y, method, &start);
        note(7, end, &mut y);
        let method = RadauIndex2::new(&y);
        let end = timed(&mut y, method, &start);
        note(8, end, &mut y);
    }
    let names = [
        "none",
        "project_momenta",
        "mass",
        "gradient",
        "partition",
        "minimal",
        "minimal, momenta",
        "rattle",
        "index two",
        "decay",
        "penalty",
    ];
    for (name, (time, drift, lost)) in names.iter().zip(best) {
        let ratio = time / best[0].0;
        println!("{name:16} {:6.2} us/step, {ratio:5.2}, drift {drift:.1e}, energy {lost:.1e}", time * 1e6);
    }
}
