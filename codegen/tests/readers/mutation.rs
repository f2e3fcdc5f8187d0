//! Damaged files must give findings and never a panic. They give a model exactly if no finding is an error.

use mbd_codegen::read::{self, ImportOptions};

use crate::mutate::{self, Mutator};

fn survive(file: &str, seeds: &[String], rounds: u64) {
    let mut with_model = 0;
    for seed in 0..rounds {
        let text = Mutator::new(seed).mutate(seeds);
        let caught = std::panic::catch_unwind(|| read::load(file, &text, &ImportOptions::default()));
        let Ok((model, findings)) = caught else { panic!("seed {seed} of {file} panics with\n{text}") };
        assert_eq!(model.is_some(), !findings.has_errors(), "seed {seed}: {findings}\n{text}");
        for d in &findings.0 {
            let lines = text.matches('\n').count() + 1;
            assert!(d.line <= lines && !d.message.is_empty() && !d.message.contains('\n'), "seed {seed}: {d:?}");
        }
        with_model += u64::from(model.is_some());
    }
    // Mutations must be small enough that some files get past the parser to the checks.
    assert!(with_model > rounds / 50, "only {with_model} of {rounds} mutated files were models");
}

/// The broken models and the valid ones of one format.
fn seeds(extension: &str) -> Vec<String> {
    let file = format!("m.{extension}");
    let folders = [concat!(env!("CARGO_MANIFEST_DIR"), "/tests"), concat!(env!("CARGO_MANIFEST_DIR"), "/../models")];
    let mut seeds = mutate::corpus(&folders, extension);
    // Large files take long and find little more.
    seeds.retain(|s| s.len() < 20_000);
    mutate::balanced(seeds, |text| read::load(&file, text, &ImportOptions::default()).0.is_some())
}

#[test]
fn mutated_toml_never_panics() {
    survive("m.toml", &seeds("toml"), 20_000);
}

#[test]
fn mutated_urdf_never_panics() {
    survive("m.urdf", &seeds("urdf"), 20_000);
}

#[test]
fn mutated_mjcf_never_panics() {
    survive("m.xml", &seeds("xml"), 20_000);
}
