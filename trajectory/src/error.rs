//! Why a trajectory could not be planned.

use thiserror::Error;

/// Why a path has no time law. These errors do not occur in the control cycle.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TimingError {
    /// A joint limit is zero, negative or not a number (infinity means: no limit).
    #[error("joint {joint}: the {quantity} limit must be positive, got {value}")]
    BadJointLimit {
        /// Index of the joint, from 0.
        joint: usize,
        /// `velocity`, `acceleration` or `jerk`.
        quantity: &'static str,
        /// What was given.
        value: f64,
    },
    /// A tool limit is zero, negative or not a number (infinity means: no limit).
    #[error("tool: the {quantity} limit must be positive, got {value}")]
    BadToolLimit {
        /// Which limit, `speed` or `angular_jerk` for example.
        quantity: &'static str,
        /// What was given.
        value: f64,
    },
    /// An option is out of its range.
    #[error("option {option} must be positive and finite, got {value}")]
    BadOption {
        /// Name of the option.
        option: &'static str,
        /// What was given.
        value: f64,
    },
    /// The path has no positive finite length of its parameter.
    #[error("the path parameter must end at a positive finite value, got {end}")]
    EmptyPath {
        /// The last parameter value of the path.
        end: f64,
    },
    /// A value or derivative of the path is not finite.
    #[error("the path is not finite at u = {u}")]
    NotFinite {
        /// Path parameter.
        u: f64,
    },
    /// The path has a corner, or a jump of curvature, which a motion with bounded jerk can only
    /// pass at rest: the path must be split there.
    #[error(
        "joint {joint}: derivative {order} of the path jumps by {jump} at u = {u}; split the path there"
    )]
    Corner {
        /// Path parameter of the corner.
        u: f64,
        /// Index of the joint, from 0.
        joint: usize,
        /// Which derivative jumps: 1 or 2.
        order: usize,
        /// By how much.
        jump: f64,
    },
    /// No limit bounds the motion at all, so there is no shortest time.
    #[error("no limit bounds the motion")]
    Unbounded,
    /// The given state at the start of the path cannot be continued within the limits.
    #[error("the start state exceeds what the limits allow {ratio:.4} times ({limit})")]
    StartTooFast {
        /// Least excess that was reached, over 1.
        ratio: f64,
        /// The limit that is exceeded most.
        limit: String,
    },
}
