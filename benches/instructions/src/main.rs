//! `instructions MODEL FUNCTION CALLS` calls a generated function as many times as it is told. `.ci/instructions.sh`
//! counts the instructions of one call by valgrind, from two runs with different numbers of calls.

use std::hint::black_box;

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
