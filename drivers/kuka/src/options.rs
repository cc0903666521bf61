//! Options of the driver.

use driver_kit::About;

/// Options of the driver.
#[derive(Clone, Debug, PartialEq)]
pub struct KukaOptions {
    /// Address and port that the controller sends to.
    pub listen: String,
    /// Ranges and the maker's limits of the joints; name, clocks and periods are filled in.
    pub about: About,
    /// Length of the controller's cycle (s): 0.004 or 0.012.
    pub cycle: f64,
    /// How far the arm is behind the setpoints (s).
    pub delay: f64,
    /// Share of the maker's limits that the commands keep.
    pub share: f64,
    /// `SCHED_FIFO` priority of the thread that owns the socket; 0 does not ask.
    pub priority: i32,
}

impl KukaOptions {
    /// The usual choice: 4 ms, two cycles of delay.
    pub fn new(listen: &str, about: About) -> Self {
        Self {
            listen: listen.to_owned(),
            about,
            cycle: 0.004,
            delay: 0.008,
            share: 0.97,
            priority: 80,
        }
    }
}
