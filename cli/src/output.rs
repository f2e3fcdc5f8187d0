//! Writing: notes to standard error, and files that are written completely or not at all.

use std::fmt::{Arguments, Display};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use super::{Failure, Outcome};

/// Writes one note to standard error. A failure to write it is ignored.
pub fn note(text: Arguments) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Time after which work that goes on is mentioned.
const LONG: Duration = Duration::from_secs(2);

/// Does some work, and says on standard error what it is if it takes longer than two seconds.
pub fn mentioned<R>(what: impl Display + Sync, work: impl FnOnce() -> R) -> R {
    std::thread::scope(|scope| {
        let (done, wait) = mpsc::channel::<()>();
        let what = &what;
        scope.spawn(move || {
            if wait.recv_timeout(LONG) == Err(RecvTimeoutError::Timeout) {
                note(format_args!("{what} ..."));
            }
        });
        let result = work();
        drop(done);
        result
    })
}

/// Writes a result to a file, or to standard output where no file is named or its name is `-`.
pub fn write_result(file: Option<&Path>, content: &str, out: &mut dyn Write) -> Outcome {
    match file.filter(|file| *file != Path::new("-")) {
        Some(file) => write_file(file, content),
        None => Ok(out.write_all(content.as_bytes())?),
    }
}

/// Writes a file through a temporary file in the same directory, so that it is either complete or unchanged.
pub fn write_file(path: &Path, content: &str) -> Outcome {
    write_files(&[(path, content)])
}

/// Writes several files that belong together: none is replaced before all have been written.
pub fn write_files<C: AsRef<[u8]>>(files: &[(&Path, C)]) -> Outcome {
    let mut written: Vec<(PathBuf, PathBuf, &Path)> = Vec::new();
    let result = files.iter().try_for_each(|(path, content)| {
        writable(path)?;
        // A link stays a link, and a pipe or terminal cannot be the target of a rename.
        let target = target(path);
        if written.iter().any(|(_, other, _)| *other == target) {
            let what = format!("cannot write `{}`: two outputs have this name", path.display());
            return Err(Failure::new(what, "name a file of its own for each of them"));
        }
        if target.exists() && !target.is_file() {
            return std::fs::write(&target, content).map_err(|e| failure(path, &e));
        }
        let temporary = temporary(&target);
        written.push((temporary.clone(), target, path));
        std::fs::write(&temporary, content).map_err(|e| failure(path, &e))
    });
    let result = result.and_then(|()| {
        let mut all = written.iter();
        all.try_for_each(|(from, to, path)| std::fs::rename(from, to).map_err(|e| failure(path, &e)))
    });
    if result.is_err() {
        written.iter().for_each(|(temporary, ..)| drop(std::fs::remove_file(temporary)));
    }
    result
}

/// The file itself that a path leads to, whether it is there or not.
fn target(path: &Path) -> PathBuf {
    let beside = || Some(std::fs::canonicalize(folder(path)).ok()?.join(path.file_name()?));
    std::fs::canonicalize(path).ok().or_else(beside).unwrap_or_else(|| path.to_path_buf())
}

/// The folder of a file.
fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether two paths lead to one file, which need not be there.
pub fn same_file(a: &Path, b: &Path) -> bool {
    target(a) == target(b)
}

/// The files that this process has read as its input.
static READ: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Remembers that a file is input, so that it is not overwritten.
pub fn is_input(path: &Path) {
    if let Ok(path) = std::fs::canonicalize(path) {
        READ.lock().unwrap_or_else(PoisonError::into_inner).push(path);
    }
}

/// Checks whether a file can be written, before its contents are computed. What was read as input is not, and `-` is no file:
/// the results that may go to standard output do not come here.
pub fn writable(path: &Path) -> Outcome {
    if path == Path::new("-") {
        return Err(Failure::new(
            "cannot write `-`: this result goes to a file, not to standard output",
            "name a file; `./-` is one of that name",
        ));
    }
    let target = std::fs::canonicalize(path).ok().filter(|target| target.is_file());
    let read = READ.lock().unwrap_or_else(PoisonError::into_inner);
    if target.is_some_and(|target| read.contains(&target)) {
        let what = format!("cannot write `{}`: it is the input of this command", path.display());
        return Err(Failure::new(what, "name another file for the output"));
    }
    if path.is_dir() {
        return Err(Failure::new(format!("cannot write `{}`: it is a directory", path.display()), "name a file in it"));
    }
    std::fs::metadata(folder(path)).map(drop).map_err(|e| failure(path, &e))
}

fn failure(path: &Path, e: &std::io::Error) -> Failure {
    Failure::new(
        format!("cannot write `{}`: {e}", path.display()),
        "check that the directory exists and that you may write to it",
    )
}

fn temporary(target: &Path) -> PathBuf {
    let name = target.file_name().map_or_else(|| "out".into(), |n| n.to_string_lossy());
    target.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
}
