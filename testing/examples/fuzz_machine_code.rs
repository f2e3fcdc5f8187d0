//! Compares machine code made at run time with the interpreter on random models, bit by bit.
//!
//! ```sh
//! cargo run --release -p mbd-testing --example fuzz_machine_code -- [--models 100000] [--seed 0] [--seconds 3600]
//! ```
//!
//! Each model has its rates and one more output compared; models have every kind of joint, loops, like branches, rolled
//! code. It stops at the first difference, with the seed and the model, or after so many models or seconds.

#[path = "../tests/code/fuzzed.rs"]
mod fuzzed;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

fn main() -> Result<(), String> {
    let (mut models, mut seed, mut seconds) = (100_000, 0, 3600);
    let mut arguments = std::env::args().skip(1);
    while let Some(key) = arguments.next() {
        let value = arguments.next().ok_or(format!("{key} needs a value"))?;
        let to = match key.as_str() {
            "--models" => &mut models,
            "--seed" => &mut seed,
            "--seconds" => &mut seconds,
            _ => return Err(format!("unknown option {key} {value}")),
        };
        *to = value.parse::<u64>().map_err(|e| format!("{value}: {e}"))?;
    }
    let (start, mut last, mut done) = (Instant::now(), Instant::now(), 0);
    let mut outputs: BTreeMap<&str, u64> = BTreeMap::new();
    while done < models && start.elapsed() < Duration::from_secs(seconds) {
        *outputs.entry(fuzzed::compare(seed + done).name()).or_default() += 1;
        done += 1;
        if last.elapsed() > Duration::from_secs(30) {
            last = Instant::now();
            println!("{done} models in {:.0} s", start.elapsed().as_secs_f64());
        }
    }
    println!(
        "{done} models from seed {seed} on, no difference, {:.0} s; beside the rates:",
        start.elapsed().as_secs_f64()
    );
    for (output, count) in outputs {
        println!("{output}: {count}");
    }
    Ok(())
}
