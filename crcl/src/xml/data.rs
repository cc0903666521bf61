//! The data that commands and status documents share.

use crate::guard::GuardLimit;
use crate::pose::Pose;

/// A pose with the settings that hold on the way to it, if it has any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// The pose.
    pub pose: Pose,
    /// The settings of a `PoseAndSet`.
    pub settings: Option<PoseSettings>,
}

impl From<Pose> for Waypoint {
    fn from(pose: Pose) -> Self {
        Self {
            pose,
            settings: None,
        }
    }
}

/// The settings that a pose brings with it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseSettings {
    /// Let translation and rotation end together.
    pub coordinated: bool,
    /// Speed of the controlled point.
    pub trans_speed: Option<Quantity>,
    /// Speed of rotation.
    pub rot_speed: Option<Quantity>,
    /// Acceleration of the controlled point.
    pub trans_accel: Option<Quantity>,
    /// Acceleration of rotation.
    pub rot_accel: Option<Quantity>,
    /// How near the pose must come.
    pub tolerance: Option<PoseTolerance>,
}

/// A speed or an acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// In length or angle units per second, or per second squared.
    Absolute(f64),
    /// A share of the robot's largest, 0 to 1.
    Relative(f64),
}

/// How near to a pose something must come; what is missing is free. All hold at the same instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseTolerance {
    /// Along the X axis of the workstation (length units).
    pub x: Option<f64>,
    /// Along the Y axis of the workstation (length units).
    pub y: Option<f64>,
    /// Along the Z axis of the workstation (length units).
    pub z: Option<f64>,
    /// Between the X axes (angle units).
    pub x_axis: Option<f64>,
    /// Between the Z axes (angle units).
    pub z_axis: Option<f64>,
}

impl PoseTolerance {
    /// The radius of the largest ball inside the box, if the box has a side (length units).
    pub fn ball(&self) -> Option<f64> {
        smallest(&[self.x, self.y, self.z])
    }

    /// The smaller of the two angles, if there is one (angle units).
    pub fn angle(&self) -> Option<f64> {
        smallest(&[self.x_axis, self.z_axis])
    }
}

fn smallest(values: &[Option<f64>]) -> Option<f64> {
    values.iter().copied().flatten().reduce(f64::min)
}

/// How near one joint must come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointTolerance {
    /// Number of the joint, from 1.
    pub joint: i32,
    /// The tolerance (angle or length units).
    pub tolerance: f64,
}

/// A name and a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// The name.
    pub name: String,
    /// The value.
    pub value: String,
}

/// A condition on a sensor that ends a command before its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Guard {
    /// Name of the guard itself.
    pub name: Option<String>,
    /// The sensor.
    pub sensor: String,
    /// Which of its values, such as `Fz`.
    pub field: Option<String>,
    /// What trips it.
    pub kind: GuardLimit,
    /// The limit, in units of the sensor.
    pub limit: f64,
    /// How often to look (us).
    pub recheck_us: Option<i64>,
    /// How often it was looked at.
    pub check_count: Option<i64>,
    /// When it was looked at last (ms since 1970).
    pub last_check_ms: Option<i64>,
    /// What was seen then.
    pub last_check_value: Option<f64>,
    /// Whether the command fails when the guard does not trip.
    pub require_trigger: Option<bool>,
    /// Whether the command fails when the guard trips.
    pub error_on_trigger: Option<bool>,
}

impl Guard {
    /// A guard without name, times and flags.
    pub fn new(sensor: &str, field: Option<&str>, kind: GuardLimit, limit: f64) -> Self {
        Self {
            name: None,
            sensor: sensor.to_owned(),
            field: field.map(str::to_owned),
            kind,
            limit,
            recheck_us: None,
            check_count: None,
            last_check_ms: None,
            last_check_value: None,
            require_trigger: None,
            error_on_trigger: None,
        }
    }
}
