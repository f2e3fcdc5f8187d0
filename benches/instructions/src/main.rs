//! `instructions MODEL FUNCTION CALLS` calls a generated function as many times as it is told. `.ci/instructions.sh`
//! counts the instructions of one call by valgrind, from two runs with different numbers of calls.
//!
//! The functions `free` and `far` are motions of 1 s, without contacts and with contacts that are far away.

use std::hint::black_box;

use mbd_runtime::constrained::{Projection, WithPostStep};
use mbd_runtime::contact::{Hybrid, Touching, WithContacts};
use mbd_runtime::integrate::{Solver, Step, Tolerances, Verner9};
use mbd_runtime::Conjugate;

macro_rules! models {
    ($($name:ident, $type:ident;)*) => {
        $(mod $name {
            include!(concat!(env!("INSTRUCTIONS"), "/", stringify!($name), ".rs"));
        })*

        fn run(model: &str, function: &str, calls: u32) -> Result<f64, String> {
            match (model, function) {
                $((stringify!($name), "rates") => {
                    let system = $name::$type::new();
                    let (q, p) = (state(), state());
                    let (mut qd, mut pd) = ([0.0; $name::$type::NQ], [0.0; $name::$type::NV]);
                    for _ in 0..calls {
                        black_box(&system).rates(black_box(&q), black_box(&p), &mut qd, &mut pd);
                        black_box((&mut qd, &mut pd));
                    }
                    Ok(qd[0] + pd[0])
                })*
                $((stringify!($name), "accelerations") => {
                    let system = $name::$type::new();
                    let (q, v) = (state(), state());
                    let mut a = [0.0; $name::$type::NV];
                    for _ in 0..calls {
                        black_box(&system).accelerations(black_box(&q), black_box(&v), &mut a);
                        black_box(&mut a);
                    }
                    Ok(a[0])
                })*
                $((stringify!($name), "rates_lanes") => {
                    let system = $name::RobotLanes::<8>::new();
                    let (q, p) = (state().map(|x| [x; 8]), state().map(|x| [x; 8]));
                    let (mut qd, mut pd) = ([[0.0; 8]; $name::$type::NQ], [[0.0; 8]; $name::$type::NV]);
                    for _ in 0..calls {
                        black_box(&system).rates(black_box(&q), black_box(&p), &mut qd, &mut pd);
                        black_box((&mut qd, &mut pd));
                    }
                    Ok(qd[0][0] + pd[0][0])
                })*
                _ => motion(model, function, calls),
            }
        }
    };
}

/// Models with contacts: without them in the first module, with them in the second, and the first velocities.
macro_rules! motions {
    ($($name:ident, $touching:ident, $change:expr, $v:expr;)*) => {
        $(mod $name {
            include!(concat!(env!("INSTRUCTIONS"), "/", stringify!($name), ".rs"));
        }
        mod $touching {
            include!(concat!(env!("INSTRUCTIONS"), "/", stringify!($touching), ".rs"));
        })*

        fn motion(model: &str, function: &str, calls: u32) -> Result<f64, String> {
            match (model, function) {
                $((stringify!($name), "free") => free($name::Robot::new(), &$change($name::Robot::START), &$v, calls),
                (stringify!($name), "far") => far($touching::Robot::new(), &$change($name::Robot::START), &$v, calls),)*
                _ => Err(format!("{model} {function}: no such model or function")),
            }
        }
    };
}

models! {
    double_pendulum, Robot;
    chain6, Robot;
    chain10_planar, Robot;
    ur5, Robot;
    panda_arm, Robot;
    iiwa14, Robot;
    solo12, Robot;
    g1, Robot;
}

motions! {
    // 10 m above the floor, with legs that swing; 10 m above the floor, and turns over.
    quadruped, quadruped_touching, |mut q: [f64; 19]| {
        q[2] = 10.0;
        q
    }, [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.5, 8.0, 0.0, -0.5, -8.0, 0.0, -0.5, -8.0, 0.0, 0.5, 8.0, 0.0];
    leg, leg_touching, |q: [f64; 5]| q, [1.0, 3.0, 5.0, -4.0, 0.2];
}

fn step() -> Step {
    Step::Adaptive(Tolerances::new(1e-9))
}

/// Motions without contacts.
fn free<Y>(mut system: Y, q: &Y::Coordinates, v: &Y::Momenta, motions: u32) -> Result<f64, String>
where
    Y: Conjugate<Scalar = f64>,
{
    let (mut p, mut end) = (v.clone(), v.clone());
    system.conjugate_momenta(q, v, &mut p);
    for _ in 0..motions {
        let method = Verner9::new(&system);
        let solver = Solver::new(&mut system, method, step(), 0.0, black_box(q), &p);
        let mut solver = solver.map_err(|error| error.to_string())?;
        solver.run(&mut system, 1.0).map_err(|error| error.to_string())?;
        solver.state(&system, &mut q.clone(), &mut end);
    }
    Ok(end.as_ref()[0])
}

/// The same with contacts.
fn far<Y>(mut system: Y, q: &Y::Coordinates, v: &Y::Momenta, motions: u32) -> Result<f64, String>
where
    Y: Touching<Scalar = f64> + Conjugate,
{
    let (mut p, mut end) = (v.clone(), v.clone());
    system.conjugate_momenta(q, v, &mut p);
    let mut system = WithContacts::new(system);
    for _ in 0..motions {
        let projection = Projection::fixed_work::<1>(&system);
        let method = WithPostStep::new(&system, Verner9::new(&system), projection);
        let motion = Hybrid::new(&mut system, method, step(), 0.0, black_box(q), &p);
        let mut motion = motion.map_err(|error| error.to_string())?;
        motion.run(&mut system, 1.0, &mut ()).map_err(|error| error.to_string())?;
        motion.state(&system, &mut q.clone(), &mut end);
        if motion.contact_statistics().events > 0 {
            return Err("a contact is not far".into());
        }
    }
    Ok(end.as_ref()[0])
}

/// An arbitrary state. The number of instructions does not depend on it: the only branches are for angles beyond 1e5
/// rad.
fn state<const N: usize>() -> [f64; N] {
    std::array::from_fn(|k| 0.1 + 0.05 * k as f64)
}

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, function, calls] = &arguments[..] else { return Err("usage: instructions MODEL FUNCTION CALLS".into()) };
    let calls = calls.parse().map_err(|_| format!("`{calls}` is no number of calls"))?;
    let result = run(model, function, calls)?;
    // The result is used, so that the compiler cannot remove the calls.
    if result.is_nan() {
        return Err(format!("{model} {function}: not a number"));
    }
    Ok(())
}
