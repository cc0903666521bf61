//! Smooth moves whose legs have limits of their own.

use nalgebra::SVector;
use trajectory::bounds::Held;
use trajectory::{Boundary, MotionBounds, PacedPath, TimingOptions, Trajectory, smooth, time_path};

use super::cartesian::{Way, is_still, joint_path};
use super::certificate::Arm;
use super::draft::{Crossing, Draft};
use super::smooth_joints::moment;
use super::{Blend, MotionError, PlannedMove, Planner};
use crate::task::LegsMove;

impl<const N: usize> Planner<N> {
    /// As a smooth move, and in each leg within its own limits. If the certificate fails, a quarter of
    /// the tolerance is tried, then a stop at each pose.
    pub(super) fn plan_legs(
        &self,
        legs: &LegsMove,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        let motion = &legs.motion;
        if legs.limits.iter().all(|limits| *limits == motion.limits) {
            return self.plan_move(motion, start);
        }
        self.check_reach(motion, start)?;
        let attempt = |tolerance: f64| {
            let plan = |fit| self.legs_within(legs, start, tolerance, fit);
            plan(true).or_else(|_| plan(false))
        };
        match attempt(motion.tolerance) {
            Err(first)
                if matches!(first, MotionError::Uncertified(_)) && motion.tolerance > 0.0 =>
            {
                attempt(0.25 * motion.tolerance)
                    .or_else(|_| attempt(0.0))
                    .map_err(|_| first)
            }
            other => other,
        }
    }

    fn legs_within(
        &self,
        legs: &LegsMove,
        start: &SVector<f64, N>,
        tolerance: f64,
        fit: bool,
    ) -> Result<PlannedMove<N>, MotionError> {
        let motion = &legs.motion;
        let poses = self.through(motion, start);
        let mut options = smooth::SmoothOptions::new(tolerance, motion.limits);
        options.fit = fit;
        let plan = smooth::plan(&poses, &options)?;
        let at: Vec<f64> = plan.crossings().iter().map(|pass| pass.time).collect();
        if is_still(&poses) || plan.duration() <= 0.0 {
            return self.plan_move(motion, start);
        }
        let certificate = plan.certificate();
        let blend = Blend {
            tolerance,
            exact_stop: plan.exact_stop(),
            corridor_ratio: certificate.corridor.ratio,
            jerk_ratio: certificate.jerk.ratio.max(certificate.angular_jerk.ratio),
            fallbacks: plan.fallbacks(),
        };
        let towards = |u: f64| 1 + at.iter().take_while(|time| **time <= u).count();
        let way = Way {
            still_ends: true,
            towards: &towards,
            ..Way::along(&plan)
        };
        let points = self
            .followed(&way, start)
            .map_err(|blocked| self.blamed(blocked, motion, start))?;
        let path = PacedPath::new(
            joint_path(&plan, &points)?,
            &at,
            &legs.limits,
            &motion.limits,
        );
        let options = TimingOptions {
            start: Boundary::Free,
            end: Boundary::Free,
            rate_cap: Some(1.0),
            ..Default::default()
        };
        let timed = time_path(&path, &self.limits, &motion.limits, &options)?;
        let draft = Draft {
            crossings: Crossing::at(&Crossing::of(&plan), |u| moment(&timed.law, u)),
            ..Draft::of(timed.trajectory)
        };
        let draft = self.within_legs(self.slowed(draft, motion), legs);
        Ok(PlannedMove {
            blend: Some(blend),
            ..self.certify(motion, start, draft)?
        })
    }

    /// Slows a motion down, uniformly and by as little as needed, until the limits of every leg hold
    /// at all times.
    fn within_legs(&self, draft: Draft<N>, legs: &LegsMove) -> Draft<N> {
        let ends = draft.crossings.iter().map(|pass| pass.time);
        let ends = ends.chain([f64::INFINITY]);
        let mut start = 0.0;
        let mut slower = 1.0_f64;
        for (end, limits) in ends.zip(&legs.limits) {
            let times = draft.trajectory.times().windows(2);
            let pieces = draft.trajectory.pieces().iter().zip(times);
            let own = pieces.filter(|(_, time)| {
                let middle = 0.5 * (time[0] + time[1]);
                (start..end).contains(&middle)
            });
            let own: Vec<_> = own.map(|(piece, _)| *piece).collect();
            start = end;
            if own.is_empty() {
                continue;
            }
            let held = Held {
                joints: &self.limits,
                tool: limits,
                place: f64::INFINITY,
            };
            let bounds = MotionBounds::new(&Trajectory::new(own), &Arm(self.chain()), &held);
            slower = slower.max(bounds.slower());
        }
        if slower.is_nan() || slower <= 1.0 + 1e-12 {
            return draft;
        }
        let slower = slower * (1.0 + 1e-9);
        Draft {
            bounds: None,
            ..draft.stretched(slower)
        }
    }
}
