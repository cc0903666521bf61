//! Limits of the joints.

use nalgebra::SVector;

use crate::JointLimits;

/// Limits of `N` joints for a state-to-state move; both directions may differ.
///
/// An infinite jerk limit makes the move second order: acceleration may jump. An infinite velocity
/// limit is allowed as well; acceleration limits must be finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<const N: usize> {
    /// Highest positions (rad), may be infinite.
    pub position_max: SVector<f64, N>,
    /// Lowest positions (rad), may be minus infinite.
    pub position_min: SVector<f64, N>,
    /// Highest velocities (rad/s), positive.
    pub velocity_max: SVector<f64, N>,
    /// Lowest velocities (rad/s), negative.
    pub velocity_min: SVector<f64, N>,
    /// Highest accelerations (rad/s²), positive.
    pub acceleration_max: SVector<f64, N>,
    /// Lowest accelerations (rad/s²), negative.
    pub acceleration_min: SVector<f64, N>,
    /// Largest magnitudes of jerk (rad/s³), positive, may be infinite.
    pub jerk: SVector<f64, N>,
}

impl<const N: usize> Limits<N> {
    /// The same magnitude in both directions and no limit on position.
    ///
    /// ```
    /// use nalgebra::vector;
    /// use trajectory::otg::Limits;
    ///
    /// let limits = Limits::symmetric(vector![1.0, 2.0], vector![5.0, 5.0], vector![50.0, 50.0]);
    /// assert_eq!(limits.velocity_min, vector![-1.0, -2.0]);
    /// ```
    pub fn symmetric(
        velocity: SVector<f64, N>,
        acceleration: SVector<f64, N>,
        jerk: SVector<f64, N>,
    ) -> Self {
        Self {
            position_max: SVector::repeat(f64::INFINITY),
            position_min: SVector::repeat(f64::NEG_INFINITY),
            velocity_max: velocity,
            velocity_min: -velocity,
            acceleration_max: acceleration,
            acceleration_min: -acceleration,
            jerk,
        }
    }

    /// These limits with the positions kept between `lower` and `upper` (rad).
    #[must_use]
    pub fn within(mut self, lower: SVector<f64, N>, upper: SVector<f64, N>) -> Self {
        self.position_min = lower;
        self.position_max = upper;
        self
    }
}

impl<const N: usize> From<&JointLimits<N>> for Limits<N> {
    fn from(limits: &JointLimits<N>) -> Self {
        Self::symmetric(limits.velocity, limits.acceleration, limits.jerk)
            .within(limits.lower, limits.upper)
    }
}
