//! Limits of the joints.

use nalgebra::SVector;

/// Limits of `N` joints (rad, rad/s, rad/s², rad/s³; metres for a prismatic joint). Infinity
/// means: not limited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits<const N: usize> {
    /// Lowest positions (rad).
    pub lower: SVector<f64, N>,
    /// Highest positions (rad).
    pub upper: SVector<f64, N>,
    /// Highest speeds (rad/s).
    pub velocity: SVector<f64, N>,
    /// Highest accelerations (rad/s²), up and down.
    pub acceleration: SVector<f64, N>,
    /// Highest jerks (rad/s³), up and down.
    pub jerk: SVector<f64, N>,
}

impl<const N: usize> JointLimits<N> {
    /// The same velocity (rad/s), acceleration (rad/s²) and jerk (rad/s³) for every joint, any
    /// position.
    pub fn uniform(velocity: f64, acceleration: f64, jerk: f64) -> Self {
        Self {
            lower: SVector::repeat(f64::NEG_INFINITY),
            upper: SVector::repeat(f64::INFINITY),
            velocity: SVector::repeat(velocity),
            acceleration: SVector::repeat(acceleration),
            jerk: SVector::repeat(jerk),
        }
    }
}
