//! The commands of the language.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::argument::Value;
use crate::guard::Guard;
use crate::joint::JointTarget;
use crate::pose::Pose;
use crate::pose_and_set::PoseAndSet;
use crate::screw::Screw;
use crate::units::{AngleUnit, CoordinateFrame, LengthUnit};

/// One command, in raw numbers of the program.
///
/// Lengths, speeds, accelerations and angles are in the units that apply when the command is
/// executed; nothing here is converted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "command", deny_unknown_fields)]
pub enum Command {
    /// Get ready to move; units go back to their defaults.
    InitCanon,
    /// Stop executing commands.
    EndCanon {
        /// 0 when all went well, above 0 when not.
        #[schemars(range(min = 0))]
        reason: i64,
    },
    /// Show a text to the operator.
    Message {
        /// The text.
        text: String,
    },
    /// Stay motionless.
    Dwell {
        /// For how long (s).
        #[schemars(range(min = 0.0))]
        seconds: f64,
    },
    /// Move along any convenient trajectory and stop.
    MoveTo {
        /// Where to stop.
        pose: Pose,
    },
    /// Move the controlled point along a straight line and stop.
    MoveStraightTo {
        /// Where to stop.
        pose: Pose,
    },
    /// Move smoothly near all poses but the last and stop at the last.
    MoveSmoothlyTo {
        /// The poses, in order.
        #[schemars(length(min = 1))]
        poses: Vec<Pose>,
    },
    /// Extension: the later name of MoveSmoothlyTo.
    MoveThroughTo {
        /// The poses, in order.
        #[schemars(length(min = 1))]
        poses: Vec<Pose>,
    },
    /// Extension: move single joints; the others rest.
    ActuateJoints {
        /// One target for each joint that moves.
        #[schemars(length(min = 1))]
        joints: Vec<JointTarget>,
    },
    /// Extension: MoveSmoothlyTo with settings for single poses.
    MoveThroughWaypoints {
        /// The poses with their settings, in order.
        #[schemars(length(min = 1))]
        waypoints: Vec<PoseAndSet>,
    },
    /// Extension: turn and advance in step.
    MoveScrew {
        /// The screw.
        screw: Screw,
    },
    /// Extension: stop the next command that moves the arm or waits when a sensor trips the guard.
    Guard {
        /// The sensor and its limit.
        guard: Guard,
    },
    /// Open the gripper.
    OpenGripper,
    /// Close the gripper.
    CloseGripper,
    /// Extension: open the gripper to a share of its way.
    SetEndEffector {
        /// The share: 0 is closed, 1 is open.
        #[schemars(range(min = 0.0, max = 1.0))]
        setting: f64,
    },
    /// Extension: release the end effector.
    OpenToolChanger,
    /// Extension: take hold of an end effector.
    CloseToolChanger,
    /// Set the speed of the controlled point.
    SetAbsoluteSpeed {
        /// The speed (length units per second).
        #[schemars(range(min = 0.0))]
        value: f64,
    },
    /// Set the acceleration of the controlled point.
    SetAbsoluteAcceleration {
        /// The acceleration (length units per second squared).
        #[schemars(range(min = 0.0))]
        value: f64,
    },
    /// Set the speed as a share of the robot's maximum.
    SetRelativeSpeed {
        /// The share (percent).
        #[schemars(range(min = 0.0, max = 100.0))]
        percent: f64,
    },
    /// Set the acceleration as a share of the robot's maximum.
    SetRelativeAcceleration {
        /// The share (percent).
        #[schemars(range(min = 0.0, max = 100.0))]
        percent: f64,
    },
    /// Extension: set the speed of rotation, which else has the same share as the speed.
    SetAbsoluteRotSpeed {
        /// The speed (angle units per second).
        #[schemars(range(min = 0.0))]
        value: f64,
    },
    /// Extension: set the acceleration of rotation, which else has the same share as the
    /// acceleration.
    SetAbsoluteRotAccel {
        /// The acceleration (angle units per second squared).
        #[schemars(range(min = 0.0))]
        value: f64,
    },
    /// Extension: set the speed of rotation as a share of the robot's maximum.
    SetRelativeRotSpeed {
        /// The share (percent).
        #[schemars(range(min = 0.0, max = 100.0))]
        percent: f64,
    },
    /// Extension: set the acceleration of rotation as a share of the robot's maximum.
    SetRelativeRotAccel {
        /// The share (percent).
        #[schemars(range(min = 0.0, max = 100.0))]
        percent: f64,
    },
    /// Extension: set how near a smooth motion must come to its intermediate orientations.
    SetIntermediateAngleTolerance {
        /// The angle (angle units).
        #[schemars(range(min = 0.0))]
        tolerance: f64,
    },
    /// Extension: keep speeds, accelerations and tolerances for RestoreSettings.
    SaveSettings,
    /// Extension: go back to what SaveSettings has kept.
    RestoreSettings,
    /// Set the unit that later lengths, speeds, accelerations and tolerances are in.
    SetLengthUnits {
        /// The unit.
        unit: LengthUnit,
    },
    /// Set the unit that later angles are in.
    SetAngleUnits {
        /// The unit.
        unit: AngleUnit,
    },
    /// Set how near the controlled point must stop to the end of a move.
    SetEndPointTolerance {
        /// The distance (length units).
        #[schemars(range(min = 0.0))]
        tolerance: f64,
    },
    /// Set how near the orientation must be to that of the end of a move.
    SetEndAngleTolerance {
        /// The angle (angle units).
        #[schemars(range(min = 0.0))]
        tolerance: f64,
    },
    /// Set how near a smooth motion must pass its intermediate points.
    SetIntermediatePointTolerance {
        /// The distance (length units).
        #[schemars(range(min = 0.0))]
        tolerance: f64,
    },
    /// Extension: stop moving now.
    StopMotion {
        /// 0 for a normal stop, anything else for the fastest.
        emergency: i64,
    },
    /// Extension: set the frame that later poses are in.
    SetCoordinateFrame {
        /// The frame.
        frame: CoordinateFrame,
    },
}

impl Command {
    /// The name of the command, in text and in JSON.
    pub fn name(&self) -> &'static str {
        self.parts().0
    }

    /// The poses of a move, in order; empty for every other command, and for poses with settings.
    pub fn poses(&self) -> &[Pose] {
        match self {
            Self::MoveTo { pose } | Self::MoveStraightTo { pose } => std::slice::from_ref(pose),
            Self::MoveSmoothlyTo { poses } | Self::MoveThroughTo { poses } => poses,
            Self::MoveScrew { screw } => screw.start.as_slice(),
            _ => &[],
        }
    }

    /// The name and the value of the argument: from a command back to the table.
    pub(crate) fn parts(&self) -> (&'static str, Value) {
        match self {
            Self::InitCanon => ("InitCanon", Value::None),
            Self::EndCanon { reason } => ("EndCanon", Value::Integer(*reason)),
            Self::Message { text } => ("Message", Value::Text(text.clone())),
            Self::Dwell { seconds } => ("Dwell", Value::Number(*seconds)),
            Self::MoveTo { pose } => ("MoveTo", Value::Pose(*pose)),
            Self::MoveStraightTo { pose } => ("MoveStraightTo", Value::Pose(*pose)),
            Self::MoveSmoothlyTo { poses } => ("MoveSmoothlyTo", Value::Poses(poses.clone())),
            Self::MoveThroughTo { poses } => ("MoveThroughTo", Value::Poses(poses.clone())),
            Self::ActuateJoints { joints } => ("ActuateJoints", Value::Joints(joints.clone())),
            Self::SetAbsoluteRotSpeed { value } => ("SetAbsoluteRotSpeed", Value::Number(*value)),
            Self::SetAbsoluteRotAccel { value } => ("SetAbsoluteRotAccel", Value::Number(*value)),
            Self::SetRelativeRotSpeed { percent } => {
                ("SetRelativeRotSpeed", Value::Number(*percent))
            }
            Self::SetRelativeRotAccel { percent } => {
                ("SetRelativeRotAccel", Value::Number(*percent))
            }
            Self::SetIntermediateAngleTolerance { tolerance } => {
                ("SetIntermediateAngleTolerance", Value::Number(*tolerance))
            }
            Self::SaveSettings => ("SaveSettings", Value::None),
            Self::RestoreSettings => ("RestoreSettings", Value::None),
            Self::MoveThroughWaypoints { waypoints } => {
                ("MoveThroughWaypoints", Value::Waypoints(waypoints.clone()))
            }
            Self::MoveScrew { screw } => ("MoveScrew", Value::Screw(*screw)),
            Self::Guard { guard } => ("Guard", Value::Guard(guard.clone())),
            Self::OpenGripper => ("OpenGripper", Value::None),
            Self::CloseGripper => ("CloseGripper", Value::None),
            Self::SetEndEffector { setting } => ("SetEndEffector", Value::Number(*setting)),
            Self::OpenToolChanger => ("OpenToolChanger", Value::None),
            Self::CloseToolChanger => ("CloseToolChanger", Value::None),
            Self::SetAbsoluteSpeed { value } => ("SetAbsoluteSpeed", Value::Number(*value)),
            Self::SetAbsoluteAcceleration { value } => {
                ("SetAbsoluteAcceleration", Value::Number(*value))
            }
            Self::SetRelativeSpeed { percent } => ("SetRelativeSpeed", Value::Number(*percent)),
            Self::SetRelativeAcceleration { percent } => {
                ("SetRelativeAcceleration", Value::Number(*percent))
            }
            Self::SetLengthUnits { unit } => ("SetLengthUnits", Value::LengthUnit(*unit)),
            Self::SetAngleUnits { unit } => ("SetAngleUnits", Value::AngleUnit(*unit)),
            Self::SetEndPointTolerance { tolerance } => {
                ("SetEndPointTolerance", Value::Number(*tolerance))
            }
            Self::SetEndAngleTolerance { tolerance } => {
                ("SetEndAngleTolerance", Value::Number(*tolerance))
            }
            Self::SetIntermediatePointTolerance { tolerance } => {
                ("SetIntermediatePointTolerance", Value::Number(*tolerance))
            }
            Self::StopMotion { emergency } => ("StopMotion", Value::Integer(*emergency)),
            Self::SetCoordinateFrame { frame } => ("SetCoordinateFrame", Value::Frame(*frame)),
        }
    }
}
