//! What is known for certain about a time law.

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

/// What is known for certain about a timed path.
///
/// Joint ratios are bounds on the quintic pieces themselves for all times. Tool ratios come from
/// dense samples of the exact composition plus `tool_margin`.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeCertificate {
    /// Every finite limit with its peak, in the order of [`Limit`].
    pub peaks: Vec<LimitPeak>,
    /// The intervals in which limits are active, in the order of time; those of different limits
    /// may overlap.
    pub active: Vec<ActiveSpan>,
    /// How long the motion lasts (s).
    pub duration: f64,
    /// No motion along this path within these limits is shorter (s): the fastest without jerk limits
    /// (less an error bar for its grid), or that of one joint or of the tool straight from end to
    /// end with them, whichever is longer.
    pub lower_bound: f64,
    /// Largest distance of a joint from the path (rad), at the middle and the quarters of pieces.
    pub fit_error: f64,
    /// Margin added to sampled tool ratios for the times between the samples.
    pub tool_margin: f64,
    /// Factor by which the whole law was slowed down at the end to meet every bound; 1 = not at
    /// all.
    pub stretch: f64,
    /// Time (s) until which the given start state determines the motion; 0 from rest.
    pub given: f64,
    /// Cells of the law.
    pub cells: usize,
    /// Newton steps that were taken.
    pub iterations: usize,
}

impl TimeCertificate {
    /// The largest ratio among the limits that `which` picks; 0 when there is none.
    pub fn ratio(&self, which: impl Fn(Limit) -> bool) -> f64 {
        let picked = self.peaks.iter().filter(|peak| which(peak.limit));
        picked.map(|peak| peak.ratio).fold(0.0, f64::max)
    }

    /// Whether every limit holds for all times; a start state that was given may exceed them by
    /// a millionth, as it may come from rounded numbers.
    pub fn holds(&self) -> bool {
        let allowed = |peak: &LimitPeak| {
            if peak.time < self.given {
                1.0 + 1e-6
            } else {
                1.0
            }
        };
        self.peaks.iter().all(|peak| peak.ratio <= allowed(peak))
    }

    /// Duration over its lower bound, 1 at best.
    pub fn optimality(&self) -> f64 {
        if self.lower_bound > 0.0 {
            self.duration / self.lower_bound
        } else {
            1.0
        }
    }
}
