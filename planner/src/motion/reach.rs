//! Checks the reach before a curve is planned.

use super::{MotionError, Planner};
use crate::task::{Move, Shape};
use nalgebra::SVector;

impl<const N: usize> Planner<N> {
    /// Refuses a straight or smooth move with a pose outside the ball of reach, before a curve is
    /// planned: a curve of kilometres would be followed in steps of millimetres. A joint move has
    /// no curve; the inverse kinematics refuses it with the same message.
    ///
    /// An intermediate pose may be out of reach by the tolerance, but by no more than the radius of
    /// the ball: a larger tolerance does not help.
    ///
    /// # Errors
    /// The error of the inverse kinematics for the first such pose.
    pub(super) fn check_reach(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<(), MotionError> {
        if motion.shape == Shape::Joint {
            return Ok(());
        }
        let (middle, radius) = self.chain().reach_ball();
        let last = motion.poses.len().saturating_sub(1);
        for (index, pose) in motion.poses.iter().enumerate() {
            let distance = (pose.translation.vector - middle.coords).norm();
            let slack = if index < last {
                motion.tolerance.min(radius)
            } else {
                0.0
            };
            // Written so that NaN is refused too.
            let inside = distance <= radius + slack + ROUNDING_M;
            if inside {
                continue;
            }
            return Err(match self.solver.nearest(pose, start) {
                Err(report) => self.refusal(index + 1, &report),
                Ok(_) => MotionError::OutOfReach {
                    pose: index + 1,
                    millimetres: (distance - radius) * 1e3,
                },
            });
        }
        Ok(())
    }
}

/// Tolerance of the ball's radius for rounding, m.
const ROUNDING_M: f64 = 1e-9;
