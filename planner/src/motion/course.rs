//! A motion of an arm from which a search with the joints begins.

use kinematics::follow;
use nalgebra::SVector;
use trajectory::Trajectory;
use trajectory::smooth::Seed;

use super::cartesian::pieces;
use super::smooth_joints::Followed;
use super::{PlannedMove, Planner};

/// A motion of an arm from which a search with the joints begins.
pub(super) struct Course<const N: usize> {
    pub(super) trajectory: Trajectory<N>,
    /// The times at which it passes the poses but the last, s.
    pub(super) passes: Vec<f64>,
    /// About the time that the joints need along it, s.
    pub(super) time: f64,
    /// The linear function of the joints that says where a spare joint is.
    pub(super) direction: Option<SVector<f64, N>>,
    /// Where the search ended whose curve it follows in the time of the tool.
    pub(super) seed: Option<Seed>,
}

impl<const N: usize> Planner<N> {
    /// The course of a motion that is planned.
    pub(super) fn course_of(&self, planned: &PlannedMove<N>) -> Course<N> {
        let passes = planned.certificate.poses.iter().map(|pass| pass.time_s);
        let trajectory = planned.trajectory.clone();
        Course {
            passes: passes.collect(),
            time: trajectory.duration(),
            direction: self.direction(&trajectory),
            trajectory,
            seed: None,
        }
    }

    /// The course of the joints along a curve in the time of the tool, in which they need not keep their limits.
    pub(super) fn course_along(&self, followed: &Followed<N>) -> Course<N> {
        let trajectory = Trajectory::new(pieces(&followed.points));
        let passes = followed.path.plan.crossings().iter();
        Course {
            passes: passes.map(|pass| pass.time).collect(),
            time: self.about_time(&followed.points),
            direction: self.direction(&trajectory),
            trajectory,
            seed: None,
        }
    }

    /// The direction in which a spare joint is free in the middle of a motion.
    fn direction(&self, trajectory: &Trajectory<N>) -> Option<SVector<f64, N>> {
        let middle = trajectory.sample(0.5 * trajectory.duration()).position;
        follow::spare_direction(self.chain(), &middle)
    }
}
