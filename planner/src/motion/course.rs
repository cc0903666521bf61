//! A motion of an arm from which a search with the joints begins.

use nalgebra::SVector;
use trajectory::Trajectory;
use trajectory::smooth::Seed;

use super::cartesian::pieces;
use super::slow_time::SlowTime;
use super::smooth_joints::Followed;
use super::{PlannedMove, Planner};

/// Time of the joints along a curve, over that of the tool, up to which a search goes on from where the one before ended; where
/// they need longer they were known too badly.
const FORESEEN: f64 = 1.15;

/// A motion of an arm from which a search with the joints begins.
pub(super) struct Course<const N: usize> {
    pub(super) trajectory: Trajectory<N>,
    /// The times of the trajectory at which it passes the poses but the last, s.
    passes: Vec<f64>,
    /// About the time that the joints need along it, s.
    pub(super) time: f64,
    /// Where the search ended whose curve it follows in the time of the tool.
    pub(super) seed: Option<Seed>,
    /// A time in which the joints about keep their limits, if they do not in that of the trajectory.
    slow: Option<SlowTime>,
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
            slow: None,
        }
    }

    /// The same that goes on from where a search ended, if the joints need about the time that it foretold, s.
    pub(super) fn onward(self, seed: Seed, foretold: f64) -> Self {
        if self.time >= FORESEEN * foretold {
            return self;
        }
        Self {
            seed: Some(seed),
            ..self
        }
    }

    /// The same that does not go on from where a search ended.
    pub(super) fn anew(self) -> Self {
        Self { seed: None, ..self }
    }

    /// The time in which it is made, if not in that of its trajectory: a search that goes on begins in that of the tool.
    fn slow(&self) -> Option<&SlowTime> {
        self.slow.as_ref().filter(|_| self.seed.is_none())
    }

    /// How long it takes, s.
    pub(super) fn duration(&self) -> f64 {
        let slow = self.slow().map(SlowTime::duration);
        slow.unwrap_or_else(|| self.trajectory.duration())
    }

    /// The time, s, of the motion at which a search begins, or about that of its joints if it is longer.
    pub(super) fn begins(&self) -> f64 {
        self.time.max(self.duration())
    }

    /// Where its joints are at a time, s.
    pub(super) fn joints(&self, time: f64) -> SVector<f64, N> {
        let time = self.slow().map_or(time, |slow| slow.tool(time));
        self.trajectory.sample(time).position
    }

    /// When it passes the poses but the last, s.
    pub(super) fn passes(&self) -> Vec<f64> {
        let slow = |time: &f64| self.slow().map_or(*time, |slow| slow.at(*time));
        self.passes.iter().map(slow).collect()
    }
}

impl<const N: usize> Planner<N> {
    /// The course of the joints along a curve.
    pub(super) fn course_along(&self, followed: &Followed<N>) -> Course<N> {
        let passes = followed.path.plan.crossings().iter();
        let passes: Vec<f64> = passes.map(|pass| pass.time).collect();
        let points = followed.points.iter();
        let factors: Vec<_> = points
            .map(|point| (point.u, self.slowdown(point)))
            .collect();
        let moves = factors.len() > 1;
        Course {
            slow: moves.then(|| SlowTime::new(&factors, passes.len() + 1)),
            trajectory: Trajectory::new(pieces(&followed.points)),
            passes,
            time: self.about_time(&followed.points),
            seed: None,
        }
    }
}
