//! What a controller says about itself, as it is written: raw numbers in the units of the
//! connection.

use super::data::{Guard, JointTolerance, Parameter, PoseTolerance};
use crate::pose::Pose;
use crate::units::{AngleUnit, ForceUnit, LengthUnit, TorqueUnit};

/// How far the last command is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CommandState {
    /// It is executed.
    Done,
    /// It could not be executed.
    Error,
    /// It is under way.
    Working,
    /// No command has come yet.
    #[default]
    Ready,
}

impl CommandState {
    pub(super) const NAMES: &[(&'static str, Self)] = &[
        ("CRCL_Done", Self::Done),
        ("CRCL_Error", Self::Error),
        ("CRCL_Working", Self::Working),
        ("CRCL_Ready", Self::Ready),
    ];
}

/// Where a command comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProgramPlace {
    /// Name of the file.
    pub file: Option<String>,
    /// Number of the command in it; InitCanon is 0.
    pub index: Option<i32>,
    /// How many commands it has.
    pub length: Option<i32>,
}

/// The last command and how far it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CommandStatus {
    /// Its `Name`.
    pub name: Option<String>,
    /// Its `CommandID`.
    pub command: i64,
    /// Counts up with every status that is new.
    pub status: i64,
    /// How far it is.
    pub state: CommandState,
    /// A sentence for a person.
    pub description: Option<String>,
    /// Where the command comes from.
    pub place: ProgramPlace,
    /// Share of the speed (percent).
    pub override_percent: Option<i32>,
}

/// One joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointStatus {
    /// Number of the joint, from 1.
    pub joint: i32,
    /// Position (angle units; length units for a sliding joint).
    pub position: Option<f64>,
    /// Torque or force.
    pub effort: Option<f64>,
    /// Velocity (units per second).
    pub velocity: Option<f64>,
}

/// Where the controlled point is.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseStatus {
    /// The pose, in the frame that commands are given in.
    pub pose: Pose,
    /// Velocity (length units per second) and angular velocity (angle units per second).
    pub twist: Option<([f64; 3], [f64; 3])>,
    /// Force and moment.
    pub wrench: Option<([f64; 3], [f64; 3])>,
    /// The robot's name for the branch that it is in.
    pub configuration: Option<String>,
}

/// What kind of gripper it is, and how it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GripperState {
    /// Two jaws.
    Parallel {
        /// How far they are apart (length units).
        separation: f64,
    },
    /// A sucker.
    Vacuum {
        /// Whether it sucks.
        powered: bool,
    },
    /// Three fingers.
    ThreeFinger {
        /// How far each is open, 0 to 1.
        positions: [Option<f64>; 3],
        /// Force of each.
        forces: [Option<f64>; 3],
    },
}

/// The gripper.
#[derive(Clone, Debug, PartialEq)]
pub struct GripperStatus {
    /// Its name: letters, digits and `.-_:`.
    pub name: String,
    /// Its options.
    pub options: Vec<Parameter>,
    /// Whether it holds something.
    pub holding: Option<bool>,
    /// How it is.
    pub state: GripperState,
}

/// Limits of one joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointLimits {
    /// Number of the joint, from 1.
    pub joint: i32,
    /// Least position.
    pub min_position: Option<f64>,
    /// Largest position.
    pub max_position: Option<f64>,
    /// Largest torque or force.
    pub max_effort: Option<f64>,
    /// Largest velocity.
    pub max_velocity: Option<f64>,
}

/// The settings in force.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SettingsStatus {
    /// Unit of angles.
    pub angle_unit: Option<AngleUnit>,
    /// Parameters of the end effector.
    pub end_effector_parameters: Vec<Parameter>,
    /// The last setting of the end effector, 0 to 1.
    pub end_effector: Option<f64>,
    /// Unit of forces.
    pub force_unit: Option<ForceUnit>,
    /// Limits of the joints.
    pub joint_limits: Vec<JointLimits>,
    /// How near a motion must pass its intermediate poses.
    pub intermediate_tolerance: Option<PoseTolerance>,
    /// Unit of lengths.
    pub length_unit: Option<LengthUnit>,
    /// Largest corner of the working space.
    pub max_cartesian: Option<[f64; 3]>,
    /// Least corner of the working space.
    pub min_cartesian: Option<[f64; 3]>,
    /// Whether translation and rotation end together.
    pub coordinated: Option<bool>,
    /// How near the end of a move must come; before 2020 it was called `PoseTolerance`.
    pub end_tolerance: Option<PoseTolerance>,
    /// Parameters of the robot.
    pub robot_parameters: Vec<Parameter>,
    /// Acceleration of rotation.
    pub rot_accel: Option<f64>,
    /// The same as a share.
    pub rot_accel_share: Option<f64>,
    /// Speed of rotation.
    pub rot_speed: Option<f64>,
    /// The same as a share.
    pub rot_speed_share: Option<f64>,
    /// Unit of torques.
    pub torque_unit: Option<TorqueUnit>,
    /// Acceleration of the controlled point.
    pub trans_accel: Option<f64>,
    /// The same as a share.
    pub trans_accel_share: Option<f64>,
    /// Speed of the controlled point.
    pub trans_speed: Option<f64>,
    /// The same as a share.
    pub trans_speed_share: Option<f64>,
    /// How near joints must come.
    pub joint_tolerances: Vec<JointTolerance>,
}

/// What a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorValue {
    /// On or off.
    OnOff(bool),
    /// A number.
    Scalar(f64),
    /// A count.
    Count(i64),
    /// Fx, Fy, Fz, Tx, Ty, Tz.
    ForceTorque([f64; 6]),
}

/// One sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorStatus {
    /// Its name.
    pub id: String,
    /// How often it was read.
    pub read_count: i32,
    /// When it was read last (ms since 1970).
    pub last_read_ms: i64,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// What it measures.
    pub value: SensorValue,
}

/// The guards.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GuardsStatus {
    /// The guards of the last command.
    pub guards: Vec<Guard>,
    /// How often one has tripped.
    pub trigger_count: i32,
    /// How long the stop took (us).
    pub stop_us: i64,
    /// The value that tripped it.
    pub value: Option<f64>,
    /// Where that was.
    pub pose: Option<Pose>,
}

/// A status document.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// Name of the document.
    pub name: Option<String>,
    /// The last command.
    pub command: CommandStatus,
    /// The joints; empty where they are not reported.
    pub joints: Vec<JointStatus>,
    /// The controlled point.
    pub pose: Option<PoseStatus>,
    /// The gripper.
    pub gripper: Option<GripperStatus>,
    /// The settings.
    pub settings: Option<SettingsStatus>,
    /// The sensors; empty where they are not reported.
    pub sensors: Vec<SensorStatus>,
    /// The guards.
    pub guards: Option<GuardsStatus>,
}
