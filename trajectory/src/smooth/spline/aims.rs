//! Where and when the motion of an iterate sees the poses.

use nalgebra::{Isometry3, Vector3};

use super::build::Task;
use super::problem::{Point, Problem};
use super::turns::turns;
use crate::line::body_turn;
use crate::smooth::span::Span;

impl Task<'_> {
    /// Whether the place alone says when each inner pose is passed: the legs beside it are not turns on the spot.
    pub(super) fn led(&self) -> Vec<bool> {
        let far = |pair: &[Isometry3<f64>]| {
            let way = pair[1].translation.vector - pair[0].translation.vector;
            way.norm() > self.options.tolerance
        };
        let around = self.poses.windows(3);
        around
            .map(|three| far(&three[..2]) && far(&three[1..]))
            .collect()
    }

    /// The inner vertices where the motion of an iterate sees the poses: the rotation vector of a pose is that of
    /// the iterate at the pass, less the turn from the pose to the motion there.
    pub(super) fn aims<const D: usize>(
        &self,
        problem: &Problem<D>,
        point: &Point<D>,
    ) -> Vec<[f64; D]> {
        let h = problem.spacing(point.z);
        let rotations = self.rotations(problem, point, D - 3, h);
        let passes = point.crossings.iter().zip(problem.inner());
        let aim = |(i, (time, vertex)): (usize, (&f64, &[f64; D]))| {
            let (span, share) = point.locate(*time);
            let control = &rotations[span..span + 5];
            let span = Span {
                start: 0.0,
                duration: h,
                point: [Vector3::zeros(); 5],
                base: control[0],
                turns: turns(control, h),
            };
            let off = body_turn(
                &self.poses[i + 1].rotation,
                &span.at(share * h).pose.rotation,
            );
            let at = point.at(*time)[0];
            let mut aim = *vertex;
            for d in 0..3 {
                aim[D - 3 + d] = at[D - 3 + d] - off[d];
            }
            aim
        };
        passes.enumerate().map(aim).collect()
    }
}
