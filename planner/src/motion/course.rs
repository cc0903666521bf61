//! A motion of an arm from which a search with the joints begins.

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
    /// Where the search ended whose curve it follows in the time of the tool.
    pub(super) seed: Option<Seed>,
}

impl<const N: usize> Course<N> {
    /// The course of a motion that is planned.
    pub(super) fn of(planned: &PlannedMove<N>) -> Self {
        let passes = planned.certificate.poses.iter().map(|pass| pass.time_s);
        Self {
            trajectory: planned.trajectory.clone(),
            passes: passes.collect(),
            time: planned.trajectory.duration(),
            seed: None,
        }
    }
}

impl<const N: usize> Planner<N> {
    /// The course of the joints along a curve in the time of the tool, in which they need not keep their limits.
    pub(super) fn course_along(&self, followed: &Followed<N>) -> Course<N> {
        let passes = followed.path.plan.crossings().iter();
        Course {
            trajectory: Trajectory::new(pieces(&followed.points)),
            passes: passes.map(|pass| pass.time).collect(),
            time: self.about_time(&followed.points),
            seed: None,
        }
    }
}
