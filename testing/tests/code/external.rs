//! Programs that are not part of the project: tests that need one are skipped where it is not there, and fail with
//! `MBD_TEST_ALL=1` in the environment.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Whether a program is there; a message says so if not.
///
/// # Panics
/// If not, where all tests are to run.
pub fn is_there(program: &str) -> bool {
    let there = Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success());
    if !there {
        assert!(std::env::var("MBD_TEST_ALL").as_deref() != Ok("1"), "`{program}` is not there");
        eprintln!("skipped: `{program}` is not there");
    }
    there
}

/// A folder for the files of a test.
pub fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    std::fs::create_dir_all(&folder).expect("the folder of tests can be written");
    folder
}

/// Writes a file of a test.
pub fn write(folder: &Path, name: &str, content: impl AsRef<[u8]>) {
    std::fs::write(folder.join(name), content).expect("the folder of tests can be written");
}
