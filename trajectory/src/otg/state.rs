//! The state of a group of joints at one time.

use nalgebra::SVector;
use realtime::Sample;

/// Position, velocity and acceleration of `N` joints at one time: the start or the target of a move
/// (rad, rad/s, rad/s²; metres for prismatic joints).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<const N: usize> {
    /// Joint positions (rad).
    pub position: SVector<f64, N>,
    /// Joint velocities (rad/s).
    pub velocity: SVector<f64, N>,
    /// Joint accelerations (rad/s²).
    pub acceleration: SVector<f64, N>,
}

impl<const N: usize> State<N> {
    /// Standing still at `position` (rad).
    pub fn rest(position: SVector<f64, N>) -> Self {
        Self {
            position,
            velocity: SVector::zeros(),
            acceleration: SVector::zeros(),
        }
    }
}

impl<const N: usize> From<Sample<N>> for State<N> {
    fn from(sample: Sample<N>) -> Self {
        Self {
            position: sample.position,
            velocity: sample.velocity,
            acceleration: sample.acceleration,
        }
    }
}
