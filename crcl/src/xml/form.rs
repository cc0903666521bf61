//! What commands of the language are in CRCL's XML.

use super::command::{ActuateJoint, JointDetails, MoveScrew, StopCondition, XmlCommand};
use super::data::{PoseTolerance, Quantity, Waypoint};
use super::own_settings::settings_of;
use crate::command::Command;
use crate::joint::JointTarget;
use crate::pose::Pose;
use crate::pose_and_set::PoseAndSet;
use crate::screw::Screw;
use crate::units::AngleUnit;

/// The command in XML, with the `Name` that carries what XML has no element for. `angle` is the
/// unit that angles of poses are in.
///
/// # Errors
/// Why XML cannot say it.
pub(super) fn form(
    command: &Command,
    angle: AngleUnit,
) -> Result<(Option<String>, XmlCommand), String> {
    let plain = |command| Ok((None, command));
    match command {
        Command::InitCanon => plain(XmlCommand::InitCanon),
        Command::EndCanon { reason: 0 } => plain(XmlCommand::EndCanon),
        Command::EndCanon { reason } => {
            Ok((Some(format!("reason-{reason}")), XmlCommand::EndCanon))
        }
        Command::Message { text } => match text.chars().find(|c| !is_xml(*c)) {
            Some(found) => Err(format!(
                "a text in XML cannot have the character U+{:04X}",
                u32::from(found)
            )),
            None => plain(XmlCommand::Message(text.clone())),
        },
        Command::Dwell { seconds } => plain(XmlCommand::Dwell(*seconds)),
        Command::MoveTo { pose } => plain(XmlCommand::MoveTo {
            straight: false,
            end: waypoint(pose, angle)?,
        }),
        Command::MoveStraightTo { pose } => plain(XmlCommand::MoveTo {
            straight: true,
            end: waypoint(pose, angle)?,
        }),
        Command::MoveSmoothlyTo { poses } | Command::MoveThroughTo { poses } => {
            let waypoints = poses.iter().map(|pose| waypoint(pose, angle));
            through(waypoints.collect::<Result<_, _>>()?)
        }
        Command::ActuateJoints { joints } => plain(XmlCommand::ActuateJoints {
            joints: joints.iter().map(actuate_joint).collect(),
            tolerances: Vec::new(),
        }),
        Command::MoveThroughWaypoints { waypoints } => {
            let own = |each: &PoseAndSet| -> Result<Waypoint, String> {
                Ok(Waypoint {
                    settings: settings_of(each),
                    ..waypoint(&each.pose, angle)?
                })
            };
            through(waypoints.iter().map(own).collect::<Result<_, _>>()?)
        }
        Command::MoveScrew { screw } => plain(XmlCommand::MoveScrew(move_screw(screw, angle)?)),
        Command::OpenGripper => plain(XmlCommand::SetEndEffector(1.0)),
        Command::CloseGripper => plain(XmlCommand::SetEndEffector(0.0)),
        Command::SetEndEffector { setting } => plain(XmlCommand::SetEndEffector(*setting)),
        Command::OpenToolChanger => plain(XmlCommand::OpenToolChanger),
        Command::CloseToolChanger => plain(XmlCommand::CloseToolChanger),
        Command::StopMotion { emergency: 0 } => {
            plain(XmlCommand::StopMotion(StopCondition::Normal))
        }
        Command::StopMotion { .. } => plain(XmlCommand::StopMotion(StopCondition::Immediate)),
        Command::SetCoordinateFrame { .. } => Err("XML has no coordinate frames".to_owned()),
        setting => plain(form_of_setting(setting)?),
    }
}

fn move_screw(screw: &Screw, angle: AngleUnit) -> Result<MoveScrew, String> {
    let start = screw.start.as_ref();
    Ok(MoveScrew {
        start: start.map(|pose| waypoint(pose, angle)).transpose()?,
        axis_point: screw.axis_point,
        free: (screw.free != 0.0).then_some(screw.free),
        advance: screw.advance,
        turn: screw.turn,
    })
}

/// A move through waypoints.
fn through(waypoints: Vec<Waypoint>) -> Result<(Option<String>, XmlCommand), String> {
    let command = match *waypoints.as_slice() {
        [] => return Err("a move in XML goes through at least one pose".to_owned()),
        // The schema wants two waypoints; through no other pose the way is a straight line.
        [end] => XmlCommand::MoveTo {
            straight: true,
            end,
        },
        _ => XmlCommand::MoveThroughTo {
            straight: false,
            waypoints,
        },
    };
    Ok((None, command))
}

fn form_of_setting(command: &Command) -> Result<XmlCommand, String> {
    use XmlCommand as X;
    let ball = |tolerance: f64| PoseTolerance {
        x: Some(tolerance),
        y: Some(tolerance),
        z: Some(tolerance),
        ..PoseTolerance::default()
    };
    let angle = |tolerance: f64| PoseTolerance {
        x_axis: Some(tolerance),
        z_axis: Some(tolerance),
        ..PoseTolerance::default()
    };
    Ok(match command {
        Command::SetAbsoluteSpeed { value } => X::SetTransSpeed(Quantity::Absolute(*value)),
        Command::SetAbsoluteAcceleration { value } => X::SetTransAccel(Quantity::Absolute(*value)),
        Command::SetRelativeSpeed { percent } => {
            X::SetTransSpeed(Quantity::Relative(percent / 100.0))
        }
        Command::SetRelativeAcceleration { percent } => {
            X::SetTransAccel(Quantity::Relative(percent / 100.0))
        }
        Command::SetAbsoluteRotSpeed { value } => X::SetRotSpeed(Quantity::Absolute(*value)),
        Command::SetAbsoluteRotAccel { value } => X::SetRotAccel(Quantity::Absolute(*value)),
        Command::SetRelativeRotSpeed { percent } => {
            X::SetRotSpeed(Quantity::Relative(percent / 100.0))
        }
        Command::SetRelativeRotAccel { percent } => {
            X::SetRotAccel(Quantity::Relative(percent / 100.0))
        }
        Command::SetIntermediateAngleTolerance { tolerance } => {
            X::SetIntermediatePoseTolerance(angle(*tolerance))
        }
        Command::SetLengthUnits { unit } => X::SetLengthUnits(*unit),
        Command::SetAngleUnits { unit } => X::SetAngleUnits(*unit),
        Command::SetEndPointTolerance { tolerance } => X::SetEndPoseTolerance(ball(*tolerance)),
        Command::SetIntermediatePointTolerance { tolerance } => {
            X::SetIntermediatePoseTolerance(ball(*tolerance))
        }
        Command::SetEndAngleTolerance { tolerance } => X::SetEndPoseTolerance(angle(*tolerance)),
        other => return Err(format!("XML has no command for {}", other.name())),
    })
}

fn actuate_joint(target: &JointTarget) -> ActuateJoint {
    let told = |value: f64| (value != 0.0).then_some(value);
    ActuateJoint {
        joint: i32::try_from(target.joint).unwrap_or(i32::MAX),
        position: target.position,
        details: JointDetails::SpeedAccel {
            speed: told(target.speed),
            accel: told(target.acceleration),
        },
    }
}

/// The pose with axes, which is the only form in XML.
fn waypoint(pose: &Pose, angle: AngleUnit) -> Result<Waypoint, String> {
    let pose = match pose {
        Pose::Axes { .. } => *pose,
        Pose::RollPitchYaw { point, .. } => {
            let axes = pose.axes(angle).map_err(|error| error.to_string())?;
            let [x_axis, _, z_axis] = axes;
            Pose::Axes {
                point: *point,
                z_axis,
                x_axis,
            }
        }
    };
    Ok(Waypoint::from(pose))
}

/// Whether XML 1.0 can hold the character.
fn is_xml(c: char) -> bool {
    matches!(c, '\t' | '\n' | '\r') || (c >= ' ' && !matches!(c, '\u{FFFE}' | '\u{FFFF}'))
}
