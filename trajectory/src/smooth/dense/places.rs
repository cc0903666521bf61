//! The poses of a list as points, in units of what they are allowed to deviate.

use nalgebra::{Isometry3, Quaternion, SVector, UnitQuaternion, Vector3};

use crate::smooth::options::SmoothOptions;

/// Share of the tolerance that the balls of the fit have, so that rounding does not read it as
/// exceeded.
const INSIDE: f64 = 0.999;

/// Units of the coordinates: a point of the list is its position over `length`, and with `D = 7`
/// its quaternion (w, i, j, k), with the sign of the one before, over `turn`. So every ball has the
/// radius 1 in each part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Units {
    /// Radius of the balls, m.
    pub length: f64,
    /// Change of the quaternion at the largest angle allowed.
    pub turn: f64,
}

impl Units {
    /// The units that follow from the tolerances.
    pub(super) fn new(options: &SmoothOptions) -> Self {
        Self {
            length: INSIDE * options.tolerance.min(options.corridor()),
            // A turn by an angle moves its quaternion by twice the sine of a quarter of it.
            turn: INSIDE * 2.0 * (0.25 * options.angular_tolerance()).sin(),
        }
    }

    /// The points of the poses, each relative to the first position.
    pub(super) fn points<const D: usize>(&self, poses: &[Isometry3<f64>]) -> Vec<SVector<f64, D>> {
        let first = &poses[0];
        let since = (first.translation.vector, first.rotation.into_inner());
        self.points_since(poses, since)
    }

    /// The points of poses in the middle of a list: relative to its first position, with the sign of the
    /// quaternion before them.
    pub(super) fn points_since<const D: usize>(
        &self,
        poses: &[Isometry3<f64>],
        (origin, mut before): (Vector3<f64>, Quaternion<f64>),
    ) -> Vec<SVector<f64, D>> {
        let mut points = Vec::with_capacity(poses.len());
        for pose in poses {
            let mut point = SVector::zeros();
            let place = (pose.translation.vector - origin) / self.length;
            for d in 0..3 {
                point[d] = place[d];
            }
            if D > 3 {
                let mut turn = pose.rotation.into_inner();
                if turn.dot(&before) < 0.0 {
                    turn = -turn;
                }
                before = turn;
                for (d, x) in [turn.w, turn.i, turn.j, turn.k].into_iter().enumerate() {
                    point[3 + d] = x / self.turn;
                }
            }
            points.push(point);
        }
        points
    }

    /// The position of a point, m, relative to `origin`.
    pub(super) fn place<const D: usize>(&self, point: &SVector<f64, D>) -> Vector3<f64> {
        Vector3::new(point[0], point[1], point[2]) * self.length
    }

    /// The quaternion of a point before it is normalised; `D = 7`.
    pub(super) fn quaternion<const D: usize>(&self, point: &SVector<f64, D>) -> Quaternion<f64> {
        Quaternion::new(point[3], point[4], point[5], point[6]) * self.turn
    }

    /// The orientation of a point; `D = 7`.
    pub(super) fn rotation<const D: usize>(&self, point: &SVector<f64, D>) -> UnitQuaternion<f64> {
        UnitQuaternion::new_normalize(self.quaternion(point))
    }
}

/// Length of the position part of an offset, and of the quaternion part; 1 is the radius of a ball.
#[inline]
pub(super) fn parts<const D: usize>(offset: &SVector<f64, D>) -> [f64; 2] {
    let place = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
    let turn: f64 = (3..D).map(|d| offset[d] * offset[d]).sum();
    [place.sqrt(), turn.sqrt()]
}

/// The larger of both parts.
#[inline]
pub(super) fn size<const D: usize>(offset: &SVector<f64, D>) -> f64 {
    let [place, turn] = parts(offset);
    place.max(turn)
}
