//! What a command means once every mode has been applied: SI units, workstation frame.

use nalgebra::Isometry3;
use trajectory::ToolLimits;

/// A self-contained piece of work; nothing after [`crate::modal`] has modes.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// Get ready to move.
    Begin,
    /// Stop executing; the program's reason (0 success).
    End {
        /// Reason given by the program.
        reason: i64,
    },
    /// A setting was applied; nothing moves.
    Setting,
    /// Show a text on the operator console.
    Message {
        /// The text.
        text: String,
    },
    /// Stay motionless.
    Dwell {
        /// Time in s.
        seconds: f64,
    },
    /// Move the controlled point.
    Move(Move),
    /// Open or close the gripper, or the tool changer.
    Tool(ToolAction),
    /// Stop on the path, as soon as the limits allow.
    Stop {
        /// Whether the program called it an emergency.
        emergency: bool,
    },
}

/// Shape of the path to the last pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Any convenient path: joint space.
    Joint,
    /// Straight line of the controlled point.
    Straight,
    /// Near all poses but the last without stopping.
    Smooth,
}

/// One motion from the current pose, at rest, to the last of `poses`, at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Move {
    /// Shape of the path.
    pub shape: Shape,
    /// Poses of the controlled point, `workstation_from_tool`, in order; never empty.
    pub poses: Vec<Isometry3<f64>>,
    /// Radius of the ball round each intermediate pose, m.
    pub tolerance: f64,
    /// Limits of the controlled point.
    pub limits: ToolLimits,
}

/// An action of a tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToolAction {
    /// Open the gripper of the mounted end effector.
    OpenGripper,
    /// Close the gripper of the mounted end effector.
    CloseGripper,
    /// Let go of the end effector.
    OpenToolChanger,
    /// Take the end effector in the holder at the arm's end.
    CloseToolChanger,
}
