//! Functions that the tests of the commands share.
#![allow(dead_code)] // Each test uses a part.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// Root of the repository.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The executable under test: that of the crate to which the test belongs.
pub const PROGRAM: &str = match (option_env!("CARGO_BIN_EXE_mbd"), option_env!("CARGO_BIN_EXE_mbd-lab")) {
    (Some(program), _) | (None, Some(program)) => program,
    (None, None) => panic!("the tests of a command must be in its crate"),
};

/// Whether the program has the generated scenes; only that of the experiments can.
#[allow(unexpected_cfgs)]
pub const HAS_SCENES: bool = cfg!(feature = "generated");

/// Whether the executable is that of the experiments, `mbd-lab`.
pub const IS_LAB: bool = option_env!("CARGO_BIN_EXE_mbd-lab").is_some();

/// An empty directory for one test.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("cli_{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a directory");
    folder
}

/// Runs the executable in a folder.
pub fn run_in(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(PROGRAM).current_dir(folder).args(arguments).output().expect("the program runs")
}

/// Starts the executable in a folder, silently.
pub fn start_in(folder: &Path, arguments: &[&str]) -> std::process::Child {
    let silent = std::process::Stdio::null;
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder).args(arguments).stdout(silent()).stderr(silent()).spawn().expect("the program runs")
}

/// Runs the executable in the root of the repository.
pub fn run(arguments: &[&str]) -> Output {
    run_in(Path::new(ROOT), arguments)
}

/// Standard output.
pub fn out(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).expect("UTF-8")
}

/// Standard error.
pub fn err(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).expect("UTF-8")
}

/// Asserts exit status 0.
#[track_caller]
pub fn good(output: Output) -> Output {
    assert_eq!(output.status.code(), Some(0), "{}", err(&output));
    output
}

/// Asserts exit status 1, an empty standard output, and messages that contain a help line and all of the texts.
#[track_caller]
pub fn bad(output: Output, texts: &[&str]) {
    let messages = err(&output);
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert_eq!(out(&output), "");
    assert!(messages.contains("\n  help: "), "{messages}");
    for text in texts {
        assert!(messages.contains(text), "`{text}` is not in:\n{messages}");
    }
}

/// Names of the files in a folder.
pub fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("a directory")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Writes a file and returns its path.
pub fn write(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a file");
    path.to_string_lossy().into_owned()
}

/// Text of a file.
pub fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).expect("a file")
}

/// Standard output as JSON.
pub fn json_of(output: &Output) -> Value {
    serde_json::from_str(out(output)).expect("JSON")
}

/// Whether a program is there; a message says so if not.
pub fn is_there(program: &str) -> bool {
    let there = Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success());
    if !there {
        eprintln!("skipped: `{program}` is not there");
    }
    there
}
