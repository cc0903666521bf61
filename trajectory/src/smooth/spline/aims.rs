//! Where and when the motion of an iterate sees the poses.

use nalgebra::{Isometry3, UnitQuaternion};

use super::build::Task;
use super::meet::{meet, seen};
use super::problem::{Point, Problem};
use crate::line::body_turn;

/// Least way of a leg that moves the place, in tolerances.
const STANDING: f64 = 1e-3;
/// Least time of its way over that of its turn, both at full speed, where the way is within the tolerance.
const SPOT: f64 = 0.01;

impl Task<'_> {
    /// Whether the place alone says when each inner pose is passed: the legs beside it are not turns on the spot.
    pub(super) fn led(&self) -> Vec<bool> {
        let legs = self.poses.windows(2);
        let leads: Vec<bool> = legs.map(|leg| self.leads(leg)).collect();
        leads.windows(2).map(|pair| pair[0] && pair[1]).collect()
    }

    /// Whether a leg moves the place: by more than the tolerance, or far enough beside its turn.
    fn leads(&self, leg: &[Isometry3<f64>]) -> bool {
        let (limits, tolerance) = (&self.options.limits, self.options.tolerance);
        let way = (leg[1].translation.vector - leg[0].translation.vector).norm();
        let turn = body_turn(&leg[0].rotation, &leg[1].rotation).norm();
        let turned = SPOT * turn / limits.angular_speed;
        way > tolerance || (way > STANDING * tolerance && way / limits.speed > turned)
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
        let rotations = self.rotations(problem, point, h);
        let passes = point.crossings.iter().zip(problem.inner());
        let aim = |(i, (time, vertex)): (usize, (&f64, &[f64; D]))| {
            let (span, share) = point.locate(*time);
            let off = seen(&rotations[span..span + 5], share, h, &self.poses[i + 1]);
            let at = point.at(*time)[0];
            let mut aim = *vertex;
            for d in 0..3 {
                let turn = Problem::<D>::LAST + d;
                aim[turn] = at[turn] - off[d];
            }
            aim
        };
        passes.enumerate().map(aim).collect()
    }
}
