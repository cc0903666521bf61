//! The driver of KUKA arms over the Robot Sensor Interface (RSI): XML by UDP, every 4 or 12 ms.
//!
//! The controller asks and this driver answers: in each cycle it gets the joint angles and must
//! return the corrections of all joints before the next cycle, with the controller's own time stamp
//! (IPOC). [`Kuka`] is the robot of `driver-kit`; one thread owns the socket.
//!
//! This crate never plans, and without a session its corrections do not change.

mod options;
mod robot;
mod socket_thread;
mod telegram;

use std::sync::atomic::AtomicBool;

pub use driver_kit::{About, DriverError, DriverReport, RunOptions};
pub use options::KukaOptions;
pub use robot::Kuka;
pub use telegram::{Telegram, answer, read};

/// Joints of an arm.
pub const JOINTS: usize = 6;

/// Drives a KUKA arm as `arm` until `stop` becomes true.
///
/// # Errors
/// When the options are not consistent, the port is taken, the arm already has a driver, or shared
/// memory cannot be used. A controller that is silent is no error: the handshake says so.
pub fn run(
    arm: &ipc::Arm,
    options: KukaOptions,
    how: &RunOptions,
    stop: &AtomicBool,
) -> Result<DriverReport, DriverError> {
    driver_kit::run(arm, Kuka::new(options)?, how, stop)
}
