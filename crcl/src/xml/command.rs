//! Every command of CRCL's XML, as it is written: raw numbers in the units of the connection.

use super::data::{Guard, JointTolerance, Parameter, PoseTolerance, Quantity, Waypoint};
use crate::units::{AngleUnit, ForceUnit, LengthUnit, TorqueUnit};

/// A command with what every command of CRCL's XML may carry.
#[derive(Clone, Debug, PartialEq)]
pub struct Instruction {
    /// The element `Name`, if there is one.
    pub name: Option<String>,
    /// The element `CommandID`.
    pub id: i64,
    /// Conditions that end the command before its time.
    pub guards: Vec<Guard>,
    /// What is to be done.
    pub command: XmlCommand,
}

impl Instruction {
    /// The command with its guards in SI units; everything else stays as it is.
    pub fn in_si(&self, force: ForceUnit, torque: TorqueUnit) -> Self {
        let guards = self.guards.iter().map(|guard| guard.in_si(force, torque));
        Self {
            guards: guards.collect(),
            ..self.clone()
        }
    }

    /// A command without name and guards.
    pub fn new(id: i64, command: XmlCommand) -> Self {
        Self {
            name: None,
            id,
            guards: Vec::new(),
            command,
        }
    }
}

/// How StopMotion stops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopCondition {
    /// As fast as possible; the arm may leave its path.
    Immediate,
    /// Fast, on the path.
    Fast,
    /// Gently, on the path.
    Normal,
}

impl StopCondition {
    pub(super) const NAMES: &[(&'static str, Self)] = &[
        ("Immediate", Self::Immediate),
        ("Fast", Self::Fast),
        ("Normal", Self::Normal),
    ];
}

/// What ActuateJoints asks of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuateJoint {
    /// Number of the joint, from 1.
    pub joint: i32,
    /// Where it is to stop (angle units; length units for a sliding joint).
    pub position: f64,
    /// How it gets there.
    pub details: JointDetails,
}

/// How ActuateJoints moves one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointDetails {
    /// With a speed and an acceleration (units per second, per second squared).
    SpeedAccel {
        /// Largest speed.
        speed: Option<f64>,
        /// Largest acceleration.
        accel: Option<f64>,
    },
    /// With a force or torque; no arm of ours does that.
    ForceTorque {
        /// The force or torque.
        setting: Option<f64>,
        /// How fast it changes.
        change_rate: Option<f64>,
    },
}

/// A straight way followed by a turn with an advance in step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveScrew {
    /// Where to go first.
    pub start: Option<Waypoint>,
    /// A point of the axis; the controlled point's own where it is missing (length units).
    pub axis_point: Option<[f64; 3]>,
    /// Straight way before the turn, along the tool's Z axis (length units).
    pub free: Option<f64>,
    /// Advance during the turn, along the tool's Z axis (length units).
    pub advance: f64,
    /// The turn about the Z axis (angle units).
    pub turn: f64,
}

/// What ConfigureJointReports asks of one joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointReport {
    /// Number of the joint, from 1.
    pub joint: i32,
    /// Report its position.
    pub position: bool,
    /// Report its torque or force.
    pub effort: bool,
    /// Report its velocity.
    pub velocity: bool,
}

/// Which parts a status has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StatusParts {
    /// JointStatuses.
    pub joints: bool,
    /// PoseStatus.
    pub pose: bool,
    /// GripperStatus.
    pub gripper: bool,
    /// SettingsStatus.
    pub settings: bool,
    /// SensorStatuses; files from before 2019 do not say.
    pub sensors: bool,
    /// GuardsStatuses; files from before 2019 do not say.
    pub guards: bool,
}

/// A command of CRCL's XML.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum XmlCommand {
    /// Get ready to move.
    InitCanon,
    /// Stop executing commands.
    EndCanon,
    /// Move to a pose and stop.
    MoveTo {
        /// Along a straight line.
        straight: bool,
        /// Where to stop.
        end: Waypoint,
    },
    /// Move near all waypoints but the last and stop at the last.
    MoveThroughTo {
        /// Along straight lines, rounded within the tolerance.
        straight: bool,
        /// The poses, at least two.
        waypoints: Vec<Waypoint>,
    },
    /// Turn and advance in step.
    MoveScrew(MoveScrew),
    /// Move single joints.
    ActuateJoints {
        /// One entry for each joint that moves.
        joints: Vec<ActuateJoint>,
        /// How near the joints must come.
        tolerances: Vec<JointTolerance>,
    },
    /// Stop moving.
    StopMotion(StopCondition),
    /// Stay motionless for a time (s).
    Dwell(f64),
    /// Show a text to the operator.
    Message(String),
    /// Release the end effector.
    OpenToolChanger,
    /// Take hold of an end effector.
    CloseToolChanger,
    /// Set the gripper: 0 is closed, 1 is open.
    SetEndEffector(f64),
    /// Set the speed of the controlled point.
    SetTransSpeed(Quantity),
    /// Set the acceleration of the controlled point.
    SetTransAccel(Quantity),
    /// Set the speed of rotation.
    SetRotSpeed(Quantity),
    /// Set the acceleration of rotation.
    SetRotAccel(Quantity),
    /// Set how near the end of a move must come to its pose.
    SetEndPoseTolerance(PoseTolerance),
    /// Set how near a motion must pass its intermediate poses.
    SetIntermediatePoseTolerance(PoseTolerance),
    /// Let translation and rotation end together.
    SetMotionCoordination(bool),
    /// Set the unit of lengths.
    SetLengthUnits(LengthUnit),
    /// Set the unit of angles.
    SetAngleUnits(AngleUnit),
    /// Set the unit of forces.
    SetForceUnits(ForceUnit),
    /// Set the unit of torques.
    SetTorqueUnits(TorqueUnit),
    /// Set how near joints must come to their positions.
    SetDefaultJointPositonsTolerances(Vec<JointTolerance>),
    /// Choose what a status says of each joint.
    ConfigureJointReports {
        /// Forget what was chosen before.
        reset_all: bool,
        /// What is chosen now.
        reports: Vec<JointReport>,
    },
    /// Choose which parts a status has.
    ConfigureStatusReport(StatusParts),
    /// Ask for a status.
    GetStatus,
    /// Set parameters of the end effector.
    SetEndEffectorParameters(Vec<Parameter>),
    /// Set parameters of the robot.
    SetRobotParameters(Vec<Parameter>),
    /// Run a program in the robot's own language.
    RunProgram(String),
    /// Take a sensor into use.
    EnableSensor {
        /// Which one.
        sensor: String,
        /// Its options.
        options: Vec<Parameter>,
    },
    /// Take a sensor out of use.
    DisableSensor(String),
    /// Report a gripper.
    EnableGripper {
        /// Which one.
        gripper: String,
        /// Its options.
        options: Vec<Parameter>,
    },
    /// Report a gripper no more.
    DisableGripper(String),
    /// Report a parameter of the robot.
    EnableRobotParameterStatus(String),
    /// Report a parameter of the robot no more.
    DisableRobotParameterStatus(String),
    /// Begin a block that is repeated.
    LoopBlockStart(String),
    /// End a block that is repeated.
    LoopBlockEnd {
        /// Name of the block.
        name: String,
        /// How many times it is executed.
        count: i32,
    },
}

/// The names of all commands, without the `Type` that ends them in `xsi:type`.
pub const COMMAND_NAMES: &[&str] = &[
    "InitCanon",
    "EndCanon",
    "MoveTo",
    "MoveThroughTo",
    "MoveScrew",
    "ActuateJoints",
    "StopMotion",
    "Dwell",
    "Message",
    "OpenToolChanger",
    "CloseToolChanger",
    "SetEndEffector",
    "SetTransSpeed",
    "SetTransAccel",
    "SetRotSpeed",
    "SetRotAccel",
    "SetEndPoseTolerance",
    "SetIntermediatePoseTolerance",
    "SetMotionCoordination",
    "SetLengthUnits",
    "SetAngleUnits",
    "SetForceUnits",
    "SetTorqueUnits",
    "SetDefaultJointPositonsTolerances",
    "ConfigureJointReports",
    "ConfigureStatusReport",
    "GetStatus",
    "SetEndEffectorParameters",
    "SetRobotParameters",
    "RunProgram",
    "EnableSensor",
    "DisableSensor",
    "EnableGripper",
    "DisableGripper",
    "EnableRobotParameterStatus",
    "DisableRobotParameterStatus",
    "LoopBlockStart",
    "LoopBlockEnd",
];

impl XmlCommand {
    /// The name of the command; its `xsi:type` is this with `Type` behind.
    pub fn name(&self) -> &'static str {
        match self {
            Self::InitCanon => "InitCanon",
            Self::EndCanon => "EndCanon",
            Self::MoveTo { .. } => "MoveTo",
            Self::MoveThroughTo { .. } => "MoveThroughTo",
            Self::MoveScrew(_) => "MoveScrew",
            Self::ActuateJoints { .. } => "ActuateJoints",
            Self::StopMotion(_) => "StopMotion",
            Self::Dwell(_) => "Dwell",
            Self::Message(_) => "Message",
            Self::OpenToolChanger => "OpenToolChanger",
            Self::CloseToolChanger => "CloseToolChanger",
            Self::SetEndEffector(_) => "SetEndEffector",
            Self::SetTransSpeed(_) => "SetTransSpeed",
            Self::SetTransAccel(_) => "SetTransAccel",
            Self::SetRotSpeed(_) => "SetRotSpeed",
            Self::SetRotAccel(_) => "SetRotAccel",
            Self::SetEndPoseTolerance(_) => "SetEndPoseTolerance",
            Self::SetIntermediatePoseTolerance(_) => "SetIntermediatePoseTolerance",
            Self::SetMotionCoordination(_) => "SetMotionCoordination",
            Self::SetLengthUnits(_) => "SetLengthUnits",
            Self::SetAngleUnits(_) => "SetAngleUnits",
            Self::SetForceUnits(_) => "SetForceUnits",
            Self::SetTorqueUnits(_) => "SetTorqueUnits",
            Self::SetDefaultJointPositonsTolerances(_) => "SetDefaultJointPositonsTolerances",
            Self::ConfigureJointReports { .. } => "ConfigureJointReports",
            Self::ConfigureStatusReport(_) => "ConfigureStatusReport",
            Self::GetStatus => "GetStatus",
            Self::SetEndEffectorParameters(_) => "SetEndEffectorParameters",
            Self::SetRobotParameters(_) => "SetRobotParameters",
            Self::RunProgram(_) => "RunProgram",
            Self::EnableSensor { .. } => "EnableSensor",
            Self::DisableSensor(_) => "DisableSensor",
            Self::EnableGripper { .. } => "EnableGripper",
            Self::DisableGripper(_) => "DisableGripper",
            Self::EnableRobotParameterStatus(_) => "EnableRobotParameterStatus",
            Self::DisableRobotParameterStatus(_) => "DisableRobotParameterStatus",
            Self::LoopBlockStart(_) => "LoopBlockStart",
            Self::LoopBlockEnd { .. } => "LoopBlockEnd",
        }
    }
}
