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

use super::basis;
use super::problem::Problem;
use super::start::{FEWEST, KNOTS_PER_RAMP, MOST};
use crate::line::body_turn;
use crate::smooth::crossing::crossings_made;
use crate::smooth::options::SmoothOptions;
use crate::smooth::span::{Span, span_at};

/// Rate at which a motion that starts in motion is followed in the end, so that its limits leave the
/// search room, and the share of its time in which the rate falls from 1.
const RATE: f64 = 0.85;
const FALL: f64 = 0.3;

/// Knots that pass before a start from rest moves: the time at which the first control point that is
/// free acts.
const LEAD: f64 = 1.5;

/// Control points from either end over which that of an end in motion passes into the places.
const FADE: f64 = 16.0;

/// Around a corner that is left at rest with jerk J the average over w is `J w^3 / 96` away at most: a factor of
/// 38 is 0.4 of the tolerance.
const EASE: f64 = 38.0;
/// Share of the greatest speed that counts as a rest.
const STILL: f64 = 1e-6;
/// Samples of an average.
const PARTS: u32 = 8;

/// Knots in the time of the corner that the tolerance allows, and by how much a spline without orientations may have
/// more of them than others.
const KNOTS_PER_CORNER: f64 = 6.0;
const FINER: f64 = 2.0;

/// A known motion, sampled for the control points of a spline.
#[derive(Clone, Debug)]
pub(super) struct Known<'a> {
    spans: &'a [Span],
    poses: &'a [Isometry3<f64>],
    /// Rotation vectors of the poses, unrolled.
    vectors: &'a [Vector3<f64>],
    /// Time at which it passes each inner pose, s.
    times: Vec<f64>,
    /// Width of the average around a rest, s.
    ease: f64,
    /// Times at which it rests, s.
    rests: Vec<f64>,
}

impl<'a> Known<'a> {
    /// The motion `spans` through `poses`, and whether it will be made from its end to its start.
    pub(super) fn new(
        spans: &'a [Span],
        (poses, backwards): (&'a [Isometry3<f64>], bool),
        vectors: &'a [Vector3<f64>],
        options: &SmoothOptions,
    ) -> Self {
        let passes = crossings_made(spans, (poses, backwards), options);
        let limits = &options.limits;
        let place = options.tolerance.min(options.corridor()) / limits.jerk;
        let turn = options.angular_tolerance() / limits.angular_jerk;
        let slow = |span: &&Span| {
            let state = span.at(0.0);
            let turning = state.angular[0].norm() > STILL * limits.angular_speed;
            state.linear[0].norm() <= STILL * limits.speed && !turning
        };
        Self {
            rests: spans
                .iter()
                .skip(1)
                .filter(slow)
                .map(|span| span.start)
                .collect(),
            ease: (EASE * place.min(turn)).cbrt(),
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

    /// Knot spacing of a spline that starts at rest, s: fine enough for the corners that the tolerance shows, where
    /// orientations do not make each knot dear.
    pub(super) fn spacing<const D: usize>(&self, problem: &Problem<D>) -> f64 {
        let groups = &problem.groups[..Problem::<D>::GROUPS];
        let ramps = groups.iter().map(|group| group.caps[1] / group.caps[2]);
        let ramp = ramps.fold(0.0, f64::max) / KNOTS_PER_RAMP;
        let total = self.duration();
        if Problem::<D>::TURNS {
            return ramp.min(total / FEWEST).max(total / MOST);
        }
        // The time in which a jerk turns the motion at a corner.
        let near = groups[0].radius.min(groups[0].width);
        let corner = (96.0 * near / groups[0].caps[2]).cbrt() / KNOTS_PER_CORNER;
        ramp.min(corner)
            .min(total / FEWEST)
            .max(total / (FINER * MOST))
    }

    /// Position and unrolled rotation vector of each control point at a knot spacing (s), and when
    /// each inner pose is passed, in knots.
    pub(super) fn control(
        &self,
        spacing: f64,
        [moving, onwards]: [bool; 2],
    ) -> (Vec<[Vector3<f64>; 2]>, Vec<f64>) {
        let lead = if moving { 0.0 } else { LEAD };
        let follow = |time: f64| match [moving, onwards] {
            [true, true] => self.between(time),
            [true, false] => self.slower(time),
            _ => time,
        };
        let total = self.after(self.duration(), &follow);
        let knots = if onwards {
            (self.slowest() / spacing).round() as usize + 4
        } else {
            (total / spacing + lead + LEAD).ceil().max(FEWEST) as usize + 4
        };
        let mut leg = 0;
        let mut control = Vec::with_capacity(knots);
        for k in 0..knots {
            let time = follow((k as f64 - LEAD - lead) * spacing);
            while leg < self.times.len() && self.times[leg] <= time {
                leg += 1;
            }
            let width = if onwards { self.width(time) } else { 0.0 };
            control.push(self.mean(time, width, leg));
        }
        if onwards {
            join(&mut control);
        } else if !moving && self.rests.is_empty() {
            reproduce(&mut control, |_| 1.0);
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

    /// Time that a motion takes which starts and ends in motion, s: the rate falls and rises again.
    fn slowest(&self) -> f64 {
        let total = self.duration();
        (total - (1.0 - RATE) * FALL * total) / RATE
    }

    /// Knot spacing, s, near the one that is wanted, of a spline that starts and ends in motion.
    pub(super) fn even(&self, wanted: f64) -> f64 {
        let total = self.slowest();
        total / (total / wanted).ceil().clamp(FEWEST, MOST)
    }

    /// Time of the motion that is followed after a time, from motion to motion.
    fn between(&self, time: f64) -> f64 {
        let whole = self.slowest();
        if time < 0.5 * whole {
            self.slower(time)
        } else {
            self.duration() - self.slower(whole - time)
        }
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

    /// Place and rotation vector on leg `leg + 1`, averaged over `width` (s) around a time.
    fn mean(&self, time: f64, width: f64, leg: usize) -> [Vector3<f64>; 2] {
        let parts = if width > 0.0 { PARTS } else { 1 };
        let share = 1.0 / f64::from(parts);
        let mut sum = [Vector3::zeros(); 2];
        for part in 0..parts {
            let off = width * ((f64::from(part) + 0.5) * share - 0.5);
            let (point, rotation) = self.at(time + off);
            let turn = body_turn(&self.poses[leg].rotation, &rotation);
            sum[0] += point * share;
            sum[1] += (self.vectors[leg] + turn) * share;
        }
        sum
    }

    /// Width of the average at a time, s: what rests would pass a pose at no speed, and a search there does
    /// not know when it is passed. So around a rest the motion is averaged over as much of it as the
    /// tolerance allows.
    fn width(&self, time: f64) -> f64 {
        let near = self.rests.iter().map(|rest| (rest - time).abs());
        let off = near.fold(f64::INFINITY, f64::min);
        (self.ease - 0.5 * off).max(0.0)
    }

    /// Place and orientation at a time; those of the ends before and after.
    fn at(&self, time: f64) -> (Vector3<f64>, UnitQuaternion<f64>) {
        let Some((span, local)) = span_at(self.spans, time) else {
            return (self.poses[0].translation.vector, self.poses[0].rotation);
        };
        (span.motion(local)[0], span.rotation(local))
    }
}

/// Moves the places near both ends to where control points are that reproduce cubics, as those are that the
/// ends fix.
fn join(control: &mut [[Vector3<f64>; 2]]) {
    let last = control.len() - 1;
    let fade = FADE.min(last as f64 / 3.0);
    reproduce(control, |k| {
        let x = ((k.min(last - k) as f64 - 4.0) / fade).clamp(0.0, 1.0);
        1.0 - x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
    });
}

/// [`basis::reproduce`] of places and rotation vectors.
fn reproduce(control: &mut [[Vector3<f64>; 2]], share: impl Fn(usize) -> f64) {
    for i in 0..6 {
        basis::reproduce(control, |c| &mut c[i / 3][i % 3], &share);
    }
}
