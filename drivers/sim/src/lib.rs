//! The built-in simulated servo driver: a process of its own that stands where a robot's driver
//! stands.
//!
//! [`Driver`] is the protocol and the servos, without a clock and without a channel: times go in,
//! messages come out, the same every time. [`run`] puts it between shared memory and a clock.
//!
//! A driver owns the watchdog: without a setpoint it goes on for a while as it was going, then
//! stops by itself within acceleration and jerk limits, then latches. Only a new session leads on.
//!
//! This crate never plans, and knows no kinematics.

mod driver;
mod error;
mod log;
mod noise;
mod options;
mod process;
mod reference;
mod servo;
mod tool;

pub use driver::Driver;
pub use error::SimError;
pub use options::{Options, ToolOptions};
pub use process::{Report, run};
