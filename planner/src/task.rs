//! What a command means once every mode has been applied: SI units, workstation frame.

use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use trajectory::{Helix, ToolCurve, ToolLimits};

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
    /// Move single joints.
    Joints(JointMove),
    /// Turn and advance in step.
    Screw(ScrewMove),
    /// Move near poses with limits of their own.
    Legs(LegsMove),
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

/// Where one joint is to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointGoal {
    /// Index of the joint, from 0.
    pub joint: usize,
    /// Where it stops (rad, m).
    pub position: f64,
    /// Its largest speed (rad/s, m/s), if told.
    pub speed: Option<f64>,
    /// Its largest acceleration (rad/s2, m/s2), if told.
    pub acceleration: Option<f64>,
}

/// One motion of single joints from rest to rest; joints without a goal rest.
#[derive(Clone, Debug, PartialEq)]
pub struct JointMove {
    /// The goals; each joint is one of the robot's and has at most one.
    pub goals: Vec<JointGoal>,
    /// Share of the joints' largest speed and acceleration where no other is told, above 0.
    pub shares: (f64, f64),
    /// Limits of the controlled point.
    pub limits: ToolLimits,
}

impl JointMove {
    /// Puts the joints that have a goal there.
    pub fn apply(&self, joints: &mut [f64]) {
        for goal in &self.goals {
            if let Some(joint) = joints.get_mut(goal.joint) {
                *joint = goal.position;
            }
        }
    }

    /// The motion as one of the controlled point: any way to where the joints put it.
    #[must_use]
    pub fn of_point(&self, workstation_from_tool: Isometry3<f64>) -> Move {
        Move {
            shape: Shape::Joint,
            poses: vec![workstation_from_tool],
            tolerance: 0.0,
            limits: self.limits,
        }
    }
}

/// A smooth move whose legs have limits of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct LegsMove {
    /// The move, with the widest limits of all legs.
    pub motion: Move,
    /// Limits of the controlled point on the way to each pose.
    pub limits: Vec<ToolLimits>,
}

impl LegsMove {
    /// A smooth move through `poses` within `tolerance` (m), with limits on the way to each.
    #[must_use]
    pub fn new(poses: Vec<Isometry3<f64>>, tolerance: f64, limits: Vec<ToolLimits>) -> Self {
        let widest = limits.iter().copied().reduce(|a, b| ToolLimits {
            speed: a.speed.max(b.speed),
            acceleration: a.acceleration.max(b.acceleration),
            jerk: a.jerk.max(b.jerk),
            angular_speed: a.angular_speed.max(b.angular_speed),
            angular_acceleration: a.angular_acceleration.max(b.angular_acceleration),
            angular_jerk: a.angular_jerk.max(b.angular_jerk),
        });
        Self {
            motion: Move {
                shape: Shape::Smooth,
                poses,
                tolerance,
                limits: widest.unwrap_or(ToolLimits::UNLIMITED),
            },
            limits,
        }
    }
}

/// A screw of the controlled point: to a pose, straight along the tool's z axis, then turn and
/// advance in step about an axis that has the tool's direction. At rest before and after each part.
#[derive(Clone, Debug, PartialEq)]
pub struct ScrewMove {
    /// Where to go first, `workstation_from_tool`; along any way.
    pub start: Option<Isometry3<f64>>,
    /// A point of the axis, in the workstation, m; the controlled point itself where it is missing.
    pub axis_point: Option<Point3<f64>>,
    /// Straight way before the turn, along the tool's z axis, m.
    pub free: f64,
    /// Advance during the turn, along the tool's z axis, m.
    pub advance: f64,
    /// The turn, counterclockwise for who looks against the tool's z axis, rad.
    pub turn: f64,
    /// Limits of the controlled point.
    pub limits: ToolLimits,
}

impl ScrewMove {
    /// Where the turn begins, from where the controlled point stands.
    #[must_use]
    pub fn before_turn(&self, from: &Isometry3<f64>) -> Isometry3<f64> {
        self.start.unwrap_or(*from) * Translation3::new(0.0, 0.0, self.free)
    }

    /// The turn with its advance, from where it begins.
    #[must_use]
    pub fn helix(&self, from: &Isometry3<f64>) -> Helix {
        let axis = from.rotation * Vector3::z_axis();
        let point = self.axis_point.unwrap_or(from.translation.vector.into());
        Helix::new(*from, (point, axis), self.advance, self.turn)
    }

    /// Where the controlled point stands at the end.
    #[must_use]
    pub fn end(&self, from: &Isometry3<f64>) -> Isometry3<f64> {
        self.helix(&self.before_turn(from)).at(1.0).pose
    }

    /// The motion as one of the controlled point: any way to its end.
    #[must_use]
    pub fn of_point(&self, from: &Isometry3<f64>) -> Move {
        Move {
            shape: Shape::Joint,
            poses: vec![self.end(from)],
            tolerance: 0.0,
            limits: self.limits,
        }
    }
}

/// An action of a tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToolAction {
    /// Open the gripper of the mounted end effector.
    OpenGripper,
    /// Close the gripper of the mounted end effector.
    CloseGripper,
    /// Open the gripper of the mounted end effector to a part of its way.
    MoveGripper {
        /// Opening, um.
        opening_um: u32,
    },
    /// Let go of the end effector.
    OpenToolChanger,
    /// Take the end effector in the holder at the arm's end.
    CloseToolChanger,
}
