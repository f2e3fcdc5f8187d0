//! Messages of `mbd_model!` about wrong arguments and wrong models. Each `tests/ui/*.rs` must fail to compile and print
//! its `.stderr`. `UPDATE=1 cargo test -p multibody --test facade macro_errors` rewrites the `.stderr` files.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

/// The folder of the cases; paths in the macro are relative to it.
const CASES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ui");

/// The library `multibody` that was compiled last. It belongs to the present sources, because this test depends on it.
fn library(dependencies: &Path) -> PathBuf {
    let files =
        std::fs::read_dir(dependencies).expect("the folder of the dependencies").map(|f| f.expect("a file").path());
    let is_library = |path: &PathBuf| {
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        name.starts_with("libmultibody-") && name.ends_with(".rlib")
    };
    let age = |path: &PathBuf| path.metadata().and_then(|m| m.modified()).unwrap_or(SystemTime::UNIX_EPOCH);
    files.filter(is_library).max_by_key(age).expect("cargo has compiled the library")
}

/// Messages of the compiler for a case, without the lines that count errors.
fn messages(case: &Path, dependencies: &Path, library: &Path) -> String {
    let name = case.file_name().and_then(|n| n.to_str()).expect("a name");
    let compiled = Command::new(std::env::var_os("RUSTC").unwrap_or("rustc".into()))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("CARGO_MANIFEST_DIR", CASES)
        .env_remove("RUSTFLAGS")
        .args(["--edition=2021", "--crate-type=bin", "--emit=metadata", "--color=never", "--out-dir"])
        .arg(env!("CARGO_TARGET_TMPDIR"))
        .arg("-L")
        .arg(format!("dependency={}", dependencies.display()))
        .arg("--extern")
        .arg(format!("multibody={}", library.display()))
        .arg(format!("tests/ui/{name}"))
        .output()
        .expect("the compiler runs");
    assert!(!compiled.status.success(), "{name} compiles");
    let text = String::from_utf8(compiled.stderr).expect("UTF-8");
    let counts =
        |line: &str| line.starts_with("error: aborting due to ") || line.starts_with("For more information about ");
    let kept: Vec<&str> = text.lines().filter(|line| !counts(line)).collect();
    kept.join("\n").trim_end().to_string() + "\n"
}

#[test]
fn messages_are_those_of_the_cases() {
    let own = std::env::current_exe().expect("the path of this test");
    let dependencies = own.parent().expect("a folder");
    let library = library(dependencies);
    let mut cases: Vec<PathBuf> =
        std::fs::read_dir(CASES).expect("the cases").map(|f| f.expect("a file").path()).collect();
    cases.retain(|path| path.extension().is_some_and(|e| e == "rs"));
    cases.sort();
    assert!(!cases.is_empty());
    let mut wrong = Vec::new();
    for case in cases {
        let printed = messages(&case, dependencies, &library);
        let file = case.with_extension("stderr");
        if std::env::var_os("UPDATE").is_some() {
            std::fs::write(&file, &printed).expect("the file can be written");
        }
        let expected = std::fs::read_to_string(&file).unwrap_or_default();
        if printed != expected {
            wrong.push(format!("{}: expected\n{expected}\nprinted\n{printed}", file.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
