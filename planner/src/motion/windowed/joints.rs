//! The joints along the whole way of a long smooth move.
//!
//! All of them are checked, but few are kept: the points from which a stretch of the way is followed
//! again when it is timed. A stretch follows from its first point alone, so what is followed again is
//! what was checked, to the last bit.

use kinematics::follow::{
    FollowOptions, FollowPoint, NullMotion, TwistPoint, follow_choosing, refine,
};
use kinematics::measure::dexterity;
use nalgebra::SVector;
use trajectory::smooth::FittedCurve;
use trajectory::{JointPoint, ToolCurve};

use super::super::Planner;
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

/// Points of the joint path, and about the least time from the start to each (s).
#[derive(Clone, Debug, Default)]
pub(super) struct Stretch<const N: usize> {
    pub points: Vec<(f64, JointPoint<N>)>,
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

impl<const N: usize> Planner<N> {
    /// The joints along the whole curve, on one branch, inside their ranges, away from singular places,
    /// if the way is regular; `None` otherwise.
    pub(super) fn joints_along(
        &self,
        curve: &FittedCurve,
        start: &SVector<f64, N>,
        motion: &Move,
    ) -> Option<JointsAlong<N>> {
        let knots = curve.knots();
        let tool = |u: f64| twist(curve, u);
        // Without a null space there is nothing to choose, so one leg is enough to begin.
        let known = if N > 6 { knots.len() } else { 2 };
        let (points, chosen) =
            follow_choosing(&self.solver, &tool, (&knots[..known], start), &options()).ok()?;
        let mut begin = (*points.first()?, 0.0);
        let (mut begins, mut count, mut slowest) = (Vec::new(), 0, f64::INFINITY);
        for grid in grids(&knots) {
            let points =
                refine(&self.solver, &tool, (grid, &[begin.0]), &options(), &chosen).ok()?;
            let far =
                |point: &FollowPoint<N>| dexterity(self.chain(), &point.q[0]).smallest >= SINGULAR;
            let inside = points.windows(2).all(|pair| self.stays_inside(pair));
            count += points.len();
            if !inside || !points.iter().all(far) || count > MOST_POINTS {
                return None;
            }
            let least = self.least_times(curve, (&points, begin.1), motion);
            for (times, pair) in least.windows(2).zip(points.windows(2)) {
                let rate = (times[1] - times[0]) / (pair[1].u - pair[0].u);
                slowest = if rate >= slowest { slowest } else { rate };
            }
            begins.push(begin);
            begin = (*points.last()?, *least.last()?);
        }
        let along = JointsAlong {
            motion: chosen,
            begins,
            end: begin,
        };
        let (end, time) = along.end();
        // Nothing on the way may rest although its parameter moves.
        (slowest * end >= REGULAR * time).then_some(along)
    }

    /// A stretch, followed again from its first point.
    pub(super) fn stretch(
        &self,
        curve: &FittedCurve,
        along: &JointsAlong<N>,
        index: usize,
        motion: &Move,
    ) -> Option<Stretch<N>> {
        let knots = curve.knots();
        let (first, time) = along.begins.get(index)?;
        let tool = |u: f64| twist(curve, u);
        let grid = grids(&knots).nth(index)?;
        let known = (grid, std::slice::from_ref(first));
        let points = refine(&self.solver, &tool, known, &options(), &along.motion).ok()?;
        let least = self.least_times(curve, (&points, *time), motion);
        let points = points
            .into_iter()
            .map(|point| (point.u, JointPoint { q: point.q }))
            .collect();
        Some(Stretch { points, least })
    }

    /// Whether the polynomial of degree seven between two points stays inside the ranges of the
    /// joints: it lies between the least and the largest of its Bernstein points.
    fn stays_inside(&self, pair: &[FollowPoint<N>]) -> bool {
        let step = pair[1].u - pair[0].u;
        let side = |point: &FollowPoint<N>, h: f64| {
            let [q, q1, q2, q3] = point.q;
            let one = q + q1 * (h / 7.0);
            let two = one * 2.0 - q + q2 * (h * h / 42.0);
            let three = two * 3.0 - one * 3.0 + q + q3 * (h * h * h / 210.0);
            [q, one, two, three]
        };
        let limits = &self.limits;
        let inside = |q: &SVector<f64, N>| {
            (0..N).all(|j| q[j] >= limits.lower[j] + MARGIN && q[j] <= limits.upper[j] - MARGIN)
        };
        let (left, right) = (side(&pair[0], step), side(&pair[1], -step));
        left.iter().chain(&right).all(inside)
    }

    /// About the least time from the start to each point at the largest speeds, from that to the first.
    fn least_times(
        &self,
        curve: &FittedCurve,
        (points, first): (&[FollowPoint<N>], f64),
        motion: &Move,
    ) -> Vec<f64> {
        let (tool, joints) = (&motion.limits, &self.limits);
        let slowness = |point: &FollowPoint<N>| {
            let seen = curve.at(point.u);
            let place = seen.linear[0].norm() / tool.speed;
            let turn = seen.angular[0].norm() / tool.angular_speed;
            let joint = |j: usize| point.q[1][j].abs() / joints.velocity[j];
            (0..N).map(joint).fold(place.max(turn), f64::max)
        };
        let (mut time, mut before) = (first, None);
        let mut least = Vec::with_capacity(points.len());
        for point in points {
            let slow = slowness(point);
            if let Some((u, other)) = before {
                time += 0.5 * (slow + other) * (point.u - u);
            }
            least.push(time);
            before = Some((point.u, slow));
        }
        least
    }
}

/// The knots of each stretch: its last one is the first of the next.
fn grids(knots: &[f64]) -> impl Iterator<Item = &[f64]> {
    let last = knots.len() - 1;
    (0..last)
        .step_by(STRETCH)
        .map(move |first| &knots[first..=(first + STRETCH).min(last)])
}

fn options() -> FollowOptions {
    FollowOptions {
        most_points: MOST_POINTS,
        ..Default::default()
    }
}

/// The tool at a parameter of the curve.
fn twist(curve: &FittedCurve, u: f64) -> TwistPoint {
    let seen = curve.at(u);
    TwistPoint {
        pose: seen.pose,
        linear: seen.linear,
        angular: seen.angular,
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
        let curve = FittedCurve::new(&poses, &options).unwrap();
        let along = planner.joints_along(&curve, &home, &motion).unwrap();
        assert!(along.count() >= 3, "{}", along.count());
        for index in 0..along.count() {
            let stretch = planner.stretch(&curve, &along, index, &motion).unwrap();
            let (point, least) = along.begins.get(index + 1).unwrap_or(&along.end);
            let last = stretch.points.last().unwrap();
            assert_eq!((last.0, last.1.q), (point.u, point.q));
            assert_eq!(stretch.least.last(), Some(least));
        }
        assert_eq!(along.end().0, curve.end());
    }
}
