//! MoveSmoothlyTo where the joints rule: along a rough curve of the tool, which a short search finds.
//!
//! The fastest curve of the tool takes ten to a hundred times the planning, and the joints are no faster along it.

use nalgebra::{Isometry3, SVector};

use super::smooth::Search;
use super::smooth_joints::Followed;
use super::{PlannedMove, Planner};
use crate::task::Move;

/// Time of the joints along the rough curve, over that of the tool alone, up to which the tool rules.
const RULED: f64 = 1.05;
/// Time of a fitted curve over its bound from which on a spline may be faster, where the tolerance is that of mean legs or more, and
/// the gap to its optimum at which the search for that ends.
const FAR: f64 = 1.15;
const GAP: f64 = 0.01;

impl<const N: usize> Planner<N> {
    /// The motion along a rough curve that the joints follow, in about that time (s); `None` where the tool rules.
    pub(super) fn on_rough(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (curve, time): (Followed<N>, f64),
    ) -> Option<PlannedMove<N>> {
        if time <= RULED * curve.path.plan.duration() {
            return None;
        }
        let other = self.spline_instead(motion, start, (&curve, time));
        let curve = other.unwrap_or(curve);
        let first = self.on(&curve, motion, (start, f64::INFINITY)).ok()?;
        Some(self.for_the_arm(motion, start, (first, &curve)))
    }

    /// The joints along a spline, nearer to its optimum, where they need about less time for it than along the rough curve (s): it may cut
    /// the corners of a list that is finer than its tolerance.
    fn spline_instead(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (curve, time): (&Followed<N>, f64),
    ) -> Option<Followed<N>> {
        let plan = &curve.path.plan;
        let far = plan.duration() > FAR * plan.certificate().lower_bound;
        if curve.path.is_fitted() && !far || motion.tolerance < self.mean_leg(motion, start) {
            return None;
        }
        let search = Search {
            gap: Some(GAP),
            most: f64::INFINITY,
        };
        let spline = self.curve(start, (motion, search), false).ok()?;
        (self.about_time(&spline.points) < time).then_some(spline)
    }

    /// The mean length of the legs of a list, m.
    pub(super) fn mean_leg(&self, motion: &Move, start: &SVector<f64, N>) -> f64 {
        let poses = self.through(motion, start);
        let leg = |pair: &[Isometry3<f64>]| {
            (pair[1].translation.vector - pair[0].translation.vector).norm()
        };
        let length: f64 = poses.windows(2).map(leg).sum();
        length / motion.poses.len() as f64
    }
}
