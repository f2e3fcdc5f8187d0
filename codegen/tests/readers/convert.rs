//! Descriptions that are converted to the TOML format stay the same.

use std::path::{Path, PathBuf};

use mbd_codegen::read::{load_all, to_toml, Base, ImportOptions};

/// No file is there.
fn none(path: &Path) -> std::io::Result<Vec<u8>> {
    Err(std::io::Error::new(std::io::ErrorKind::NotFound, path.display().to_string()))
}

/// Files below a folder that end so.
fn files(folder: &Path, all: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.extension().and_then(|e| e.to_str()) {
            _ if path.is_dir() => files(&path, all),
            Some("toml" | "urdf" | "xml") => all.push(path),
            _ => {}
        }
    }
}

/// Converts a file and compares the models with their variants, which the conversion itself does, too.
fn converted(path: &Path, options: &ImportOptions) {
    let (file, text) = (path.to_string_lossy(), std::fs::read_to_string(path).expect("a model"));
    let (model, _) = load_all(&file, &text, options);
    // A base is there, and is in what was converted.
    let (toml, _) = to_toml(&file, &text, options, &|path| std::fs::read(path))
        .unwrap_or_else(|findings| panic!("{file}: {findings}"));
    let (again, findings) = load_all("again.toml", &toml, &ImportOptions::default());
    assert!(again.is_some() && again == model, "{file}: {findings}");
    // What was converted is converted to itself.
    let (twice, _) = to_toml("again.toml", &toml, &ImportOptions::default(), &none).expect("a sound model");
    assert_eq!(twice, toml, "{file}");
}

#[test]
fn every_model_converts_to_itself() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut all = Vec::new();
    files(&root.join("../models"), &mut all);
    all.extend(
        ["everything", "constraints", "contacts", "variants"].map(|f| root.join(format!("tests/readers/{f}.toml"))),
    );
    // These are there to be refused.
    all.retain(|path| !path.ends_with("point_on_axis.toml") && !path.ends_with("massless_tip.toml"));
    assert!(all.len() > 40, "{} models", all.len());
    // Some of MuJoCo's are refused, and some are parts of others.
    let mut of_mujoco = Vec::new();
    files(&root.join("../tests/reference/mjcf"), &mut of_mujoco);
    of_mujoco.retain(|path| {
        let text = std::fs::read_to_string(path).expect("a model");
        load_all(&path.to_string_lossy(), &text, &ImportOptions::default()).0.is_some()
    });
    assert!(of_mujoco.len() > 36, "{} models of MuJoCo", of_mujoco.len());
    all.extend(of_mujoco);
    for path in &all {
        converted(path, &ImportOptions::default());
        if path.extension().is_some_and(|e| e == "urdf") {
            for base in [Base::Floating, Base::Planar] {
                converted(path, &ImportOptions { base, limits: true, ..ImportOptions::default() });
            }
        }
    }
}

#[test]
fn a_floor_is_not_converted() {
    let floor = Some(mbd_codegen::read::Floor { height: 0.0, friction: 0.5 });
    let text = "<robot name='r'><link name='l'/></robot>";
    let findings =
        to_toml("r.urdf", text, &ImportOptions { floor, ..ImportOptions::default() }, &none).expect_err("a refusal");
    assert!(findings.to_string().contains("floor"), "{findings}");
}
