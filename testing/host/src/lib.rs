//! The generator as functions that WebAssembly can export: JavaScript writes a description into the memory and reads
//! the code that was made of it.

use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;

use mbd_codegen::read::{self, Base, ImportOptions};
use mbd_codegen::{generate, Options, Output};

/// The code of a description, or why there is none. `files` reads the other files that it names.
pub fn code(path: &str, text: &str, files: &dyn Fn(&Path) -> io::Result<Vec<u8>>) -> String {
    let floating = ["solo12", "g1"].iter().any(|name| path.contains(name));
    let base = if floating { Base::Floating } else { Base::Fixed };
    let model = match read::load_with(path, text, &ImportOptions { base, ..ImportOptions::default() }, files) {
        (Some((model, _)), _) => model,
        (None, findings) => return findings.to_string(),
    };
    let outputs = vec![Output::Rates, Output::Momenta, Output::Energy, Output::Accelerations];
    match generate(&model, &Options { outputs, ..Options::default() }) {
        Ok(generated) => generated.source,
        Err(error) => error.to_string(),
    }
}

/// Files that descriptions name: their names without folders, and contents.
static FILES: Mutex<Vec<(String, Vec<u8>)>> = Mutex::new(Vec::new());

/// Length of the code that was written last.
static LENGTH: AtomicUsize = AtomicUsize::new(0);

/// Memory for a text of `n` bytes.
#[no_mangle]
pub extern "C" fn space(n: usize) -> *mut u8 {
    vec![0; n].leak().as_mut_ptr()
}

/// Address of the code of a description, whose path and text are `path` and `text`.
///
/// # Safety
/// Addresses of so many bytes each.
#[no_mangle]
pub unsafe extern "C" fn run(path: *const u8, m: usize, text: *const u8, n: usize) -> *const u8 {
    let string = |at, n| String::from_utf8_lossy(std::slice::from_raw_parts(at, n));
    let given = |wanted: &Path| {
        let files = FILES.lock().expect("one thread");
        let name = wanted.file_name().map(|name| name.to_string_lossy());
        let found = files.iter().find(|(file, _)| name.as_ref().is_some_and(|name| name == file));
        found.map(|(_, contents)| contents.clone()).ok_or_else(|| io::ErrorKind::NotFound.into())
    };
    let code = code(&string(path, m), &string(text, n), &given);
    LENGTH.store(code.len(), Ordering::Relaxed);
    code.leak().as_ptr()
}

/// Takes a file that descriptions may name, by its name without folders.
///
/// # Safety
/// Addresses of so many bytes each.
#[no_mangle]
pub unsafe extern "C" fn file(name: *const u8, m: usize, contents: *const u8, n: usize) {
    let bytes = |at, n| std::slice::from_raw_parts(at, n);
    let name = String::from_utf8_lossy(bytes(name, m)).into_owned();
    FILES.lock().expect("one thread").push((name, bytes(contents, n).to_vec()));
}

/// Length of that code.
#[no_mangle]
pub extern "C" fn length() -> usize {
    LENGTH.load(Ordering::Relaxed)
}
