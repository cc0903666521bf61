//! MoveSmoothlyTo where the joints rule: rounder curves of the tool than the one that is fastest for it.
//!
//! Such a curve is found by a short search on few knots, as it stays far from its bounds.

use nalgebra::{Isometry3, SVector};

use super::course::Course;
use super::many::{BEGINNINGS, or_sooner, sooner};
use super::smooth::{Along, Search};
use super::smooth_joints::{Followed, HELPED};
use super::{MotionError, PlannedMove, Planner};
use crate::task::Move;

/// Time of the motion over that of the tool alone from which on the joints rule.
const RULED: f64 = 1.3;
/// Time of a motion through few poses, over that of the tool alone, from which on a search also begins at straight moves.
const SLOW: f64 = 2.0;
/// Share of its time that the motion along it may take after a search with the joints for no other curve to be tried.
const ENOUGH: f64 = 0.95;
/// Share of its time that the motion along the fastest curve for the tool may take after a search with the joints for no other curve
/// to be tried: there more can be saved.
const MUCH: f64 = 0.8;
/// Other curves tried then, each planned under a share of the linear and one of the angular limits; if the first of a pair
/// is better than the other first one, the second is tried, too.
const OTHERS: [[[f64; 2]; 2]; 2] = [[[1.0, 0.6], [1.0, 0.4]], [[0.7, 1.0], [0.6, 0.6]]];
/// Gap to the optimum at which their searches end: far from its optimum a curve is rounder, which the joints follow faster.
const OTHER_GAP: f64 = 0.5;
/// The same where the joints cannot follow the first curve: also one that differs only in that it is rounder.
const INSTEAD: [[f64; 2]; 5] = [[1.0, 0.6], [1.0, 0.4], [0.7, 1.0], [0.6, 0.6], [1.0, 1.0]];
const INSTEAD_GAP: f64 = 1.0;
/// Time of the joints over its bound up to which a fitted curve is not compared with others.
const UNEVEN: f64 = 1.06;
/// Share by which the joints may be faster along another curve than their bound along it foretells.
const SPREAD: f64 = 4e-3;
/// The most that a motion takes over the bound along its curve for that to say something of other curves.
const FORETOLD: f64 = 1.1;
/// Most spans of a curve, and most poses of a list, that is cheap enough for others.
const CHEAP: usize = 400;
const FEW: usize = 20;
/// Most poses at which it is foretold whether the joints rule.
const LOOKS: usize = 32;
/// A list of more poses than so is dear to plan for the tool alone: one that is dense is not searched with the joints, and one that
/// does not turn is searched in parts.
const MANY: usize = 60;

/// Least tolerance, in mean legs of a list, within which its parts are searched: within less they take seconds and find nothing.
const ROOM: f64 = 0.01;

/// What is known before other curves are tried.
#[derive(Clone, Copy)]
struct Known {
    /// Time of the fastest motion, s.
    time: f64,
    /// That time over the bound of the time along its curve.
    over: f64,
}

impl Known {
    /// Whether a curve with this bound of the time may be faster.
    fn may_be_beaten(&self, least: f64) -> bool {
        least * self.over * (1.0 - SPREAD) < self.time
    }
}

/// Another curve, which the joints follow.
struct Other<const N: usize> {
    /// The bound of the time along it, s.
    least: f64,
    followed: Followed<N>,
}

impl<const N: usize> Planner<N> {
    /// The fastest motion along curves that are rounder than the fastest one for the tool, where the joints rule; none that
    /// rests without need.
    ///
    /// # Errors
    ///
    /// [`MotionError`] if the joints follow no curve through many poses.
    pub(super) fn rounder(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<Option<PlannedMove<N>>, MotionError> {
        if motion.tolerance <= 0.0 {
            return Ok(None);
        }
        let planned = if self.has_many_turns(motion, start) {
            self.through_many(motion, start)?
        } else {
            self.near_rough(motion, start)
        };
        let rests =
            |planned: &PlannedMove<N>| planned.blend.is_some_and(|blend| blend.fallbacks > 0);
        Ok(planned.filter(|planned| !rests(planned)))
    }

    /// The motion near a rough curve, if the joints rule.
    fn near_rough(&self, motion: &Move, start: &SVector<f64, N>) -> Option<PlannedMove<N>> {
        if !self.foretells_joints(motion, start) {
            return None;
        }
        let (curve, course) = self.rough(motion, start, BEGINNINGS[0]).ok()?;
        let (time, tool) = (course.time, curve.path.plan.duration());
        let searched = motion.poses.len() <= FEW && time > RULED * tool;
        let found = searched.then(|| self.rounder_of_few(motion, start, (&curve, course)));
        let along = || self.on_rough(motion, start, (curve, time));
        found.flatten().or_else(along)
    }

    /// The fastest motion of a search with the joints that begins at the one along a rough curve through few poses and, where that saves
    /// little, at the one along others.
    fn rounder_of_few(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (curve, course): (&Followed<N>, Course<N>),
    ) -> Option<PlannedMove<N>> {
        let (about, tool) = (course.time, curve.path.plan.duration());
        let found = match self.with_joints(motion, start, course) {
            Some(found) if found.trajectory.duration() <= ENOUGH * about => found,
            found => {
                let first = self.on(curve, motion, (start, f64::INFINITY)).ok()?;
                let other = self.on_others(motion, start, (first, curve), false);
                sooner(found, other)
            }
        };
        if found.trajectory.duration() <= SLOW * tool {
            return Some(found);
        }
        let other = self.searched_from_stops(motion, start).ok().flatten();
        or_sooner(Some(found), other)
    }

    /// The fastest motion of searches with the joints that begin at the one along a curve or, where that saves little, at the
    /// one along others.
    pub(super) fn for_the_arm(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (first, curve): (Along<N>, &Followed<N>),
    ) -> PlannedMove<N> {
        let time = first.planned.trajectory.duration();
        if time <= HELPED * first.tool {
            return first.planned;
        }
        let found = self.with_joints_near(motion, start, (&first.planned, curve));
        let found = found.or_else(|| self.in_parts_near(motion, start, (&first.planned, curve)));
        match found {
            Some(found) if found.trajectory.duration() <= MUCH * time => found,
            found => sooner(found, self.on_others(motion, start, (first, curve), true)),
        }
    }

    /// The fastest motion of a search with the joints that begins at the fastest one along a curve and others; none begins
    /// again at the one along the curve if that was `searched`.
    fn on_others(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (first, curve): (Along<N>, &Followed<N>),
        searched: bool,
    ) -> PlannedMove<N> {
        let time = first.planned.trajectory.duration();
        let other = self.for_the_joints(motion, start, (first, curve));
        if searched && other.trajectory.duration() >= time {
            return other;
        }
        let found = self.with_joints_near(motion, start, (&other, curve));
        found.unwrap_or(other)
    }

    /// [`Planner::with_joints`] near a motion, but through no dense list of many poses: they leave little room, and a search
    /// takes longer than it saves.
    fn with_joints_near(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (planned, curve): (&PlannedMove<N>, &Followed<N>),
    ) -> Option<PlannedMove<N>> {
        if motion.poses.len() > MANY && curve.is_dense() {
            return None;
        }
        self.with_joints(motion, start, Course::of(planned))
    }

    /// [`Planner::in_parts`] where that is faster than a motion that is known, through a list of many poses that is not dense. One that
    /// turns was tried before.
    fn in_parts_near(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (planned, curve): (&PlannedMove<N>, &Followed<N>),
    ) -> Option<PlannedMove<N>> {
        let is_open = || self.has_room(motion, start) && !self.turns(motion, start);
        if !Self::has_many(motion) || curve.is_dense() || !is_open() {
            return None;
        }
        let most = planned.trajectory.duration();
        let found = self.in_parts(motion, start)?;
        (found.trajectory.duration() < most).then_some(found)
    }

    /// Whether the tolerance leaves room beside the legs of a list for curves of another shape.
    fn has_room(&self, motion: &Move, start: &SVector<f64, N>) -> bool {
        motion.tolerance >= ROOM * self.mean_leg(motion, start)
    }

    /// Whether a list has many poses for a search with the joints.
    pub(super) fn has_many(motion: &Move) -> bool {
        motion.poses.len() > MANY && Self::has_inverse()
    }

    /// Whether the joints that reach the poses, or some of many, one after the other take longer, from stop to stop, than the tool.
    fn foretells_joints(&self, motion: &Move, start: &SVector<f64, N>) -> bool {
        let step = motion.poses.len().div_ceil(LOOKS);
        let some = motion.poses.iter().rev().step_by(step).rev();
        let motion = &Move {
            poses: some.copied().collect(),
            ..motion.clone()
        };
        let tool: f64 = self.least_of_legs(motion, start).iter().sum();
        let mut from = *start;
        let mut leg = |pose: &Isometry3<f64>| {
            let to = self.solver.nearest(pose, &from).ok()?.q;
            Some(self.least_of_joints(&std::mem::replace(&mut from, to), &to))
        };
        let joints: Option<f64> = motion.poses.iter().map(&mut leg).sum();
        joints.is_some_and(|joints| joints > tool)
    }

    /// The fastest of the motion found and of those along curves planned for less speed along or about,
    /// where the joints rule: the fastest curve of the tool is not the fastest one for the joints. Only where
    /// a curve is cheap to plan, and may be slow.
    fn for_the_joints(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (first, curve): (Along<N>, &Followed<N>),
    ) -> PlannedMove<N> {
        let time = first.planned.trajectory.duration();
        let fitted = curve.path.is_fitted();
        let cheap = first.spans <= CHEAP || fitted && first.spans <= 4 * motion.poses.len();
        if time <= RULED * first.tool || motion.tolerance <= 0.0 || !cheap {
            return first.planned;
        }
        let least = self.least_along(curve, motion).unwrap_or(time);
        // Along a fitted curve as it should be the limits of jerk cost the joints little.
        if fitted && time <= UNEVEN * least {
            return first.planned;
        }
        let known = Known {
            time,
            over: (time / least).min(FORETOLD),
        };
        let search = Search {
            gap: Some(OTHER_GAP),
            most: time,
        };
        let other = |shares| self.other(motion, start, (search, shares));
        let pairs = OTHERS.into_iter();
        let firsts: Vec<_> = pairs
            .filter_map(|[first, next]| Some((other(first)?, next)))
            .collect();
        let best = firsts
            .iter()
            .min_by(|(a, _), (b, _)| a.least.total_cmp(&b.least));
        let best = best.filter(|(best, _)| known.may_be_beaten(best.least));
        let next = best.and_then(|(_, next)| other(*next));
        let others = firsts
            .into_iter()
            .map(|(first, _)| first)
            .chain(next)
            .collect();
        let other = self.fastest_of(others, (motion, start), known);
        other.unwrap_or(first.planned)
    }

    /// The fastest motion along another curve, where the joints cannot follow the first, which has so many spans.
    pub(super) fn instead(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        spans: usize,
    ) -> Option<PlannedMove<N>> {
        if spans > CHEAP {
            return None;
        }
        let none = Known {
            time: f64::INFINITY,
            over: 1.0,
        };
        let search = Search {
            gap: Some(INSTEAD_GAP),
            most: f64::INFINITY,
        };
        let other = |shares| self.other(motion, start, (search, shares));
        let others = INSTEAD.into_iter().filter_map(other).collect();
        self.fastest_of(others, (motion, start), none)
    }

    /// The joints along the curve that is planned under shares of the limits, and the bound of the time along it.
    fn other(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        searched: (Search, [f64; 2]),
    ) -> Option<Other<N>> {
        let followed = self.slower(motion, start, searched).ok()?;
        Some(Other {
            least: self.least_along(&followed, motion).ok()?,
            followed,
        })
    }

    /// The fastest motion along one of these curves that is faster than the one that is known. The curves whose bounds of
    /// the time are least are timed, as long as one may be faster.
    fn fastest_of(
        &self,
        mut others: Vec<Other<N>>,
        (motion, start): (&Move, &SVector<f64, N>),
        mut known: Known,
    ) -> Option<PlannedMove<N>> {
        others.sort_by(|a, b| a.least.total_cmp(&b.least));
        let mut best = None;
        for Other { least, followed } in others {
            if !known.may_be_beaten(least) {
                break;
            }
            let Ok(other) = self.on(&followed, motion, (start, known.time)) else {
                continue;
            };
            let time = other.planned.trajectory.duration();
            if time < known.time {
                // No more is foretold than what was seen.
                let over = time / least;
                known.over = if known.time.is_finite() {
                    known.over.min(over)
                } else {
                    over
                };
                (known.time, best) = (time, Some(other.planned));
            }
        }
        best
    }
}
