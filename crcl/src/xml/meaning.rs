//! What commands of CRCL's XML are in the language, and what has no place there.

use super::command::{Instruction, StopCondition, XmlCommand};
use super::data::{PoseTolerance, Quantity, Waypoint};
use crate::command::Command;
use crate::pose::Pose;

/// Why a command of XML cannot be executed, and which element says it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Name of the element.
    pub element: &'static str,
    /// Which of the elements of that name in the command, from 0.
    pub occurrence: usize,
    /// What cannot be done.
    pub message: String,
    /// What to do instead.
    pub help: Option<&'static str>,
}

/// What a command of XML is in the language.
#[derive(Clone, Debug, PartialEq)]
pub enum Meaning {
    /// These commands, in this order.
    Commands(Vec<Command>),
    /// It concerns the connection only; this is why it changes no motion.
    NoEffect(&'static str),
    /// A block begins.
    LoopStart(String),
    /// A block ends.
    LoopEnd {
        /// Name of the block.
        name: String,
        /// How many times it is executed.
        count: i32,
    },
}

impl Instruction {
    /// What the command is in the language.
    ///
    /// ```
    /// use crcl::Command;
    /// use crcl::xml::{Instruction, Meaning, XmlCommand};
    /// let close = Instruction::new(4, XmlCommand::SetEndEffector(0.0));
    /// assert_eq!(close.meaning(), Ok(Meaning::Commands(vec![Command::CloseGripper])));
    /// ```
    ///
    /// # Errors
    /// A [`Refusal`] that names the element that cannot be executed.
    pub fn meaning(&self) -> Result<Meaning, Refusal> {
        if let Some(guard) = self.guards.first() {
            let message = format!(
                "a guard on the sensor `{}`: no sensor is connected",
                guard.sensor
            );
            return Err(refusal("Guard", message));
        }
        let reason = self.reason();
        match &self.command {
            XmlCommand::InitCanon => one(Command::InitCanon),
            XmlCommand::EndCanon => one(Command::EndCanon { reason }),
            XmlCommand::Message(text) => one(Command::Message { text: text.clone() }),
            XmlCommand::Dwell(seconds) => one(Command::Dwell { seconds: *seconds }),
            XmlCommand::OpenToolChanger => one(Command::OpenToolChanger),
            XmlCommand::CloseToolChanger => one(Command::CloseToolChanger),
            XmlCommand::SetEndEffector(setting) => one(if *setting > 0.0 {
                Command::OpenGripper
            } else {
                Command::CloseGripper
            }),
            XmlCommand::StopMotion(condition) => one(Command::StopMotion {
                emergency: i64::from(*condition != StopCondition::Normal),
            }),
            XmlCommand::SetLengthUnits(unit) => one(Command::SetLengthUnits { unit: *unit }),
            XmlCommand::SetAngleUnits(unit) => one(Command::SetAngleUnits { unit: *unit }),
            XmlCommand::LoopBlockStart(name) => Ok(Meaning::LoopStart(name.clone())),
            XmlCommand::LoopBlockEnd { name, count } => Ok(Meaning::LoopEnd {
                name: name.clone(),
                count: *count,
            }),
            XmlCommand::MoveTo { .. }
            | XmlCommand::MoveThroughTo { .. }
            | XmlCommand::MoveScrew(_)
            | XmlCommand::ActuateJoints { .. } => motion(&self.command),
            other => setting(other),
        }
    }

    /// The reason of EndCanon, which XML has no element for: a `Name` such as `reason-2`.
    fn reason(&self) -> i64 {
        let digits = self.name.as_deref().and_then(|n| n.strip_prefix("reason-"));
        let reason = digits.and_then(|digits| digits.parse().ok());
        reason.filter(|reason| *reason >= 0).unwrap_or(0)
    }
}

fn motion(command: &XmlCommand) -> Result<Meaning, Refusal> {
    match command {
        XmlCommand::MoveTo { straight, end } => {
            let pose = plain(end, "EndPosition", 0)?;
            one(if *straight {
                Command::MoveStraightTo { pose }
            } else {
                Command::MoveTo { pose }
            })
        }
        // The way is made of straight lines in either case.
        XmlCommand::MoveThroughTo { waypoints, .. } => {
            let poses = waypoints
                .iter()
                .enumerate()
                .map(|(index, waypoint)| plain(waypoint, "Waypoint", index))
                .collect::<Result<_, _>>()?;
            one(Command::MoveSmoothlyTo { poses })
        }
        XmlCommand::MoveScrew(_) => Err(refusal(
            "AxialDistanceScrew",
            "MoveScrew: turning and advancing in step",
        )),
        _ => Err(refusal(
            "ActuateJoint",
            "ActuateJoints: moving single joints",
        )),
    }
}

/// The pose of a waypoint that has no settings of its own.
fn plain(waypoint: &Waypoint, element: &'static str, occurrence: usize) -> Result<Pose, Refusal> {
    match waypoint.settings {
        None => Ok(waypoint.pose),
        Some(_) => Err(Refusal {
            occurrence,
            help: Some("write the settings as commands before the move"),
            ..refusal(element, "a pose with settings of its own (PoseAndSetType)")
        }),
    }
}

fn setting(command: &XmlCommand) -> Result<Meaning, Refusal> {
    use XmlCommand as X;
    let report = "it chooses what a status says, and a program in a file has no status";
    match command {
        X::SetTransSpeed(Quantity::Absolute(value)) => {
            one(Command::SetAbsoluteSpeed { value: *value })
        }
        X::SetTransSpeed(Quantity::Relative(share)) => one(Command::SetRelativeSpeed {
            percent: percent(*share),
        }),
        X::SetTransAccel(Quantity::Absolute(value)) => {
            one(Command::SetAbsoluteAcceleration { value: *value })
        }
        X::SetTransAccel(Quantity::Relative(share)) => one(Command::SetRelativeAcceleration {
            percent: percent(*share),
        }),
        X::SetEndPoseTolerance(tolerance) => Ok(Meaning::Commands(end_tolerance(tolerance))),
        X::SetIntermediatePoseTolerance(tolerance) => {
            let ball = tolerance.ball();
            let set = |tolerance| Command::SetIntermediatePointTolerance { tolerance };
            Ok(Meaning::Commands(ball.map(set).into_iter().collect()))
        }
        X::SetMotionCoordination(_) => Ok(Meaning::NoEffect(
            "translation and rotation always end together here",
        )),
        X::SetForceUnits(_) | X::SetTorqueUnits(_) => Ok(Meaning::NoEffect(
            "no command of the language has a force or a torque",
        )),
        X::SetDefaultJointPositonsTolerances(_) => Ok(Meaning::NoEffect(
            "joints stop exactly where they are told to",
        )),
        X::ConfigureJointReports { .. }
        | X::ConfigureStatusReport(_)
        | X::GetStatus
        | X::EnableGripper { .. }
        | X::DisableGripper(_)
        | X::EnableRobotParameterStatus(_)
        | X::DisableRobotParameterStatus(_) => Ok(Meaning::NoEffect(report)),
        X::SetRotSpeed(_) => Err(refusal("RotSpeed", "SetRotSpeed: a speed of rotation")),
        X::SetRotAccel(_) => Err(refusal(
            "RotAccel",
            "SetRotAccel: an acceleration of rotation",
        )),
        X::SetEndEffectorParameters(parameters) | X::SetRobotParameters(parameters) => {
            let name = parameters.first().map_or("", |first| first.name.as_str());
            let message = format!("the parameter `{name}`: this robot has no parameters");
            Err(refusal("ParameterSetting", message))
        }
        X::EnableSensor { sensor, .. } | X::DisableSensor(sensor) => {
            let message = format!("the sensor `{sensor}`: no sensor is connected");
            Err(refusal("SensorID", message))
        }
        X::RunProgram(_) => Err(refusal(
            "ProgramText",
            "RunProgram: a program in the robot's own language",
        )),
        other => Err(refusal("CommandID", other.name())),
    }
}

/// A box becomes the ball inside it; what is free stays as it was set before, which is nearer.
fn end_tolerance(tolerance: &PoseTolerance) -> Vec<Command> {
    let point = tolerance.ball();
    let angle = tolerance.angle();
    let point = point.map(|tolerance| Command::SetEndPointTolerance { tolerance });
    let angle = angle.map(|tolerance| Command::SetEndAngleTolerance { tolerance });
    point.into_iter().chain(angle).collect()
}

/// The percentage whose hundredth is the share.
pub(super) fn percent(share: f64) -> f64 {
    let percent = share * 100.0;
    // 0.07 is 7 percent, not 7.000000000000001.
    let short = format!("{percent:.13e}").parse().unwrap_or(percent);
    if short / 100.0 == share {
        short
    } else {
        percent
    }
}

fn one(command: Command) -> Result<Meaning, Refusal> {
    Ok(Meaning::Commands(vec![command]))
}

fn refusal(element: &'static str, message: impl Into<String>) -> Refusal {
    Refusal {
        element,
        occurrence: 0,
        message: message.into(),
        help: None,
    }
}
