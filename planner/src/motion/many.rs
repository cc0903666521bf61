//! MoveSmoothlyTo through many poses that turn, where the joints rule: searches with the joints that begin at rough curves of the tool,
//! which short searches find, and at straight moves to each pose in turn.
//!
//! The fastest curve of the tool takes ten times the planning there and is of no use. A move is refused whose joints follow none of the
//! rough curves and cannot make the straight moves, and for whose parts no motion is found either.

use nalgebra::SVector;

use super::course::Course;
use super::smooth::{Failure, Search};
use super::smooth_joints::Followed;
use super::{MotionError, PlannedMove, Planner};
use crate::task::Move;

/// Most poses of a list that turns for which the fastest curve of the tool is cheap enough to be planned.
const FEW: usize = 8;
/// Time of the joints along the first rough curve, over that of the tool alone, up to which the tool rules.
const RULED: f64 = 1.05;
/// Time of a motion, over that of the tool alone, up to which no other beginning is tried.
const NEAR: f64 = 1.2;

/// A rough curve: the gap to the optimum at which its search ends, the usual one if none is given, and shares of the linear and the
/// angular limits for it.
pub(super) type Beginning = (Option<f64>, [f64; 2]);

/// The rough curves from which searches with the joints begin, one after the other until one ends at a fast motion. Through few
/// poses only the first.
pub(super) const BEGINNINGS: [Beginning; 5] = [
    (Some(0.05), [1.0, 1.0]),
    (Some(0.5), [0.7, 1.0]),
    (Some(0.5), [1.0, 0.6]),
    (Some(0.3), [1.0, 1.0]),
    (Some(0.5), [1.0, 0.4]),
];

/// What searches from several beginnings have found.
struct Tried<const N: usize> {
    found: Option<PlannedMove<N>>,
    /// The rough curve along which the joints are fastest, and about that time, s.
    curve: Option<(f64, Followed<N>)>,
    /// The least time of the tool alone along such a curve, s.
    tool: f64,
    /// Why the joints did not follow the first one that they did not follow.
    failed: Option<MotionError>,
}

impl<const N: usize> Tried<N> {
    /// Before any was tried.
    fn nothing() -> Self {
        Self {
            found: None,
            curve: None,
            tool: f64::INFINITY,
            failed: None,
        }
    }

    /// With what was found from a rough curve along which the joints take about a time, s.
    fn add_curve(&mut self, time: f64, curve: Followed<N>, found: Option<PlannedMove<N>>) {
        self.tool = self.tool.min(curve.path.plan.duration());
        self.add(found);
        if self.curve.as_ref().is_none_or(|(least, _)| time < *least) {
            self.curve = Some((time, curve));
        }
    }

    /// With another motion.
    fn add(&mut self, found: Option<PlannedMove<N>>) {
        self.found = or_sooner(self.found.take(), found);
    }

    /// Whether no other beginning is worth a search.
    fn is_fast(&self) -> bool {
        let found = self.found.as_ref();
        found.is_some_and(|found| found.trajectory.duration() <= NEAR * self.tool)
    }
}

impl<const N: usize> Planner<N> {
    /// Whether a list of many poses turns, and the arm has joints that are searched.
    pub(super) fn has_many_turns(&self, motion: &Move, start: &SVector<f64, N>) -> bool {
        motion.poses.len() > FEW && Self::has_inverse() && self.turns(motion, start)
    }

    /// The fastest motion of searches with the joints that begin at those along rough curves and at straight moves to each pose, and of
    /// searches of parts of the list; that along a rough curve if the list is dense; `None` if the tool rules.
    ///
    /// # Errors
    ///
    /// [`MotionError`] if the joints follow no rough curve and cannot make the straight moves, and no motion is found in parts.
    pub(super) fn through_many(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<Option<PlannedMove<N>>, MotionError> {
        let first = match self.rough(motion, start, BEGINNINGS[0]) {
            Ok((curve, course)) if curve.is_dense() => {
                return Ok(self.on_rough(motion, start, (curve, course.time)));
            }
            first => first,
        };
        let Some(mut tried) = self.tried_from_rough(motion, start, first)? else {
            return Ok(None);
        };
        let stops = if tried.is_fast() {
            Ok(None)
        } else {
            self.searched_from_stops(motion, start)
        };
        let is_blocked = stops.is_err() && tried.curve.is_none();
        tried.add(stops.ok().flatten());
        let failed = tried.failed.take().filter(|_| is_blocked);
        match (self.fastest_tried(motion, start, tried), failed) {
            (None, Some(error)) => Err(self.blamed(error, motion, start)),
            (found, _) => Ok(found),
        }
    }

    /// What searches have found that begin at rough curves, the first of which is known; `None` if the list is dense or the tool rules.
    ///
    /// # Errors
    ///
    /// [`MotionError`] if no other curve need be tried where the joints do not follow the first.
    fn tried_from_rough(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        first: Result<(Followed<N>, Course<N>), Failure>,
    ) -> Result<Option<Tried<N>>, MotionError> {
        let mut tried = Tried::nothing();
        let others = BEGINNINGS[1..].iter();
        let others = others.map(|beginning| self.rough(motion, start, *beginning));
        for (k, rough) in std::iter::once(first).chain(others).enumerate() {
            let (curve, course) = match rough {
                Ok(rough) => rough,
                Err(failure) => {
                    if k == 0 && self.is_refused(&failure, motion, start) {
                        return Err(self.blamed(failure.error, motion, start));
                    }
                    tried.failed.get_or_insert(failure.error);
                    continue;
                }
            };
            let time = course.time;
            if curve.is_dense() || k == 0 && time <= RULED * curve.path.plan.duration() {
                return Ok(None);
            }
            let found = self.with_joints(motion, start, course);
            tried.add_curve(time, curve, found);
            if tried.is_fast() {
                break;
            }
        }
        Ok(Some(tried))
    }

    /// The motion of a search with the joints that begins at straight moves to each pose in turn, with a stop at each.
    ///
    /// # Errors
    ///
    /// [`MotionError`] if the joints cannot make the straight moves; its poses are not those of the list.
    pub(super) fn searched_from_stops(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<Option<PlannedMove<N>>, MotionError> {
        if !Self::has_inverse() {
            return Ok(None);
        }
        Ok(self.with_joints(motion, start, self.stops(motion, start)?))
    }

    /// The course of straight moves to each pose in turn, with a stop at each.
    ///
    /// # Errors
    ///
    /// As those of [`Planner::searched_from_stops`].
    pub(super) fn stops(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<Course<N>, MotionError> {
        let straights = self.straight_moves(motion, (start, f64::INFINITY))?;
        Ok(Course::of(&straights))
    }

    /// The fastest motion that was found, also of the parts of a list; if there is none, that along a rough curve.
    fn fastest_tried(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        mut tried: Tried<N>,
    ) -> Option<PlannedMove<N>> {
        // The search of the one part of a list would be the same.
        if !Self::is_one_part(motion) {
            tried.add(self.in_parts(motion, start));
        }
        let Some((time, curve)) = tried.curve else {
            return tried.found;
        };
        let found = tried
            .found
            .filter(|found| found.trajectory.duration() <= time);
        found.or_else(|| {
            let along = self.on(&curve, motion, (start, f64::INFINITY)).ok();
            along.map(|along| along.planned)
        })
    }

    /// The joints along a rough curve.
    pub(super) fn rough(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (gap, shares): Beginning,
    ) -> Result<(Followed<N>, Course<N>), Failure> {
        let most = f64::INFINITY;
        let curve = self.slower(motion, start, (Search { gap, most }, shares))?;
        // The time of the joints need not be known exactly.
        let course = self.course_along(&curve);
        Ok((curve, course))
    }

    /// The joints along the curve that is planned under shares of the linear and the angular limits.
    pub(super) fn slower(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (search, [along, about]): (Search, [f64; 2]),
    ) -> Result<Followed<N>, Failure> {
        let slower = Move {
            limits: motion.limits.scaled(along, about),
            ..motion.clone()
        };
        self.curve(start, (&slower, search), true)
    }
}

/// The motion that ends first, if one is found.
pub(super) fn or_sooner<const N: usize>(
    found: Option<PlannedMove<N>>,
    other: Option<PlannedMove<N>>,
) -> Option<PlannedMove<N>> {
    match other {
        Some(other) => Some(sooner(found, other)),
        None => found,
    }
}

/// The motion that ends first.
pub(super) fn sooner<const N: usize>(
    found: Option<PlannedMove<N>>,
    other: PlannedMove<N>,
) -> PlannedMove<N> {
    let time = other.trajectory.duration();
    let found = found.filter(|found| found.trajectory.duration() <= time);
    found.unwrap_or(other)
}
