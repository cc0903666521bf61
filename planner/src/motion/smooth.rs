//! MoveSmoothlyTo: which of the motions that can be certified is taken.

use std::borrow::Cow;

use nalgebra::{Isometry3, SVector};
use trajectory::smooth::RestCause;
use trajectory::{Line, Trajectory};

use super::cartesian::{Way, is_still};
use super::course::Course;
use super::draft::{Crossing, Draft};
use super::smooth_joints::Followed;
use super::{Blend, MotionError, PlannedMove, Planner, ROUNDING};
use crate::task::{Move, Shape};

/// Share of the tolerance that is tried where all of it fails with the joints.
const QUARTER: f64 = 0.25;

/// Tolerance (m) up to which a curve through dense poses meets the limits of the joints and the singular places that its legs meet.
const NARROW: f64 = 2e-3;

/// Whether a curve may be possible for the tool, and only the joints fail on it.
fn is_of_the_joints(error: &MotionError) -> bool {
    matches!(
        error,
        MotionError::Uncertified(_) | MotionError::Blocked { .. }
    )
}

/// How a curve of the tool is searched for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    /// Gap to the optimum at which it ends, if not the usual one.
    pub(super) gap: Option<f64>,
    /// Time from which on a motion of the tool is of no use, s.
    pub(super) most: f64,
}

/// The search of the curve of a motion.
const FULL: Search = Search {
    gap: None,
    most: f64::INFINITY,
};

/// Why there is no motion along a smooth curve of the tool.
pub(super) struct Failure {
    pub(super) error: MotionError,
    /// Spans of the curve; none if there is no curve.
    spans: usize,
    /// Whether there is a curve through dense poses, near to them.
    near: bool,
}

impl From<MotionError> for Failure {
    fn from(error: MotionError) -> Self {
        Self {
            error,
            spans: 0,
            near: false,
        }
    }
}

/// A motion along a smooth curve of the tool.
pub(super) struct Along<const N: usize> {
    pub(super) planned: PlannedMove<N>,
    /// Time of the tool alone, s.
    pub(super) tool: f64,
    /// Spans of the curve.
    pub(super) spans: usize,
}

impl<const N: usize> Planner<N> {
    /// The smooth motion within the tolerance asked for. If its certificate with the joints fails, or
    /// if they cannot follow its curve, other curves are tried; then, if they could follow the straight legs, a quarter of the
    /// tolerance, then a stop at each pose. Where the joints make it slower than the tool needs, a faster one is searched
    /// with them. Never slower than straight moves to each pose in turn: these are tried wherever they may be faster.
    pub(super) fn smooth_move(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        if let Some(windowed) = self.begin_windows(Cow::Borrowed(motion), start) {
            return self.all_windows(windowed);
        }
        if let Some(corners) = self.corners(motion, start)
            && let Ok(planned) = self.smooth_through(&corners.motion, start)
            && let Some(whole) = self.through_all(motion, start, (planned, &corners))
        {
            return Ok(whole);
        }
        self.smooth_through(motion, start)
    }

    /// The same through all poses, as a whole.
    fn smooth_through(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        if let Some(rounder) = self.rounder(motion, start)? {
            return self.or_straight(motion, start, rounder);
        }
        let planned = match self.blended(motion, start, motion) {
            Ok((first, curve)) => self.for_the_arm(motion, start, (first, &curve)),
            Err(failure) => {
                let refused = motion.tolerance <= 0.0 || self.is_refused(&failure, motion, start);
                let error = self.blamed(failure.error, motion, start);
                if refused || !is_of_the_joints(&error) {
                    return Err(error);
                }
                self.elsewhere(motion, start, (error, failure.spans))?
            }
        };
        self.or_straight(motion, start, planned)
    }

    /// The motion of a search with the joints that begins at straight moves or at a motion along another curve than the first, which
    /// failed with the joints and has so many spans; if there is none, that motion.
    fn elsewhere(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (error, spans): (MotionError, usize),
    ) -> Result<PlannedMove<N>, MotionError> {
        if !Self::has_many(motion)
            && let Ok(Some(found)) = self.searched_from_stops(motion, start)
        {
            return Ok(found);
        }
        let other = match self.instead(motion, start, spans) {
            Some(other) => other,
            None => self.nearer(motion, start, error)?,
        };
        let found = self.with_joints(motion, start, Course::of(&other));
        Ok(found.unwrap_or(other))
    }

    /// A motion nearer to the legs than one that failed with the joints: within a quarter of the tolerance, or with stops.
    /// Not where the joints cannot follow the legs either.
    fn nearer(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        error: MotionError,
    ) -> Result<PlannedMove<N>, MotionError> {
        if self.is_blocked_anyway(&error, motion, start) {
            return Err(error);
        }
        let within = |share: f64| Move {
            tolerance: share * motion.tolerance,
            ..motion.clone()
        };
        self.blended(motion, start, &within(QUARTER))
            .or_else(|_| self.blended(motion, start, &within(0.0)))
            .map(|(along, _)| along.planned)
            .map_err(|_| error)
    }

    /// Whether the joints can follow neither a curve, which failed so, nor the straight legs.
    fn is_blocked_anyway(
        &self,
        error: &MotionError,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> bool {
        matches!(error, MotionError::Blocked { .. }) && !self.legs_are_free(motion, start)
    }

    /// Whether no other curve need be tried: the joints follow neither one through dense poses nor the straight legs, which it is near.
    pub(super) fn is_refused(
        &self,
        failure: &Failure,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> bool {
        failure.near && self.is_blocked_anyway(&failure.error, motion, start)
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
        let most = planned.trajectory.duration();
        Ok(match self.straight_moves(motion, (start, most)) {
            Ok(straights) => PlannedMove {
                blend: planned.blend.map(|blend| Blend {
                    tolerance: 0.0,
                    corridor_ratio: 0.0,
                    fallbacks: motion.poses.len() - 1,
                    ..blend
                }),
                ..straights
            },
            Err(_) => planned,
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
        let passes = planned.certificate.poses.iter();
        let near = passes.map(|pass| planned.trajectory.sample(pass.time_s).position);
        // The joints of a seven-joint arm may be elsewhere at the same poses.
        let joints = |pose: &Isometry3<f64>, near: &SVector<f64, N>| {
            let reached = (N <= 6).then(|| self.solver.nearest(pose, near).ok());
            reached.flatten().map(|solution| solution.q)
        };
        let (mut from, mut sum) = (Some(*start), 0.0);
        let legs = motion.poses.iter().zip(self.least_of_legs(motion, start));
        for (near, (next, tool)) in near.chain([planned.end]).zip(legs) {
            let to = joints(next, &near);
            let both = from.zip(to);
            let joint = both.map_or(0.0, |(from, to)| self.least_of_joints(&from, &to));
            sum += tool.max(joint);
            from = to;
        }
        sum
    }

    /// The motion along the curve of another move through the same poses, of at most the tolerance and the
    /// limits of this one, and the curve. An arm that cannot follow the curve fitted through a dense list may follow the
    /// spline.
    fn blended(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        curve: &Move,
    ) -> Result<(Along<N>, Followed<N>), Failure> {
        let first = self.curve(start, (curve, FULL), true)?;
        match self.on(&first, motion, (start, f64::INFINITY)) {
            Err(_) if first.path.is_fitted() => {
                let spline = self.curve(start, (curve, FULL), false)?;
                let along = self.on(&spline, motion, (start, f64::INFINITY))?;
                Ok((along, spline))
            }
            along => Ok((along?, first)),
        }
    }

    /// The joints along that curve, if the tool alone takes less time than is useful on it. Where they can follow neither the
    /// curve fitted through a dense list nor its straight legs, the spline is not searched: it is as near to the legs.
    pub(super) fn curve(
        &self,
        start: &SVector<f64, N>,
        (curve, search): (&Move, Search),
        fit: bool,
    ) -> Result<Followed<N>, Failure> {
        let path = self.smooth_path(curve, start, (fit, search.gap))?;
        if path.plan.duration() >= search.most {
            return Err(MotionError::NoWay.into());
        }
        let (spans, fitted) = (path.plan.spans(), path.is_fitted());
        let near = path.is_dense() && curve.tolerance <= NARROW;
        match self.joints_on(path, start, None) {
            Err(error) if fitted && !self.is_blocked_anyway(&error, curve, start) => {
                self.curve(start, (curve, search), false)
            }
            followed => followed.map_err(|error| Failure { error, spans, near }),
        }
    }

    /// The motion along a curve that the joints follow, if it is shorter than `most` (s).
    pub(super) fn on(
        &self,
        followed: &Followed<N>,
        motion: &Move,
        (start, most): (&SVector<f64, N>, f64),
    ) -> Result<Along<N>, Failure> {
        let path = &followed.path;
        let spans = path.plan.spans();
        let failure = |error| Failure {
            error,
            spans,
            near: false,
        };
        let certified = |help: bool| {
            let mut planned = Err(MotionError::NoWay);
            for draft in self.along_smooth((followed, help), motion, (start, most))? {
                planned = self.certify(motion, start, draft);
                if planned.is_ok() {
                    break;
                }
            }
            planned
        };
        let mut planned = certified(true);
        // One that is slower than with help was perhaps not timed.
        if followed.may_be_helped && matches!(planned, Err(MotionError::Uncertified(_))) {
            planned = certified(false);
        }
        Ok(Along {
            planned: PlannedMove {
                blend: Some(path.blend()),
                ..planned.map_err(failure)?
            },
            tool: path.plan.duration(),
            spans,
        })
    }

    /// A straight move to each pose in turn, with a stop at each; [`MotionError::NoWay`], as soon as that is known, where
    /// they take `most` (s) or longer.
    pub(super) fn straight_moves(
        &self,
        motion: &Move,
        (start, most): (&SVector<f64, N>, f64),
    ) -> Result<PlannedMove<N>, MotionError> {
        let (mut pieces, mut crossings) = (Vec::new(), Vec::with_capacity(motion.poses.len()));
        let (mut joints, mut time) = (*start, 0.0);
        let least = self.least_of_legs(motion, start);
        let mut left: f64 = least.iter().sum();
        for (pose, least) in motion.poses.iter().zip(least) {
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
            left = (left - least).max(0.0);
            if time + left >= most {
                return Err(MotionError::NoWay);
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
