//! Damaged files must give findings, never a panic, and a model exactly where no finding is an error.

mod mutate;

use mbd_codegen::import::{load, ImportOptions};
use mutate::Mutator;

fn survive(file: &str, seeds: &[String], rounds: u64) {
    let mut with_model = 0;
    for seed in 0..rounds {
        let text = Mutator::new(seed).mutate(seeds);
        let caught = std::panic::catch_unwind(|| load(file, &text, &ImportOptions::default()));
        let Ok((model, findings)) = caught else { panic!("seed {seed} of {file} panics with\n{text}") };
        assert_eq!(model.is_some(), !findings.has_errors(), "seed {seed}: {findings}\n{text}");
        for d in &findings.0 {
            let lines = text.matches('\n').count() + 1;
            assert!(d.line <= lines && !d.message.is_empty() && !d.message.contains('\n'), "seed {seed}: {d:?}");
        }
        with_model += u64::from(model.is_some());
    }
    // The mutations have to be small enough for the checks behind the parser to be reached.
    assert!(with_model > rounds / 50, "only {with_model} of {rounds} mutated files were models");
}

#[test]
fn mutated_toml_never_panics() {
    let seeds = mutate::corpus(&[concat!(env!("CARGO_MANIFEST_DIR"), "/tests")], "toml");
    let seeds = mutate::balanced(seeds, |text| load("m.toml", text, &ImportOptions::default()).0.is_some());
    survive("m.toml", &seeds, 20_000);
}
