//! MoveStraightTo and MoveSmoothlyTo: a curve of the tool, followed by the joints.

use kinematics::follow::{
    self, FollowCause, FollowError, FollowOptions, FollowPoint, NullMotion, SpareSearch, TwistPoint,
};
use kinematics::{Chain, IkFailure};
use nalgebra::{Isometry3, SVector, Vector3};
use realtime::{Piece, Sample};
use trajectory::smooth::angular_tolerance;
use trajectory::timing::{self, PathTiming};
use trajectory::{
    HermitePath, HermitePoint, JointPoint, Line, TimingOptions, ToolCurve, ToolPoint, Trajectory,
};

use super::soonest::RESTING;
use super::{BlockedCause, Draft, MotionError, Planner};
use crate::task::Move;

/// Longest distance of the tool between two solved points, m.
const STEP_M: f64 = 4e-3;
/// Largest turn of the tool between two solved points, rad.
const STEP_RAD: f64 = 0.02;
/// Largest deviation of the fitted joint path between solved points, m and rad.
const FIT: f64 = 5e-7;
/// Relative gap of the time law: so small that hardly any motion is slower than with a search that begins far
/// from the limits and ends at the usual gap.
const GAP: f64 = 5e-4;
/// Null-space motions that are tried for a faster one.
const TRIALS: usize = 16;
/// How often the grid is refined before the path is given up.
const REFINEMENTS: usize = 8;
/// Most points of a path.
const MOST_POINTS: usize = 400_000;

impl<const N: usize> Planner<N> {
    /// Where the tool is at the start of a move, and the poses of the move.
    pub(super) fn through(&self, motion: &Move, start: &SVector<f64, N>) -> Vec<Isometry3<f64>> {
        let mut poses = vec![self.chain().forward(start)];
        poses.extend_from_slice(&motion.poses);
        poses
    }

    pub(super) fn plan_straight(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<Draft<N>, MotionError> {
        let goal = motion.poses.first().copied().unwrap_or_default();
        let from = self.chain().forward(start);
        if is_still(&[from, goal]) {
            return Ok(Draft::of(Trajectory::new(Vec::new())));
        }
        self.along(&Line::new(from, goal), motion, start)
    }

    /// A motion along a curve whose parameter has no time in it, from rest to rest.
    pub(super) fn along(
        &self,
        curve: &dyn ToolCurve,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<Draft<N>, MotionError> {
        let way = Way::along(curve);
        let (points, spare) = self
            .follows(&way, start)
            .map_err(|blocked| self.blamed(blocked, motion, start))?;
        let quicker = self.quicker(&way, (&points, &spare), motion, start);
        let options = TimingOptions {
            gap: GAP,
            ..RESTING
        };
        let path = joint_path(curve, &points)?;
        let time = |path| PathTiming::new(path, &self.limits, &motion.limits, &options);
        let (mut timing, mut points) = (time(&path)?, &points);
        let other = quicker.and_then(|points| Some((joint_path(curve, &points).ok()?, points)));
        if let Some((path, quicker)) = &other
            && let Ok(other) = time(path)
            && other.expected() < timing.expected()
        {
            (timing, points) = (other, quicker);
        }
        let timed = timing.near().solve()?;
        let trajectory = self.finite(timed.trajectory, points, &|_| 1)?;
        let draft = Draft {
            // The joints of a seven-joint arm may take another path along the same line.
            least: if N > 6 {
                0.0
            } else {
                timed.certificate.lower_bound
            },
            ..Draft::of(trajectory)
        };
        Ok(self.slowed(draft, motion))
    }

    /// The joints along a curve with a null-space motion near a known one with which they need about less time, if one is found.
    fn quicker(
        &self,
        way: &Way<'_, N>,
        (points, spare): (&[FollowPoint<N>], &NullMotion<N>),
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Option<Vec<FollowPoint<N>>> {
        if N <= 6 {
            return None;
        }
        let cost = |points: &[FollowPoint<N>]| self.about_law(way.curve, points, motion);
        let grid: Vec<f64> = points.iter().map(|point| point.u).collect();
        let (tool, options) = (way.tool(), way.options());
        let at = (&grid[..], start);
        let search = SpareSearch {
            known: spare,
            cost: &cost,
            trials: TRIALS,
        };
        let quicker = follow::cheaper_near(&self.solver, &tool, at, &options, &search)?;
        let way = Way {
            spare: Some(&quicker),
            ..*way
        };
        self.followed(&way, start).ok()
    }

    /// About the time of a law of the joints along a curve (s), infinite where there is none.
    pub(super) fn about_law(
        &self,
        curve: &dyn ToolCurve,
        points: &[FollowPoint<N>],
        motion: &Move,
    ) -> f64 {
        let about = |path| timing::about_time(&path, &self.limits, &motion.limits).ok();
        let path = joint_path(curve, points).ok();
        path.and_then(about).unwrap_or(f64::INFINITY)
    }

    /// Solves inverse kinematics along a curve, on one branch, on a grid fine
    /// enough that a quintic between its points stays on the curve.
    pub(super) fn followed(
        &self,
        way: &Way<'_, N>,
        start: &SVector<f64, N>,
    ) -> Result<Vec<FollowPoint<N>>, MotionError> {
        self.follows(way, start).map(|(points, _)| points)
    }

    /// The same with the null-space motion.
    fn follows(
        &self,
        way: &Way<'_, N>,
        start: &SVector<f64, N>,
    ) -> Result<(Vec<FollowPoint<N>>, NullMotion<N>), MotionError> {
        let (mut points, mut chosen) = self.solved(way, &first_grid(way.curve), start)?;
        for _ in 0..REFINEMENTS {
            let finer = refined(self.chain(), &points, way.curve);
            if finer.len() == points.len() || finer.len() > MOST_POINTS {
                break;
            }
            let found = self.with_more(way, (&finer, &points), &chosen);
            // Another null-space motion can be searched only where there is one and it was not given.
            let searched = N > 6 && way.spare.is_none();
            match found {
                Err(_) if searched => (points, chosen) = self.solved(way, &finer, start)?,
                found => points = found?,
            }
        }
        Ok((points, chosen))
    }

    /// The joints at the points of a finer grid, with the null-space motion of those that are known.
    fn with_more(
        &self,
        way: &Way<'_, N>,
        (grid, points): (&[f64], &[FollowPoint<N>]),
        spare: &NullMotion<N>,
    ) -> Result<Vec<FollowPoint<N>>, MotionError> {
        let (tool, options) = (way.tool(), way.options());
        follow::refine(&self.solver, &tool, (grid, points), &options, spare)
            .map_err(|error| self.blocked(&error, way.curve.end(), way.towards))
    }

    /// The joints at the points of a grid and between them, and the null-space motion that was followed.
    fn solved(
        &self,
        way: &Way<'_, N>,
        grid: &[f64],
        start: &SVector<f64, N>,
    ) -> Result<(Vec<FollowPoint<N>>, NullMotion<N>), MotionError> {
        let (tool, at, options) = (way.tool(), (grid, start), way.options());
        let found = match way.spare {
            Some(spare) => follow::follow_with(&self.solver, &tool, at, &options, spare)
                .map(|points| (points, spare.clone())),
            None => follow::follow_choosing(&self.solver, &tool, at, &options),
        };
        found.map_err(|error| self.blocked(&error, way.curve.end(), way.towards))
    }

    /// Why the path is blocked. If the pose ahead is out of reach by more than the tolerance, that
    /// is the reason: no other path would help.
    #[cold]
    pub(super) fn blamed(
        &self,
        blocked: MotionError,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> MotionError {
        let MotionError::Blocked {
            pose,
            percent,
            cause,
        } = &blocked
        else {
            return blocked;
        };
        let ahead = pose
            .checked_sub(1)
            .and_then(|index| motion.poses.get(index));
        let failure = match cause {
            // At the end of the way that pose has been looked at.
            BlockedCause::Unreachable(failure) if *percent >= 100.0 => Some(*failure),
            _ => ahead
                .and_then(|goal| self.solver.nearest(goal, start).err())
                .map(|report| report.failure),
        };
        // The last pose is reached, the others are passed.
        let slack = if *pose < motion.poses.len() {
            motion.tolerance
        } else {
            0.0
        };
        match failure {
            Some(IkFailure::OutOfReach { distance }) if distance <= slack => blocked,
            Some(IkFailure::Orientation { angle }) if angle <= angular_tolerance(slack) => blocked,
            Some(failure) => Self::out_of_reach(*pose, failure).unwrap_or(blocked),
            None => blocked,
        }
    }

    #[cold]
    fn blocked(
        &self,
        error: &FollowError,
        end: f64,
        towards: &dyn Fn(f64) -> usize,
    ) -> MotionError {
        let cause = match (error.cause, error.joint) {
            (FollowCause::Limit, Some(joint)) => BlockedCause::JointLimit {
                joint: self.joint_name(joint),
                beyond: self.amount(joint, error.amount),
            },
            (FollowCause::Singular, Some(joint)) => BlockedCause::Singular {
                joint: self.joint_name(joint),
                smallest: error.amount,
            },
            (FollowCause::Unreachable(IkFailure::AtLimit { joint, beyond }), _) => {
                BlockedCause::BeyondLimit {
                    joint: self.joint_name(joint),
                    beyond: self.amount(joint, beyond),
                }
            }
            (FollowCause::Unreachable(failure), _) => BlockedCause::Unreachable(failure),
            (_, _) => BlockedCause::Path(*error),
        };
        MotionError::Blocked {
            pose: towards(error.u),
            percent: 100.0 * error.u / end,
            cause,
        }
    }
}

/// Whether all poses are where the first is, within 1e-9 m and rad.
pub(super) fn is_still(poses: &[Isometry3<f64>]) -> bool {
    poses.iter().all(|pose| {
        let gap = poses[0].inv_mul(pose);
        gap.translation.vector.norm() < 1e-9 && gap.rotation.angle() < 1e-9
    })
}

/// A curve of the tool, whether it is at rest at both ends in its own parameter, the next pose of the
/// command after a parameter, and the null-space motion if it is not to be searched.
pub(super) struct Way<'a, const N: usize> {
    pub curve: &'a dyn ToolCurve,
    pub still_ends: bool,
    pub towards: &'a dyn Fn(f64) -> usize,
    pub spare: Option<&'a NullMotion<N>>,
}

impl<'a, const N: usize> Way<'a, N> {
    /// A curve whose parameter has no time in it, to the one pose of its command.
    pub(super) fn along(curve: &'a dyn ToolCurve) -> Self {
        Self {
            curve,
            still_ends: false,
            towards: &|_| 1,
            spare: None,
        }
    }

    /// How closely the joints follow it.
    pub(super) fn options(&self) -> FollowOptions {
        FollowOptions {
            still_ends: self.still_ends,
            ..FollowOptions::default()
        }
    }

    /// The motion of the tool.
    pub(super) fn tool(&self) -> impl Fn(f64) -> TwistPoint {
        let (knots, aside) = (self.curve.knots(), ASIDE * self.curve.end());
        move |u| {
            let ToolPoint {
                pose,
                mut linear,
                mut angular,
            } = self.curve.at(u);
            let mut jump = [Vector3::zeros(); 2];
            let knot = knots.get(knots.partition_point(|knot| *knot < u - aside));
            if knot.is_some_and(|knot| *knot <= u + aside) {
                let [before, after] = [-2.0, 2.0].map(|side| self.curve.at(u + side * aside));
                jump = [
                    after.linear[2] - before.linear[2],
                    after.angular[2] - before.angular[2],
                ];
                (linear[2], angular[2]) = (after.linear[2], after.angular[2]);
            }
            TwistPoint {
                pose,
                linear,
                angular,
                jump,
            }
        }
    }
}

fn sample<const N: usize>(point: &FollowPoint<N>) -> Sample<N> {
    let [position, velocity, acceleration, jerk] = point.q;
    Sample {
        position,
        velocity,
        acceleration,
        jerk,
    }
}

/// Quintics between followed points, in the parameter of the curve.
pub(super) fn pieces<const N: usize>(points: &[FollowPoint<N>]) -> Vec<Piece<N>> {
    points
        .windows(2)
        .map(|pair| piece(&pair[0], &pair[1]))
        .collect()
}

fn piece<const N: usize>(from: &FollowPoint<N>, to: &FollowPoint<N>) -> Piece<N> {
    Piece::hermite(to.u - from.u, &sample(from), &sample(to))
}

/// A followed point as one of the path of the joints.
pub(super) fn of_path<const N: usize>(point: &FollowPoint<N>) -> HermitePoint<N> {
    HermitePoint {
        u: point.u,
        joint: JointPoint { q: point.q },
        jump: point.jump,
    }
}

/// The followed points as a path of the joints.
pub(super) fn joint_path<'a, const N: usize>(
    curve: &'a dyn ToolCurve,
    points: &[FollowPoint<N>],
) -> Result<HermitePath<N, &'a dyn ToolCurve>, MotionError> {
    let points = points.iter().map(of_path).collect();
    HermitePath::new(points, curve).ok_or(MotionError::NoWay)
}

/// Distance from a knot at which derivatives are those of its side, as a share of the curve.
const ASIDE: f64 = 1e-9;
/// Share of a curve up to which two of its knots are one: between nearer points rounding looks like a jump of the acceleration.
const NEAR: f64 = 1e-6;

/// Knots of the curve, with points between them so that no step is long.
fn first_grid(curve: &dyn ToolCurve) -> Vec<f64> {
    let mut knots = curve.knots();
    knots.push(0.0);
    knots.push(curve.end());
    knots.retain(|u| (0.0..=curve.end()).contains(u));
    knots.sort_by(f64::total_cmp);
    knots.dedup_by(|b, a| *b - *a <= NEAR * curve.end());
    if let Some(last) = knots.last_mut() {
        *last = curve.end();
    }
    let mut grid = vec![0.0];
    for pair in knots.windows(2) {
        let steps = steps_between(curve, pair[0], pair[1]);
        for step in 1..=steps {
            grid.push(pair[0] + (pair[1] - pair[0]) * step as f64 / steps as f64);
        }
    }
    grid
}

fn steps_between(curve: &dyn ToolCurve, from: f64, to: f64) -> usize {
    const PROBES: usize = 4;
    let poses: Vec<_> = (0..=PROBES)
        .map(|i| curve.at(from + (to - from) * i as f64 / PROBES as f64).pose)
        .collect();
    let (mut way, mut turn) = (0.0, 0.0);
    for pair in poses.windows(2) {
        let gap = pair[0].inv_mul(&pair[1]);
        way += gap.translation.vector.norm();
        turn += gap.rotation.angle();
    }
    let steps = (way / STEP_M).max(turn / STEP_RAD).ceil();
    (steps as usize).clamp(1, 100_000)
}

/// The grid with one more point in each interval in which the fit leaves the curve.
fn refined<const N: usize>(
    chain: &Chain<N>,
    points: &[FollowPoint<N>],
    curve: &dyn ToolCurve,
) -> Vec<f64> {
    let mut finer = Vec::with_capacity(points.len() * 2);
    for pair in points.windows(2) {
        finer.push(pair[0].u);
        let half = 0.5 * (pair[1].u - pair[0].u);
        let joints = piece(&pair[0], &pair[1]).sample(half).position;
        let middle = pair[0].u + half;
        let gap = chain.forward(&joints).inv_mul(&curve.at(middle).pose);
        if gap.translation.vector.norm() > FIT || gap.rotation.angle() > FIT {
            finer.push(middle);
        }
    }
    finer.extend(points.last().map(|point| point.u));
    finer
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tool that rests, with knots that are very near to each other.
    struct Resting;

    impl ToolCurve for Resting {
        fn end(&self) -> f64 {
            4.0
        }

        fn knots(&self) -> Vec<f64> {
            vec![0.0, 1e-6, 2.0, 2.000_000_4, 3.0, 3.999_999, 4.0]
        }

        fn at(&self, _: f64) -> ToolPoint {
            ToolPoint::still(Isometry3::identity())
        }
    }

    /// A path timing would see a corner between knots that are nearer to each other than rounding allows.
    #[test]
    fn knots_that_are_very_near_are_one() {
        assert_eq!(first_grid(&Resting), [0.0, 2.0, 3.0, 4.0]);
    }
}
