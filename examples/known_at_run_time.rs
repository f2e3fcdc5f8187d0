//! A robot whose description is read while the program runs: machine code is made of it in milliseconds.
//!
//! `cargo run --release --features jit --example known_at_run_time [MODEL]` prints how long that takes, and the times of
//! the rates by machine code and by the interpreter.

use std::hint::black_box;
use std::time::Instant;

use multibody::codegen::jit::Compiled;
use multibody::codegen::model::Model;
use multibody::codegen::options::PlanOptions;
use multibody::codegen::{Arithmetic, Options};
use multibody::prelude::*;

/// Smallest time of an evaluation of the rates, ns. The state changes from one to the next.
fn nanoseconds(robot: &mut Compiled, q: &[f64], p: &[f64]) -> f64 {
    let (mut q, p) = (q.to_vec(), p.to_vec());
    let (mut qd, mut pd) = (robot.neutral(), robot.zero_momenta());
    let mut round = |robot: &mut Compiled| {
        let start = Instant::now();
        for k in 0..500 {
            q[0] = 1e-3 * f64::from(k);
            robot.rates_at(0.0, &q, &p, &mut qd, &mut pd);
            black_box((&qd, &pd));
        }
        1e9 * start.elapsed().as_secs_f64() / 500.0
    };
    (0..20).map(|_| round(robot)).fold(f64::INFINITY, f64::min)
}

/// Compiles a model, measures it, and lets it fall.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let models = concat!(env!("CARGO_MANIFEST_DIR"), "/models/ur5.urdf");
    // The name of a test that runs this is no file.
    let described = |path: &String| [".toml", ".urdf", ".xml"].iter().any(|end| path.to_lowercase().ends_with(end));
    let path = std::env::args().nth(1).filter(described);
    let start = Instant::now();
    let model = Model::load(path.as_deref().unwrap_or(models))?;
    let mut robot = model.compile(&Options::default())?;
    let (q, p) = (robot.neutral(), vec![0.1; robot.zero_momenta().len()]);
    let (mut qd, mut pd) = (robot.neutral(), robot.zero_momenta());
    robot.rates_at(0.0, &q, &p, &mut qd, &mut pd);
    println!("{}: {:.1} ms from the file to the first rates", model.name, 1e3 * start.elapsed().as_secs_f64());
    // Where the first answer matters more than the fastest code, no elimination is searched for.
    let start = Instant::now();
    let mut quick = Model::load(path.as_deref().unwrap_or(models))?
        .compile(&Options { plan: PlanOptions::quick(), ..Options::default() })?;
    quick.rates_at(0.0, &q, &p, &mut qd, &mut pd);
    println!("{}: {:.1} ms without a search", model.name, 1e3 * start.elapsed().as_secs_f64());

    // In exact arithmetic the code has the bits of the interpreter.
    let exact = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    let mut exact = model.compile(&exact)?;
    let mut interpreted = exact.clone().interpreted();
    let (mut qd2, mut pd2) = (qd.clone(), pd.clone());
    exact.rates_at(0.0, &q, &p, &mut qd, &mut pd);
    interpreted.rates_at(0.0, &q, &p, &mut qd2, &mut pd2);
    assert_eq!((&qd, &pd), (&qd2, &pd2));
    println!("rates by machine code, fast arithmetic: {:6.0} ns", nanoseconds(&mut robot, &q, &p));
    println!("rates by machine code, exact arithmetic:{:6.0} ns", nanoseconds(&mut exact, &q, &p));
    println!("rates by the interpreter:               {:6.0} ns", nanoseconds(&mut interpreted, &q, &p));

    // All integrators take it, as they take generated types.
    let (mut q, mut p) = (robot.neutral(), robot.zero_momenta());
    let energy = |robot: &mut Compiled, q: &Vec<f64>, p: &Vec<f64>| {
        let (kinetic, potential) = robot.energies(q, p);
        kinetic + potential
    };
    let before = energy(&mut robot, &q, &p);
    let mut rk4 = Rk4::new(&robot);
    for k in 0..100 {
        rk4.step(&mut robot, f64::from(k) * 1e-3, 1e-3, &mut q, &mut p)?;
    }
    let change = energy(&mut robot, &q, &p) - before;
    println!("energy changes by {change:.1e} J while it falls for 0.1 s");
    assert!(path.is_some() || change.abs() < 1e-6, "{change:e}");
    Ok(())
}
