//! The generator as functions that WebAssembly can export: JavaScript writes a description into the memory and reads
//! the code that was made of it.

use std::sync::atomic::{AtomicUsize, Ordering};

use mbd_codegen::read::{self, Base, ImportOptions};
use mbd_codegen::{generate, Options, Output};

/// The code of a description, or why there is none.
pub fn code(path: &str, text: &str) -> String {
    let floating = ["solo12", "g1"].iter().any(|name| path.contains(name));
    let base = if floating { Base::Floating } else { Base::Fixed };
    let model = match read::model(path, text, &ImportOptions { base, ..ImportOptions::default() }) {
        Ok(read) => read.model,
        Err(findings) => return findings.to_string(),
    };
    let outputs = vec![Output::Rates, Output::Momenta, Output::Energy, Output::Accelerations];
    match generate(&model, &Options { outputs, ..Options::default() }) {
        Ok(generated) => generated.source,
        Err(error) => error.to_string(),
    }
}

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
    let code = code(&string(path, m), &string(text, n));
    LENGTH.store(code.len(), Ordering::Relaxed);
    code.leak().as_ptr()
}

/// Length of that code.
#[no_mangle]
pub extern "C" fn length() -> usize {
    LENGTH.load(Ordering::Relaxed)
}
