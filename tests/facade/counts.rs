//! Limits of operation counts: additions, multiplications and divisions of the emitted rates. The tests of `testing`
//! count general chains of more lengths.
//!
//! *Best known* counts are those of a prototype before this generator. They count one operation each for additions,
//! multiplications and divisions, with sines and cosines given and without joint forces. One of the two arithmetics
//! must reach them. The other limits are about 1 % above what has been reached.

use std::fmt::Write as _;

use multibody::codegen::generate::trace;
use multibody::codegen::model::{Model, Param, Value};
use multibody::codegen::options::{EliminationStrategy, PlanOptions};
use multibody::codegen::read::{self, Base, ImportOptions};
use multibody::codegen::search;
use multibody::codegen::{Arithmetic, Options, Output};
use multibody::runtime::sweep::Quantity;

const ARITHMETIC: [Arithmetic; 2] = [Arithmetic::Exact, Arithmetic::Fast];
const NO_GRAVITY: Option<[f64; 3]> = Some([0.0; 3]);

fn file(name: &str, base: Base, gravity: Option<[f64; 3]>) -> Model {
    let root = env!("CARGO_MANIFEST_DIR");
    let text = std::fs::read_to_string(format!("{root}/models/{name}")).expect("the model");
    read(name, &text, base, gravity)
}

fn read(name: &str, text: &str, base: Base, gravity: Option<[f64; 3]>) -> Model {
    read::model(name, text, &ImportOptions { base, gravity, ..ImportOptions::default() })
        .unwrap_or_else(|findings| panic!("{findings}"))
        .model
}

/// The operations that are counted.
#[derive(Clone, Copy, PartialEq)]
enum Scope {
    /// All operations but sines and cosines.
    All,
    /// The operations of the best known counts. They begin after sines and cosines, or after the rotation matrix of a
    /// floating base; an addition for the offset of an angle is before that. They end with velocities, before
    /// quaternion rates.
    Core,
}

/// Operations of the rates without joint forces, exact and fast.
fn rates(model: &Model, elimination: EliminationStrategy, scope: Scope) -> [usize; 2] {
    let plan_options = PlanOptions { elimination, accelerations: false, mass_matrix: false, ..PlanOptions::default() };
    let plan = search::plan(model, plan_options);
    ARITHMETIC.map(|arithmetic| {
        let options = Options { plan: plan_options, efforts: false, arithmetic, ..Options::default() };
        let program = trace(&plan, Output::Rates, &options).expect("rates").program;
        let outside = |what| scope == Scope::Core && matches!(what, Quantity::Pose | Quantity::Rate);
        program.counts_where(|&(_, what)| !outside(what)).total()
    })
}

fn check(what: &str, best_known: Option<usize>, limits: [usize; 2], counts: [usize; 2]) {
    let [exact, fast] = counts;
    let known = best_known.map_or(String::new(), |k| format!(", best known {k}"));
    println!("{what}: {exact} exact, {fast} fast; limits {limits:?}{known}");
    assert!(exact <= limits[0], "{what}: {exact} operations in exact arithmetic, at most {}", limits[0]);
    assert!(fast <= limits[1], "{what}: {fast} operations in fast arithmetic, at most {}", limits[1]);
    let best = exact.min(fast);
    assert!(best_known.is_none_or(|k| best <= k), "{what}: {best} operations, best known {best_known:?}");
}

/// A tree of `n` revolute joints without aligned axes and without zeros. `parent` gives the parent of each body.
fn general(n: usize, parent: impl Fn(usize) -> String, first: &str, gravity: Option<[f64; 3]>) -> Model {
    // The numbers of the model have no pattern.
    let mut k = 0.0_f64;
    let mut next = |low: f64, high: f64| {
        k += 0.618_033_988_749_894_9;
        low + (high - low) * (k * k * 7.0).fract()
    };
    let mut text = format!("name = \"general\"\n{first}");
    for i in 1..=n {
        let mut vector =
            |low, high| format!("[{:.3}, {:.3}, {:.3}]", next(low, high), next(low, high), next(low, high));
        let (com, xyz, rpy, axis) = (vector(0.05, 0.2), vector(0.1, 0.4), vector(0.3, 1.2), vector(0.2, 1.0));
        let inertia = [next(0.03, 0.04), next(0.03, 0.04), next(0.03, 0.04)].map(|x| format!("{x:.4}"));
        let _ = writeln!(
            text,
            "[[body]]\nname = \"link{i}\"\nmass = {:.3}\ncom = {com}\n\
             inertia = {{ xx = {}, yy = {}, zz = {}, xy = 0.0021, xz = -0.0013, yz = 0.0017 }}\n\
             [[joint]]\nname = \"joint{i}\"\ntype = \"revolute\"\nparent = \"{}\"\nchild = \"link{i}\"\n\
             xyz = {xyz}\nrpy = {rpy}\naxis = {axis}\n",
            next(0.5, 3.0),
            inertia[0],
            inertia[1],
            inertia[2],
            parent(i),
        );
    }
    read("general.toml", &text, Base::Fixed, gravity)
}

fn general_chain(n: usize, gravity: Option<[f64; 3]>) -> Model {
    general(n, |i| if i == 1 { "ground".to_string() } else { format!("link{}", i - 1) }, "", gravity)
}

/// A floating trunk with four legs of three joints each.
fn general_quadruped(gravity: Option<[f64; 3]>) -> Model {
    let trunk = "[[body]]\nname = \"trunk\"\nmass = 12.3\ncom = [0.02, -0.03, 0.05]\n\
        inertia = { xx = 0.4, yy = 0.5, zz = 0.6, xy = 0.021, xz = -0.013, yz = 0.017 }\n\
        [[joint]]\nname = \"float\"\ntype = \"floating\"\nparent = \"ground\"\nchild = \"trunk\"\n";
    general(12, |i| if i % 3 == 1 { "trunk".to_string() } else { format!("link{}", i - 1) }, trunk, gravity)
}

/// Counts of general chains without and with gravity. No number is zero, so these counts are bounds for every chain of
/// revolute joints.
#[test]
fn general_chains_stay_below_the_best_known() {
    for (n, best_known) in [(2, [59, 83]), (3, [220, 261]), (6, [1037, 1126]), (7, [1380, 1485]), (10, [2327, 2564])] {
        for (k, gravity) in [NO_GRAVITY, None].into_iter().enumerate() {
            let counts = rates(&general_chain(n, gravity), EliminationStrategy::Fewest, Scope::Core);
            let what = format!("general chain of {n}, {} gravity", ["without", "with"][k]);
            check(&what, Some(best_known[k]), [best_known[k] + best_known[k] / 100, best_known[k]], counts);
        }
    }
}

#[test]
fn a_general_quadruped_stays_below_the_best_known() {
    for (k, gravity) in [NO_GRAVITY, None].into_iter().enumerate() {
        let best_known = [3465, 3747][k];
        let counts = rates(&general_quadruped(gravity), EliminationStrategy::Fewest, Scope::Core);
        check(
            &format!("general quadruped, {} gravity", ["without", "with"][k]),
            Some(best_known),
            [[3512, 3465], [3756, 3747]][k],
            counts,
        );
    }
}

/// Counts for the eliminations with the fewest operations.
#[test]
fn real_robots_stay_below_the_best_known() {
    type Row = (&'static str, Base, [Option<usize>; 2], [[usize; 2]; 2]);
    let rows: [Row; 10] = [
        ("ur5.urdf", Base::Fixed, [Some(417), Some(438)], [[240, 237], [249, 245]]),
        ("panda_arm.urdf", Base::Fixed, [Some(823), Some(877)], [[819, 812], [869, 861]]),
        // One coordinate moves both fingers.
        ("panda.urdf", Base::Fixed, [None; 2], [[885, 850], [934, 892]]),
        ("iiwa14.urdf", Base::Fixed, [None; 2], [[579, 567], [645, 634]]),
        // Fast arithmetic repeats shared products where the longest path waits for them.
        ("chain10_planar.toml", Base::Fixed, [Some(498), Some(647)], [[466, 466], [496, 495]]),
        ("double_pendulum.toml", Base::Fixed, [None; 2], [[19, 18], [30, 29]]),
        ("spherical_pendulum.toml", Base::Fixed, [None; 2], [[98, 94], [129, 124]]),
        ("satellite.toml", Base::Fixed, [None; 2], [[268, 233]; 2]),
        ("solo12.urdf", Base::Floating, [None; 2], [[1966, 1846], [2098, 1972]]),
        ("g1.urdf", Base::Floating, [None; 2], [[6058, 5977], [6529, 6448]]),
    ];
    for (name, base, best_known, limits) in rows {
        for (k, gravity) in [NO_GRAVITY, None].into_iter().enumerate() {
            let counts = rates(&file(name, base, gravity), EliminationStrategy::Fewest, Scope::All);
            check(&format!("{name}, {} gravity", ["without", "with"][k]), best_known[k], limits[k], counts);
        }
    }
}

/// Counts for the default eliminations, which take the shortest time.
#[test]
fn what_is_generated_by_default_stays_below_its_limits() {
    for (name, base, limits) in [
        ("ur5.urdf", Base::Fixed, [262, 274]),
        ("panda_arm.urdf", Base::Fixed, [871, 864]),
        ("panda.urdf", Base::Fixed, [936, 900]),
        ("iiwa14.urdf", Base::Fixed, [649, 637]),
        ("chain6.toml", Base::Fixed, [1135, 1120]),
        ("chain10_planar.toml", Base::Fixed, [888, 908]),
        ("solo12.urdf", Base::Floating, [2177, 2073]),
        ("g1.urdf", Base::Floating, [6646, 6559]),
    ] {
        check(
            &format!("{name}, default"),
            None,
            limits,
            rates(&file(name, base, None), EliminationStrategy::default(), Scope::All),
        );
    }
}

#[test]
fn joint_forces_cost_one_addition_each_at_most() {
    for (name, nv) in [("ur5.urdf", 6), ("panda_arm.urdf", 7)] {
        let model = file(name, Base::Fixed, None);
        let plan = search::plan(&model, PlanOptions::default());
        let [with, without] = [true, false].map(|efforts| {
            let options = Options { efforts, arithmetic: Arithmetic::Exact, ..Options::default() };
            trace(&plan, Output::Rates, &options).expect("rates").program.counts().total()
        });
        // If the axis of the first joint is vertical, its momentum rate is the joint force alone, without an addition.
        assert!(with - without == nv || with - without == nv - 1, "{name}: {}", with - without);
    }
}

/// Counts the operations of derivatives in fast arithmetic.
#[track_caller]
fn check_derivatives(name: &str, model: &Model, output: Output, limit: usize) {
    let plan = search::plan(model, PlanOptions::default());
    let count = trace(&plan, output, &Options::default()).expect("derivatives").program.counts().total();
    println!("{name}: {count}");
    assert!(count <= limit, "{name}: {count} operations, at most {limit}");
}

/// Counts for the derivatives of mechanisms with constraints. The comments give those of dual numbers through the rates, once
/// for each direction.
#[test]
fn derivatives_of_loops_stay_below_their_limits() {
    for (name, limit) in [
        ("slider_crank", 470),     // 512
        ("fourbar", 540),          // 933
        ("fourbar_3d", 1650),      // 2430
        ("strandbeest_leg", 3500), // 7107
        ("spring_leg", 5500),      // 14040
        ("delta", 9000),           // 26544
        ("rolling_disc", 2130),    // 4564
        ("bicycle", 12100),        // 22907
        ("stewart", 60000),        // 139472
    ] {
        let model = file(&format!("mechanisms/{name}.toml"), Base::Fixed, None);
        check_derivatives(name, &model, Output::Derivatives, limit);
    }
}

/// Counts for the derivatives of mechanisms with constraints with respect to the first five masses. The comments give those of the
/// rates on dual numbers, once for each parameter.
#[test]
fn parameter_derivatives_of_loops_stay_below_their_limits() {
    for (name, limit) in [
        ("fourbar", 480),     // 558
        ("spring_leg", 4050), // 4396
        ("delta", 4750),      // 5629
        ("bicycle", 6000),    // 9081
        ("stewart", 9300),    // 11153
    ] {
        let mut model = file(&format!("mechanisms/{name}.toml"), Base::Fixed, None);
        for (k, body) in model.bodies.iter_mut().take(5).enumerate() {
            let default = body.mass.constant().expect("a constant");
            model.params.push(Param { name: format!("m{k}"), default });
            body.mass = Value::Param(k);
        }
        check_derivatives(name, &model, Output::ParameterDerivatives, limit);
    }
}

/// Counts for rates and all four blocks of derivatives. The comments give the operations of CasADi's code for
/// Pinocchio's `computeABADerivatives` (`benches/rivals/derivatives`), where it was generated.
#[test]
fn derivatives_stay_below_their_limits() {
    for (file, base, limit) in [
        ("double_pendulum.toml", Base::Fixed, 70), // 173
        ("ur5.urdf", Base::Fixed, 1280),           // 7049
        ("panda_arm.urdf", Base::Fixed, 2760),     // 9837
        ("iiwa14.urdf", Base::Fixed, 2090),        // 9531
        ("chain6.toml", Base::Fixed, 2600),        // 10271
        ("chain10_planar.toml", Base::Fixed, 5420),
        ("satellite.toml", Base::Fixed, 580),
        ("solo12.urdf", Base::Floating, 10700), // 37411
        ("g1.urdf", Base::Floating, 56500),
    ] {
        let model = self::file(file, base, None);
        check_derivatives(file, &model, Output::Derivatives, limit);
    }
}
