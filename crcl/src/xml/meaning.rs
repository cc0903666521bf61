//! What commands of CRCL's XML are in the language, and what has no place there.

use super::command::{
    ActuateJoint, Instruction, JointDetails, MoveScrew, StopCondition, XmlCommand,
};
use super::data::Quantity;
use super::own_settings::{end_tolerance, own_settings, percent, through};
use super::refusal::{Refusal, refusal};
use crate::command::Command;
use crate::joint::JointTarget;
use crate::screw::Screw;

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
            XmlCommand::SetEndEffector(setting) => one(match *setting {
                0.0 => Command::CloseGripper,
                1.0 => Command::OpenGripper,
                setting => Command::SetEndEffector { setting },
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
            let pose = end.pose;
            let command = if *straight {
                Command::MoveStraightTo { pose }
            } else {
                Command::MoveTo { pose }
            };
            Ok(Meaning::Commands(own_settings(end, command)))
        }
        // The way is made of straight lines in either case.
        XmlCommand::MoveThroughTo { waypoints, .. } => one(through(waypoints)),
        XmlCommand::MoveScrew(screw) => Ok(move_screw(screw)),
        XmlCommand::ActuateJoints { joints, .. } => {
            let targets = joints
                .iter()
                .enumerate()
                .map(|(at, joint)| target(joint, at));
            let joints = targets.collect::<Result<_, _>>()?;
            one(Command::ActuateJoints { joints })
        }
        other => Err(refusal("CommandID", other.name())),
    }
}

/// A start with settings of its own becomes a move of its own: they hold on the way there only.
fn move_screw(xml: &MoveScrew) -> Meaning {
    let own = xml.start.filter(|start| start.settings.is_some());
    let screw = Screw {
        advance: xml.advance,
        turn: xml.turn,
        free: xml.free.unwrap_or(0.0),
        axis_point: xml.axis_point,
        start: xml.start.filter(|_| own.is_none()).map(|start| start.pose),
    };
    let mut commands = match &own {
        Some(start) => {
            let pose = start.pose;
            own_settings(start, Command::MoveTo { pose })
        }
        None => Vec::new(),
    };
    commands.push(Command::MoveScrew { screw });
    Meaning::Commands(commands)
}

fn target(joint: &ActuateJoint, occurrence: usize) -> Result<JointTarget, Refusal> {
    match joint.details {
        JointDetails::SpeedAccel { speed, accel } => Ok(JointTarget {
            joint: i64::from(joint.joint),
            position: joint.position,
            speed: speed.unwrap_or(0.0),
            acceleration: accel.unwrap_or(0.0),
        }),
        JointDetails::ForceTorque { .. } => Err(Refusal {
            occurrence,
            ..refusal("JointDetails", "moving a joint with a force or torque")
        }),
    }
}

fn setting(command: &XmlCommand) -> Result<Meaning, Refusal> {
    use XmlCommand as X;
    let report = "it chooses what a status says, and a program in a file has no status";
    match command {
        X::SetTransSpeed(quantity) => one(speed_setting(quantity)),
        X::SetTransAccel(quantity) => one(acceleration_setting(quantity)),
        X::SetRotSpeed(quantity) => one(rotation_speed_setting(quantity)),
        X::SetRotAccel(quantity) => one(rotation_acceleration_setting(quantity)),
        X::SetEndPoseTolerance(tolerance) => Ok(Meaning::Commands(end_tolerance(tolerance))),
        X::SetIntermediatePoseTolerance(tolerance) => {
            let point = |tolerance| Command::SetIntermediatePointTolerance { tolerance };
            let angle = |tolerance| Command::SetIntermediateAngleTolerance { tolerance };
            let point = tolerance.ball().map(point);
            let angle = tolerance.angle().map(angle);
            Ok(Meaning::Commands(point.into_iter().chain(angle).collect()))
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
        X::SetEndEffectorParameters(_) | X::SetRobotParameters(_) => Ok(Meaning::NoEffect(
            "what parameters mean is not part of the language, and none means anything here",
        )),
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

/// `SetTransSpeed` in the language.
fn speed_setting(quantity: &Quantity) -> Command {
    match *quantity {
        Quantity::Absolute(value) => Command::SetAbsoluteSpeed { value },
        Quantity::Relative(share) => Command::SetRelativeSpeed {
            percent: percent(share),
        },
    }
}

/// `SetTransAccel` in the language.
fn acceleration_setting(quantity: &Quantity) -> Command {
    match *quantity {
        Quantity::Absolute(value) => Command::SetAbsoluteAcceleration { value },
        Quantity::Relative(share) => Command::SetRelativeAcceleration {
            percent: percent(share),
        },
    }
}

/// `SetRotSpeed` in the language.
fn rotation_speed_setting(quantity: &Quantity) -> Command {
    match *quantity {
        Quantity::Absolute(value) => Command::SetAbsoluteRotSpeed { value },
        Quantity::Relative(share) => Command::SetRelativeRotSpeed {
            percent: percent(share),
        },
    }
}

/// `SetRotAccel` in the language.
fn rotation_acceleration_setting(quantity: &Quantity) -> Command {
    match *quantity {
        Quantity::Absolute(value) => Command::SetAbsoluteRotAccel { value },
        Quantity::Relative(share) => Command::SetRelativeRotAccel {
            percent: percent(share),
        },
    }
}

fn one(command: Command) -> Result<Meaning, Refusal> {
    Ok(Meaning::Commands(vec![command]))
}
