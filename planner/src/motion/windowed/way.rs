//! The check of the whole way of a long smooth move.

use kinematics::follow::{FollowOptions, FollowPoint, TwistPoint, follow};
use kinematics::measure::dexterity;
use nalgebra::SVector;
use trajectory::smooth::{FittedCurve, SmoothOptions};
use trajectory::{Boundary, HermitePath, JointPoint, ToolCurve};

use super::super::Planner;
use super::WindowedMove;
use crate::task::{Move, Shape};

/// Fewest poses of a move that is planned in windows.
const LONG: usize = 4000;
/// Least tolerance, m: a fiftieth of it is kept for what follows the curve.
const LEAST_TOLERANCE: f64 = 1e-5;
/// Least distance of the joints from the ends of their ranges, rad and m.
const MARGIN: f64 = 1e-6;
/// Smallest singular value of the Jacobian (lengths in units of 0.3 m) that is not near a singular
/// place.
const SINGULAR: f64 = 0.02;
/// Least rate of the way at full speed, over its mean: slower is a cusp.
const REGULAR: f64 = 1e-3;
/// Most points of the joint path.
const MOST_POINTS: usize = 4_000_000;

impl<const N: usize> Planner<N> {
    /// Checks the whole way of a long smooth move: a curve passes every pose in order within 0.98 of
    /// its tolerances and stays in the corridor; the joints follow it on one branch, inside their
    /// ranges, away from singular places, from its first point to its last. The first window is planned
    /// too. `None` if that cannot be done in this way: then the move is planned as a whole.
    pub(in super::super) fn begin_windows(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Option<WindowedMove<N>> {
        let long = motion.shape == Shape::Smooth && motion.poses.len() >= LONG;
        if !long || motion.tolerance < LEAST_TOLERANCE || self.efforts.is_some() {
            return None;
        }
        self.check_reach(motion, start).ok()?;
        let origin = self.chain().forward(start);
        let options = SmoothOptions::new(motion.tolerance, motion.limits);
        let curve = {
            let mut poses = Vec::with_capacity(motion.poses.len() + 1);
            poses.push(origin);
            poses.extend_from_slice(&motion.poses);
            FittedCurve::new(&poses, &options)?
        };
        let points = self.joints_along(&curve, start)?;
        if !points.windows(2).all(|pair| self.stays_inside(pair)) {
            return None;
        }
        let least = self.least_times(&curve, &points, motion);
        if !is_regular(&least) {
            return None;
        }
        let end = points.last()?.q[0];
        let points = points
            .into_iter()
            .map(|point| (point.u, JointPoint { q: point.q }))
            .collect();
        let mut windowed = WindowedMove {
            motion: motion.clone(),
            start: *start,
            origin,
            path: HermitePath::new(points, curve)?,
            least,
            end,
            from: 0.0,
            boundary: Boundary::Rest,
            passed: 0,
            stop: None,
            certificate: None,
            rests: 0,
            first: None,
        };
        windowed.first = Some(self.next_window(&mut windowed).ok()?);
        Some(windowed)
    }

    /// The joints along the whole curve, away from singular places.
    fn joints_along(
        &self,
        curve: &FittedCurve,
        start: &SVector<f64, N>,
    ) -> Option<Vec<FollowPoint<N>>> {
        let tool = |u: f64| {
            let seen = curve.at(u);
            TwistPoint {
                pose: seen.pose,
                linear: seen.linear,
                angular: seen.angular,
            }
        };
        let options = FollowOptions {
            most_points: MOST_POINTS,
            ..Default::default()
        };
        let points = follow(&self.solver, &tool, &curve.knots(), start, &options).ok()?;
        let regular =
            |point: &FollowPoint<N>| dexterity(self.chain(), &point.q[0]).smallest >= SINGULAR;
        points.iter().all(regular).then_some(points)
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

    /// The parameter of each point, and about the least time from the start to it at the largest
    /// speeds.
    fn least_times(
        &self,
        curve: &FittedCurve,
        points: &[FollowPoint<N>],
        motion: &Move,
    ) -> Vec<[f64; 2]> {
        let (tool, joints) = (&motion.limits, &self.limits);
        let slowness = |point: &FollowPoint<N>| {
            let seen = curve.at(point.u);
            let place = seen.linear[0].norm() / tool.speed;
            let turn = seen.angular[0].norm() / tool.angular_speed;
            let joint = |j: usize| point.q[1][j].abs() / joints.velocity[j];
            (0..N).map(joint).fold(place.max(turn), f64::max)
        };
        let (mut time, mut before) = (0.0, None);
        let mut least = Vec::with_capacity(points.len());
        for point in points {
            let slow = slowness(point);
            if let Some((u, other)) = before {
                time += 0.5 * (slow + other) * (point.u - u);
            }
            least.push([point.u, time]);
            before = Some((point.u, slow));
        }
        least
    }
}

/// Whether nothing on the way rests although its parameter moves.
fn is_regular(least: &[[f64; 2]]) -> bool {
    let Some([end, time]) = least.last() else {
        return false;
    };
    least
        .windows(2)
        .all(|pair| (pair[1][1] - pair[0][1]) * end >= REGULAR * time * (pair[1][0] - pair[0][0]))
}
