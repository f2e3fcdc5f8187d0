//! Many rows of work on several threads, which Python can interrupt.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// Time between two looks whether Python was interrupted.
const LOOK: Duration = Duration::from_millis(50);
/// Number of steps between two looks at the clock.
const STEPS: u32 = 64;

/// Tells whether a row is to go on.
pub struct Beat<'a> {
    stop: &'a AtomicBool,
    error: &'a Mutex<Option<PyErr>>,
    /// Only the thread that Python has called asks it.
    caller: Option<Caller>,
}

struct Caller {
    last: Instant,
    steps: u32,
}

impl Beat<'_> {
    /// Called once a step; whether to go on.
    #[inline]
    pub fn goes_on(&mut self) -> bool {
        if let Some(caller) = &mut self.caller {
            caller.steps += 1;
            if caller.steps >= STEPS {
                caller.steps = 0;
                self.look();
            }
        }
        !self.stop.load(Ordering::Relaxed)
    }

    /// Asks Python whether it was interrupted, if the last time is long ago.
    fn look(&mut self) {
        let Some(caller) = self.caller.as_mut().filter(|caller| caller.last.elapsed() >= LOOK) else { return };
        caller.last = Instant::now();
        if let Err(error) = Python::attach(|py| py.check_signals()) {
            self.stop_with(error);
        }
    }

    /// Ends all rows; the caller gets the exception, the first one if there are several.
    pub fn stop_with(&self, error: PyErr) {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// A thread of [`on_threads`] that counts itself out where it ends, by a panic too: its caller would wait for it without end.
struct Leaves<'a> {
    left: &'a AtomicUsize,
    caller: &'a std::thread::Thread,
}

impl Drop for Leaves<'_> {
    fn drop(&mut self) {
        self.left.fetch_sub(1, Ordering::Release);
        self.caller.unpark();
    }
}

/// Runs `work` on every item, each on one thread only; at most so many threads. Threads make their memory by `begin`.
/// Called without the lock of the interpreter.
///
/// # Errors
/// What Python was interrupted with, or what [`Beat::stop_with`] was given.
pub fn on_threads<T: Send, M>(
    items: impl Iterator<Item = T> + Send,
    threads: usize,
    begin: impl Fn() -> M + Sync,
    end: impl Fn(M) + Sync,
    work: impl Fn(&mut M, T, &mut Beat) + Sync,
) -> PyResult<()> {
    let (stop, error) = (AtomicBool::new(false), Mutex::new(None));
    let (left, items) = (AtomicUsize::new(threads - 1), Mutex::new(items));
    let take = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
    let all = |beat: &mut Beat| {
        let mut memory = begin();
        while let Some(item) = take() {
            work(&mut memory, item, beat);
            if !beat.goes_on() {
                break;
            }
        }
        end(memory);
    };
    let caller = std::thread::current();
    std::thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(|| {
                let _leaves = Leaves { left: &left, caller: &caller };
                all(&mut Beat { stop: &stop, error: &error, caller: None });
            });
        }
        let own = Caller { last: Instant::now(), steps: 0 };
        let mut beat = Beat { stop: &stop, error: &error, caller: Some(own) };
        all(&mut beat);
        while left.load(Ordering::Acquire) > 0 {
            std::thread::park_timeout(LOOK);
            beat.look();
        }
    });
    error.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
}
