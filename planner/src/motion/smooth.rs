//! MoveSmoothlyTo: which of the motions that can be certified is taken.

use nalgebra::{Isometry3, SVector};
use trajectory::smooth::{RestCause, SmoothOptions, least_time};
use trajectory::{Line, Trajectory};

use super::cartesian::{SmoothPath, Way, is_still};
use super::draft::{Crossing, Draft};
use super::{Blend, MotionError, PlannedMove, Planner, ROUNDING};
use crate::task::{Move, Shape};

/// Share of the tolerance that is tried where all of it fails with the joints.
const QUARTER: f64 = 0.25;
/// Time of the motion over that of the tool alone from which on the joints rule.
const RULED: f64 = 1.3;
/// Other curves tried then: shares of the linear and of the angular limits under which each is planned, and the gap to
/// the optimum at which its search ends. Far from its optimum a curve is rounder, which the joints follow faster.
const OTHERS: [([f64; 2], f64); 4] = [
    ([0.7, 1.0], 1.0),
    ([0.6, 0.6], 1.0),
    ([1.0, 0.4], 1.0),
    ([1.0, 1.0], 0.3),
];
/// Most spans of a curve that is cheap enough for that.
const CHEAP: usize = 400;

/// What is wanted of a curve that is tried besides another.
#[derive(Clone, Copy)]
struct Rough {
    /// Gap to the optimum at which its search ends.
    gap: f64,
    /// Time of the motion that it has to be faster than, s.
    most: f64,
}

/// Whether a curve may be possible for the tool, and only the joints fail on it.
fn is_of_the_joints(error: &MotionError) -> bool {
    matches!(
        error,
        MotionError::Uncertified(_) | MotionError::Blocked { .. }
    )
}

/// A motion along a smooth curve of the tool.
struct Along<const N: usize> {
    planned: PlannedMove<N>,
    /// Time of the tool alone, s.
    tool: f64,
    /// Spans of the curve.
    spans: usize,
}

impl<const N: usize> Planner<N> {
    /// The smooth motion within the tolerance asked for. If its certificate with the joints fails, or
    /// if they cannot follow its curve, other curves are tried; then, if they could follow the straight legs, a quarter of the
    /// tolerance, then a stop at each pose. Never slower than straight moves to each pose in turn: these are
    /// tried wherever they may be faster.
    pub(super) fn smooth_move(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        if let Some(windowed) = self.begin_windows(motion, start) {
            return self.all_windows(windowed);
        }
        let planned = match self.blended(motion, start, (motion, None)) {
            Ok(first) => self.for_the_joints(motion, start, first),
            Err(first) if motion.tolerance > 0.0 && is_of_the_joints(&first) => {
                match self.otherwise(motion, start, f64::INFINITY) {
                    Some(other) => other,
                    None => self.nearer(motion, start, first)?,
                }
            }
            Err(first) => return Err(first),
        };
        self.or_straight(motion, start, planned)
    }

    /// A motion nearer to the legs than one that failed with the joints: within a quarter of the tolerance, or with stops.
    /// Not where the joints cannot follow the legs either.
    fn nearer(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        error: MotionError,
    ) -> Result<PlannedMove<N>, MotionError> {
        if matches!(error, MotionError::Blocked { .. }) && !self.legs_are_free(motion, start) {
            return Err(error);
        }
        let within = |share: f64| Move {
            tolerance: share * motion.tolerance,
            ..motion.clone()
        };
        self.blended(motion, start, (&within(QUARTER), None))
            .or_else(|_| self.blended(motion, start, (&within(0.0), None)))
            .map(|along| along.planned)
            .map_err(|_| error)
    }

    /// Whether the joints can follow straight legs to all poses; much cheaper than a curve.
    fn legs_are_free(&self, motion: &Move, start: &SVector<f64, N>) -> bool {
        let mut joints = *start;
        motion.poses.iter().all(|pose| {
            let from = self.chain().forward(&joints);
            if is_still(&[from, *pose]) {
                return true;
            }
            let Ok(points) = self.followed(&Way::along(&Line::new(from, *pose)), &joints) else {
                return false;
            };
            joints = points.last().map_or(joints, |point| point.q[0]);
            true
        })
    }

    /// The fastest of the motion found and of those along curves planned for less speed along or about,
    /// where the joints rule: the fastest curve of the tool is not the fastest one for the joints. Only where
    /// a curve is cheap to plan.
    fn for_the_joints(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        first: Along<N>,
    ) -> PlannedMove<N> {
        let ruled = first.planned.trajectory.duration() > RULED * first.tool;
        if !ruled || motion.tolerance <= 0.0 || first.spans > CHEAP {
            return first.planned;
        }
        let most = first.planned.trajectory.duration();
        self.otherwise(motion, start, most).unwrap_or(first.planned)
    }

    /// The fastest motion along another curve that takes less than `most` seconds.
    fn otherwise(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        mut most: f64,
    ) -> Option<PlannedMove<N>> {
        let mut best = None;
        for ([along, about], gap) in OTHERS {
            let slower = Move {
                limits: motion.limits.scaled(along, about),
                ..motion.clone()
            };
            let rough = Some(Rough { gap, most });
            let Ok(other) = self.blended(motion, start, (&slower, rough)) else {
                continue;
            };
            let duration = other.planned.trajectory.duration();
            if duration < most {
                (most, best) = (duration, Some(other.planned));
            }
        }
        best
    }

    /// A smooth motion, or straight moves to each pose in turn if these are faster.
    fn or_straight(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        planned: PlannedMove<N>,
    ) -> Result<PlannedMove<N>, MotionError> {
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

    /// The motion along the curve of another move through the same poses, of at most the tolerance and the
    /// limits of this one; a rough one only if the tool alone is fast enough on it. An arm that cannot follow the curve fitted through a dense list may follow the
    /// spline.
    fn blended(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (curve, rough): (&Move, Option<Rough>),
    ) -> Result<Along<N>, MotionError> {
        let along = |path: &SmoothPath| -> Result<_, MotionError> {
            let mut planned = Err(MotionError::NoWay);
            for draft in self.follow_smooth(path, motion, start)? {
                planned = self.certify(motion, start, draft);
                if planned.is_ok() {
                    break;
                }
            }
            Ok(Along {
                planned: PlannedMove {
                    blend: Some(path.blend(curve.tolerance)),
                    ..planned?
                },
                tool: path.plan.duration(),
                spans: path.plan.spans(),
            })
        };
        let gap = rough.map(|rough| rough.gap);
        let path = self.smooth_path(curve, start, (true, gap))?;
        if rough.is_some_and(|rough| path.plan.duration() >= rough.most) {
            return Err(MotionError::NoWay);
        }
        match along(&path) {
            Err(_) if path.is_fitted() => along(&self.smooth_path(curve, start, (false, gap))?),
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
            crossings.push(Crossing {
                time,
                rests: Some(RestCause::Stop),
            });
        }
        crossings.pop();
        let draft = Draft {
            crossings,
            ..Draft::of(Trajectory::new(pieces))
        };
        self.certify(motion, start, draft)
    }
}
