//! A limit of a motion, and how near the motion comes to it.

use std::fmt;

/// One limit of the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Limit {
    /// Speed of a joint (index from 0).
    JointVelocity(usize),
    /// Acceleration of a joint.
    JointAcceleration(usize),
    /// Jerk of a joint.
    JointJerk(usize),
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
    /// The cap on the rate of the path parameter.
    Rate,
}

/// For people: joints are counted from 1.
impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::JointVelocity(joint) => write!(f, "velocity of joint {}", joint + 1),
            Self::JointAcceleration(joint) => write!(f, "acceleration of joint {}", joint + 1),
            Self::JointJerk(joint) => write!(f, "jerk of joint {}", joint + 1),
            Self::ToolSpeed => f.write_str("tool speed"),
            Self::ToolAcceleration => f.write_str("tool acceleration"),
            Self::ToolJerk => f.write_str("tool jerk"),
            Self::AngularSpeed => f.write_str("angular speed"),
            Self::AngularAcceleration => f.write_str("angular acceleration"),
            Self::AngularJerk => f.write_str("angular jerk"),
            Self::Rate => f.write_str("rate of the path parameter"),
        }
    }
}

/// The power of the stretching factor by which a ratio falls: first, second or third.
pub(crate) fn order(limit: Limit) -> i32 {
    match limit {
        Limit::JointVelocity(_) | Limit::ToolSpeed | Limit::AngularSpeed | Limit::Rate => 1,
        Limit::JointAcceleration(_) | Limit::ToolAcceleration | Limit::AngularAcceleration => 2,
        Limit::JointJerk(_) | Limit::ToolJerk | Limit::AngularJerk => 3,
    }
}

/// Root of the order 1, 2 or 3.
pub(crate) fn root(x: f64, order: i32) -> f64 {
    match order {
        1 => x,
        2 => x.sqrt(),
        _ => x.cbrt(),
    }
}

/// How near the motion comes to one limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitPeak {
    /// Which limit.
    pub limit: Limit,
    /// Highest value over the limit: a bound that holds for all times, not only at samples.
    pub ratio: f64,
    /// When (s).
    pub time: f64,
}

/// A part of the motion in which one limit is active.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActiveSpan {
    /// Which limit.
    pub limit: Limit,
    /// From when (s).
    pub start: f64,
    /// Until when (s).
    pub end: f64,
}
