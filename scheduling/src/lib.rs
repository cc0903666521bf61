//! What a process with deadlines asks of the operating system: the clock of the messages, and
//! real-time scheduling of its threads.
//!
//! Engine, drivers and tests stand on it alike, so it depends on nothing of ours. This crate never
//! knows a robot, a message or a period.

mod clock;
mod real_time;

pub use clock::{now_ns, sleep_until_ns};
pub use real_time::{Granted, RealTimeRequest, request_real_time};
