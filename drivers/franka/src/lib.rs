//! The driver of Franka arms: FR3 (FCI version 10) and Panda (version 5), in joint position control
//! at 1 kHz, with the Franka Hand.
//!
//! [`Franka`] is the robot of `driver-kit`. One thread owns the arm's controller: it reads its
//! states, resamples the references of the engine to the controller's own time, keeps the maker's
//! limits, and recovers from errors when an engine asks for a session. Two more threads own the
//! gripper, whose commands block.
//!
//! This crate never plans, and moves nothing without a session.

mod arm_thread;
mod arrivals;
mod gripper;
mod options;
mod robot;
mod snapshot;
mod taken;

use std::sync::atomic::AtomicBool;

pub use arrivals::{Arrivals, Sockets};
pub use driver_kit::{About, DriverError, DriverReport, EndSpeeds, RunOptions, host};
pub use options::{Collision, FrankaOptions, GripperOptions};
pub use robot::Franka;
pub use taken::Taken;

/// Joints of an arm.
pub const JOINTS: usize = 7;

/// Drives a Franka arm as `arm` until `stop` becomes true.
///
/// # Errors
/// When the options are not consistent, the arm already has a driver, or shared memory cannot be
/// used. An arm that does not answer is no error: the handshake says so.
pub fn run(
    arm: &ipc::Arm,
    options: FrankaOptions,
    how: &RunOptions,
    stop: &AtomicBool,
) -> Result<DriverReport, DriverError> {
    driver_kit::run(arm, Franka::new(options)?, how, stop)
}
