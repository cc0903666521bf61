//! What keeps an arm from following a way.

use std::fmt;

use kinematics::{FollowError, IkFailure};
use thiserror::Error;

use super::figures::figures;

/// What keeps an arm from following a way. Joints are called by their names.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BlockedCause {
    /// A joint would leave its range on the way.
    #[error("{joint} would pass its limit by {beyond}")]
    JointLimit {
        /// The joint.
        joint: String,
        /// How far beyond.
        beyond: JointAmount,
    },
    /// The way runs into a singular pose in a direction that the arm cannot move in there.
    #[error(
        "a singular pose, where {joint} would have to jump (smallest singular value {smallest:.1e})"
    )]
    Singular {
        /// The joint that would have to move most.
        joint: String,
        /// Smallest singular value of the Jacobian (lengths in units of 0.3 m).
        smallest: f64,
    },
    /// The way comes so near to a singular pose that it has no time law.
    #[error("it comes too near to a singular pose (smallest singular value {smallest:.1e})")]
    NearSingular {
        /// Smallest singular value of the Jacobian on the way (lengths in units of 0.3 m).
        smallest: f64,
    },
    /// A pose of the way could be reached only with a joint beyond its limit.
    #[error("{joint} would have to go {beyond} beyond its limit")]
    BeyondLimit {
        /// The joint.
        joint: String,
        /// How far beyond.
        beyond: JointAmount,
    },
    /// A pose of the way cannot be reached.
    #[error("{0}")]
    Unreachable(IkFailure),
    /// The way cannot be followed for another reason.
    #[error("{0}")]
    Path(FollowError),
}

/// Why there is no way in the direction of a jog.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum JogRefusal {
    /// A joint is as far as it goes in that direction.
    #[error("{joint} is at the end of its range")]
    EndOfRange {
        /// The joint.
        joint: String,
    },
    /// The goal is where the arm is.
    #[error("the pose is reached")]
    AtGoal,
    /// The goal is beyond the range of a joint.
    #[error("the goal is beyond the range of {joint}")]
    GoalBeyond {
        /// The joint.
        joint: String,
    },
    /// The direction is zero, or too small for a move.
    #[error("no direction")]
    NoDirection,
}

/// A position or distance of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointAmount {
    /// Of a joint that turns, rad.
    Angle(f64),
    /// Of a joint that slides, m.
    Length(f64),
}

impl fmt::Display for JointAmount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Angle(angle) => write!(f, "{} degrees", figures(angle.to_degrees(), 2)),
            Self::Length(length) => write!(f, "{} mm", figures(length * 1e3, 1)),
        }
    }
}
