//! Writing: notes to standard error, files that appear whole or not at all.

use std::fmt::Arguments;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::{Failure, Outcome};

/// One note to standard error. Nobody listening is no reason to stop.
pub fn note(text: Arguments) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Writes a file by way of a temporary one beside it, so that it is whole or as it was.
pub fn write_file(path: &Path, content: &str) -> Outcome {
    let failure = |e: std::io::Error| {
        Failure::new(
            format!("cannot write `{}`: {e}", path.display()),
            "check that the directory exists and that you may write to it",
        )
    };
    // A link keeps being one; a pipe or terminal cannot be renamed onto.
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    if target.is_dir() {
        return Err(Failure::new(format!("cannot write `{}`: it is a directory", path.display()), "name a file in it"));
    }
    if target.exists() && !target.is_file() {
        return std::fs::write(&target, content).map_err(failure);
    }
    let temporary = temporary(&target);
    let written = std::fs::write(&temporary, content).and_then(|()| std::fs::rename(&temporary, &target));
    written.map_err(|e| {
        let _ = std::fs::remove_file(&temporary);
        failure(e)
    })
}

fn temporary(target: &Path) -> PathBuf {
    let name = target.file_name().map_or_else(|| "out".into(), |n| n.to_string_lossy());
    target.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
}
