//! Options of the driver.

use driver_kit::{About, DriverError};

use crate::Drive;

/// Whether the drives' distributed clocks are used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clocks {
    /// Where at least one drive has one.
    Auto,
    /// Not used: the drives follow at the arrival of the process data.
    Off,
}

/// Options of the driver.
#[derive(Clone, Debug, PartialEq)]
pub struct Cia402Options {
    /// The network interface of the bus.
    pub interface: String,
    /// Ranges and limits of the joints; name, clocks and periods are filled in.
    pub about: About,
    /// The drives, one entry per joint.
    pub drives: Vec<Drive>,
    /// Cycle of the bus (s).
    pub cycle: f64,
    /// How far the targets are behind the setpoints of the engine (s).
    pub delay: f64,
    /// Share of the limits that the targets keep.
    pub share: f64,
    /// After this time without process data a drive leaves operation by itself (s).
    pub watchdog: f64,
    /// Distributed clocks.
    pub clocks: Clocks,
    /// `SCHED_FIFO` priority of the thread that owns the bus; 0 does not ask.
    pub priority: i32,
}

impl Cia402Options {
    /// The usual choice: 1 ms, four cycles of delay, a watchdog of 20 cycles.
    pub fn new(interface: &str, about: About, drives: Vec<Drive>) -> Self {
        Self {
            interface: interface.to_owned(),
            about,
            drives,
            cycle: 0.001,
            delay: 0.004,
            share: 0.97,
            watchdog: 0.02,
            clocks: Clocks::Auto,
            priority: 80,
        }
    }

    /// Whether the numbers fit together.
    ///
    /// # Errors
    /// [`DriverError`] with the option's name.
    pub(crate) fn check(&self) -> Result<(), DriverError> {
        let within = DriverError::check_range;
        within("cycle", self.cycle, [0.00025, 0.02], "0.25 to 20 ms")?;
        let twice = [2.0 * self.cycle, 6.5];
        within("watchdog", self.watchdog, twice, "two cycles to 6.5 s")?;
        DriverError::check_value("delay", self.delay, true)?;
        DriverError::check_value("share", self.share, true)?;
        let (found, joints) = (self.drives.len(), self.about.joints());
        if found == joints {
            return Ok(());
        }
        Err(DriverError::Count {
            option: "drives",
            found,
            joints,
        })
    }
}
