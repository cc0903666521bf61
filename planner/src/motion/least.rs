//! A lower bound of the time of all motions within the limits.

use nalgebra::{Isometry3, SVector};
use trajectory::smooth::{self, SmoothOptions};
use trajectory::timing::least_time;

use super::Planner;
use super::draft::Draft;
use super::least_turn::least_turn;
use crate::task::{Move, Shape};

impl<const N: usize> Planner<N> {
    /// Lower bound of the time of all motions between the same ends within the limits, s: from each
    /// joint alone, from the tool alone through the poses, and from the known path.
    pub(super) fn least_time(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        end: &SVector<f64, N>,
        draft: &Draft<N>,
    ) -> f64 {
        let poses = self.through(motion, start);
        let mut options = SmoothOptions::new(motion.tolerance, motion.limits);
        match motion.shape {
            // Any path is allowed.
            Shape::Joint => options.corridor = Some(f64::INFINITY),
            Shape::Straight => options.tolerance = 0.0,
            Shape::Smooth => {}
        }
        let mut tool = smooth::least_time(&poses, &options).unwrap_or(0.0);
        if motion.shape == Shape::Joint {
            let turn = least_turn(self.chain(), start, end);
            tool = tool.max(smooth::least_turning_time(turn, &motion.limits));
        }
        // The joints of a seven-joint arm may stop elsewhere at the same poses.
        let stops = motion.shape == Shape::Smooth && motion.tolerance == 0.0 && N <= 6;
        let joints = if stops {
            self.least_with_stops(motion, start, end, draft)
        } else {
            self.least_of_joints(start, end)
        };
        // Both are exact up to rounding where they are the motion itself.
        let least = joints.max(tool).max(draft.least);
        least.min(draft.trajectory.duration())
    }

    /// The least time from rest to rest of the slowest joint, s.
    pub(super) fn least_of_joints(&self, start: &SVector<f64, N>, end: &SVector<f64, N>) -> f64 {
        let (way, limits) = ((end - start).abs(), self.limits());
        let time = |j: usize| {
            let all = [limits.velocity[j], limits.acceleration[j], limits.jerk[j]];
            least_time(way[j], all)
        };
        (0..N).map(time).fold(0.0, f64::max)
    }

    /// The sum of the least times of all legs, from stop to stop, s.
    fn least_with_stops(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        end: &SVector<f64, N>,
        draft: &Draft<N>,
    ) -> f64 {
        let stops = draft.crossings.iter();
        let stops = stops.map(|pass| draft.trajectory.sample(pass.time).position);
        let (mut from, mut sum) = (*start, 0.0);
        for (to, tool) in stops.chain([*end]).zip(self.least_of_legs(motion, start)) {
            sum += self.least_of_joints(&from, &to).max(tool);
            from = to;
        }
        sum
    }

    /// A lower bound of the time of a straight move to each pose in turn, s: from the tool.
    pub(super) fn least_of_legs(&self, motion: &Move, start: &SVector<f64, N>) -> Vec<f64> {
        let options = SmoothOptions::new(0.0, motion.limits);
        let mut from = self.chain().forward(start);
        let least = |to: &Isometry3<f64>| {
            let leg = [std::mem::replace(&mut from, *to), *to];
            smooth::least_time(&leg, &options).unwrap_or(0.0)
        };
        motion.poses.iter().map(least).collect()
    }
}
