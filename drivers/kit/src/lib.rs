//! All that a driver does but move the robot: handshake, sessions, checks of setpoints, watchdog,
//! stop, latch, periods by the clock or in lock-step, as `docs/driver-protocol.md` has it.
//!
//! Implement [`Robot`] for your arm and call [`run`]: `examples/template.rs` is a driver in less
//! than 60 lines. [`Driver`] is the protocol without a clock and without a channel: times go in,
//! messages come out, the same every time.
//!
//! A driver owns the watchdog: without a setpoint it goes on for a while as it was going, then
//! stops by itself within acceleration and jerk limits, then latches. Only a new session leads on.
//! What the robot follows never leaves range, speed, acceleration and jerk limits of a joint,
//! whatever comes and whoever stalls; setpoints within them are followed as they are.
//!
//! This crate never plans, and knows no kinematics.

mod driver;
mod error;
mod greeting;
mod limiter;
mod log;
mod process;
mod ramp;
mod reference;
mod robot;

pub use driver::Driver;
pub use error::DriverError;
use limiter::Limiter;
pub use process::{DriverReport, RunOptions, asked_to_end, run};
use ramp::Ramp;
pub use reference::Reference;
pub use robot::{About, Measured, Robot};
