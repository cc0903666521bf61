//! Why there is no state-to-state move.

use thiserror::Error;

/// Why no state-to-state move could be planned. Every variant names the joint and the number.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum OtgError {
    /// A number of the start or the target is not finite.
    #[error("joint {joint}: {quantity} must be finite, got {value}")]
    NotFinite {
        /// Which joint, from 0.
        joint: usize,
        /// Which quantity.
        quantity: &'static str,
        /// The number given.
        value: f64,
    },
    /// A limit has the wrong sign, is zero or is not a number.
    #[error("joint {joint}: {quantity} limit must be {expected}, got {value}")]
    BadLimit {
        /// Which joint, from 0.
        joint: usize,
        /// Which limit.
        quantity: &'static str,
        /// What it must be.
        expected: &'static str,
        /// The number given.
        value: f64,
    },
    /// An option is not usable.
    #[error("{option} must be {expected}, got {value}")]
    BadOption {
        /// Which option.
        option: &'static str,
        /// What it must be.
        expected: &'static str,
        /// The number given.
        value: f64,
    },
    /// The target itself breaks a limit, or can only be reached by breaking one.
    #[error("joint {joint}: target {quantity} {value} is beyond the limit {limit}")]
    TargetBeyondLimit {
        /// Which joint, from 0.
        joint: usize,
        /// Which quantity.
        quantity: &'static str,
        /// The number of the target, or what it makes unavoidable.
        value: f64,
        /// The limit.
        limit: f64,
    },
    /// The move would leave the range of positions.
    #[error("joint {joint}: the move would reach position {value}, beyond the limit {limit}")]
    PositionLimit {
        /// Which joint, from 0.
        joint: usize,
        /// The outermost position (rad).
        value: f64,
        /// The limit (rad).
        limit: f64,
    },
    /// The states do not lie on one straight line in joint space.
    #[error("joint {joint}: no straight line, {quantity} is off it by {deviation}")]
    NotStraight {
        /// Which joint, from 0.
        joint: usize,
        /// Which quantity.
        quantity: &'static str,
        /// By how much (SI).
        deviation: f64,
    },
    /// The numbers are so far apart that durations leave the range of floating point.
    #[error("joint {joint}: no duration above {time} s can be computed for these numbers")]
    OutOfRange {
        /// Which joint, from 0.
        joint: usize,
        /// The last duration tried (s).
        time: f64,
    },
}
