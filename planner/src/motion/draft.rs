//! A motion that is not certified yet.

use trajectory::{MotionBounds, Trajectory};

/// A motion of the joints, with the data known about it.
#[derive(Clone, Debug)]
pub(super) struct Draft<const N: usize> {
    /// The motion.
    pub trajectory: Trajectory<N>,
    /// When it passes each intermediate pose of a smooth move, s; never decreasing.
    pub crossings: Vec<f64>,
    /// Its bounds, once they were computed: then it keeps every limit.
    pub bounds: Option<MotionBounds<N>>,
    /// Lower bound of the time along its path, s; 0 if not known.
    pub least: f64,
}

impl<const N: usize> Draft<N> {
    /// A motion of which nothing else is known.
    pub(super) fn of(trajectory: Trajectory<N>) -> Self {
        Self {
            trajectory,
            crossings: Vec::new(),
            bounds: None,
            least: 0.0,
        }
    }

    /// The motion and its bounds, slowed down if they exceed a limit.
    pub(super) fn bounded(self, bounds: MotionBounds<N>) -> (Self, MotionBounds<N>) {
        let slower = bounds.slower() * (1.0 + 1e-12);
        // The certificate refuses NaN.
        if slower.is_nan() || slower <= 1.0 + 1e-12 || self.trajectory.duration() <= 0.0 {
            return (self, bounds);
        }
        let slow = Self {
            trajectory: self.trajectory.stretched(slower),
            crossings: self.crossings.iter().map(|time| time * slower).collect(),
            ..self
        };
        (slow, bounds.stretched(slower))
    }
}
