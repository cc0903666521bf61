//! From a curve and its time law to the spans of a smooth motion.
//!
//! The control points of a uniform quartic spline in time are places of the motion at even moments.
//! Differences of them are averages of its velocity, acceleration and jerk, so the spline keeps
//! every limit that the motion keeps. It cuts corners by `5/24 h^2` times the acceleration, which
//! the knot spacing `h` makes small beside the tolerance.
//!
//! # Source
//! I. J. Schoenberg's variation diminishing spline approximation; C. de Boor, "A Practical Guide to
//! Splines", 1978, chapter 11. Differences as averages: Peano kernels, same book, chapter 1.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::line::body_turn;
use crate::smooth::SmoothOptions;
use crate::smooth::span::Span;
use crate::smooth::spline::{START, power, turns};

/// How much later than the law the spline starts and ends, in knots: it starts at rest with a jerk
/// that is not zero, which the control points around the start say.
const LAG: f64 = 0.4;
/// Share of the law's jerk with which the spline starts.
const JERK: f64 = 0.76;
/// Factors on the first control points after the start, so that no difference is above the law's
/// jerk by more than 0.3 %.
const EASED: [f64; 2] = [0.991_76, 0.999_36];

/// Share of the tolerance that the spans may cut off corners.
const CUT: f64 = 0.1;
/// Least number of knots of the spans in a ramp of the acceleration, of those of a rough motion, and most of a motion.
const KNOTS_PER_RAMP: f64 = 20.0;
const ROUGH_KNOTS_PER_RAMP: f64 = 2.0;
const MOST_KNOTS: f64 = 1e5;

/// Spans of a motion that has a `pose` at each time up to a `duration` (s), from rest in `ends[0]` to rest in `ends[1]`.
/// They are within a share of the distance `near` (m) of it.
pub(in crate::smooth) fn spans_along(
    pose: &dyn Fn(f64) -> Isometry3<f64>,
    duration: f64,
    ends: [&Isometry3<f64>; 2],
    (near, options): (f64, &SmoothOptions),
) -> Vec<Span> {
    let limits = &options.limits;
    let knots = if options.is_rough() {
        ROUGH_KNOTS_PER_RAMP
    } else {
        KNOTS_PER_RAMP
    };
    let ramp = limits.acceleration / limits.jerk;
    let cut = (CUT * near * 4.8 / limits.acceleration).sqrt();
    let least = duration / MOST_KNOTS;
    spans(pose, duration, ends, cut.min(ramp / knots).max(least))
}

/// The same with knots about `spacing` apart, s.
fn spans(
    pose: &dyn Fn(f64) -> Isometry3<f64>,
    duration: f64,
    ends: [&Isometry3<f64>; 2],
    spacing: f64,
) -> Vec<Span> {
    // Control point k stands for the time (k - 1.5) h.
    let steps = (duration / spacing).ceil().max(8.0);
    let h = duration / (steps - 2.0 * LAG);
    let inner = (4..steps as usize).map(|k| {
        let time = (k as f64 - 1.5 - LAG) * h;
        pose(time)
    });
    let mut control = vec![*ends[0]; 4];
    control.extend(inner);
    control.extend([*ends[1]; 4]);
    leave(&mut control);
    control.reverse();
    leave(&mut control);
    control.reverse();
    control
        .windows(5)
        .enumerate()
        .map(|(k, control)| span(k, control, h))
        .collect()
}

/// Sets the first control poses to those of a start from rest with a jerk, in the direction and
/// about of the size that the ones after them have.
fn leave(control: &mut [Isometry3<f64>]) {
    let (start, ahead) = (control[0], control[4]);
    let way = ahead.translation.vector - start.translation.vector;
    let turn = body_turn(&start.rotation, &ahead.rotation);
    let share = |x: f64| {
        let rotation = start.rotation * UnitQuaternion::from_scaled_axis(turn * x);
        Isometry3::from_parts((start.translation.vector + way * x).into(), rotation)
    };
    // The place after (2.5 - LAG) knots at a jerk of 1 a knot cubed.
    let whole = (2.5 - LAG).powi(3) / 6.0;
    for (pose, w) in control.iter_mut().zip(START) {
        *pose = share(w[2] * JERK / whole);
    }
    for (pose, x) in control[4..].iter_mut().zip(EASED) {
        let way = pose.translation.vector - start.translation.vector;
        let turn = body_turn(&start.rotation, &pose.rotation);
        let rotation = start.rotation * UnitQuaternion::from_scaled_axis(turn * x);
        *pose = Isometry3::from_parts((start.translation.vector + way * x).into(), rotation);
    }
}

/// The span with the number `k` that five control poses rule.
fn span(k: usize, control: &[Isometry3<f64>], h: f64) -> Span {
    let mut point = [Vector3::zeros(); 5];
    let begin = control[0].translation.vector;
    for d in 0..3 {
        let values: [f64; 5] = std::array::from_fn(|i| control[i].translation.vector[d] - begin[d]);
        for (c, value) in point.iter_mut().zip(power(&values, h)) {
            c[d] = value;
        }
    }
    point[0] += begin;
    let rotations: Vec<_> = control.iter().map(|pose| pose.rotation).collect();
    let turned = rotations.iter().any(|rotation| *rotation != rotations[0]);
    Span {
        start: h * k as f64,
        duration: h,
        point,
        base: rotations[0],
        turns: if turned {
            turns(&rotations, h)
        } else {
            Vec::new()
        },
    }
}
