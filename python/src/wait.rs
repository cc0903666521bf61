//! Work without the interpreter's lock, ended by Ctrl-C, without panics through the border.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::{self, Builder};
use std::time::Duration;

use pyo3::prelude::*;

use crate::error::internal;

/// How often a long call looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// Stack of a thread that plans (bytes).
const STACK: usize = 16 << 20;

/// Runs short work without the interpreter's lock.
pub(crate) fn short<T: Send>(
    py: Python<'_>,
    what: &str,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    py.detach(|| catch_unwind(AssertUnwindSafe(work)))
        .map_err(|_| internal(what))
}

/// Runs long work in a thread of its own. At Ctrl-C its result is given up at once; the work itself
/// ends by itself, since it has no effect but its result.
pub(crate) fn long<T: Send + 'static>(
    py: Python<'_>,
    what: &'static str,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (tell, told) = channel();
    let thread = Builder::new()
        .name(format!("canter {what}"))
        .stack_size(STACK);
    thread
        .spawn(move || {
            // Whoever waited may have given up.
            let _ = tell.send(catch_unwind(AssertUnwindSafe(work)));
        })
        .map_err(PyErr::from)?;
    let told = Mutex::new(told);
    loop {
        let heard = py.detach(|| match told.lock() {
            Ok(told) => told.recv_timeout(LOOK),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        });
        match heard {
            Ok(result) => return result.map_err(|_| internal(what)),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => return Err(internal(what)),
        }
    }
}

/// Works through jobs with so many threads (0: one for each processor). At Ctrl-C no further job
/// begins.
pub(crate) fn parallel<J: Send>(
    py: Python<'_>,
    what: &'static str,
    jobs: impl Iterator<Item = J> + Send,
    threads: usize,
    work: impl Fn(J) + Sync,
) -> PyResult<()> {
    let threads = match threads {
        0 => thread::available_parallelism().map_or(1, usize::from),
        told => told,
    };
    let (jobs, ends, panicked) = (
        Mutex::new(jobs),
        AtomicBool::new(false),
        AtomicBool::new(false),
    );
    let next = || jobs.lock().ok().and_then(|mut jobs| jobs.next());
    let run = || {
        while !ends.load(Ordering::Relaxed) {
            let Some(job) = next() else { return };
            if catch_unwind(AssertUnwindSafe(|| work(job))).is_err() {
                panicked.store(true, Ordering::Relaxed);
                ends.store(true, Ordering::Relaxed);
            }
        }
    };
    let interrupted = py.detach(|| {
        thread::scope(|scope| {
            // A thread that cannot be started is missing; the others do its work.
            let workers: Vec<_> = (0..threads)
                .filter_map(|_| {
                    Builder::new()
                        .stack_size(STACK)
                        .spawn_scoped(scope, run)
                        .ok()
                })
                .collect();
            if workers.is_empty() {
                run();
            }
            watch(&workers, &ends)
        })
    });
    interrupted?;
    if panicked.into_inner() {
        return Err(internal(what));
    }
    Ok(())
}

/// Looks for Ctrl-C until all workers have ended.
fn watch(workers: &[thread::ScopedJoinHandle<'_, ()>], ends: &AtomicBool) -> PyResult<()> {
    let mut pause = Duration::from_micros(20);
    let mut waited = Duration::ZERO;
    while workers.iter().any(|worker| !worker.is_finished()) {
        thread::sleep(pause);
        waited += pause;
        pause = (2 * pause).min(Duration::from_millis(2));
        if waited >= LOOK {
            waited = Duration::ZERO;
            if let Err(error) = Python::attach(|py| py.check_signals()) {
                ends.store(true, Ordering::Relaxed);
                return Err(error);
            }
        }
    }
    Ok(())
}
