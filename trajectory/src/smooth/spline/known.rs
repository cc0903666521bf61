//! First iterate from a known motion through the same poses, which keeps every bound but may rest on
//! the way.
//!
//! Its places at even times are control points. Differences of them are averages of its velocity,
//! acceleration and jerk, so no limit is exceeded; the balls and the corridor are missed by no more
//! than the corners that the spline cuts. A search from there needs no other feasible point.
//!
//! # Source
//! I. J. Schoenberg's variation diminishing spline approximation; C. de Boor, "A Practical Guide to
//! Splines", 1978, chapter 11.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::problem::Problem;
use super::start::{FEWEST, KNOTS_PER_RAMP, MOST};
use crate::line::body_turn;
use crate::smooth::crossing::crossings;
use crate::smooth::options::SmoothOptions;
use crate::smooth::span::Span;

/// Rate at which a motion that starts in motion is followed in the end, so that its limits leave the
/// search room, and the share of its time in which the rate falls from 1.
const RATE: f64 = 0.85;
const FALL: f64 = 0.3;

/// Knots that pass before a start from rest moves: the time at which the first control point that is
/// free acts.
const LEAD: f64 = 1.5;

/// A known motion, sampled for the control points of a spline.
#[derive(Clone, Debug)]
pub(super) struct Known<'a> {
    spans: &'a [Span],
    poses: &'a [Isometry3<f64>],
    /// Rotation vectors of the poses, unrolled.
    vectors: &'a [Vector3<f64>],
    /// Time at which it passes each inner pose, s.
    times: Vec<f64>,
}

impl<'a> Known<'a> {
    /// The motion `spans` through `poses`.
    pub(super) fn new(
        spans: &'a [Span],
        poses: &'a [Isometry3<f64>],
        vectors: &'a [Vector3<f64>],
        options: &SmoothOptions,
    ) -> Self {
        let passes = crossings(spans, poses, options);
        Self {
            spans,
            poses,
            vectors,
            times: passes.iter().map(|pass| pass.time).collect(),
        }
    }

    /// Time of the motion, s.
    fn duration(&self) -> f64 {
        self.spans.last().map_or(0.0, Span::end)
    }

    /// Knot spacing of a spline that starts at rest, s.
    pub(super) fn spacing<const D: usize>(&self, problem: &Problem<D>) -> f64 {
        let ramp = (0..Problem::<D>::GROUPS)
            .map(|g| problem.groups[g].caps[1] / problem.groups[g].caps[2])
            .fold(0.0, f64::max);
        let total = self.duration();
        (ramp / KNOTS_PER_RAMP)
            .min(total / FEWEST)
            .max(total / MOST)
    }

    /// Position and unrolled rotation vector of each control point at a knot spacing (s), and when
    /// each inner pose is passed, in knots.
    pub(super) fn control(&self, spacing: f64, moving: bool) -> (Vec<[Vector3<f64>; 2]>, Vec<f64>) {
        let lead = if moving { 0.0 } else { LEAD };
        let follow = |time: f64| if moving { self.slower(time) } else { time };
        let total = self.after(self.duration(), &follow);
        let knots = (total / spacing + lead + LEAD).ceil().max(FEWEST) as usize + 4;
        let mut leg = 0;
        let mut control = Vec::with_capacity(knots);
        for k in 0..knots {
            let time = follow((k as f64 - LEAD - lead) * spacing);
            while leg < self.times.len() && self.times[leg] <= time {
                leg += 1;
            }
            let (point, rotation) = self.at(time);
            let turn = body_turn(&self.poses[leg].rotation, &rotation);
            control.push([point, self.vectors[leg] + turn]);
        }
        let end = (knots - 4) as f64;
        let pass = |time: &f64| (self.after(*time, &follow) / spacing + lead).min(end);
        (control, self.times.iter().map(pass).collect())
    }

    /// Time of the motion that is followed after a time: the rate falls from 1 to [`RATE`].
    fn slower(&self, time: f64) -> f64 {
        let fall = FALL * self.duration();
        let x = (time / fall).clamp(0.0, 1.0);
        // The integral of the smooth step 3 x^2 - 2 x^3.
        let slow = fall * x * x * x * (1.0 - 0.5 * x) + (time - fall).max(0.0);
        time - (1.0 - RATE) * slow
    }

    /// When a time of the motion is reached.
    fn after(&self, time: f64, follow: &dyn Fn(f64) -> f64) -> f64 {
        let (mut low, mut high) = (0.0, time / RATE);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if follow(middle) < time {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }

    /// Place and orientation at a time; those of the ends before and after.
    fn at(&self, time: f64) -> (Vector3<f64>, UnitQuaternion<f64>) {
        let next = self.spans.partition_point(|span| span.start <= time);
        let Some(span) = self.spans.get(next.saturating_sub(1)) else {
            return (self.poses[0].translation.vector, self.poses[0].rotation);
        };
        let local = (time - span.start).clamp(0.0, span.duration);
        (span.motion(local)[0], span.rotation(local))
    }
}
