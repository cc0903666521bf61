//! The servo loop from outside: engine, shared memory and driver together.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

mod conformance;
mod lock_step;
mod processes;
mod virtual_time;
mod wall_clock;
