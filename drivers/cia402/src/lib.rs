//! The driver of arms whose joints are servo drives after CiA 402 on EtherCAT: cyclic synchronous
//! position, one drive a joint.
//!
//! This process is the master of the bus. [`Cia402`] is the robot of `driver-kit`; one thread owns the
//! network interface and exchanges the process data of all drives in each cycle, by the distributed
//! clock where the drives have one. Which drive is which joint, its counts and its gear are in a file
//! ([`read_drives`]).
//!
//! This crate never plans, and no drive is enabled without a session.

mod axes;
mod bring_up;
mod bus_error;
mod bus_thread;
mod drive_state;
mod drives;
mod group;
mod options;
mod process_data;
mod pump;
mod robot;
mod snapshot;
mod socket;

use std::sync::atomic::AtomicBool;

pub use drive_state::{DriveState, control_word};
pub use driver_kit::{About, DriverError, DriverReport, RunOptions};
pub use drives::{Drive, DrivesError, read_drives};
pub use options::{Cia402Options, Clocks};
pub use robot::Cia402;
pub use socket::EtherSocket;

/// Devices on the bus at most; drives and others.
pub const MAX_DEVICES: usize = 16;

/// Drives an arm of CiA 402 drives as `arm` until `stop` becomes true.
///
/// # Errors
/// When the options are not consistent, the arm already has a driver, or shared memory cannot be used.
/// A bus that does not answer is no error: the handshake says so.
pub fn run(
    arm: &ipc::Arm,
    options: Cia402Options,
    how: &RunOptions,
    stop: &AtomicBool,
) -> Result<DriverReport, DriverError> {
    driver_kit::run(arm, Cia402::new(options)?, how, stop)
}
