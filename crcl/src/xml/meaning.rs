//! What commands of CRCL's XML are in the language, and what has no place there.

use super::command::{
    ActuateJoint, Instruction, JointDetails, MoveScrew, StopCondition, XmlCommand,
};
use super::data::Quantity;
use super::own_settings::{end_tolerance, own_settings, percent, through};
use super::refusal::{Refusal, refusal};
use crate::command::Command;
use crate::finding::{Finding, Severity};
use crate::joint::JointTarget;
use crate::json;
use crate::program::ReadOptions;
use crate::screw::Screw;
use crate::text;

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
        let meaning = self.unguarded()?;
        if self.guards.is_empty() {
            return Ok(meaning);
        }
        match meaning {
            Meaning::Commands(commands) if commands.iter().any(Command::takes_guards) => {
                let guards = self.guards.iter().enumerate();
                let mut all = guards
                    .map(|(at, guard)| guard.meaning(at))
                    .collect::<Result<Vec<_>, _>>()?;
                all.extend(commands);
                Ok(Meaning::Commands(all))
            }
            _ => {
                let name = self.command.name();
                let message = format!("a guard on {name}, which neither moves the arm nor waits");
                Err(refusal("Guard", message))
            }
        }
    }

    /// What the command is without its guards.
    fn unguarded(&self) -> Result<Meaning, Refusal> {
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
            XmlCommand::RunProgram(text) => run_program(text),
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

/// The commands of a program in text or JSON, in the units in force; InitCanon at its beginning and
/// EndCanon at its end are those of the program around it.
fn run_program(source: &str) -> Result<Meaning, Refusal> {
    let options = ReadOptions::default();
    let reading = if source.trim_start().starts_with('{') {
        json::read(source, &options)
    } else {
        text::read(source, &options)
    };
    let error = |finding: &&Finding| finding.severity == Severity::Error;
    if let Some(finding) = reading.findings.iter().find(error) {
        let before = source.get(..finding.span.start).unwrap_or_default();
        let line = before.matches('\n').count() + 1;
        let message = format!(
            "RunProgram, line {line} of its program: {}",
            finding.message
        );
        return Err(refusal("ProgramText", message));
    }
    let mut commands: Vec<_> = reading.program.iter().cloned().collect();
    if commands.first() == Some(&Command::InitCanon) {
        commands.remove(0);
    }
    if matches!(commands.last(), Some(Command::EndCanon { .. })) {
        commands.pop();
    }
    let place =
        |command: &Command| matches!(command, Command::InitCanon | Command::EndCanon { .. });
    if commands.iter().any(place) {
        let message = "RunProgram: InitCanon or EndCanon inside its program";
        return Err(refusal("ProgramText", message));
    }
    Ok(Meaning::Commands(commands))
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
        // Whoever reads the limits of guards follows them.
        X::SetForceUnits(_) | X::SetTorqueUnits(_) => Ok(Meaning::Commands(Vec::new())),
        X::SetDefaultJointPositonsTolerances(_) => Ok(Meaning::NoEffect(
            "joints stop exactly where they are told to",
        )),
        X::ConfigureJointReports { .. }
        | X::ConfigureStatusReport(_)
        | X::GetStatus
        | X::EnableGripper { .. }
        | X::DisableGripper(_)
        | X::EnableRobotParameterStatus(_)
        | X::DisableRobotParameterStatus(_)
        | X::EnableSensor { .. }
        | X::DisableSensor(_) => Ok(Meaning::NoEffect(report)),
        X::SetEndEffectorParameters(_) | X::SetRobotParameters(_) => Ok(Meaning::NoEffect(
            "what parameters mean is not part of the language, and none means anything here",
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
