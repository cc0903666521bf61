//! Tests of the servo loop as a whole: engine, shared memory and driver.
#![allow(clippy::too_many_lines, reason = "a test reads from top to bottom")]
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

mod conformance;
mod goodbyes;
mod hostile;
mod lock_step;
mod processes;
mod scene;
mod virtual_time;
mod wall_clock;

/// Ends a driver's thread however the test ends: a scope waits for its threads.
struct StopOnDrop<'a>(&'a std::sync::atomic::AtomicBool);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, std::sync::atomic::Ordering::Relaxed);
    }
}
