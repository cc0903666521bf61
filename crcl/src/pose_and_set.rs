//! A pose with settings that hold on the way to it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::pose::Pose;

/// A pose with settings of its own, in raw numbers of the program: they hold on the way to this pose
/// and nowhere else. What is missing is as the settings in force say.
///
/// ```
/// use crcl::{ReadOptions, text};
/// let source = r#"MoveThroughWaypoints ({
///     {{{400, 0, 300}, {0, 0, -1}, {1, 0, 0}}, {"speed", 50}, {"tolerance", 2}},
///     {{{400, 99, 300}, {0, 0, -1}, {1, 0, 0}}}})"#;
/// assert!(!text::read(source, &ReadOptions::default()).has_errors());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PoseAndSet {
    /// The pose.
    pub pose: Pose,
    /// Speed of the controlled point (length units per second).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
    /// The same as a share of the robot's maximum (percent).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_speed: Option<f64>,
    /// Acceleration of the controlled point (length units per second squared).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acceleration: Option<f64>,
    /// The same as a share of the robot's maximum (percent).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_acceleration: Option<f64>,
    /// Speed of rotation (angle units per second).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rot_speed: Option<f64>,
    /// The same as a share of the robot's maximum (percent).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_rot_speed: Option<f64>,
    /// Acceleration of rotation (angle units per second squared).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rot_accel: Option<f64>,
    /// The same as a share of the robot's maximum (percent).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_rot_accel: Option<f64>,
    /// How near the pose is passed (length units).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// How near its orientation is passed (angle units).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_tolerance: Option<f64>,
}

impl From<Pose> for PoseAndSet {
    fn from(pose: Pose) -> Self {
        Self {
            pose,
            speed: None,
            relative_speed: None,
            acceleration: None,
            relative_acceleration: None,
            rot_speed: None,
            relative_rot_speed: None,
            rot_accel: None,
            relative_rot_accel: None,
            tolerance: None,
            angle_tolerance: None,
        }
    }
}

impl PoseAndSet {
    /// The names of all settings, in the order in which they are written and applied.
    pub(crate) const NAMES: [&'static str; 10] = [
        "speed",
        "relative_speed",
        "acceleration",
        "relative_acceleration",
        "rot_speed",
        "relative_rot_speed",
        "rot_accel",
        "relative_rot_accel",
        "tolerance",
        "angle_tolerance",
    ];

    /// The values of all settings, in the order of their names.
    pub(crate) fn values(&self) -> [Option<f64>; 10] {
        [
            self.speed,
            self.relative_speed,
            self.acceleration,
            self.relative_acceleration,
            self.rot_speed,
            self.relative_rot_speed,
            self.rot_accel,
            self.relative_rot_accel,
            self.tolerance,
            self.angle_tolerance,
        ]
    }

    /// The value of the setting of that name; nothing for another name.
    pub(crate) fn value_mut(&mut self, name: &str) -> Option<&mut Option<f64>> {
        Some(match name {
            "speed" => &mut self.speed,
            "relative_speed" => &mut self.relative_speed,
            "acceleration" => &mut self.acceleration,
            "relative_acceleration" => &mut self.relative_acceleration,
            "rot_speed" => &mut self.rot_speed,
            "relative_rot_speed" => &mut self.relative_rot_speed,
            "rot_accel" => &mut self.rot_accel,
            "relative_rot_accel" => &mut self.relative_rot_accel,
            "tolerance" => &mut self.tolerance,
            "angle_tolerance" => &mut self.angle_tolerance,
            _ => return None,
        })
    }
}
