//! The control orientations that a start or an end in motion fixes, and those that poses draw to themselves.

use nalgebra::{UnitQuaternion, Vector3};

use super::basis::START;
use super::problem::{Point, Problem};
use super::turns::turns;
use crate::ToolPoint;
use crate::line::body_turn;
use crate::smooth::span::Span;

/// Position, velocity, acceleration and jerk of the rolled-out rotation vector (axes of the tool) whose
/// spline starts, or ends, with exactly the given motion.
///
/// Products of turns are not sums of vectors; the difference is of second
/// order in the turn over one knot, so correcting it repeatedly converges.
pub(super) fn rolled(state: &ToolPoint, h: f64) -> [Vector3<f64>; 4] {
    let back = state.pose.rotation.inverse();
    let [w, a, j] = state.angular.map(|x| back * x);
    let mut result = [Vector3::zeros(), w, a, j - w.cross(&a)];
    if w.norm() + a.norm() + j.norm() < 1e-15 {
        return result;
    }
    for _ in 0..40 {
        let control = roll(&state.pose.rotation, &result, h);
        let span = Span {
            start: 0.0,
            duration: h,
            point: [Vector3::zeros(); 5],
            base: control[0],
            turns: turns(
                &[control[0], control[1], control[2], control[3], control[3]],
                h,
            ),
        };
        let got = span.at(0.0);
        result[0] += body_turn(&got.pose.rotation, &state.pose.rotation);
        for k in 0..3 {
            result[k + 1] += back * (state.angular[k] - got.angular[k]);
        }
    }
    result
}

/// The four control orientations of a start or an end in motion at knot spacing `h`.
pub(super) fn rotations(state: &ToolPoint, h: f64) -> [UnitQuaternion<f64>; 4] {
    roll(&state.pose.rotation, &rolled(state, h), h)
}

/// Control orientations of a rolled-out motion.
fn roll(
    base: &UnitQuaternion<f64>,
    motion: &[Vector3<f64>; 4],
    h: f64,
) -> [UnitQuaternion<f64>; 4] {
    let vector = START.map(|w| {
        motion[0] + (motion[1] * w[0] + (motion[2] * w[1] + motion[3] * (w[2] * h)) * h) * h
    });
    let mut result = [*base * UnitQuaternion::from_scaled_axis(vector[0]); 4];
    for k in 1..4 {
        result[k] = result[k - 1] * UnitQuaternion::from_scaled_axis(vector[k] - vector[k - 1]);
    }
    result
}

/// Turns the control orientations after `from` so that the one at `to` becomes
/// `target`, smoothly; those after `to` follow.
pub(super) fn correct(
    rotations: &mut [UnitQuaternion<f64>],
    from: usize,
    to: usize,
    target: &UnitQuaternion<f64>,
) {
    // In the axes of the room: a correction in those of the tool would end with a jump of the angular
    // velocity, which it turns too.
    let drift = rotations[to] * body_turn(&rotations[to], target);
    for k in from + 1..=to {
        let x = (k - from) as f64 / (to - from) as f64;
        let share = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
        rotations[k] = UnitQuaternion::from_scaled_axis(drift * share) * rotations[k];
    }
    let follow = UnitQuaternion::from_scaled_axis(drift);
    for rotation in rotations.iter_mut().skip(to + 1) {
        // Products of many unit quaternions drift in length.
        *rotation = UnitQuaternion::new_normalize((follow * *rotation).into_inner());
    }
}

/// Control points in the middle of a leg, with the leg, at least six apart.
pub(super) fn anchors<const D: usize>(
    problem: &Problem<D>,
    point: &Point<D>,
) -> Vec<(usize, usize)> {
    let knots = point.control.len();
    let mut result = Vec::new();
    let mut last = 3;
    for leg in 1..problem.vertices.len() {
        let since = if leg == 1 {
            0.0
        } else {
            point.crossings[leg - 2]
        };
        let until = point
            .crossings
            .get(leg - 1)
            .copied()
            .unwrap_or(point.spans() as f64);
        let middle = (0.5 * (since + until) + 1.5).round().max(0.0) as usize;
        if middle >= last + 6 && middle + 10 <= knots {
            result.push((middle, leg));
            last = middle;
        }
    }
    result
}
