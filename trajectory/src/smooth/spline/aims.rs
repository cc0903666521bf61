//! Where and when the motion of an iterate sees the poses.

use nalgebra::{Isometry3, UnitQuaternion};

use super::build::Task;
use super::meet::{meet, seen};
use super::problem::{Point, Problem};

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

    /// Turns control orientations that follow the path where they cut corners, so that the poses are met within the
    /// angular tolerance: those around each pass that misses one, in turn.
    pub(super) fn meet<const D: usize>(
        &self,
        rotations: &mut [UnitQuaternion<f64>],
        point: &Point<D>,
        h: f64,
    ) {
        let most = self.options.angular_tolerance();
        let passes: Vec<_> = point
            .crossings
            .iter()
            .zip(&self.poses[1..])
            .map(|(time, pose)| {
                let (first, share) = point.locate(*time);
                (first, share, pose)
            })
            .collect();
        meet(rotations, &passes, (h, most));
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
            let off = seen(&rotations[span..span + 5], share, h, &self.poses[i + 1]);
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
