//! The part of the way that is being timed: the joints along it, and those a window further on.

use trajectory::HermitePath;
use trajectory::smooth::{FittedCurve, FittedPart};

use super::super::Planner;
use super::joints::{Checked, JointsAlong, Stretch, grid};
use crate::task::Move;

/// Most points of the joint path in a window.
const MOST_POINTS: usize = 1500;

/// A checked way, with the joints along the part of it that is being timed.
#[derive(Clone, Debug)]
pub(super) struct Ahead<const N: usize> {
    pub curve: FittedCurve,
    /// The part of the curve that was made again.
    pub part: FittedPart,
    joints: JointsAlong<N>,
    /// The points that were followed again, those before the window at the front.
    open: Stretch<N>,
    /// The stretch that comes after them.
    next: usize,
}

impl<const N: usize> Ahead<N> {
    pub(super) fn new(curve: FittedCurve, checked: Checked<N>) -> Self {
        Self {
            curve,
            part: checked.first,
            joints: checked.joints,
            open: Stretch::default(),
            next: 0,
        }
    }

    /// Last parameter.
    pub(super) fn last(&self) -> f64 {
        self.joints.end().0
    }

    /// Frees the joints and the curve before a parameter at which so many poses are passed.
    fn forget(&mut self, (u, poses): (f64, usize)) {
        self.part.forget(&self.curve, (u, poses));
        let passed = self.open.points.partition_point(|point| point.u <= u);
        let before = passed.saturating_sub(1);
        self.open.points.drain(..before);
        self.open.least.drain(..before);
    }

    /// The parameter at which a window from `from` ends that takes at least this time at full speed (s);
    /// `None` where more of the way has to be followed first.
    fn horizon(&self, from: f64, time: f64) -> Option<f64> {
        let Stretch { points, least } = &self.open;
        let (end, whole) = self.joints.end();
        let now = points
            .partition_point(|point| point.u <= from)
            .checked_sub(1)?;
        let after = least.partition_point(|at| *at < least[now] + time);
        let far = after.min(now + MOST_POINTS).max(now + 2);
        match points.get(far) {
            // A short rest of the way joins this window.
            Some(point) if whole - least[far] > 0.5 * time => Some(point.u),
            Some(_) => Some(end),
            None => (self.next == self.joints.count()).then_some(end),
        }
    }

    /// The joint path of the points that are open.
    pub(super) fn path(&self) -> Option<HermitePath<N, &FittedPart>> {
        HermitePath::new(self.open.points.clone(), &self.part)
    }
}

impl<const N: usize> Planner<N> {
    /// Follows the way again so far that a window from `from`, where so many poses are passed, can take this time
    /// at full speed (s); the parameter at which it ends. `None` where the way cannot be followed.
    pub(super) fn look_ahead(
        &self,
        ahead: &mut Ahead<N>,
        motion: &Move,
        ((from, passed), time): ((f64, usize), f64),
    ) -> Option<f64> {
        loop {
            let to = ahead.horizon(from, time);
            let reached = ahead.open.points.last().map_or(-1.0, |point| point.u);
            if let Some(to) = to.filter(|to| *to <= reached) {
                return Some(to);
            }
            let Ahead {
                curve,
                part,
                joints,
                next,
                ..
            } = &mut *ahead;
            let end = *grid(curve, *next).last()?;
            if !part.cover(curve, &motion.poses, end) {
                return None;
            }
            let stretch = self.stretch((curve, part), joints, *next, motion)?;
            ahead.next += 1;
            // The first point of a stretch is the last of the one before it.
            ahead.open.points.pop();
            ahead.open.least.pop();
            ahead.open.points.extend(stretch.points);
            ahead.open.least.extend(stretch.least);
            ahead.forget((from, passed));
        }
    }
}
