//! Everything a driver needs except the robot itself: handshake, sessions, checks of setpoints,
//! watchdog, stop, latch, periods by the clock or in lock-step, as in `docs/driver-protocol.md`.
//!
//! Implement [`Robot`] for your arm and call [`run`]: `examples/template.rs` is a driver in less
//! than 60 lines. [`Driver`] is the protocol without a clock and without a channel: it gets times
//! and messages and returns messages, and is deterministic.
//!
//! The driver has the watchdog: without setpoints it continues the motion for a while, then stops
//! within acceleration and jerk limits, then latches. Only a new session clears the latch. The
//! reference that the robot follows always keeps range, speed, acceleration and jerk limits of each
//! joint, whatever is received and whichever process stalls; setpoints within the limits are
//! followed as they are.
//!
//! This crate never plans, and knows no kinematics.

mod address;
mod command;
mod driver;
mod end_speeds;
mod error;
mod greeting;
mod limiter;
mod log;
mod measured;
mod own_thread;
mod process;
mod ramp;
mod reference;
mod references;
mod report;
mod resampler;
mod robot;

pub use address::host;
pub use command::{Command, TimedReferences};
pub use driver::Driver;
pub use end_speeds::EndSpeeds;
use end_speeds::NearEnds;
pub use error::DriverError;
use limiter::Limiter;
pub use measured::{Inputs, Measured, Measurement, Outputs, RobotFault, Sensors};
pub use own_thread::{OwnThread, pause};
pub use process::{DriverReport, RunOptions, asked_to_end, run};
use ramp::Ramp;
pub use reference::Reference;
pub use resampler::{Resampler, ResamplerOptions, speed_share};
pub use robot::{About, Readiness, Robot};
