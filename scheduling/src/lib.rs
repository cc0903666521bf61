//! Services of the operating system for processes with deadlines: the clock that times in messages
//! use, real-time scheduling of threads, and memory that the process keeps.
//!
//! Engine, drivers and tests use it, so it depends on no other crate of Canter. This crate knows no
//! robot, no message and no period.

mod clock;
mod memory;
mod real_time;
mod turns;

pub use clock::{now_ns, sleep_until_ns, thread_time_ns};
pub use memory::keep_freed_memory;
pub use real_time::{Granted, RealTimeRequest, request_real_time};
pub use turns::Turns;
