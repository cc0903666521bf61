//! The control orientations of an iterate.

use nalgebra::{UnitQuaternion, Vector3};

use super::build::Task;
use super::ends::{anchors, correct, rotations};
use super::problem::{Point, Problem};
use crate::line::body_turn;

/// Share of the angular limits that a correction of the drift may take, and the largest second and third
/// derivative of its course from 0 to 1.
const CORRECTED: f64 = 0.015;
const BEND: f64 = 5.8;
const STEEPEST: f64 = 60.0;

/// Control points over which the difference of an orientation in motion fades out.
const FADE: f64 = 12.0;

impl Task<'_> {
    /// Control orientations: those beside the known motion of an arm, or the control points rolled out from the start; the small
    /// drift from the poses is then distributed over the path.
    ///
    /// Rolling a polygon of rotation vectors keeps every angular rate; cutting its corners changes
    /// its end by the square of the tolerance.
    pub(super) fn rotations<const D: usize>(
        &self,
        problem: &Problem<D>,
        point: &Point<D>,
        h: f64,
    ) -> Vec<UnitQuaternion<f64>> {
        let last = self.poses.len() - 1;
        if !problem.frames.is_empty() {
            let ends = [0, last].map(|pose| self.poses[pose].rotation);
            return problem.turned(point, ends);
        }
        let knots = point.control.len();
        let vector = |k: usize| Problem::<D>::turn(&point.control[k]);
        let mut result = match self.moving {
            Some(moving) => rotations(&moving.state, h),
            None => [self.poses[0].rotation; 4],
        }
        .to_vec();
        for k in 4..knots {
            let step = UnitQuaternion::from_scaled_axis(vector(k) - vector(k - 1));
            result.push(result[k - 1] * step);
        }
        let mut from = 3;
        let mut anchors = anchors(problem, point);
        anchors.push((knots - 4, last));
        let end = match self.request.finish {
            Some(finish) => rotations(finish, h),
            None => [self.poses[last].rotation; 4],
        };
        for (to, leg) in anchors {
            let target = if to == knots - 4 {
                end[0]
            } else {
                self.on_leg(&vector(to), leg)
            };
            // As long as it has to be, over other corrections where the legs are short.
            let drift = body_turn(&result[to], &target).norm() / CORRECTED;
            let [_, bent, steep] = problem.groups[Problem::<D>::GROUPS - 1].caps;
            let reach = (BEND * drift / bent).sqrt();
            let reach = reach.max((STEEPEST * drift / steep).cbrt()) / h;
            let since = from.min(to.saturating_sub(reach as usize));
            correct(&mut result, since.max(3), to, &target);
            from = to;
        }
        result[knots - 4..].copy_from_slice(&end);
        result
    }

    /// Control orientations that follow the progress of the control points along the path.
    pub(super) fn following<const D: usize>(
        &self,
        problem: &Problem<D>,
        point: &Point<D>,
        h: f64,
    ) -> Vec<UnitQuaternion<f64>> {
        let (mut leg, end) = (1, self.poses.len() - 1);
        let mut result = Vec::with_capacity(point.control.len());
        for (k, c) in point.control.iter().enumerate() {
            let time = k as f64 - 1.5;
            while leg < end && point.crossings[leg - 1] <= time {
                leg += 1;
            }
            let foot = problem.nearest(&[c[0], c[1], c[2]], leg, 0);
            let turn = (self.vectors[foot.leg] - self.vectors[foot.leg - 1]) * foot.share;
            result.push(self.poses[foot.leg - 1].rotation * UnitQuaternion::from_scaled_axis(turn));
        }
        let Some(moving) = self.moving else {
            self.meet(&mut result, point, h);
            return result;
        };
        // The orientations of the start differ only slightly: the difference fades out.
        let begin = rotations(&moving.state, h);
        let drift = body_turn(&result[3], &begin[3]);
        for (k, rotation) in result.iter_mut().enumerate() {
            let x = (k.max(3) - 3) as f64 / FADE.min(point.control.len() as f64 - 8.0).max(1.0);
            let left = (1.0 - x).max(0.0).powi(3);
            *rotation *= UnitQuaternion::from_scaled_axis(drift * left);
        }
        result[..4].copy_from_slice(&begin);
        if let Some(finish) = self.request.finish {
            let end = rotations(finish, h);
            let last = result.len() - 4;
            let drift = body_turn(&result[last], &end[0]);
            for (k, rotation) in result.iter_mut().enumerate().take(last) {
                let x = (last - k) as f64 / FADE.min(last as f64 - 4.0).max(1.0);
                let left = (1.0 - x).max(0.0).powi(3);
                *rotation *= UnitQuaternion::from_scaled_axis(drift * left);
            }
            result[last..].copy_from_slice(&end);
        }
        result
    }

    /// Orientation of a rotation vector near a leg.
    fn on_leg(&self, vector: &Vector3<f64>, leg: usize) -> UnitQuaternion<f64> {
        let way = self.vectors[leg] - self.vectors[leg - 1];
        let off = vector - self.vectors[leg - 1];
        let square = way.norm_squared();
        let share = if square > 0.0 {
            (off.dot(&way) / square).clamp(0.0, 1.0)
        } else {
            0.0
        };
        self.poses[leg - 1].rotation
            * UnitQuaternion::from_scaled_axis(way * share)
            * UnitQuaternion::from_scaled_axis(off - way * share)
    }
}
