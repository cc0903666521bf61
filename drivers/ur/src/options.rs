//! Options of the driver, with the maker's defaults.

use driver_kit::{About, DriverError};

/// How the program gets onto the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// The driver sends it; an e-Series robot must be in remote control.
    Send,
    /// The operator starts a program on the pendant whose node asks this machine for it (the URCap
    /// External Control), on this port.
    Pendant {
        /// The port that the node asks.
        port: u16,
    },
}

/// A gripper at a digital output: on is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripperOutput {
    /// 0 to 7 are the standard outputs, 8 to 15 the configurable ones, 16 and 17 those of the tool.
    pub output: u32,
    /// How long it takes to open and to close (s).
    pub time: f64,
}

/// Options of the driver.
#[derive(Clone, Debug, PartialEq)]
pub struct UrOptions {
    /// Address of the controller.
    pub address: String,
    /// Ranges and limits of the joints; name, clocks and periods are filled in.
    pub about: About,
    /// How many states a second are asked for; `None` is what the series offers: 125 or 500.
    pub rate: Option<f64>,
    /// How far the setpoints that are sent are behind those of the engine (s).
    pub delay: f64,
    /// `lookahead_time` of `servoj` (s).
    pub lookahead: f64,
    /// `gain` of `servoj`.
    pub gain: f64,
    /// After this time without a setpoint the program on the robot stops the arm and ends (s).
    pub timeout: f64,
    /// How the program gets onto the robot.
    pub delivery: Delivery,
    /// Address of this machine as the robot sees it; `None` is that of the connection.
    pub host: Option<String>,
    /// Port on which this machine waits for the program; 0 is any free one.
    pub port: u16,
    /// The gripper; `None` has none.
    pub gripper: Option<GripperOutput>,
    /// `SCHED_FIFO` priority of the thread that answers the controller; 0 does not ask.
    pub priority: i32,
}

impl UrOptions {
    /// The usual choice for a robot at `address`: `servoj` as the maker's own driver calls it.
    pub fn new(address: &str, about: About) -> Self {
        Self {
            address: address.to_owned(),
            about,
            rate: None,
            delay: 0.006,
            lookahead: 0.03,
            gain: 2000.0,
            timeout: 0.1,
            delivery: Delivery::Send,
            host: None,
            port: 50001,
            gripper: None,
            priority: 80,
        }
    }

    /// Whether the numbers are those that the controller takes.
    ///
    /// # Errors
    /// [`DriverError::Value`] with the option's name.
    pub(crate) fn check(&self) -> Result<(), DriverError> {
        let within = DriverError::check_range;
        within("lookahead", self.lookahead, [0.03, 0.2], "0.03 to 0.2 s")?;
        within("gain", self.gain, [100.0, 2000.0], "100 to 2000")?;
        within("timeout", self.timeout, [0.02, 0.5], "0.02 to 0.5 s")?;
        within(
            "rate",
            self.rate.unwrap_or(500.0),
            [50.0, 500.0],
            "50 to 500 Hz",
        )?;
        if let Some(gripper) = self.gripper {
            let number = f64::from(gripper.output);
            within("gripper output", number, [0.0, 17.0], "0 to 17")?;
            within("gripper time", gripper.time, [0.0, 60.0], "0 to 60 s")?;
        }
        DriverError::check_value("delay", self.delay, true)
    }
}
