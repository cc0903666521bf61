//! The driver of arms of Universal Robots (CB3 and e-Series): RTDE brings the robot's states, a
//! program on the robot follows setpoints with `servoj`, the dashboard server switches on, opens the
//! brakes and unlocks protective stops.
//!
//! [`Ur`] is the robot of `driver-kit`. One thread answers the controller: for each state it
//! resamples the references of the engine to the controller's time and sends a setpoint. A second
//! thread gets the robot ready when an engine asks for a session.
//!
//! This crate never plans, and without a session no program of it runs on the robot.

mod control_thread;
mod cycle_thread;
mod dashboard;
mod link;
mod options;
mod primary;
mod program;
mod robot;
mod rtde;
mod snapshot;
mod stream;
mod words;

use std::sync::atomic::AtomicBool;

pub use driver_kit::{About, DriverError, DriverReport, RunOptions};
pub use options::{Delivery, GripperOutput, UrOptions};
pub use program::Program;
pub use robot::Ur;
pub use rtde::Version;

/// Joints of an arm.
pub const JOINTS: usize = 6;

/// Drives an arm of Universal Robots as `arm` until `stop` becomes true.
///
/// # Errors
/// When the options are not consistent, a port is taken, the arm already has a driver, or shared
/// memory cannot be used. A robot that does not answer is no error: the handshake says so.
pub fn run(
    arm: &ipc::Arm,
    options: UrOptions,
    how: &RunOptions,
    stop: &AtomicBool,
) -> Result<DriverReport, DriverError> {
    driver_kit::run(arm, Ur::new(options)?, how, stop)
}
