//! Interrupts from the keyboard: a simulation then ends early, and what it has is written.

use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);

/// From now on, an interrupt is noticed by [`asked`] in place of ending the process. A second one ends it.
pub fn listen() {
    // Where there are no signals, an interrupt ends the process as before.
    let _ = ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::Relaxed) {
            std::process::exit(STATUS.into());
        }
    });
}

/// Exit status of an interrupted command, as shells have it.
pub const STATUS: u8 = 130;

/// Whether the user has asked for the end.
pub fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
