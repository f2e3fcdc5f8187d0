//! A loop whose rows become nearly dependent during a motion, in another order at every place: no order that is chosen once
//! is good for all of it.

use std::fmt::Write;

use mbd_codegen::jit::Compiled;
use mbd_codegen::options::{PlanOptions, RowElimination};
use mbd_codegen::plan::Plan;
use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::search::{self, Wide};
use mbd_codegen::{Arithmetic, Options};
use mbd_runtime::constrained::{Effort, PostStep, Projection, Stabilisation, WithPostStep};
use mbd_runtime::integrate::{Rk4, Stepper};
use mbd_runtime::{Accelerated, Conjugate, Constrained, Interpreter, Real, Scalar, System};
use mbd_testing::relative_error;

/// Angles of the slots, rad.
const SLOTS: [f64; 3] = [0.0, 0.7, 1.4];
/// Moment of inertia of a body of 1 kg, kg m²: nearly a point, so that its mobility has nearly rank one.
const INERTIA: f64 = 1e-6;

/// A trammel with a third slider. Every point on a circle of the body through the crossing of the slots moves on a straight
/// line through that crossing, so that the third slot is redundant everywhere. The body turns about a point 1 m from its
/// centre of mass, which hardly resists: rows are nearly parallel to one another in the metric of the inverse mass matrix,
/// but for the row of a slot across the line to that point.
fn trammel(order: [usize; 3]) -> String {
    let mut text = format!(
        "name = \"trammel\"\ngravity = [0, -9.81, 0]\n[[body]]\nname = \"disc\"\nmass = 1\ninertia = [1, 1, {INERTIA:e}]\n\
         [[joint]]\nname = \"plane\"\ntype = \"planar\"\nparent = \"ground\"\nchild = \"disc\"\n"
    );
    for k in order {
        let (s, c) = SLOTS[k].sin_cos();
        let (s2, c2) = (2.0 * SLOTS[k]).sin_cos();
        let _ = write!(
            text,
            "[[frame]]\nname = \"slider{k}\"\nbody = \"disc\"\nxyz = [{c2:.17}, {s2:.17}, 0]\n\
             [[loop]]\nname = \"slot{k}\"\ntype = \"point_on_plane\"\nnormal = [{:.17}, {c:.17}, 0]\nbetween = [\"ground\", \"slider{k}\"]\n",
            -s
        );
    }
    text
}

fn plan(order: [usize; 3], rows: RowElimination) -> Plan {
    let read = read::model("trammel.toml", &trammel(order), &ImportOptions::default());
    let options = PlanOptions { rows, ..PlanOptions::quick() };
    search::plan(&read.unwrap_or_else(|e| panic!("{e}")).model, options)
}

/// Largest error of the accelerations relative to the largest one, at the steps past the place where the slot `k` is
/// across the line to the centre of rotation.
fn error<Y, P>(y: &mut Y, exact: &mut Interpreter<Wide>, k: usize, hold: P) -> f64
where
    Y: Constrained<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>> + Conjugate + Accelerated,
    P: PostStep<Y>,
{
    let angle = SLOTS[k] + std::f64::consts::FRAC_PI_2 - 0.01;
    let (s, c) = angle.sin_cos();
    let mut q = vec![c, s, -angle];
    // The centre moves across the line to the crossing; its velocity is in the axes of the body.
    let (s2, c2) = (2.0 * angle).sin_cos();
    let (mut p, v) = (y.zero_momenta(), vec![-s2, c2, -1.0]);
    y.conjugate_momenta(&q, &v, &mut p);
    let mut method = WithPostStep::new(y, Rk4::new(y), hold);
    let mut worst = 0.0_f64;
    for step in 0..200 {
        method.step(y, 1e-4 * f64::from(step), 1e-4, &mut q, &mut p).expect("a step");
        let (mut free, mut v, mut sigma) = (p.clone(), y.zero_momenta(), y.zero_rows());
        y.project_momenta(0.0, &q, &mut free, &mut v, &mut sigma);
        let mut a = y.zero_momenta();
        y.generalized_accelerations(&q, &v, &mut a);
        let wide = |x: &[f64]| x.iter().map(|x| Wide::constant(*x)).collect::<Vec<_>>();
        let mut right = exact.zero_momenta();
        exact.generalized_accelerations(&wide(&q), &wide(&v), &mut right);
        let right: Vec<f64> = right.iter().map(|a| a.to_f64()).collect();
        worst = worst.max(relative_error(&a, &right, 0.0));
    }
    worst
}

/// The worst errors of accelerations at all three places: with the order of the plan, ordered anew by the ends of steps, and in
/// passes, which need no other order and no more than a fixed number of operations at the ends of steps.
fn errors(order: [usize; 3]) -> [f64; 3] {
    let (once, passes) = (plan(order, RowElimination::Once), plan(order, RowElimination::Passes));
    let mut exact = passes.default_interpreter::<Wide>();
    let mut worst = [0.0_f64; 3];
    for k in 0..3 {
        let (mut fixed, mut anew, mut any) =
            (once.default_interpreter(), once.default_interpreter(), passes.default_interpreter());
        let holds = (Projection::fixed_work::<1>(&fixed), whole(&anew), Projection::fixed_work::<1>(&any));
        let now = [
            error(&mut fixed, &mut exact, k, holds.0),
            error(&mut anew, &mut exact, k, holds.1),
            error(&mut any, &mut exact, k, holds.2),
        ];
        worst = std::array::from_fn(|i| worst[i].max(now[i]));
    }
    println!("{order:?}: fixed {:.1e}, ordered anew {:.1e}, in passes {:.1e}", worst[0], worst[1], worst[2]);
    worst
}

/// The projection that orders rows anew.
fn whole<Y>(y: &Y) -> Projection<Y>
where
    Y: Constrained<Scalar = f64>,
{
    Projection::new(y, Stabilisation::Mass, Effort::default())
}

#[test]
fn a_loop_passes_places_where_a_fixed_order_is_bad() {
    let all = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]].map(errors);
    let worst = |i: usize| all.iter().fold(0.0_f64, |most, errors| most.max(errors[i]));
    let best = all.iter().flatten().fold(f64::INFINITY, |least, error| least.min(*error));
    // Rounding errors of coordinates are amplified by 1/δ, 1e3 here, in every order.
    assert!(best < 2e-11, "{all:?}");
    assert!(worst(0) > 100.0 * best, "the place is harmless: {all:?}");
    assert!(worst(1) <= 10.0 * best && worst(2) <= 10.0 * best, "{all:?}");
}

/// Machine code does the same as the interpreter: made anew where it orders rows, and as it is in passes, as does all
/// generated code.
#[test]
fn and_machine_code_passes_them_with_the_bits_of_the_interpreter() {
    let exact = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    for rows in RowElimination::ALL {
        let plan = plan([1, 2, 0], rows);
        let (mut y, mut wide) = (plan.default_interpreter(), plan.default_interpreter());
        let mut code = Compiled::from_plan(plan, exact.clone()).expect("code");
        let holds = (whole(&y), whole(&code));
        assert_eq!(error(&mut y, &mut wide, 0, holds.0), error(&mut code, &mut wide, 0, holds.1), "{}", rows.name());
    }
}
