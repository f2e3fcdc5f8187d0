//! Functions that the tests of the commands share.
#![allow(dead_code)] // Each test uses a part.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

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

/// Waits until a command listens to interrupts and has computed for a second since, where the system tells; otherwise two
/// seconds.
pub fn wait_until_it_computes(command: &mut std::process::Child) {
    let id = command.id();
    let told = |file: &str| std::fs::read_to_string(format!("/proc/{id}/{file}")).ok();
    // The signals that are handled, bit by bit.
    let listens = || {
        let status = told("status")?;
        let handled = status.lines().find_map(|line| line.strip_prefix("SigCgt:"))?;
        Some(u64::from_str_radix(handled.trim(), 16).ok()? & (1 << 1) != 0)
    };
    // Hundredths of a second that the processor has spent; the name of the program is one word.
    let spent = || told("stat")?.split(' ').nth(13)?.parse::<u64>().ok();
    if listens().and(spent()).is_none() {
        return std::thread::sleep(Duration::from_secs(2));
    }
    let (start, mut before) = (Instant::now(), None);
    while before.is_none_or(|before| spent().is_some_and(|now| now < before + 100)) {
        if listens() == Some(true) {
            before = before.or(spent());
        }
        assert!(start.elapsed() < Duration::from_secs(120), "the command does not compute");
        assert!(matches!(command.try_wait(), Ok(None)), "the command has ended");
        std::thread::sleep(Duration::from_millis(20));
    }
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

/// Says that a test, or a part of one, is skipped.
///
/// # Panics
/// With `MBD_TEST_ALL=1` in the environment: then nothing may be.
pub fn skipped(why: &str) {
    assert!(std::env::var("MBD_TEST_ALL").as_deref() != Ok("1"), "{why}");
    eprintln!("skipped: {why}");
}

/// Whether a program is there; if not, that is [`skipped`] which needs it.
pub fn is_there(program: &str) -> bool {
    let there = Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success());
    if !there {
        skipped(&format!("`{program}` is not there"));
    }
    there
}

/// The number behind a text.
#[track_caller]
pub fn number(report: &str, before: &str) -> f64 {
    let rest = report.split(before).nth(1).unwrap_or_else(|| panic!("`{before}` is not in:\n{report}"));
    let end = rest.find(|c: char| !(c.is_ascii_digit() || ".e-".contains(c))).unwrap_or(rest.len());
    rest[..end].parse().unwrap_or_else(|_| panic!("no number behind `{before}` in:\n{report}"))
}

/// A table as columns by name.
pub struct Rows {
    pub header: Vec<String>,
    pub rows: Vec<Vec<f64>>,
}

impl Rows {
    pub fn read(folder: &Path, name: &str) -> Rows {
        let text = read(folder, name);
        let mut lines = text.lines();
        let header = lines.next().expect("a header").split(',').map(String::from).collect();
        let numbers = |line: &str| line.split(',').map(|x| x.parse().expect("a number")).collect();
        Rows { header, rows: lines.map(numbers).collect() }
    }

    pub fn column(&self, name: &str) -> Vec<f64> {
        let at = self.header.iter().position(|n| n == name).unwrap_or_else(|| panic!("{name}: {:?}", self.header));
        self.rows.iter().map(|row| row[at]).collect()
    }

    pub fn last(&self, name: &str) -> f64 {
        *self.column(name).last().expect("a row")
    }
}
