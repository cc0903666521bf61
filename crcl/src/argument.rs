//! The arguments of commands: their kinds, names and values.

use crate::guard::Guard;
use crate::joint::JointTarget;
use crate::pose::Pose;
use crate::pose_and_set::PoseAndSet;
use crate::screw::Screw;
use crate::units::{AngleUnit, CoordinateFrame, LengthUnit};
use crate::value::{self, ValueError};

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
    /// A share from 0 to 1.
    Share,
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
    /// A turn with an advance.
    Screw,
    /// A list of poses with settings of their own.
    Waypoints,
    /// A sensor with a limit.
    Guard,
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
            Self::Share => "a share",
            Self::LengthTolerance | Self::AngleTolerance => "a tolerance",
            Self::LengthUnit => "a length unit",
            Self::AngleUnit => "an angle unit",
            Self::Frame => "a coordinate frame",
            Self::Pose => "a pose",
            Self::Poses => "a list of poses",
            Self::Joints => "a list of joints",
            Self::Screw => "a screw",
            Self::Waypoints => "a list of poses with settings",
            Self::Guard => "a guard",
        }
    }

    /// An argument of this kind as it is written in text, for help texts.
    pub fn sample(self) -> &'static str {
        match self {
            Self::Reason | Self::Flag => "0",
            Self::Text => "\"text\"",
            Self::Seconds | Self::Share => "0.5",
            Self::Speed | Self::Acceleration => "250",
            Self::Percent | Self::AngularSpeed | Self::AngularAcceleration => "50",
            Self::LengthTolerance | Self::AngleTolerance => "2",
            Self::LengthUnit => "\"mm\"",
            Self::AngleUnit => "\"degree\"",
            Self::Frame => "\"Workstation\"",
            Self::Pose => "{{400, 0, 300}, {0, 0, -1}, {1, 0, 0}}",
            Self::Poses => "{{{400, 0, 300}, {0, 0, -1}, {1, 0, 0}}}, 1",
            Self::Joints => "{{1, 90}, {3, -45, 30}}",
            Self::Waypoints => {
                "{{{{400, 0, 300}, {0, 0, -1}, {1, 0, 0}}, {\"speed\", 50}, {\"tolerance\", 2}}}"
            }
            Self::Screw => "{{-5, 720, -20}, {400, 0, 300}}",
            Self::Guard => "{\"wrench.Fz\", \"OVER_MAX\", 10}",
        }
    }

    /// Whether a number of this kind is in range.
    pub(crate) fn check(self, number: f64) -> Result<f64, ValueError> {
        match self {
            Self::Percent => value::percent(self.noun(), number),
            Self::Flag => value::finite(self.noun(), number),
            Self::Share => {
                let share = value::not_negative(self.noun(), number)?;
                value::within(self.noun(), share, 1.0)
            }
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
    Screw(Screw),
    Waypoints(Vec<PoseAndSet>),
    Guard(Guard),
}

impl Value {
    pub(crate) fn none(self) -> Option<()> {
        matches!(self, Self::None).then_some(())
    }
    pub(crate) fn integer(self) -> Option<i64> {
        if let Self::Integer(integer) = self {
            Some(integer)
        } else {
            None
        }
    }
    pub(crate) fn number(self) -> Option<f64> {
        if let Self::Number(number) = self {
            Some(number)
        } else {
            None
        }
    }
    pub(crate) fn text(self) -> Option<String> {
        if let Self::Text(text) = self {
            Some(text)
        } else {
            None
        }
    }
    pub(crate) fn length_unit(self) -> Option<LengthUnit> {
        if let Self::LengthUnit(unit) = self {
            Some(unit)
        } else {
            None
        }
    }
    pub(crate) fn angle_unit(self) -> Option<AngleUnit> {
        if let Self::AngleUnit(unit) = self {
            Some(unit)
        } else {
            None
        }
    }
    pub(crate) fn frame(self) -> Option<CoordinateFrame> {
        if let Self::Frame(frame) = self {
            Some(frame)
        } else {
            None
        }
    }
    pub(crate) fn pose(self) -> Option<Pose> {
        if let Self::Pose(pose) = self {
            Some(pose)
        } else {
            None
        }
    }
    pub(crate) fn waypoints(self) -> Option<Vec<PoseAndSet>> {
        if let Self::Waypoints(waypoints) = self {
            Some(waypoints)
        } else {
            None
        }
    }
    pub(crate) fn guard(self) -> Option<Guard> {
        if let Self::Guard(guard) = self {
            Some(guard)
        } else {
            None
        }
    }
    pub(crate) fn screw(self) -> Option<Screw> {
        if let Self::Screw(screw) = self {
            Some(screw)
        } else {
            None
        }
    }
    pub(crate) fn joints(self) -> Option<Vec<JointTarget>> {
        if let Self::Joints(joints) = self {
            Some(joints)
        } else {
            None
        }
    }
    pub(crate) fn poses(self) -> Option<Vec<Pose>> {
        if let Self::Poses(poses) = self {
            Some(poses)
        } else {
            None
        }
    }
}
