//! The commands of the language and the one table that parser, writers and documents derive from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::joint::JointTarget;
use crate::pose::Pose;
use crate::units::{AngleUnit, CoordinateFrame, LengthUnit};
use crate::value::{self, ValueError};

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
    /// Open the gripper.
    OpenGripper,
    /// Close the gripper.
    CloseGripper,
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

/// The longest time that a command accepts, s: eleven days.
pub const LONGEST_S: f64 = 1e6;

/// The kind of an argument, which decides its type, its range and how it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ArgumentKind {
    /// A whole number not below zero: why the program ends.
    Reason,
    /// A whole number: zero or not.
    Flag,
    /// A text in double quotes.
    Text,
    /// A time (s), not negative, at most [`LONGEST_S`].
    Seconds,
    /// Length units per second, not negative.
    Speed,
    /// Length units per second squared, not negative.
    Acceleration,
    /// Angle units per second, not negative.
    AngularSpeed,
    /// Angle units per second squared, not negative.
    AngularAcceleration,
    /// A percentage from 0 to 100.
    Percent,
    /// Length units, not negative.
    LengthTolerance,
    /// Angle units, not negative.
    AngleTolerance,
    /// The name of a length unit in double quotes.
    LengthUnit,
    /// The name of an angle unit in double quotes.
    AngleUnit,
    /// The name of a coordinate frame in double quotes.
    Frame,
    /// One pose.
    Pose,
    /// A list of poses; in text followed by their number.
    Poses,
    /// A list of joints with their targets.
    Joints,
}

impl ArgumentKind {
    /// What the argument is called in messages.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Reason => "a reason",
            Self::Flag => "an emergency flag",
            Self::Text => "a message",
            Self::Seconds => "a time",
            Self::Speed => "a speed",
            Self::Acceleration => "an acceleration",
            Self::AngularSpeed => "a speed of rotation",
            Self::AngularAcceleration => "an acceleration of rotation",
            Self::Percent => "a percentage",
            Self::LengthTolerance | Self::AngleTolerance => "a tolerance",
            Self::LengthUnit => "a length unit",
            Self::AngleUnit => "an angle unit",
            Self::Frame => "a coordinate frame",
            Self::Pose => "a pose",
            Self::Poses => "a list of poses",
            Self::Joints => "a list of joints",
        }
    }

    /// An argument of this kind as it is written in text, for help texts.
    pub fn sample(self) -> &'static str {
        match self {
            Self::Reason | Self::Flag => "0",
            Self::Text => "\"text\"",
            Self::Seconds => "0.5",
            Self::Speed | Self::Acceleration => "250",
            Self::Percent | Self::AngularSpeed | Self::AngularAcceleration => "50",
            Self::LengthTolerance | Self::AngleTolerance => "2",
            Self::LengthUnit => "\"mm\"",
            Self::AngleUnit => "\"degree\"",
            Self::Frame => "\"Workstation\"",
            Self::Pose => "{{400, 0, 300}, {0, 0, -1}, {1, 0, 0}}",
            Self::Poses => "{{{400, 0, 300}, {0, 0, -1}, {1, 0, 0}}}, 1",
            Self::Joints => "{{1, 90}, {3, -45, 30}}",
        }
    }

    /// Whether a number of this kind is in range.
    pub(crate) fn check(self, number: f64) -> Result<f64, ValueError> {
        match self {
            Self::Percent => value::percent(self.noun(), number),
            Self::Flag => value::finite(self.noun(), number),
            Self::Seconds => {
                let seconds = value::not_negative(self.noun(), number)?;
                value::within(self.noun(), seconds, LONGEST_S)
            }
            _ => value::not_negative(self.noun(), number),
        }
    }
}

/// The argument of a command: its name in JSON and what it means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Argument {
    /// Name of the field in JSON.
    pub name: &'static str,
    /// What it means.
    pub kind: ArgumentKind,
}

/// Whether a command is of the standard language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// One of the 18 commands of the specification of 2012.
    Standard,
    /// Added later; refused in strict mode.
    Extension {
        /// The standard command that does the same, if there is one.
        instead: Option<&'static str>,
    },
}

/// One row of the table of commands.
#[derive(Debug)]
pub struct CommandInfo {
    /// The name, in text and in JSON.
    pub name: &'static str,
    /// The argument. No command has more than one (a list and its number count as one).
    pub argument: Option<Argument>,
    /// Standard or extension.
    pub standing: Standing,
    build: fn(Value) -> Option<Command>,
}

impl CommandInfo {
    /// The row of that name, if there is such a command.
    ///
    /// ```
    /// let dwell = crcl::CommandInfo::find("Dwell").unwrap();
    /// assert_eq!(dwell.argument.unwrap().name, "seconds");
    /// ```
    pub fn find(name: &str) -> Option<&'static Self> {
        COMMANDS.iter().find(|info| info.name == name)
    }

    /// The command with that value; nothing when the value is of another type.
    pub(crate) fn build(&self, value: Value) -> Option<Command> {
        (self.build)(value)
    }

    /// How the command looks in text, for help texts.
    pub fn sample(&self) -> String {
        format!(
            "{} ({})",
            self.name,
            self.argument.map_or("", |argument| argument.kind.sample())
        )
    }
}

/// The value of a command's argument.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    None,
    Integer(i64),
    Number(f64),
    Text(String),
    LengthUnit(LengthUnit),
    AngleUnit(AngleUnit),
    Frame(CoordinateFrame),
    Pose(Pose),
    Poses(Vec<Pose>),
    Joints(Vec<JointTarget>),
}

impl Value {
    fn none(self) -> Option<()> {
        matches!(self, Self::None).then_some(())
    }
    fn integer(self) -> Option<i64> {
        if let Self::Integer(integer) = self {
            Some(integer)
        } else {
            None
        }
    }
    fn number(self) -> Option<f64> {
        if let Self::Number(number) = self {
            Some(number)
        } else {
            None
        }
    }
    fn text(self) -> Option<String> {
        if let Self::Text(text) = self {
            Some(text)
        } else {
            None
        }
    }
    fn length_unit(self) -> Option<LengthUnit> {
        if let Self::LengthUnit(unit) = self {
            Some(unit)
        } else {
            None
        }
    }
    fn angle_unit(self) -> Option<AngleUnit> {
        if let Self::AngleUnit(unit) = self {
            Some(unit)
        } else {
            None
        }
    }
    fn frame(self) -> Option<CoordinateFrame> {
        if let Self::Frame(frame) = self {
            Some(frame)
        } else {
            None
        }
    }
    fn pose(self) -> Option<Pose> {
        if let Self::Pose(pose) = self {
            Some(pose)
        } else {
            None
        }
    }
    fn joints(self) -> Option<Vec<JointTarget>> {
        if let Self::Joints(joints) = self {
            Some(joints)
        } else {
            None
        }
    }
    fn poses(self) -> Option<Vec<Pose>> {
        if let Self::Poses(poses) = self {
            Some(poses)
        } else {
            None
        }
    }
}

const fn plain(name: &'static str, build: fn(Value) -> Option<Command>) -> CommandInfo {
    CommandInfo {
        name,
        argument: None,
        standing: Standing::Standard,
        build,
    }
}

const fn with(
    name: &'static str,
    argument: &'static str,
    kind: ArgumentKind,
    build: fn(Value) -> Option<Command>,
) -> CommandInfo {
    let argument = Some(Argument {
        name: argument,
        kind,
    });
    CommandInfo {
        name,
        argument,
        standing: Standing::Standard,
        build,
    }
}

const fn extension(info: CommandInfo, instead: Option<&'static str>) -> CommandInfo {
    CommandInfo {
        standing: Standing::Extension { instead },
        ..info
    }
}

/// All commands: the 18 of the specification in its order of use, then the extensions.
pub static COMMANDS: &[CommandInfo] = {
    use ArgumentKind as Kind;
    use Command as C;
    &[
        plain("InitCanon", |v| v.none().map(|()| C::InitCanon)),
        with("EndCanon", "reason", Kind::Reason, |v| {
            v.integer().map(|reason| C::EndCanon { reason })
        }),
        with("Message", "text", Kind::Text, |v| {
            v.text().map(|text| C::Message { text })
        }),
        with("Dwell", "seconds", Kind::Seconds, |v| {
            v.number().map(|seconds| C::Dwell { seconds })
        }),
        with("MoveTo", "pose", Kind::Pose, |v| {
            v.pose().map(|pose| C::MoveTo { pose })
        }),
        with("MoveStraightTo", "pose", Kind::Pose, |v| {
            v.pose().map(|pose| C::MoveStraightTo { pose })
        }),
        with("MoveSmoothlyTo", "poses", Kind::Poses, |v| {
            v.poses().map(|poses| C::MoveSmoothlyTo { poses })
        }),
        plain("OpenGripper", |v| v.none().map(|()| C::OpenGripper)),
        plain("CloseGripper", |v| v.none().map(|()| C::CloseGripper)),
        with("SetAbsoluteSpeed", "value", Kind::Speed, |v| {
            v.number().map(|value| C::SetAbsoluteSpeed { value })
        }),
        with(
            "SetAbsoluteAcceleration",
            "value",
            Kind::Acceleration,
            |v| v.number().map(|value| C::SetAbsoluteAcceleration { value }),
        ),
        with("SetRelativeSpeed", "percent", Kind::Percent, |v| {
            v.number().map(|percent| C::SetRelativeSpeed { percent })
        }),
        with("SetRelativeAcceleration", "percent", Kind::Percent, |v| {
            v.number()
                .map(|percent| C::SetRelativeAcceleration { percent })
        }),
        with("SetLengthUnits", "unit", Kind::LengthUnit, |v| {
            v.length_unit().map(|unit| C::SetLengthUnits { unit })
        }),
        with("SetAngleUnits", "unit", Kind::AngleUnit, |v| {
            v.angle_unit().map(|unit| C::SetAngleUnits { unit })
        }),
        with(
            "SetEndPointTolerance",
            "tolerance",
            Kind::LengthTolerance,
            |v| {
                v.number()
                    .map(|tolerance| C::SetEndPointTolerance { tolerance })
            },
        ),
        with(
            "SetEndAngleTolerance",
            "tolerance",
            Kind::AngleTolerance,
            |v| {
                v.number()
                    .map(|tolerance| C::SetEndAngleTolerance { tolerance })
            },
        ),
        with(
            "SetIntermediatePointTolerance",
            "tolerance",
            Kind::LengthTolerance,
            |v| {
                v.number()
                    .map(|tolerance| C::SetIntermediatePointTolerance { tolerance })
            },
        ),
        extension(
            with("MoveThroughTo", "poses", Kind::Poses, |v| {
                v.poses().map(|poses| C::MoveThroughTo { poses })
            }),
            Some("MoveSmoothlyTo"),
        ),
        extension(
            with("ActuateJoints", "joints", Kind::Joints, |v| {
                v.joints().map(|joints| C::ActuateJoints { joints })
            }),
            None,
        ),
        extension(
            with("SetAbsoluteRotSpeed", "value", Kind::AngularSpeed, |v| {
                v.number().map(|value| C::SetAbsoluteRotSpeed { value })
            }),
            None,
        ),
        extension(
            with(
                "SetAbsoluteRotAccel",
                "value",
                Kind::AngularAcceleration,
                |v| v.number().map(|value| C::SetAbsoluteRotAccel { value }),
            ),
            None,
        ),
        extension(
            with("SetRelativeRotSpeed", "percent", Kind::Percent, |v| {
                v.number().map(|percent| C::SetRelativeRotSpeed { percent })
            }),
            None,
        ),
        extension(
            with("SetRelativeRotAccel", "percent", Kind::Percent, |v| {
                v.number().map(|percent| C::SetRelativeRotAccel { percent })
            }),
            None,
        ),
        extension(
            with(
                "SetIntermediateAngleTolerance",
                "tolerance",
                Kind::AngleTolerance,
                |v| {
                    v.number()
                        .map(|tolerance| C::SetIntermediateAngleTolerance { tolerance })
                },
            ),
            None,
        ),
        extension(
            plain("SaveSettings", |v| v.none().map(|()| C::SaveSettings)),
            None,
        ),
        extension(
            plain("RestoreSettings", |v| v.none().map(|()| C::RestoreSettings)),
            None,
        ),
        extension(
            plain("OpenToolChanger", |v| v.none().map(|()| C::OpenToolChanger)),
            None,
        ),
        extension(
            plain("CloseToolChanger", |v| {
                v.none().map(|()| C::CloseToolChanger)
            }),
            None,
        ),
        extension(
            with("StopMotion", "emergency", Kind::Flag, |v| {
                v.integer().map(|emergency| C::StopMotion { emergency })
            }),
            None,
        ),
        extension(
            with("SetCoordinateFrame", "frame", Kind::Frame, |v| {
                v.frame().map(|frame| C::SetCoordinateFrame { frame })
            }),
            None,
        ),
    ]
};

impl Command {
    /// The name of the command, in text and in JSON.
    pub fn name(&self) -> &'static str {
        self.parts().0
    }

    /// The row of the table that describes the command.
    pub fn info(&self) -> Option<&'static CommandInfo> {
        CommandInfo::find(self.name())
    }

    /// The poses of a move, in order; empty for every other command.
    pub fn poses(&self) -> &[Pose] {
        match self {
            Self::MoveTo { pose } | Self::MoveStraightTo { pose } => std::slice::from_ref(pose),
            Self::MoveSmoothlyTo { poses } | Self::MoveThroughTo { poses } => poses,
            _ => &[],
        }
    }

    /// Whether the command moves the controlled point.
    pub fn is_move(&self) -> bool {
        let moves = [
            ArgumentKind::Pose,
            ArgumentKind::Poses,
            ArgumentKind::Joints,
        ];
        self.info()
            .and_then(|info| info.argument)
            .is_some_and(|a| moves.contains(&a.kind))
    }

    /// Checks every value of the command that can be checked without settings and robot, by the
    /// rules of the parser: for commands that were made in memory or received.
    ///
    /// # Errors
    /// The first value that is out of range.
    ///
    /// ```
    /// use crcl::{Command, ValueError};
    /// assert!(Command::Dwell { seconds: 0.0 }.check().is_ok());
    /// assert!(matches!(Command::Dwell { seconds: -1.0 }.check(), Err(ValueError::Negative { .. })));
    /// ```
    pub fn check(&self) -> Result<(), ValueError> {
        let kind = self
            .info()
            .and_then(|info| info.argument)
            .map(|argument| argument.kind);
        match (kind, self.parts().1) {
            (Some(kind), Value::Number(number)) => kind.check(number).map(drop),
            (Some(ArgumentKind::Reason), Value::Integer(reason)) => {
                value::not_negative(ArgumentKind::Reason.noun(), reason as f64).map(drop)
            }
            (Some(ArgumentKind::Joints), Value::Joints(joints)) => value::check_targets(&joints),
            (Some(ArgumentKind::Poses), Value::Poses(poses)) if poses.is_empty() => {
                Err(ValueError::NoPoses)
            }
            _ => match self
                .poses()
                .iter()
                .find_map(|pose| pose.faults().into_iter().next())
            {
                Some((_, error)) => Err(error),
                None => Ok(()),
            },
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
            Self::OpenGripper => ("OpenGripper", Value::None),
            Self::CloseGripper => ("CloseGripper", Value::None),
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
