//! The rules for a recorded motion, each with a name and a statement.

use serde::{Serialize, Serializer};

/// A rule that a recorded motion is checked against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Rule {
    /// See [`Rule::statement`], as for all others.
    Time,
    /// The command column.
    CommandColumn,
    /// Sequence, values and tools.
    Language,
    /// Position limits.
    JointRange,
    /// Velocity limits.
    JointVelocity,
    /// Acceleration limits.
    JointAcceleration,
    /// Jerk limits.
    JointJerk,
    /// Velocities and accelerations against positions.
    Derivatives,
    /// Pose columns against joint columns.
    Pose,
    /// Speed of the controlled point.
    ToolSpeed,
    /// Acceleration of the controlled point.
    ToolAcceleration,
    /// Jerk of the controlled point.
    ToolJerk,
    /// Angular speed of the tool.
    AngularSpeed,
    /// Angular acceleration of the tool.
    AngularAcceleration,
    /// Angular jerk of the tool.
    AngularJerk,
    /// No motion under commands that move nothing.
    Standstill,
    /// Time of Dwell and of tools.
    Duration,
    /// Rest between commands.
    Rest,
    /// The last pose of a move.
    End,
    /// Straight line.
    StraightLine,
    /// Never back along a straight line.
    NoReturn,
    /// Orientation on a straight line.
    OrientationInStep,
    /// Intermediate poses.
    Pass,
    /// Straight legs between poses.
    Corridor,
    /// Orientation at an intermediate pose.
    PassOrientation,
    /// Path time of a run.
    PathTime,
    /// Measured columns of a run.
    Measured,
}

impl Rule {
    /// Every rule.
    pub const ALL: [Rule; 27] = [
        Rule::Time,
        Rule::CommandColumn,
        Rule::Language,
        Rule::JointRange,
        Rule::JointVelocity,
        Rule::JointAcceleration,
        Rule::JointJerk,
        Rule::Derivatives,
        Rule::Pose,
        Rule::ToolSpeed,
        Rule::ToolAcceleration,
        Rule::ToolJerk,
        Rule::AngularSpeed,
        Rule::AngularAcceleration,
        Rule::AngularJerk,
        Rule::Standstill,
        Rule::Duration,
        Rule::Rest,
        Rule::End,
        Rule::StraightLine,
        Rule::NoReturn,
        Rule::OrientationInStep,
        Rule::Pass,
        Rule::Corridor,
        Rule::PassOrientation,
        Rule::PathTime,
        Rule::Measured,
    ];

    /// Its name, as findings and `--json` write it.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.words().0
    }

    /// What must hold, and to what precision; `h` is the time between two samples.
    #[must_use]
    pub fn statement(self) -> &'static str {
        self.words().1
    }

    /// Whether it is a limit of joint or tool motion, with a ratio that tells how much of it was
    /// used.
    pub(super) fn is_limit(self) -> bool {
        matches!(
            self,
            Self::JointVelocity
                | Self::JointAcceleration
                | Self::JointJerk
                | Self::ToolSpeed
                | Self::ToolAcceleration
                | Self::ToolJerk
                | Self::AngularSpeed
                | Self::AngularAcceleration
                | Self::AngularJerk
        )
    }

    fn words(self) -> (&'static str, &'static str) {
        WORDS[self as usize]
    }
}

/// Names and statements, in the order of the rules.
const WORDS: [(&str, &str); 27] = [
    (
        "time",
        "the time column starts at 0 s and grows by one period from row to row; a run may leave out whole periods",
    ),
    (
        "command-column",
        "the command column never falls, and names commands of the program that take time (the first row may name command 0)",
    ),
    (
        "language",
        "each command may be executed where it stands: sequence, values, tools",
    ),
    (
        "joint-range",
        "every joint stays within its position limits",
    ),
    (
        "joint-velocity",
        "no joint velocity is above the limit of the joint",
    ),
    (
        "joint-acceleration",
        "no joint acceleration is above the limit of the joint",
    ),
    (
        "joint-jerk",
        "between two samples no joint acceleration changes by more than the jerk limit times h",
    ),
    (
        "derivatives",
        "dq and ddq are the derivatives of q: with the jerk limit J, the trapezoid of ddq is within J h2 / 4 of the change of dq, and the corrected trapezoid of dq within sqrt(3)/54 J h3 of the change of q",
    ),
    (
        "pose",
        "the pose columns are the controlled point at the joint columns, within 1e-9 m and 1e-8 rad",
    ),
    (
        "tool-speed",
        "the controlled point is not faster than the speed that applies",
    ),
    (
        "tool-acceleration",
        "the acceleration of the controlled point is not above the one that applies; not checked while a run changes its speed along the path",
    ),
    (
        "tool-jerk",
        "between two samples the acceleration of the controlled point changes by no more than the robot's jerk limit times h; not checked while a run changes its speed along the path",
    ),
    (
        "angular-speed",
        "the tool does not turn faster than the angular speed that applies",
    ),
    (
        "angular-acceleration",
        "the angular acceleration of the tool is not above the one that applies; not checked while a run changes its speed along the path",
    ),
    (
        "angular-jerk",
        "between two samples the angular acceleration of the tool changes by no more than the robot's angular jerk limit times h; not checked while a run changes its speed along the path",
    ),
    (
        "standstill",
        "no joint moves under a command that moves nothing",
    ),
    (
        "duration",
        "a Dwell takes at least its time, and in a plan a gripper or tool changer its nominal time, as far as samples h apart show",
    ),
    (
        "rest",
        "the arm rests at the start and between commands; at a sample up to h before the end of a move, joints are no faster than they can stop in h",
    ),
    (
        "end",
        "each move ends in its last pose, within 1e-6 m and 1e-6 rad; at a sample up to h before the end, no further away than a stop in h",
    ),
    (
        "straight-line",
        "a straight move stays within 1e-5 m of the line between its ends",
    ),
    (
        "no-return",
        "a straight move never goes or turns back by more than 2e-6 m and 1e-5 rad",
    ),
    (
        "orientation-in-step",
        "on a straight move the tool turns about one axis, in proportion to the distance, within 1e-5 rad and the rotation over 2e-6 m",
    ),
    (
        "pass",
        "each intermediate pose is passed within its tolerance (at least 1e-6 m), in order",
    ),
    (
        "corridor",
        "between two passes the distance of the controlled point from the straight leg is at most the tolerance (and 1e-5 m)",
    ),
    (
        "pass-orientation",
        "where an intermediate pose is passed, the orientation is within the angular tolerance that follows from the tolerance",
    ),
    (
        "path-time",
        "in a run, planned time grows from 0 under each command, never faster than time, and joints move only while it grows",
    ),
    (
        "measured",
        "in a run, the measured point is the controlled point at the measured joints, and these follow the published ones",
    ),
];

impl std::fmt::Display for Rule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl Serialize for Rule {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::Rule;

    #[test]
    fn rules_are_in_the_order_of_their_names() {
        for (index, rule) in Rule::ALL.into_iter().enumerate() {
            assert_eq!(index, rule as usize);
        }
        assert_eq!(Rule::Time.name(), "time");
        assert_eq!(Rule::Corridor.name(), "corridor");
        assert_eq!(Rule::Measured.name(), "measured");
    }
}
