//! Broken models and the exact findings about them. `UPDATE=1 cargo test -p mbd-codegen --test readers broken` rewrites
//! the `.txt` files beside the models. Review every change of them as prose: a finding says what is wrong, where, and
//! what to do.

use std::fs;
use std::path::{Path, PathBuf};

use mbd_codegen::diag::Severity;
use mbd_codegen::read::{self, ImportOptions};

/// Reads every file in `folder` with this extension and compares the findings with the `.txt` beside it.
fn run(folder: &str, extension: &str, at_least: usize) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/broken").join(folder);
    let entries = fs::read_dir(&folder).expect("the folder of broken models").map(|e| e.expect("an entry").path());
    let mut files: Vec<PathBuf> = entries.filter(|p| p.extension().is_some_and(|e| e == extension)).collect();
    files.sort();
    assert!(files.len() >= at_least, "only {} broken models in {}", files.len(), folder.display());
    let update = std::env::var_os("UPDATE").is_some_and(|v| v == "1");
    let mut wrong = Vec::new();
    for path in &files {
        let name = path.file_name().expect("a file name").to_string_lossy().into_owned();
        let text = fs::read_to_string(path).expect("UTF-8");
        let (model, findings) = read::load(&name, &text, &ImportOptions::default());
        assert!(!findings.0.is_empty(), "{name}: nothing was found");
        assert_eq!(
            model.is_none(),
            findings.has_errors(),
            "{name}: there must be a model exactly if there is no error"
        );
        for d in &findings.0 {
            assert!(
                !d.help.is_empty() || d.severity == Severity::Notice,
                "{name}: a finding without help: {}",
                d.message
            );
            assert!(!d.message.ends_with('.') && !d.help.ends_with('.'), "{name}: a full stop: {d}");
        }
        let got = format!("{findings}\n");
        let expected = path.with_extension("txt");
        if update {
            fs::write(&expected, &got).expect("writing the expectation");
        } else if fs::read_to_string(&expected).unwrap_or_default() != got {
            wrong.push(format!("--- {name}\n{got}"));
        }
    }
    assert!(wrong.is_empty(), "findings changed (UPDATE=1 accepts them):\n{}", wrong.join("\n"));
}

#[test]
fn toml() {
    run("toml", "toml", 25);
}

#[test]
fn urdf() {
    run("urdf", "urdf", 20);
}

#[test]
fn mjcf() {
    run("mjcf", "xml", 10);
}
