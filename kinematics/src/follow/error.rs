//! Why a tool path cannot be followed.

use crate::ik::IkFailure;
use std::fmt;

/// Why a tool path cannot be followed: where, which joint, why, and by how much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowError {
    /// Path parameter.
    pub u: f64,
    /// The joint concerned, counted from 0.
    pub joint: Option<usize>,
    /// The cause.
    pub cause: FollowCause,
    /// Size of the fault in the unit of the cause.
    pub amount: f64,
}

/// Why an arm cannot follow a path.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FollowCause {
    /// The grid does not rise, or has fewer than two points; amount: their number.
    BadGrid,
    /// The arm does not stand at the start of the path; amount: distance, m (rad times 0.3 m).
    Start,
    /// The pose cannot be reached at all; amount: m or rad.
    Unreachable(IkFailure),
    /// A joint would pass its limit; amount: by how much at the worst, rad or m.
    Limit,
    /// The path runs into a singular pose in a direction that the arm cannot move in
    /// there; amount: the smallest singular value.
    Singular,
    /// More points than allowed would be needed; amount: how many were made.
    TooManyPoints,
}

impl fmt::Display for FollowError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at path parameter {:.4}: ", self.u)?;
        let joint = self.joint.map_or(0, |joint| joint + 1);
        let amount = self.amount;
        match self.cause {
            FollowCause::BadGrid => {
                write!(
                    f,
                    "the grid of {amount} parameters does not rise from start to end"
                )
            }
            FollowCause::Start => {
                write!(
                    f,
                    "the arm is {:.3} mm away from the start of the path",
                    amount * 1e3
                )
            }
            FollowCause::Unreachable(failure) => write!(f, "{failure}"),
            FollowCause::Limit => {
                write!(
                    f,
                    "joint {joint} would pass its limit by {amount:.4} (rad or m)"
                )
            }
            FollowCause::Singular => write!(
                f,
                "the path runs into a singular pose: joint {joint} would have to jump (smallest singular value {amount:.1e})"
            ),
            FollowCause::TooManyPoints => {
                write!(f, "more than {amount} points are needed to follow the path")
            }
        }
    }
}

impl std::error::Error for FollowError {}
