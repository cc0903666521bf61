//! Limits of the joints.

use nalgebra::SVector;

/// Limits of `N` joints (rad and seconds; metres for a prismatic joint).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<const N: usize> {
    /// Lower ends of the ranges (rad).
    pub lower: SVector<f64, N>,
    /// Upper ends of the ranges (rad).
    pub upper: SVector<f64, N>,
    /// Largest speeds (rad/s).
    pub velocity: SVector<f64, N>,
    /// Largest accelerations (rad/s²).
    pub acceleration: SVector<f64, N>,
    /// Largest jerks (rad/s³).
    pub jerk: SVector<f64, N>,
}
