//! The one table of commands that parser, writers and documents derive from.

use crate::argument::{Argument, ArgumentKind, Value};
use crate::command::Command;
use crate::pose_and_set::PoseAndSet;
use crate::value::{self, ValueError};

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
            with("MoveThroughWaypoints", "waypoints", Kind::Waypoints, |v| {
                v.waypoints()
                    .map(|waypoints| C::MoveThroughWaypoints { waypoints })
            }),
            Some("MoveSmoothlyTo"),
        ),
        extension(
            with("MoveScrew", "screw", Kind::Screw, |v| {
                v.screw().map(|screw| C::MoveScrew { screw })
            }),
            None,
        ),
        extension(
            with("Guard", "guard", Kind::Guard, |v| {
                v.guard().map(|guard| C::Guard { guard })
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
            with("SetEndEffector", "setting", Kind::Share, |v| {
                v.number().map(|setting| C::SetEndEffector { setting })
            }),
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
    /// The row of the table that describes the command.
    pub fn info(&self) -> Option<&'static CommandInfo> {
        CommandInfo::find(self.name())
    }

    /// Whether the command moves the controlled point.
    pub fn is_move(&self) -> bool {
        let moves = [
            ArgumentKind::Pose,
            ArgumentKind::Poses,
            ArgumentKind::Joints,
            ArgumentKind::Screw,
            ArgumentKind::Waypoints,
        ];
        self.info()
            .and_then(|info| info.argument)
            .is_some_and(|a| moves.contains(&a.kind))
    }

    /// Whether a guard before it can stop it: it moves the arm or waits.
    pub fn takes_guards(&self) -> bool {
        self.is_move() || matches!(self, Self::Dwell { .. })
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
            (_, Value::Screw(screw)) => screw.check(),
            (_, Value::Guard(guard)) => guard.check(),
            (_, Value::Waypoints(waypoints)) => check_waypoints(&waypoints),
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
}

/// At least one pose, and nothing wrong with any of them or its settings.
fn check_waypoints(waypoints: &[PoseAndSet]) -> Result<(), ValueError> {
    if waypoints.is_empty() {
        return Err(ValueError::NoPoses);
    }
    for waypoint in waypoints {
        waypoint.check_settings()?;
        if let Some((_, error)) = waypoint.pose.faults().into_iter().next() {
            return Err(error);
        }
    }
    Ok(())
}
