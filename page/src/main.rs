//! `states STEPS MODELS...` prints a line for each model: time, and a hash of the bits of coordinates and momenta, after so
//! many steps of 1 ms from its start; and a hash of its generated code. A number that is none has many bits, and counts
//! as one.

use std::path::Path;

use page::scene::{read, Files, Reading, Scene};

use page::codegen::{generate, Options};

/// The files beside a model whose names are in its text, in quotes.
fn named(path: &Path, text: &str) -> Files {
    let Ok(entries) = path.parent().unwrap_or(Path::new(".")).read_dir() else { return Files::new() };
    let others = entries.flatten().filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        if !text.contains(&format!("\"{name}\"")) {
            return None;
        }
        Some((name, std::fs::read(entry.path()).ok()?))
    });
    others.collect()
}

fn line(path: &str, steps: usize) -> Result<String, String> {
    let text = std::fs::read_to_string(path).map_err(|e| e.to_string())?;
    let name = path.rsplit('/').next().unwrap_or(path);
    let floating = ["solo12", "g1"].iter().any(|robot| name.contains(robot));
    let reading = Reading { floating, floor: None };
    let (model, findings) = read(name, &text, reading, &named(Path::new(path), &text)).map_err(|e| e.to_string())?;
    let mut scene = Scene::new(&model, findings)?;
    let done = scene.advance(steps);
    let (t, q, p) = scene.state();
    let state = hash(std::iter::once(t).chain(q.iter().chain(p).copied()).flat_map(|x| {
        let bits = if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() };
        bits.to_le_bytes()
    }));
    let source = match generate(&scene.plan.model, &Options::default()) {
        Ok(generated) => generated.source,
        Err(error) => error.to_string(),
    };
    Ok(format!("{done} {state:016x} {:016x}", hash(source.bytes())))
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let steps = arguments.next().and_then(|n| n.parse().ok()).expect("states STEPS MODELS...");
    for path in arguments {
        let line = line(&path, steps).unwrap_or_else(|message| message.lines().next().unwrap_or_default().to_string());
        println!("{path} {line}");
    }
}

/// Fowler, Noll and Vo's hash of some bytes.
fn hash(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |h, byte| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
