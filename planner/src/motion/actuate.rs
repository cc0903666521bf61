//! Moves of single joints.

use nalgebra::SVector;

use super::{MotionError, PlannedMove, Planner};
use crate::task::JointMove;

impl<const N: usize> Planner<N> {
    pub(super) fn plan_joints(
        &self,
        motion: &JointMove,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        let mut goal = *start;
        motion.apply(goal.as_mut_slice());
        let mut slow = self.clone();
        slow.limits.velocity *= motion.shares.0;
        slow.limits.acceleration *= motion.shares.1;
        for target in motion.goals.iter().filter(|target| target.joint < N) {
            self.check_range(target.joint, target.position)?;
            let joint = target.joint;
            if let Some(speed) = target.speed {
                slow.limits.velocity[joint] = speed.min(self.limits.velocity[joint]);
            }
            if let Some(acceleration) = target.acceleration {
                let most = self.limits.acceleration[joint];
                slow.limits.acceleration[joint] = acceleration.min(most);
            }
        }
        let point = motion.of_point(self.chain().forward(&goal));
        slow.certify(&point, start, slow.joint_move(&point, start, &goal)?)
    }

    /// Whether a joint may stand there (rad, m).
    fn check_range(&self, joint: usize, position: f64) -> Result<(), MotionError> {
        let (lower, upper) = (self.limits.lower[joint], self.limits.upper[joint]);
        let beyond = (position - upper).max(lower - position);
        if beyond <= 0.0 {
            return Ok(());
        }
        Err(MotionError::JointBeyondLimit {
            joint: self.joint_name(joint),
            beyond: self.amount(joint, beyond),
        })
    }
}
