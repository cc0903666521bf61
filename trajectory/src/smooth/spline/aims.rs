//! Where and when the motion of an iterate sees the poses.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::basis::weights;
use super::build::Task;
use super::problem::{Point, Problem};
use super::turns::turns;
use crate::line::body_turn;
use crate::smooth::span::Span;

/// Rounds over all passes in which orientations that miss poses are turned; the share of the angular tolerance up to
/// which a pose is met, and that to which it is turned.
const ROUNDS: usize = 12;
const MET: [f64; 2] = [0.97, 0.9];

/// The turn from a pose to the motion of five control orientations, a share of its span (s) after its start.
fn seen(
    control: &[UnitQuaternion<f64>],
    share: f64,
    h: f64,
    pose: &Isometry3<f64>,
) -> Vector3<f64> {
    let span = Span {
        start: 0.0,
        duration: h,
        point: [Vector3::zeros(); 5],
        base: control[0],
        turns: turns(control, h),
    };
    body_turn(&pose.rotation, &span.rotation(share * h))
}

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
        let (free, most) = (4..rotations.len() - 4, self.options.angular_tolerance());
        for _ in 0..ROUNDS {
            let mut missed = false;
            for (time, pose) in point.crossings.iter().zip(&self.poses[1..]) {
                let (first, share) = point.locate(*time);
                let off = seen(&rotations[first..first + 5], share, h, pose);
                if off.norm() <= MET[0] * most {
                    continue;
                }
                missed = true;
                let way = off * (1.0 - MET[1] * most / off.norm());
                let weights = weights(share)[0];
                let square: f64 = weights.iter().map(|w| w * w).sum();
                for (k, weight) in (first..).zip(weights) {
                    if free.contains(&k) {
                        rotations[k] *= UnitQuaternion::from_scaled_axis(-way * (weight / square));
                    }
                }
            }
            if !missed {
                break;
            }
        }
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
