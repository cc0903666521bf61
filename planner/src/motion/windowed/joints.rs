//! The joints along the whole way of a long smooth move.
//!
//! All of them are checked, but few are kept: the points from which a stretch of the way is followed
//! again when it is timed. A stretch follows from its first point alone, so what is followed again is
//! what was checked, to the last bit.

use std::ops::RangeInclusive;

use kinematics::follow::{
    self, FollowError, FollowOptions, FollowPoint, NullMotion, TwistPoint, follow_choosing,
    follow_with, refine,
};
use kinematics::measure::dexterity;
use nalgebra::{SVector, Vector3};
use trajectory::smooth::{FittedCurve, FittedPart};
use trajectory::{HermitePoint, ToolLimits, ToolPoint};

use super::super::Planner;
use super::super::cartesian::of_path;
use crate::task::Move;

/// Knots of the curve from the first point of a stretch to that of the next.
const STRETCH: usize = 64;
/// Least distance of the joints from the ends of their ranges, rad and m.
const MARGIN: f64 = 1e-6;
/// Smallest singular value of the Jacobian (lengths in units of 0.3 m) that is not near a singular
/// place.
const SINGULAR: f64 = 0.02;
/// Least rate of the way at full speed, over its mean: slower is a cusp.
const REGULAR: f64 = 1e-3;
/// Most points of the joint path.
const MOST_POINTS: usize = 4_000_000;

/// What is kept of the joints along a curve.
#[derive(Clone, Debug)]
pub(super) struct JointsAlong<const N: usize> {
    motion: NullMotion<N>,
    /// First point of each stretch, and about the least time from the start to it (s).
    begins: Vec<(FollowPoint<N>, f64)>,
    /// The last point, and the least time to it.
    end: (FollowPoint<N>, f64),
}

/// What the check of a whole way gives.
pub(super) struct Checked<const N: usize> {
    pub joints: JointsAlong<N>,
    /// The begin of the curve.
    pub first: FittedPart,
    pub corridor_ratio: f64,
}

/// Points of the joint path, and about the least time from the start to each (s).
#[derive(Clone, Debug, Default)]
pub(super) struct Stretch<const N: usize> {
    pub points: Vec<HermitePoint<N>>,
    pub least: Vec<f64>,
}

impl<const N: usize> JointsAlong<N> {
    /// Last parameter, and about the least time of the whole way (s).
    pub(super) fn end(&self) -> (f64, f64) {
        (self.end.0.u, self.end.1)
    }

    /// Joints at the end (rad, m).
    pub(super) fn last(&self) -> &SVector<f64, N> {
        &self.end.0.q[0]
    }

    /// How many stretches there are.
    pub(super) fn count(&self) -> usize {
        self.begins.len()
    }
}

/// Why the joints do not follow a curve.
pub(super) enum NoWay {
    /// The curve cannot be made, or misses a pose.
    Curve,
    /// The arm cannot follow it.
    Joints,
}

impl From<FollowError> for NoWay {
    fn from(_: FollowError) -> Self {
        Self::Joints
    }
}

impl<const N: usize> Planner<N> {
    /// The joints along the whole curve, on one branch, inside their ranges, away from singular places,
    /// if the way is regular. The curve is made for that, stretch by stretch, and is checked all along.
    pub(super) fn joints_along(
        &self,
        curve: &FittedCurve,
        start: &SVector<f64, N>,
        motion: &Move,
    ) -> Result<Checked<N>, NoWay> {
        let mut part = FittedPart::begin(curve, &motion.poses).ok_or(NoWay::Curve)?;
        let covered = |part: &mut FittedPart, to: f64| {
            let good = part.cover(curve, &motion.poses, to) && part.check();
            good.then_some(()).ok_or(NoWay::Curve)
        };
        // Without a null space there is nothing to choose, so one leg is enough to begin.
        let known = knots(curve, 0..=if N > 6 { curve.last_knot() } else { 1 });
        covered(&mut part, known[known.len() - 1])?;
        let tool = |u: f64| twist(&part, u);
        let at = (&known[..], start);
        let (mut points, mut chosen) = follow_choosing(&self.solver, &tool, at, &options())?;
        if let Some(quicker) = self.quicker_along(&part, at, motion)
            && let Ok(followed) = follow_with(&self.solver, &tool, at, &options(), &quicker)
        {
            (points, chosen) = (followed, quicker);
        }
        let mut begin = (*points.first().ok_or(NoWay::Joints)?, 0.0);
        drop((points, known));
        let (mut begins, mut count, mut slowest) = (Vec::new(), 0, f64::INFINITY);
        let first = part.clone();
        for index in 0..curve.last_knot().div_ceil(STRETCH) {
            let grid = grid(curve, index);
            covered(&mut part, grid[grid.len() - 1])?;
            let tool = |u: f64| twist(&part, u);
            let points = refine(
                &self.solver,
                &tool,
                (&grid, &[begin.0]),
                &options(),
                &chosen,
            )?;
            let far =
                |point: &FollowPoint<N>| dexterity(self.chain(), &point.q[0]).smallest >= SINGULAR;
            let inside = points.windows(2).all(|pair| self.stays_inside(pair));
            count += points.len();
            if !inside || !points.iter().all(far) || count > MOST_POINTS {
                return Err(NoWay::Joints);
            }
            let least = self.least_times(&part, (&points, begin.1), motion);
            for (times, pair) in least.windows(2).zip(points.windows(2)) {
                let rate = (times[1] - times[0]) / (pair[1].u - pair[0].u);
                slowest = if rate >= slowest { slowest } else { rate };
            }
            begins.push(begin);
            begin = last_of(&points, &least).ok_or(NoWay::Joints)?;
            part.forget_checked(begin.0.u);
        }
        covered(&mut part, curve.end())?;
        let joints = JointsAlong {
            motion: chosen,
            begins,
            end: begin,
        };
        let (end, time) = joints.end();
        // Nothing on the way may rest although its parameter moves.
        let regular = slowest * end >= REGULAR * time;
        let checked = Checked {
            joints,
            first,
            corridor_ratio: part.corridor_ratio(),
        };
        regular.then_some(checked).ok_or(NoWay::Joints)
    }

    /// A null-space motion with which the joints need about less time for the whole curve, which the part covers.
    fn quicker_along(
        &self,
        part: &FittedPart,
        at: (&[f64], &SVector<f64, N>),
        motion: &Move,
    ) -> Option<NullMotion<N>> {
        let cost = |points: &[FollowPoint<N>]| self.about_time_along(part, points, motion);
        let tool = |u: f64| twist(part, u);
        follow::cheaper(&self.solver, &tool, at, &options(), &[&cost])
    }

    /// About the time (s) that the joints and the tool need along points of a curve: at each point the least in which they keep their
    /// limits.
    fn about_time_along(
        &self,
        curve: &FittedPart,
        points: &[FollowPoint<N>],
        motion: &Move,
    ) -> f64 {
        let slowness = |point: &FollowPoint<N>| {
            let tool = tool_slowness(&curve.tool(point.u), &motion.limits);
            self.slowness(&point.q).max(tool)
        };
        times_along((points, 0.0), slowness)
            .last()
            .copied()
            .unwrap_or(0.0)
    }

    /// A stretch, followed again from its first point. The part covers it.
    pub(super) fn stretch(
        &self,
        (curve, part): (&FittedCurve, &FittedPart),
        along: &JointsAlong<N>,
        index: usize,
        motion: &Move,
    ) -> Option<Stretch<N>> {
        let (first, time) = along.begins.get(index)?;
        let tool = |u: f64| twist(part, u);
        let grid = grid(curve, index);
        let known = (&grid[..], std::slice::from_ref(first));
        let points = refine(&self.solver, &tool, known, &options(), &along.motion).ok()?;
        let least = self.least_times(part, (&points, *time), motion);
        let points = points.iter().map(of_path).collect();
        Some(Stretch { points, least })
    }

    /// Whether the polynomial of degree seven between two points stays inside the ranges of the
    /// joints: it lies between the least and the largest of its Bernstein points.
    fn stays_inside(&self, pair: &[FollowPoint<N>]) -> bool {
        let step = pair[1].u - pair[0].u;
        let side = |[q, q1, q2, q3]: [SVector<f64, N>; 4], h: f64| {
            let one = q + q1 * (h / 7.0);
            let two = one * 2.0 - q + q2 * (h * h / 42.0);
            let three = two * 3.0 - one * 3.0 + q + q3 * (h * h * h / 210.0);
            [q, one, two, three]
        };
        let limits = &self.limits;
        let inside = |q: &SVector<f64, N>| {
            (0..N).all(|j| q[j] >= limits.lower[j] + MARGIN && q[j] <= limits.upper[j] - MARGIN)
        };
        let (left, right) = (side(pair[0].q, step), side(pair[1].before(), -step));
        left.iter().chain(&right).all(inside)
    }

    /// About the least time from the start to each point at the largest speeds, from that to the first.
    fn least_times(
        &self,
        curve: &FittedPart,
        (points, first): (&[FollowPoint<N>], f64),
        motion: &Move,
    ) -> Vec<f64> {
        let (tool, joints) = (&motion.limits, &self.limits);
        let slowness = |point: &FollowPoint<N>| {
            let seen = curve.tool(point.u);
            let place = seen.linear[0].norm() / tool.speed;
            let turn = seen.angular[0].norm() / tool.angular_speed;
            let joint = |j: usize| point.q[1][j].abs() / joints.velocity[j];
            (0..N).map(joint).fold(place.max(turn), f64::max)
        };
        times_along((points, first), slowness)
    }
}

/// The times (s) from the start to points, that of the first of which is given, where each has a time for one of the parameter.
fn times_along<const N: usize>(
    (points, first): (&[FollowPoint<N>], f64),
    slowness: impl Fn(&FollowPoint<N>) -> f64,
) -> Vec<f64> {
    let (mut time, mut before) = (first, None);
    let mut times = Vec::with_capacity(points.len());
    for point in points {
        let slow = slowness(point);
        if let Some((u, other)) = before {
            time += 0.5 * (slow + other) * (point.u - u);
        }
        times.push(time);
        before = Some((point.u, slow));
    }
    times
}

/// The last point of a stretch, and the least time to it.
fn last_of<const N: usize>(
    points: &[FollowPoint<N>],
    least: &[f64],
) -> Option<(FollowPoint<N>, f64)> {
    Some((*points.last()?, *least.last()?))
}

/// The knots of a stretch: its last one is the first of the next.
pub(super) fn grid(curve: &FittedCurve, index: usize) -> Vec<f64> {
    let first = index * STRETCH;
    knots(curve, first..=(first + STRETCH).min(curve.last_knot()))
}

fn knots(curve: &FittedCurve, range: RangeInclusive<usize>) -> Vec<f64> {
    range.map(|index| curve.knot(index)).collect()
}

fn options() -> FollowOptions {
    FollowOptions {
        most_points: MOST_POINTS,
        ..Default::default()
    }
}

/// The least time for one of the parameter in which the tool keeps its limits at a point of a curve.
fn tool_slowness(seen: &ToolPoint, limits: &ToolLimits) -> f64 {
    let most = |rates: &[Vector3<f64>; 3], limits: [f64; 3]| {
        let [first, second, third] = [0, 1, 2].map(|k| rates[k].norm() / limits[k]);
        first.max(second.sqrt()).max(third.cbrt())
    };
    let place = most(
        &seen.linear,
        [limits.speed, limits.acceleration, limits.jerk],
    );
    let turn = most(
        &seen.angular,
        [
            limits.angular_speed,
            limits.angular_acceleration,
            limits.angular_jerk,
        ],
    );
    place.max(turn)
}

/// The tool at a parameter of the curve, no derivative of which jumps.
fn twist(curve: &FittedPart, u: f64) -> TwistPoint {
    let seen = curve.tool(u);
    TwistPoint {
        pose: seen.pose,
        linear: seen.linear,
        angular: seen.angular,
        jump: [Vector3::zeros(); 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::Controller;
    use crate::robot::load;
    use crate::task::Shape;
    use nalgebra::{Isometry3, Vector3};
    use trajectory::smooth::SmoothOptions;

    /// A stretch that is followed again ends, to the last bit, where the check of the whole way began the
    /// next one.
    #[test]
    fn stretches_join() {
        let robot = load("ur5e").unwrap();
        let controller = Controller::<6>::new(&robot, 1000.0, crcl::LengthUnit::default()).unwrap();
        let planner = controller.planner();
        let home = SVector::from_column_slice(&robot.home);
        let start = planner.chain().forward(&home);
        let at = |i: i32| {
            let (sine, cosine) = (4e-3 * f64::from(i)).sin_cos();
            let way = Vector3::new(0.1 * (cosine - 1.0), 0.1 * sine, 0.0);
            Isometry3::from_parts((start.translation.vector + way).into(), start.rotation)
        };
        let poses: Vec<_> = (0..8000).map(at).collect();
        let motion = Move {
            shape: Shape::Smooth,
            poses: poses[1..].to_vec(),
            tolerance: 1e-4,
            limits: robot.motion_limits(),
        };
        let options = SmoothOptions::new(motion.tolerance, motion.limits);
        let curve = FittedCurve::all(&poses[0], &poses[1..], &options)
            .next()
            .unwrap();
        let checked = planner.joints_along(&curve, &home, &motion);
        let Ok(Checked { joints: along, .. }) = checked else {
            panic!("the arm does not follow");
        };
        let mut part = FittedPart::begin(&curve, &motion.poses).unwrap();
        assert!(along.count() >= 3, "{}", along.count());
        for index in 0..along.count() {
            let to = *grid(&curve, index).last().unwrap();
            assert!(part.cover(&curve, &motion.poses, to));
            let stretch = planner.stretch((&curve, &part), &along, index, &motion);
            let stretch = stretch.unwrap();
            let (point, least) = along.begins.get(index + 1).unwrap_or(&along.end);
            let last = stretch.points.last().unwrap();
            assert_eq!((last.u, last.joint.q), (point.u, point.q));
            assert_eq!(stretch.least.last(), Some(least));
        }
        assert_eq!(along.end().0, curve.end());
    }
}
