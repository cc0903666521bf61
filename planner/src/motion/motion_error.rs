//! Why a motion cannot be planned.

use thiserror::Error;
use trajectory::TimingError;
use trajectory::otg::OtgError;
use trajectory::smooth::SmoothError;

use super::figures::figures;
use super::{BlockedCause, Fault, JogRefusal, JointAmount, TimedRefusal};

/// A move that the arm cannot make. Poses are counted from 1, joints by name.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MotionError {
    /// No configuration of the arm reaches the pose.
    #[error("pose {pose} is out of reach by {} mm", figures(*millimetres, 1))]
    OutOfReach {
        /// Which pose of the command.
        pose: usize,
        /// Distance from the nearest reachable place, mm.
        millimetres: f64,
    },
    /// The pose is reached only beyond a joint limit.
    #[error("pose {pose} needs {joint} {beyond} beyond its limit")]
    BeyondLimit {
        /// Which pose of the command.
        pose: usize,
        /// The joint, as people call it.
        joint: String,
        /// How far beyond.
        beyond: JointAmount,
    },
    /// The position is in reach, the orientation is not.
    #[error(
        "pose {pose} is in reach, but its orientation is {} degrees out of reach",
        figures(*degrees, 1)
    )]
    Orientation {
        /// Which pose of the command.
        pose: usize,
        /// Angle from the nearest orientation, degrees.
        degrees: f64,
    },
    /// No solution was found, and neither reach nor one joint explains it.
    #[error(
        "pose {pose} cannot be reached: the nearest found is {millimetres:.3} mm and {degrees:.3} degrees off"
    )]
    Unsolved {
        /// Which pose of the command.
        pose: usize,
        /// Position error of the nearest configuration found, mm.
        millimetres: f64,
        /// Orientation error of the nearest configuration found, degrees.
        degrees: f64,
    },
    /// The arm cannot follow the path to the pose.
    #[error(
        "the path cannot be followed at {percent:.1} % of its length, towards pose {pose}: {cause}"
    )]
    Blocked {
        /// Pose that the path leads to.
        pose: usize,
        /// Where on the path, percent of the path parameter.
        percent: f64,
        /// What blocks the path.
        cause: BlockedCause,
    },
    /// A joint is to go beyond its limit.
    #[error("{joint} is to go {beyond} beyond its limit")]
    JointBeyondLimit {
        /// The joint, as people call it.
        joint: String,
        /// How far beyond, with its unit.
        beyond: JointAmount,
    },
    /// The arm cannot move in the direction of a jog.
    #[error("{0}")]
    Jog(#[from] JogRefusal),
    /// A trajectory whose times are given cannot be executed as it is.
    #[error("{0}")]
    Timed(#[from] TimedRefusal),
    /// The smooth path could not be made.
    #[error("no smooth path: {0}")]
    Smooth(#[from] SmoothError),
    /// No time law was found for the path.
    #[error("the motion cannot be timed: {0}")]
    Timing(#[from] TimingError),
    /// No motion between the joint positions could be planned.
    #[error("the motion cannot be timed: {0}")]
    PointToPoint(#[from] OtgError),
    /// The joint path has fewer than two points.
    #[error("the motion cannot be timed: its path has fewer than two points")]
    NoWay,
    /// The move cannot begin in the state of motion that the arm is in.
    #[error("the move cannot begin while the arm moves: {0}")]
    FromMotion(&'static str),
    /// No motion goes on where a long smooth move rests on its way: it ends there.
    #[error("the motion rests on its way towards pose {pose} and cannot go on: {cause}")]
    OnTheWay {
        /// Which pose of the command would be next.
        pose: usize,
        /// Why.
        cause: Box<MotionError>,
    },
    /// The planned motion failed its own certificate; it is not executed.
    #[error("the planned motion failed its certificate: {0}")]
    Uncertified(#[from] Fault),
}

impl MotionError {
    /// What would fix it.
    #[must_use]
    pub fn help(&self) -> &'static str {
        match self {
            Self::OutOfReach { .. } => "move the pose nearer to the arm; check units and frame",
            Self::BeyondLimit { .. } | Self::Orientation { .. } => {
                "turn the tool, or move the pose"
            }
            Self::Unsolved { .. } => "check the pose with `canter ik`",
            Self::Blocked { .. } => {
                "reach the start in another configuration with MoveTo, or go round the place"
            }
            Self::JointBeyondLimit { .. } => {
                "stay within the range that `canter robots show` tells"
            }
            Self::Jog(_) => "go the other way",
            Self::FromMotion(_) => "stop first",
            Self::Timed(refusal) => refusal.help(),
            Self::Smooth(_) => "check the poses and the intermediate point tolerance",
            Self::Timing(_)
            | Self::PointToPoint(_)
            | Self::NoWay
            | Self::OnTheWay { .. }
            | Self::Uncertified(_) => {
                "please report this with the program: it is a fault of the planner"
            }
        }
    }
}
