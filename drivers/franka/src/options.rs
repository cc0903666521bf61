//! Options of the driver, with the maker's defaults.

use driver_kit::About;

/// Thresholds of the arm's collision detection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// Torque at each joint from which the arm stops (N m).
    pub torque: [f64; 7],
    /// Force (N) and torque (N m) at the flange from which the arm stops.
    pub force: [f64; 6],
}

impl Default for Collision {
    /// The values of the maker's examples.
    fn default() -> Self {
        Self {
            torque: [20.0, 20.0, 18.0, 18.0, 16.0, 14.0, 12.0],
            force: [20.0, 20.0, 20.0, 25.0, 25.0, 25.0],
        }
    }
}

/// How the Franka Hand opens and closes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripperOptions {
    /// Speed of the fingers where an order has none (m/s).
    pub speed: f64,
    /// Force of a close where an order has none (N).
    pub force: f64,
}

impl Default for GripperOptions {
    fn default() -> Self {
        Self {
            speed: 0.1,
            force: 20.0,
        }
    }
}

/// Options of the driver.
#[derive(Clone, Debug, PartialEq)]
pub struct FrankaOptions {
    /// Address of the arm's control box: host or host:port.
    pub address: String,
    /// Ranges and the maker's limits of the joints; name, clocks and periods are filled in.
    pub about: About,
    /// How far the arm is behind the setpoints (s).
    pub delay: f64,
    /// Share of the maker's limits that the commands keep; the controller's own check is sharp.
    pub share: f64,
    /// Thresholds of the collision detection; `None` leaves those of the controller.
    pub collision: Option<Collision>,
    /// Joint impedance of the internal controller (N m/rad); `None` leaves that of the controller.
    pub impedance: Option<[f64; 7]>,
    /// The gripper; `None` has no gripper.
    pub gripper: Option<GripperOptions>,
    /// `SCHED_FIFO` priority of the thread that owns the arm; 0 does not ask.
    pub priority: i32,
}

impl FrankaOptions {
    /// The usual choice for an arm at `address`, with a gripper.
    pub fn new(address: &str, about: About) -> Self {
        Self {
            address: address.to_owned(),
            about,
            delay: 0.004,
            share: 0.9,
            collision: Some(Collision::default()),
            impedance: None,
            gripper: Some(GripperOptions::default()),
            priority: 80,
        }
    }
}
