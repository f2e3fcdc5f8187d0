//! Times of generated C and WebAssembly beside generated Rust, `rates` of one state. `run.sh` says how to call it.
//!
//! Without arguments C is called in turns with Rust in one process; with the argument `wasm` every round starts Node, which
//! prints its time. The least of many rounds counts.

use std::hint::black_box;
use std::process::Command;
use std::time::Instant;

use mbd_runtime::System;

const STATES: usize = 64;
const ROUNDS: usize = 400;
/// Rounds of Node and Rust in turns.
const STARTS: usize = 5;

/// A random number between −1 and 1.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Coordinates and momenta, numbers of a state, near the neutral position.
type State<const NQ: usize, const NV: usize> = ([f64; NQ], [f64; NV]);

fn states<const NQ: usize, const NV: usize>(neutral: [f64; NQ]) -> Vec<State<NQ, NV>> {
    let mut seed = 1;
    (0..STATES).map(|_| (neutral.map(|q| q + random(&mut seed)), [0.0; NV].map(|_: f64| random(&mut seed)))).collect()
}

/// Nanoseconds of a call, of all states one after the other.
fn time<const NQ: usize, const NV: usize>(
    states: &[State<NQ, NV>],
    mut rates: impl FnMut(&[f64; NQ], &[f64; NV], &mut [f64; NQ], &mut [f64; NV]),
) -> f64 {
    let (mut qd, mut pd) = ([0.0; NQ], [0.0; NV]);
    let from = Instant::now();
    for (q, p) in states {
        rates(black_box(q), black_box(p), &mut qd, &mut pd);
        black_box((&mut qd, &mut pd));
    }
    from.elapsed().as_secs_f64() * 1e9 / states.len() as f64
}

/// Nanoseconds of a call in Node.
fn node(name: &str) -> f64 {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/src/time.mjs");
    let module = format!("{}/{name}", env!("OUT_DIR"));
    let run = Command::new("node").args([script, &module]).output().expect("`node` can be started");
    let text = String::from_utf8_lossy(&run.stdout);
    assert!(run.status.success(), "{text}{}", String::from_utf8_lossy(&run.stderr));
    text.trim().parse().expect("a time")
}

macro_rules! models {
    ($($module:ident, $name:literal { $($compiler:literal => $c:ident,)* })*) => {
        $(mod $module {
            include!(concat!(env!("OUT_DIR"), "/", $name, ".rs"));
            pub const NQ: usize = Rust::NQ;
            pub const NV: usize = Rust::NV;
            unsafe extern "C" {
                $(pub fn $c(inputs: &[f64; NV], q: &[f64; NQ], p: &[f64; NV], qd: &mut [f64; NQ], pd: &mut [f64; NV]);)*
            }
        })*

        fn main() {
            let wasm = std::env::args().any(|argument| argument == "wasm");
            match wasm {
                true => println!("| model | Rust | WebAssembly | ratio |"),
                false => println!("| model | Rust | compiler of C | C | ratio |"),
            }
            println!("{}", if wasm { "| --- | --- | --- | --- |" } else { "| --- | --- | --- | --- | --- |" });
            $({
                use $module::{Rust, NQ, NV};
                let rust = Rust::new();
                let states = states::<NQ, NV>(rust.neutral());
                let ours = || time(&states, |q, p, qd, pd| rust.rates(q, p, qd, pd));
                if wasm {
                    let mut least = [f64::INFINITY; 2];
                    for _ in 0..STARTS {
                        least[0] = (0..ROUNDS).fold(least[0], |least, _| least.min(ours()));
                        least[1] = least[1].min(node($name));
                    }
                    println!("| {} | {:.1} ns | {:.1} ns | {:.2} |", $name, least[0], least[1], least[1] / least[0]);
                } else {
                    $({
                        let inputs = [0.0; NV];
                        let c = |q: &[f64; NQ], p: &[f64; NV], qd: &mut [f64; NQ], pd: &mut [f64; NV]| {
                            // SAFETY: the arrays have the lengths of the header, and do not overlap.
                            unsafe { $module::$c(&inputs, q, p, qd, pd) }
                        };
                        for (q, p) in &states {
                            let (mut a, mut b) = (([0.0; NQ], [0.0; NV]), ([0.0; NQ], [0.0; NV]));
                            rust.rates(q, p, &mut a.0, &mut a.1);
                            c(q, p, &mut b.0, &mut b.1);
                            let pairs = || a.0.iter().chain(&a.1).zip(b.0.iter().chain(&b.1));
                            let size = pairs().fold(1.0_f64, |size, (a, _)| size.max(a.abs()));
                            // Roundings and their growth: fused operations differ.
                            assert!(pairs().all(|(a, b)| (a - b).abs() < 1e-9 * size), "{}: C differs from Rust", $name);
                        }
                        let mut least = [f64::INFINITY; 2];
                        for _ in 0..ROUNDS {
                            least[0] = least[0].min(ours());
                            least[1] = least[1].min(time(&states, c));
                        }
                        let [ours, theirs] = least;
                        println!("| {} | {ours:.1} ns | {} | {theirs:.1} ns | {:.2} |", $name, $compiler, theirs / ours);
                    })*
                }
            })*
        }
    };
}

include!(concat!(env!("OUT_DIR"), "/models.rs"));
