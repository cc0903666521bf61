//! MoveSmoothlyTo: which of the motions that can be certified is taken.

use nalgebra::{Isometry3, SVector};
use trajectory::Trajectory;
use trajectory::smooth::{RestCause, SmoothOptions, least_time};

use super::cartesian::SmoothPath;
use super::draft::Draft;
use super::{Blend, MotionError, PlannedMove, Planner, ROUNDING};
use crate::task::{Move, Shape};

/// Share of the tolerance that is tried where all of it fails with the joints.
const QUARTER: f64 = 0.25;

impl<const N: usize> Planner<N> {
    /// The smooth motion within the tolerance asked for. If its certificate with the joints fails,
    /// a quarter of the tolerance is tried, then a stop at each pose. Never slower than straight
    /// moves to each pose in turn: these are tried wherever they may be faster.
    pub(super) fn smooth_move(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        if let Some(windowed) = self.begin_windows(motion, start) {
            return self.all_windows(windowed);
        }
        let planned = match self.blended(motion, start, motion.tolerance) {
            Err(first)
                if matches!(first, MotionError::Uncertified(_)) && motion.tolerance > 0.0 =>
            {
                self.blended(motion, start, QUARTER * motion.tolerance)
                    .or_else(|_| self.blended(motion, start, 0.0))
                    .map_err(|_| first)
            }
            other => other,
        }?;
        let least = self.least_with_straights(motion, start, &planned) * (1.0 + ROUNDING);
        if planned.trajectory.duration() <= least {
            return Ok(planned);
        }
        let straights = self.straight_moves(motion, start);
        let faster = |straights: &PlannedMove<N>| {
            straights.trajectory.duration() < planned.trajectory.duration()
        };
        Ok(match straights.ok().filter(faster) {
            Some(straights) => PlannedMove {
                blend: planned.blend.map(|blend| Blend {
                    tolerance: 0.0,
                    corridor_ratio: 0.0,
                    fallbacks: motion.poses.len() - 1,
                    ..blend
                }),
                ..straights
            },
            None => planned,
        })
    }

    /// A lower bound of the time of straight moves to each pose in turn, s: from the tool, and from
    /// the joints that reach each pose near those of a motion that is planned already.
    fn least_with_straights(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        planned: &PlannedMove<N>,
    ) -> f64 {
        let options = SmoothOptions::new(0.0, motion.limits);
        let passes = planned.certificate.poses.iter();
        let near = passes.map(|pass| planned.trajectory.sample(pass.time_s).position);
        // The joints of a seven-joint arm may be elsewhere at the same poses.
        let joints = |pose: &Isometry3<f64>, near: &SVector<f64, N>| {
            let reached = (N <= 6).then(|| self.solver.nearest(pose, near).ok());
            reached.flatten().map(|solution| solution.q)
        };
        let (mut from, mut pose) = (Some(*start), self.chain().forward(start));
        let mut sum = 0.0;
        for (near, next) in near.chain([planned.end]).zip(&motion.poses) {
            let to = joints(next, &near);
            let tool = least_time(&[pose, *next], &options).unwrap_or(0.0);
            let both = from.zip(to);
            let joint = both.map_or(0.0, |(from, to)| self.least_of_joints(&from, &to));
            sum += tool.max(joint);
            (from, pose) = (to, *next);
        }
        sum
    }

    /// The motion within a tolerance, at most that of the command. An arm that cannot follow the
    /// curve fitted through a dense list may follow the spline.
    fn blended(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        tolerance: f64,
    ) -> Result<PlannedMove<N>, MotionError> {
        let tighter = Move {
            tolerance,
            ..motion.clone()
        };
        let along = |path: &SmoothPath| -> Result<_, MotionError> {
            let mut planned = Err(MotionError::NoWay);
            for draft in self.follow_smooth(path, &tighter, start)? {
                planned = self.certify(motion, start, draft);
                if planned.is_ok() {
                    break;
                }
            }
            let mut planned = planned?;
            path.name_rests(&mut planned.certificate);
            Ok(PlannedMove {
                blend: Some(path.blend(tolerance)),
                ..planned
            })
        };
        let path = self.smooth_path(&tighter, start, true)?;
        match along(&path) {
            Err(_) if path.is_fitted() => along(&self.smooth_path(&tighter, start, false)?),
            other => other,
        }
    }

    /// A straight move to each pose in turn, with a stop at each.
    fn straight_moves(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        let (mut pieces, mut crossings) = (Vec::new(), Vec::with_capacity(motion.poses.len()));
        let (mut joints, mut time) = (*start, 0.0);
        for pose in &motion.poses {
            let leg = Move {
                shape: Shape::Straight,
                poses: vec![*pose],
                ..motion.clone()
            };
            let leg = self.plan_straight(&leg, &joints)?.trajectory;
            if let Some(last) = leg.pieces().last() {
                time += leg.duration();
                joints = last.sample(last.duration).position;
                pieces.extend_from_slice(leg.pieces());
            }
            crossings.push(time);
        }
        crossings.pop();
        let draft = Draft {
            crossings,
            ..Draft::of(Trajectory::new(pieces))
        };
        let mut planned = self.certify(motion, start, draft)?;
        for pass in &mut planned.certificate.poses {
            pass.rests = Some(RestCause::Stop.as_str());
        }
        Ok(planned)
    }
}
