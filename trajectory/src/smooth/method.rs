//! How motions are made.

/// How a motion, or a part of it, was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// Nothing moves.
    Still,
    /// Straight legs with a stop at each pose.
    ExactStop,
    /// The time-optimal spline.
    Spline,
    /// A curve fitted through the balls of a dense list, and its fastest time law.
    Fit,
}
