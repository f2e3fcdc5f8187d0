//! C compilers of this machine.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::external::is_there;

/// Flags with which all generated C compiles without a word.
pub const STRICT: [&str; 6] = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"];

/// Those of GCC and Clang that are there.
pub fn compilers() -> Vec<&'static str> {
    ["gcc", "clang"].into_iter().filter(|name| is_there(name)).collect()
}

/// Compiles all sources of a folder, two at a time, and links them to a program.
///
/// # Panics
/// The compiler has something to say.
pub fn build(compiler: &str, folder: &Path, sources: &[String], flags: &[&str]) -> PathBuf {
    let object = |source: &String| folder.join(format!("{source}.{compiler}.o"));
    let run = |command: &mut Command| {
        let output = command.output().expect("the compiler runs");
        assert!(output.status.success(), "{compiler}: {}", String::from_utf8_lossy(&output.stderr));
    };
    let compile = |source: &String| {
        let mut command = Command::new(compiler);
        run(command.args(STRICT).args(flags).arg("-c").arg(folder.join(source)).arg("-o").arg(object(source)));
    };
    std::thread::scope(|scope| {
        for half in 0..2 {
            scope.spawn(move || sources.iter().skip(half).step_by(2).for_each(compile));
        }
    });
    let program = folder.join(format!("program.{compiler}"));
    run(Command::new(compiler).args(sources.iter().map(object)).arg("-lm").arg("-o").arg(&program));
    program
}

/// Runs a program that reads numbers from its standard input and writes numbers.
pub fn run(program: &Path, given: &[f64]) -> Vec<f64> {
    let input = program.with_extension("in");
    let bytes: Vec<u8> = given.iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(&input, bytes).expect("the folder of tests can be written");
    let mut command = Command::new(program);
    let output = command.stdin(File::open(input).expect("it was written")).output().expect("the program runs");
    assert!(output.status.success(), "{}: {}", program.display(), output.status);
    let (numbers, rest) = output.stdout.as_chunks();
    assert!(rest.is_empty());
    numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()
}
