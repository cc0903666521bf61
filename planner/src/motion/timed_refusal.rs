//! Why a joint trajectory with times is refused.

use thiserror::Error;

use super::JointAmount;

/// Why a joint trajectory with times is refused. Points are counted from 1, joints go by their
/// names.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TimedRefusal {
    /// There is no point, or there are too many.
    #[error("a trajectory has 1 to {most} points, got {got}")]
    Count {
        /// How many it may have.
        most: usize,
        /// How many it has.
        got: usize,
    },
    /// The arm has no such joint.
    #[error("the arm has no joint {joint:?}; its joints are {known}")]
    UnknownJoint {
        /// The name that came.
        joint: String,
        /// The names that are known.
        known: String,
    },
    /// A joint of the arm is not named.
    #[error("{joint} is missing: a trajectory names every joint of the arm")]
    MissingJoint {
        /// The joint.
        joint: String,
    },
    /// A joint is named twice.
    #[error("{joint} is named twice")]
    JointTwice {
        /// The joint.
        joint: String,
    },
    /// A point does not have one number per joint.
    #[error("point {point} has {got} {what} for {wanted} joints")]
    Length {
        /// The point.
        point: usize,
        /// Positions, velocities or accelerations.
        what: &'static str,
        /// How many there are.
        got: usize,
        /// How many joints there are.
        wanted: usize,
    },
    /// Some points have velocities or accelerations, others do not.
    #[error("point {point} has no {what}, others have: give them for all points or for none")]
    Mixed {
        /// The first point without.
        point: usize,
        /// Velocities or accelerations.
        what: &'static str,
    },
    /// A value is no number.
    #[error("point {point}: the {what} of {joint} is {value}, expected a number")]
    NoNumber {
        /// The point.
        point: usize,
        /// Position, velocity or acceleration.
        what: &'static str,
        /// The joint.
        joint: String,
        /// What came.
        value: f64,
    },
    /// The times do not grow.
    #[error("point {point} is at {time} s, expected at least {least} s")]
    Time {
        /// The point.
        point: usize,
        /// When it is, s.
        time: f64,
        /// When it is at the earliest, s.
        least: f64,
    },
    /// It begins elsewhere.
    #[error(
        "the trajectory begins with {joint} {off} away from where the arm stands, {allowed} are allowed"
    )]
    Start {
        /// The joint that is furthest away.
        joint: String,
        /// How far.
        off: JointAmount,
        /// How far it may be.
        allowed: JointAmount,
    },
    /// The first or the last point is not at rest.
    #[error(
        "point {point} has a velocity of {value:.4} for {joint}: a trajectory begins and ends at rest"
    )]
    NotAtRest {
        /// The point.
        point: usize,
        /// The joint.
        joint: String,
        /// Its velocity (rad/s, m/s).
        value: f64,
    },
    /// There are only positions, and the straight pieces between them have corners.
    #[error(
        "the points have positions only: between straight pieces the velocity of {joint} jumps by {jump:.4} at point {point}"
    )]
    Corner {
        /// The point.
        point: usize,
        /// The joint.
        joint: String,
        /// How much its velocity jumps (rad/s, m/s).
        jump: f64,
    },
    /// A point is beyond the range of a joint.
    #[error("point {point} needs {joint} {beyond} beyond its limit")]
    Beyond {
        /// The point.
        point: usize,
        /// The joint.
        joint: String,
        /// How far beyond.
        beyond: JointAmount,
    },
    /// A joint leaves its range between the points.
    #[error("{joint} goes {beyond} beyond its limit between two points")]
    BeyondBetween {
        /// The joint.
        joint: String,
        /// How far beyond.
        beyond: JointAmount,
    },
    /// A limit is exceeded.
    #[error("{limit} is {ratio:.4} times its limit at {time:.4} s, {place}")]
    Limit {
        /// Name of the limit, with the joint it is of.
        limit: String,
        /// The quantity over its limit.
        ratio: f64,
        /// When, s after the first point's time 0.
        time: f64,
        /// Between which points.
        place: String,
    },
}

impl TimedRefusal {
    /// What would fix it.
    #[must_use]
    pub fn help(&self) -> &'static str {
        match self {
            Self::Count { .. } | Self::Length { .. } | Self::Mixed { .. } => {
                "give each point one position per joint, and for all points or none velocities and accelerations"
            }
            Self::UnknownJoint { .. } | Self::MissingJoint { .. } | Self::JointTwice { .. } => {
                "name each joint once, as `canter robots show` does"
            }
            Self::NoNumber { .. } | Self::Time { .. } => {
                "give numbers, and times that grow from point to point"
            }
            Self::Start { .. } => "plan from where the arm stands now",
            Self::NotAtRest { .. } => "give the first and the last point velocity 0",
            Self::Corner { .. } => "give velocities, or ask for a time law of Canter's own",
            Self::Beyond { .. } | Self::BeyondBetween { .. } => {
                "stay within the range that `canter robots show` tells"
            }
            Self::Limit { .. } => "give it more time, or ask for a time law of Canter's own",
        }
    }
}
