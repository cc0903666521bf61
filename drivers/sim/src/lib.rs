//! The built-in driver with simulated servos: a separate process in place of a robot's driver.
//!
//! [`Simulated`] is the robot. [`driver`] combines it with the protocol, without a clock and
//! without a channel; [`run`] runs it with shared memory and a clock. `driver-kit` implements the
//! protocol, as in any other driver.
//!
//! This crate never plans, and knows no kinematics: who puts a [`Wall`] into the simulation says
//! where the tool is.

mod noise;
mod options;
mod robot;
mod servo;
mod tool;
mod wall;

use std::sync::atomic::AtomicBool;

use driver_kit::RunOptions;
pub use driver_kit::{DriverError, DriverReport, asked_to_end};
pub use options::{Options, ToolOptions};
pub use robot::Simulated;
pub use wall::{Places, Wall};

/// A simulated robot with the driver's side of the protocol.
pub type Driver = driver_kit::Driver<Simulated>;

/// A simulated robot with the protocol; the caller gives the times.
///
/// # Errors
/// When the options do not fit together.
pub fn driver(options: Options) -> Result<Driver, DriverError> {
    Driver::new(Simulated::new(options)?)
}

/// Runs the simulated driver until `stop` becomes true.
///
/// # Errors
/// When the options are not consistent, the arm already has a driver, or shared memory cannot be
/// used.
pub fn run(options: Options, stop: &AtomicBool) -> Result<DriverReport, DriverError> {
    let how = RunOptions {
        log: options.log.clone(),
        real_time: options.real_time,
    };
    let arm = options.arm.clone();
    driver_kit::run(&arm, Simulated::new(options)?, &how, stop)
}
