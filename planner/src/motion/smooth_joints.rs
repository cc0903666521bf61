//! MoveSmoothlyTo: the joints along a smooth motion of the tool.

use kinematics::follow::{self, Cost, FollowPoint, NullMotion};
use nalgebra::{Isometry3, SVector};
use trajectory::timing::PathTiming;
use trajectory::{Boundary, HermitePath, TimingOptions, ToolCurve, Trajectory, smooth};

use super::cartesian::{Way, is_still, joint_path, pieces};
use super::draft::{Crossing, Draft};
use super::few_places::FewPlaces;
use super::soonest::RESTING;
use super::{Blend, MotionError, Planner, ROUNDING};
use crate::task::Move;

/// Fraction of the time by which a motion may be slowed down uniformly before another time law is
/// computed.
const ENOUGH: f64 = 1e-3;
/// Time of the joints over that of the tool from which on another way of the joints, or another curve, is worth a search.
pub(super) const HELPED: f64 = 1.01;
/// Time of the tool with a stop at each pose, over that without, from which on a list is dense.
const DENSE: f64 = 4.0;
/// A time law along a motion of the tool, whose ends rest; it is never faster.
const ALONG: TimingOptions = TimingOptions {
    start: Boundary::Free,
    end: Boundary::Free,
    rate_cap: Some(1.0),
    fine: true,
    gap: 1e-3,
    ..RESTING
};

impl<const N: usize> Planner<N> {
    /// The joints along a smooth path, with a null-space motion that was found with it, or without one that helps them.
    pub(super) fn joints_on(
        &self,
        path: SmoothPath,
        start: &SVector<f64, N>,
        spare: Option<&NullMotion<N>>,
    ) -> Result<Followed<N>, MotionError> {
        let points = if path.is_still() {
            Vec::new()
        } else {
            let towards = |u: f64| path.towards(u);
            let way = Way {
                spare,
                ..path.way(&towards)
            };
            self.followed(&way, start)?
        };
        Ok(Followed {
            path,
            points,
            may_be_helped: N > 6 && spare.is_none(),
        })
    }

    /// The motions of the joints along a smooth path, slowed down where a joint needs it, to be certified: the fastest
    /// first. `help` says whether another null-space motion is searched. [`MotionError::NoWay`] if none is shorter than `most` (s).
    pub(super) fn along_smooth(
        &self,
        (followed, help): (&Followed<N>, bool),
        motion: &Move,
        (start, most): (&SVector<f64, N>, f64),
    ) -> Result<Vec<Draft<N>>, MotionError> {
        let Followed { path, points, .. } = followed;
        let plan = &path.plan;
        let crossings = Crossing::of(plan);
        if path.is_still() {
            let at_once = Crossing::at(&crossings, |_| 0.0);
            return Ok(vec![passing(Trajectory::new(Vec::new()), at_once)]);
        }
        let along = |points: &[FollowPoint<N>], most: f64| {
            let draft = self.fastest_along(plan, (points, most), (&crossings, motion))?;
            let shorter = draft.trajectory.duration() < most;
            shorter.then_some(draft).ok_or(MotionError::NoWay)
        };
        let helped = |most: f64| {
            let points = self.helped(followed, motion, start)?;
            along(&points, most).ok()
        };
        let time = |draft: &Draft<N>| draft.trajectory.duration();
        let help = help && followed.may_be_helped;
        let ruled = HELPED * plan.duration();
        // Where the joints are sure to need help, it is timed first: then less of the other motion need be known.
        let mut other = None;
        let sure = help && self.about_time(points) > ruled;
        if sure {
            other = helped(most);
        }
        let first = match along(points, other.as_ref().map_or(most, time)) {
            // The spare joint helps, or may help.
            Err(MotionError::NoWay) if help => None,
            Err(_) if other.is_some() => None,
            first => Some(first?),
        };
        if help && !sure {
            let known = first.as_ref().map_or(most, time);
            if known > ruled {
                other = helped(known);
            }
        }
        let mut drafts: Vec<_> = first.into_iter().chain(other).collect();
        drafts.sort_by(|a, b| time(a).total_cmp(&time(b)));
        if drafts.is_empty() {
            return Err(MotionError::NoWay);
        }
        Ok(drafts)
    }

    /// The joints along a smooth path with a null-space motion that helps them: searched by the time they need at each
    /// point and, through dense poses, which are searched in no other way, then by about the time of a law.
    fn helped(
        &self,
        Followed { path, points, .. }: &Followed<N>,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Option<Vec<FollowPoint<N>>> {
        let towards = |u: f64| path.towards(u);
        let way = path.way(&towards);
        let few = FewPlaces::new(&path.plan);
        let at_points = |points: &[FollowPoint<N>]| self.about_time(points);
        let of_a_law = |points: &[FollowPoint<N>]| self.about_law(&few, points, motion);
        let costs: [&Cost<'_, N>; 2] = [&at_points, &of_a_law];
        let count = if path.is_dense() { 2 } else { 1 };
        let spare = self.helping(&way, points, (start, &costs[..count]))?;
        let spare = Some(&spare);
        self.followed(&Way { spare, ..way }, start).ok()
    }

    /// A lower bound of the time of the joints along a smooth path, s: of the fastest law without limits of jerk.
    pub(super) fn least_along(
        &self,
        Followed { path, points, .. }: &Followed<N>,
        motion: &Move,
    ) -> Result<f64, MotionError> {
        let plan = &path.plan;
        let joints = joint_path(plan, points)?;
        let timing = PathTiming::new(&joints, &self.limits, &motion.limits, &ALONG)?;
        Ok(timing.lower_bound().max(plan.duration()))
    }

    /// The fastest motion of the joints along a smooth motion of the tool, that is never faster;
    /// [`MotionError::NoWay`], for less work, where none is shorter than `most` (s).
    pub(super) fn fastest_along(
        &self,
        curve: &dyn ToolCurve,
        (points, most): (&[FollowPoint<N>], f64),
        (crossings, motion): (&[Crossing], &Move),
    ) -> Result<Draft<N>, MotionError> {
        let free = curve.end();
        let enough = free * (1.0 + ENOUGH);
        let slowed = || {
            let direct = Trajectory::new(pieces(points));
            self.slowed(passing(direct, crossings.to_vec()), motion)
        };
        // Slowed down as a whole it takes at least so long: where that is more than enough, the whole need
        // not be bounded before another time law is known to be slower.
        let sure = free * self.least_slowdown(points) * (1.0 - ROUNDING);
        let mut direct = (sure <= enough).then(slowed);
        if let Some(direct) = direct.take_if(|direct| direct.trajectory.duration() <= enough) {
            return Ok(direct);
        }
        let path = joint_path(curve, points)?;
        let timed = self.retimed(&path, (crossings, most), motion);
        let time = |draft: &Draft<N>| draft.trajectory.duration();
        let least = direct.as_ref().map_or(sure, time);
        match timed {
            Ok(timed) if time(&timed) < least => Ok(timed),
            // No motion along this path is short enough.
            Err(error @ MotionError::NoWay) => Err(error),
            timed => {
                let direct = direct.unwrap_or_else(slowed);
                Ok(match timed {
                    Ok(timed) if time(&timed) < time(&direct) => timed,
                    _ => direct,
                })
            }
        }
    }

    /// The least factor by which time has to be stretched so that the joints keep their limits at all points,
    /// whose parameter is time; at least 1.
    fn least_slowdown(&self, points: &[FollowPoint<N>]) -> f64 {
        let factors = points.iter().map(|point| self.slowdown(point));
        factors.fold(1.0, f64::max)
    }

    /// The factor by which time has to be stretched so that the joints keep their limits at a point.
    pub(super) fn slowdown(&self, point: &FollowPoint<N>) -> f64 {
        self.factor(&point.q).max(self.factor(&point.before()))
    }

    /// The same of joints with their derivatives to time.
    fn factor(&self, joints: &[SVector<f64, N>; 4]) -> f64 {
        self.slowness(joints).max(1.0)
    }

    /// The least time for one of a parameter in which joints with such derivatives to it keep their limits.
    pub(super) fn slowness(&self, [_, first, second, third]: &[SVector<f64, N>; 4]) -> f64 {
        let limits = &self.limits;
        let most = |rates: &SVector<f64, N>, limits: &SVector<f64, N>| {
            let ratios = rates
                .iter()
                .zip(limits)
                .map(|(rate, limit)| rate.abs() / limit);
            ratios.fold(0.0, f64::max)
        };
        most(first, &limits.velocity)
            .max(most(second, &limits.acceleration).sqrt())
            .max(most(third, &limits.jerk).cbrt())
    }

    /// A null-space motion that costs the joints less along a curve whose parameter is time.
    fn helping(
        &self,
        way: &Way<'_, N>,
        points: &[FollowPoint<N>],
        (start, costs): (&SVector<f64, N>, &[&Cost<'_, N>]),
    ) -> Option<NullMotion<N>> {
        let grid: Vec<f64> = points.iter().map(|point| point.u).collect();
        let (tool, options) = (way.tool(), way.options());
        follow::cheaper(&self.solver, &tool, (&grid, start), &options, costs)
    }

    /// About the time that the joints need along points whose parameter is the time of the tool: at each point
    /// the factor by which it must be stretched.
    pub(super) fn about_time(&self, points: &[FollowPoint<N>]) -> f64 {
        let parts = points.windows(2).map(|pair| {
            let mean = 0.5 * (self.factor(&pair[0].q) + self.factor(&pair[1].before()));
            mean * (pair[1].u - pair[0].u)
        });
        parts.sum()
    }

    /// The smooth motion of the tool through the poses of a move that starts at `start`; `fit` says
    /// whether a curve may be fitted through a dense list, `gap` how near to the optimum it ends.
    pub(super) fn smooth_path(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (fit, gap): (bool, Option<f64>),
    ) -> Result<SmoothPath, MotionError> {
        let poses = self.through(motion, start);
        let mut options = smooth::SmoothOptions::new(motion.tolerance, motion.limits);
        options.fit = fit;
        options.gap = gap.unwrap_or(options.gap);
        let plan = smooth::plan(&poses, &options)?;
        Ok(SmoothPath::new(plan, motion.tolerance, &poses))
    }

    /// A motion along the path of a smooth motion, with a time law of its own that is never faster;
    /// `crossings` are those of the smooth motion. [`MotionError::NoWay`] if none is shorter than `most` (s).
    fn retimed(
        &self,
        path: &HermitePath<N, &dyn ToolCurve>,
        (crossings, most): (&[Crossing], f64),
        motion: &Move,
    ) -> Result<Draft<N>, MotionError> {
        let timing = PathTiming::new(path, &self.limits, &motion.limits, &ALONG)?;
        if timing.lower_bound() >= most {
            return Err(MotionError::NoWay);
        }
        let timed = if most < f64::INFINITY {
            timing.solve_below(most)?.ok_or(MotionError::NoWay)?
        } else {
            timing.solve()?
        };
        let times = Crossing::at(crossings, |u| moment(&timed.law, u));
        Ok(self.slowed(passing(timed.trajectory, times), motion))
    }
}

/// A smooth motion of the tool, and joints along it whose parameter is its time.
pub(super) struct Followed<const N: usize> {
    pub(super) path: SmoothPath,
    pub(super) points: Vec<FollowPoint<N>>,
    /// Whether another null-space motion may be searched that helps the joints.
    pub(super) may_be_helped: bool,
}

impl<const N: usize> Followed<N> {
    /// Whether the poses of the curve are so near to each other that a tool that stops at each of them takes much longer.
    pub(super) fn is_dense(&self) -> bool {
        self.path.is_dense()
    }
}

/// The smooth motion of the tool that the joints are to follow.
pub(super) struct SmoothPath {
    pub(super) plan: smooth::SmoothPlan,
    /// Tolerance with which it was planned, m.
    tolerance: f64,
    /// Whether all poses are where the arm is.
    still: bool,
}

impl SmoothPath {
    /// A motion through poses that was planned with a tolerance (m).
    pub(super) fn new(plan: smooth::SmoothPlan, tolerance: f64, poses: &[Isometry3<f64>]) -> Self {
        Self {
            plan,
            tolerance,
            still: is_still(poses),
        }
    }

    /// Whether it is along a curve fitted through a dense list.
    pub(super) fn is_fitted(&self) -> bool {
        self.plan.method() == smooth::Method::Fit
    }

    /// Whether its poses are so near to each other that a tool that stops at each of them takes much longer.
    pub(super) fn is_dense(&self) -> bool {
        self.is_fitted() || self.plan.exact_stop() > DENSE * self.plan.duration()
    }

    /// Whether nothing moves.
    fn is_still(&self) -> bool {
        self.still || self.plan.duration() <= 0.0
    }

    /// The pose of the command that is next at a time.
    fn towards(&self, time: f64) -> usize {
        let passes = self.plan.crossings().iter();
        1 + passes.take_while(|pass| pass.time <= time).count()
    }

    /// The way of the tool, with the next pose after a parameter.
    fn way<'a, const N: usize>(&'a self, towards: &'a dyn Fn(f64) -> usize) -> Way<'a, N> {
        Way {
            still_ends: true,
            towards,
            ..Way::along(&self.plan)
        }
    }

    /// What it promises.
    pub(super) fn blend(&self) -> Blend {
        let certificate = self.plan.certificate();
        Blend {
            tolerance: self.tolerance,
            exact_stop: self.plan.exact_stop(),
            corridor_ratio: certificate.corridor.ratio,
            jerk_ratio: certificate.jerk.ratio.max(certificate.angular_jerk.ratio),
            fallbacks: self.plan.fallbacks(),
        }
    }
}

/// A draft that passes its poses so.
fn passing<const N: usize>(trajectory: Trajectory<N>, crossings: Vec<Crossing>) -> Draft<N> {
    Draft {
        crossings,
        ..Draft::of(trajectory)
    }
}

/// The time at which a monotonic time law reaches `u`, s.
pub(super) fn moment(law: &Trajectory<1>, u: f64) -> f64 {
    let pieces = law.pieces();
    let next = pieces.partition_point(|piece| piece.coefficients[0][0] <= u);
    let Some(piece) = pieces.get(next.saturating_sub(1)) else {
        return 0.0;
    };
    let (mut low, mut high) = (0.0, piece.duration);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if piece.sample(middle).position[0] < u {
            low = middle;
        } else {
            high = middle;
        }
    }
    law.times()[next.saturating_sub(1)] + high
}
