//! MoveSmoothlyTo: which of the motions that can be certified is taken.

use std::borrow::Cow;

use nalgebra::{Isometry3, SVector};
use trajectory::smooth::{RestCause, SmoothOptions, least_time};
use trajectory::{Line, Trajectory};

use super::cartesian::{Way, is_still};
use super::draft::{Crossing, Draft};
use super::smooth_joints::Followed;
use super::{Blend, MotionError, PlannedMove, Planner, ROUNDING};
use crate::task::{Move, Shape};

/// Share of the tolerance that is tried where all of it fails with the joints.
const QUARTER: f64 = 0.25;
/// Time of the motion over that of the tool alone from which on the joints rule.
const RULED: f64 = 1.3;
/// Other curves tried then: shares of the linear and of the angular limits under which each is planned.
const OTHERS: [[f64; 2]; 4] = [[1.0, 0.6], [1.0, 0.4], [0.7, 1.0], [0.6, 0.6]];
/// The same where the joints cannot follow the first curve: also one that differs only in that it is rounder.
const INSTEAD: [[f64; 2]; 5] = [[1.0, 0.6], [1.0, 0.4], [0.7, 1.0], [0.6, 0.6], [1.0, 1.0]];
/// Gap to the optimum at which their searches end: far from its optimum a curve is rounder, which the joints follow
/// faster.
const GAP: f64 = 1.0;
/// Share by which the joints may be faster along another curve than their bound along it foretells.
const SPREAD: f64 = 4e-3;
/// Most spans of a curve that is cheap enough for that.
const CHEAP: usize = 400;

/// Whether a curve may be possible for the tool, and only the joints fail on it.
fn is_of_the_joints(error: &MotionError) -> bool {
    matches!(
        error,
        MotionError::Uncertified(_) | MotionError::Blocked { .. }
    )
}

/// Why there is no motion along a smooth curve of the tool.
struct Failure {
    error: MotionError,
    /// Spans of the curve; none if there is no curve.
    spans: usize,
}

impl From<MotionError> for Failure {
    fn from(error: MotionError) -> Self {
        Self { error, spans: 0 }
    }
}

/// What is known before other curves are tried.
#[derive(Clone, Copy)]
struct Known {
    /// Time of the fastest motion, s.
    time: f64,
    /// That time over the bound of the time along its curve.
    over: f64,
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
        if let Some(windowed) = self.begin_windows(Cow::Borrowed(motion), start) {
            return self.all_windows(windowed);
        }
        let planned = match self.blended(motion, start, motion) {
            Ok((first, curve)) => self.for_the_joints(motion, start, (first, &curve)),
            Err(Failure { error, spans }) => {
                let error = self.blamed(error, motion, start);
                if motion.tolerance <= 0.0 || !is_of_the_joints(&error) {
                    return Err(error);
                }
                let cheap = spans <= CHEAP;
                let none = Known {
                    time: f64::INFINITY,
                    over: 1.0,
                };
                let other = cheap.then(|| self.otherwise(motion, start, (none, &INSTEAD)));
                match other.flatten() {
                    Some(other) => other,
                    None => self.nearer(motion, start, error)?,
                }
            }
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
        self.blended(motion, start, &within(QUARTER))
            .or_else(|_| self.blended(motion, start, &within(0.0)))
            .map(|(along, _)| along.planned)
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
        (first, curve): (Along<N>, &Followed<N>),
    ) -> PlannedMove<N> {
        let time = first.planned.trajectory.duration();
        let ruled = time > RULED * first.tool;
        if !ruled || motion.tolerance <= 0.0 || first.spans > CHEAP {
            return first.planned;
        }
        let least = self.least_along(curve, motion).unwrap_or(time);
        let known = Known {
            time,
            over: time / least,
        };
        let other = self.otherwise(motion, start, (known, &OTHERS));
        other.unwrap_or(first.planned)
    }

    /// The fastest motion along another curve that is faster than the one that is known. The joints follow all of
    /// them; the curves whose bounds of the time are least are timed, as long as one may be faster.
    fn otherwise(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (mut known, others): (Known, &[[f64; 2]]),
    ) -> Option<PlannedMove<N>> {
        let mut tried = Vec::with_capacity(others.len());
        for &[along, about] in others {
            let slower = Move {
                limits: motion.limits.scaled(along, about),
                ..motion.clone()
            };
            let followed = self.curve(start, (&slower, Some(known.time)), true);
            let Ok(followed) = followed else {
                continue;
            };
            if let Ok(least) = self.least_along(&followed, motion) {
                tried.push((least, followed));
            }
        }
        tried.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let mut best = None;
        for (least, followed) in tried {
            if least * known.over * (1.0 - SPREAD) >= known.time {
                break;
            }
            let Ok(other) = self.on(&followed, motion, (start, known.time)) else {
                continue;
            };
            let time = other.planned.trajectory.duration();
            if time < known.time {
                // No more is foretold than what was seen.
                let over = time / least;
                known.over = if best.is_some() || known.time.is_finite() {
                    known.over.min(over)
                } else {
                    over
                };
                (known.time, best) = (time, Some(other.planned));
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
    /// limits of this one, and the curve. An arm that cannot follow the curve fitted through a dense list may follow the
    /// spline.
    fn blended(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        curve: &Move,
    ) -> Result<(Along<N>, Followed<N>), Failure> {
        let first = self.curve(start, (curve, None), true)?;
        match self.on(&first, motion, (start, f64::INFINITY)) {
            Err(_) if first.path.is_fitted() => {
                let spline = self.curve(start, (curve, None), false)?;
                let along = self.on(&spline, motion, (start, f64::INFINITY))?;
                Ok((along, spline))
            }
            along => Ok((along?, first)),
        }
    }

    /// The joints along that curve; along a rough one only if the tool alone takes less than `most` (s) on it.
    fn curve(
        &self,
        start: &SVector<f64, N>,
        (curve, most): (&Move, Option<f64>),
        fit: bool,
    ) -> Result<Followed<N>, Failure> {
        let path = self.smooth_path(curve, start, (fit, most.map(|_| GAP)))?;
        if most.is_some_and(|most| path.plan.duration() >= most) {
            return Err(MotionError::NoWay.into());
        }
        let (spans, fitted) = (path.plan.spans(), path.is_fitted());
        match self.joints_on(path, start) {
            Err(_) if fitted => self.curve(start, (curve, most), false),
            followed => followed.map_err(|error| Failure { error, spans }),
        }
    }

    /// The motion along a curve that the joints follow, if it is shorter than `most` (s).
    fn on(
        &self,
        followed: &Followed<N>,
        motion: &Move,
        (start, most): (&SVector<f64, N>, f64),
    ) -> Result<Along<N>, Failure> {
        let path = &followed.path;
        let spans = path.plan.spans();
        let failure = |error| Failure { error, spans };
        let mut planned = Err(MotionError::NoWay);
        let drafts = self.along_smooth(followed, motion, (start, most));
        for draft in drafts.map_err(failure)? {
            planned = self.certify(motion, start, draft);
            if planned.is_ok() {
                break;
            }
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
