//! A joint trajectory whose times are given by others.

/// A joint trajectory with times, as a client gives it: see [`crate::motion::Planner::timed`].
#[derive(Clone, Debug, PartialEq)]
pub struct TimedTrajectory {
    /// Names of the joints, in the order of the numbers in each point: every joint of the arm once.
    pub joints: Vec<String>,
    /// The points in the order of time.
    pub points: Vec<TimedPoint>,
    /// Whether only the way is kept, and the planner makes the time law.
    pub retime: bool,
}

/// One point of a [`TimedTrajectory`]. Either no point has velocities or all have; the same of
/// accelerations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TimedPoint {
    /// When, s after the start of the trajectory.
    pub time: f64,
    /// Joint positions (rad, m), in the order of the names.
    pub positions: Vec<f64>,
    /// Joint velocities (rad/s, m/s); empty: not given.
    pub velocities: Vec<f64>,
    /// Joint accelerations (rad/s², m/s²); empty: not given.
    pub accelerations: Vec<f64>,
}
