//! Times of machine code made at run time and of generated Rust, `rates` of one state, in one process.
//!
//!     cargo run --release --manifest-path benches/machine_code/Cargo.toml
//!
//! All run in turns on the same random states, one after the other and as a chain in which every state waits for the
//! rates of the one before. The least of many rounds counts. Machine code is made twice: as users get it, and with like
//! branches one after the other. Before that, their rates have to be those of Rust, in exact arithmetic the same numbers.
//! Names of models choose some of them; `--fused` leaves out AVX-512.

use std::hint::black_box;
use std::time::Instant;

use mbd_codegen::jit::Compiled;
use mbd_codegen::options::PlanOptions;
use mbd_codegen::read::{self, Base, ImportOptions};
use mbd_codegen::{Arithmetic, LikeBranches, Options, Output};
use mbd_runtime::System;

const STATES: usize = 64;
const ROUNDS: usize = 400;

/// Random numbers between −1 and 1.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Nanoseconds for one state of each system, `chained` or not.
fn time<S: System>(system: &mut S, states: &[(S::Coordinates, S::Momenta)], chained: bool) -> f64
where
    S::Coordinates: AsMut<[f64]>,
    S::Momenta: AsMut<[f64]>,
{
    let (mut qd, mut pd) = (system.neutral(), system.zero_momenta());
    let (mut q, mut p) = states[0].clone();
    let from = Instant::now();
    for state in states {
        if chained {
            // Rates are used, but change next to nothing.
            for (q, qd) in q.as_mut().iter_mut().zip(qd.as_mut()) {
                *q += 1e-300 * *qd;
            }
            for (p, pd) in p.as_mut().iter_mut().zip(pd.as_mut()) {
                *p += 1e-300 * *pd;
            }
            system.rates_at(zero::<S>(), &q, &p, &mut qd, &mut pd);
        } else {
            system.rates_at(zero::<S>(), black_box(&state.0), black_box(&state.1), &mut qd, &mut pd);
            black_box((&mut qd, &mut pd));
        }
    }
    black_box((&mut qd, &mut pd));
    from.elapsed().as_secs_f64() * 1e9 / states.len() as f64
}

fn zero<S: System>() -> S::Scalar {
    mbd_runtime::Scalar::zero()
}

/// Random states near the neutral one.
fn states<S: System>(system: &S) -> Vec<(S::Coordinates, S::Momenta)>
where
    S::Coordinates: AsMut<[f64]>,
    S::Momenta: AsMut<[f64]>,
{
    let mut seed = 1;
    let state = |_| {
        let (mut q, mut p) = (system.neutral(), system.zero_momenta());
        q.as_mut().iter_mut().for_each(|x| *x += random(&mut seed));
        p.as_mut().iter_mut().for_each(|x| *x = random(&mut seed));
        (q, p)
    };
    (0..STATES).map(state).collect()
}

/// Least times of machine code, of machine code of branches apart and of Rust in many rounds, in turns.
fn least<B: System>([a, apart]: &mut [Compiled; 2], b: &mut B, chained: bool) -> [f64; 3]
where
    B::Coordinates: AsMut<[f64]>,
    B::Momenta: AsMut<[f64]>,
{
    let (of_a, of_b) = (states(a), states(b));
    let mut least = [f64::INFINITY; 3];
    for _ in 0..ROUNDS {
        least[0] = least[0].min(time(a, &of_a, chained));
        least[1] = least[1].min(time(apart, &of_a, chained));
        least[2] = least[2].min(time(b, &of_b, chained));
    }
    least
}

/// Rates of all states.
fn rates<S: System>(system: &mut S) -> Vec<Vec<f64>>
where
    S::Coordinates: AsMut<[f64]>,
    S::Momenta: AsMut<[f64]>,
{
    let states = states(system);
    let (mut qd, mut pd) = (system.neutral(), system.zero_momenta());
    let rates_of = |state: &(S::Coordinates, S::Momenta)| {
        system.rates_at(zero::<S>(), &state.0, &state.1, &mut qd, &mut pd);
        [qd.as_mut(), pd.as_mut()].concat()
    };
    states.iter().map(rates_of).collect()
}

/// Largest difference of rates, relative to the largest rate of the state.
fn difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let of_state = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        let size = a.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        a.iter().zip(b).fold(0.0, |most: f64, (x, y)| most.max((x - y).abs() / size))
    };
    a.iter().zip(b).map(of_state).fold(0.0, f64::max)
}

fn compiled(path: &str, floating: bool, arithmetic: Arithmetic, branches: LikeBranches) -> Compiled {
    let text = std::fs::read_to_string(format!("{}/{path}", env!("CARGO_MANIFEST_DIR"))).expect("the model");
    let base = if floating { Base::Floating } else { Base::Fixed };
    let model = read::model(path, &text, &ImportOptions { base, ..ImportOptions::default() })
        .expect("checked by the build")
        .model;
    let plan = PlanOptions { branches, ..PlanOptions::default() };
    let compiled = Compiled::new(&model, &Options { arithmetic, plan, ..Options::default() }).expect("options");
    compiled.prepare(Output::Rates).expect("machine code");
    compiled
}

macro_rules! models {
    ($($name:ident, $path:literal, $floating:literal;)*) => {
        $(mod $name {
            include!(concat!(env!("OUT_DIR"), "/", stringify!($name), "_exact.rs"));
            include!(concat!(env!("OUT_DIR"), "/", stringify!($name), "_fast.rs"));
        })*

        fn main() {
            println!("| model | arithmetic | independent: machine code | branches apart | Rust | ratio | chained: machine code | branches apart | Rust | ratio |");
            println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
            let mut chosen: Vec<String> = std::env::args().skip(1).collect();
            if let Some(at) = chosen.iter().position(|name| name == "--fused") {
                chosen.remove(at);
                mbd_runtime::kernel::limit_level(mbd_runtime::kernel::Level::Fused);
            }
            let both = |path, floating, arithmetic| {
                [LikeBranches::Auto, LikeBranches::Apart].map(|branches| compiled(path, floating, arithmetic, branches))
            };
            $(if chosen.is_empty() || chosen.iter().any(|name| name == stringify!($name)) {
                row(stringify!($name), "exact", &mut both($path, $floating, Arithmetic::Exact), &mut $name::Exact::new());
                row(stringify!($name), "fast", &mut both($path, $floating, Arithmetic::Fast), &mut $name::Fast::new());
            })*
        }
    };
}

fn row<B: System>(name: &str, arithmetic: &str, machine: &mut [Compiled; 2], rust: &mut B)
where
    B::Coordinates: AsMut<[f64]>,
    B::Momenta: AsMut<[f64]>,
{
    // Fast arithmetic rounds otherwise.
    let most = if arithmetic == "exact" { 0.0 } else { 1e-9 };
    for machine in &mut *machine {
        let found = difference(&rates(machine), &rates(rust));
        assert!(found <= most, "{name}, {arithmetic}: machine code and Rust differ by {found:e}");
    }
    print!("| {name} | {arithmetic} |");
    for chained in [false, true] {
        let [m, apart, r] = least(machine, rust, chained);
        print!(" {m:.0} ns | {apart:.0} ns | {r:.0} ns | {:.2} |", m / r);
    }
    println!();
}

include!(concat!(env!("OUT_DIR"), "/models.rs"));
