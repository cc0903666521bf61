//! Bounds of the tool's distance from a line or from the legs between poses.

use std::ops::Range;

use nalgebra::Vector3;

use super::MotionBounds;
use super::stretch::Stretch;
use crate::found::Found;
use crate::poly::halve;
use crate::smooth::off_segment;

/// A straight leg of the path, and the time in which it is travelled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// Where it begins and ends (m).
    pub ends: [Vector3<f64>; 2],
    /// From when until when (s).
    pub when: [f64; 2],
}

/// Distances (m) below this count as zero.
const FLOOR: f64 = 1e-8;

impl<const N: usize> MotionBounds<N> {
    /// An upper bound (m) of the distance of the controlled point from the line through two points
    /// (from the first if they are equal), and the time at which it is about attained (s).
    pub fn off_line(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> (f64, f64) {
        let way = to - from;
        let along = way.try_normalize(0.0).unwrap_or_default();
        let size = |place: &Vector3<f64>| {
            let off = place - from;
            (off - along * off.dot(&along)).norm()
        };
        let mut found = Found {
            floor: FLOOR,
            ..Found::default()
        };
        for stretch in &self.stretches {
            let when = stretch.start..stretch.end();
            found.take(&stretch.place, when, stretch.place_error, size);
        }
        (found.bound, found.time)
    }

    /// An upper bound (m) of the distance of the controlled point from the leg that it travels, and
    /// the time at which it is about attained (s). Bounds below `room` (m) need not be tight. The
    /// legs are in the order of time.
    pub fn off_legs(&self, legs: &[Leg], room: f64) -> (f64, f64) {
        let mut found = Found {
            floor: room.max(FLOOR),
            ..Found::default()
        };
        let mut first = 0;
        for leg in legs {
            let size = |place: &Vector3<f64>| off_segment(place, &leg.ends);
            while self
                .stretches
                .get(first)
                .is_some_and(|s| s.end() < leg.when[0])
            {
                first += 1;
            }
            let during = self.stretches[first..].iter();
            for stretch in during.take_while(|s| s.start <= leg.when[1]) {
                let (control, when) = part(stretch, leg.when);
                found.take(&control, when, stretch.place_error, size);
            }
        }
        (found.bound, found.time)
    }
}

/// The position over the part of an interval within `[from, to]` (s), and that part.
fn part(stretch: &Stretch, [from, to]: [f64; 2]) -> ([Vector3<f64>; 5], Range<f64>) {
    let share = |time: f64| ((time - stretch.start) / stretch.duration).clamp(0.0, 1.0);
    let (low, high) = (share(from), share(to));
    let mut control = stretch.place;
    if high < 1.0 {
        control = split(&control, high).0;
    }
    if low > 0.0 {
        control = split(&control, if high > 0.0 { low / high } else { 1.0 }).1;
    }
    let at = |share: f64| stretch.start + stretch.duration * share;
    (control, at(low)..at(high))
}

/// Both parts of a polynomial in Bernstein form, divided at `x` from 0 to 1 (de Casteljau).
fn split(control: &[Vector3<f64>; 5], x: f64) -> ([Vector3<f64>; 5], [Vector3<f64>; 5]) {
    if x == 0.5 {
        return halve(control);
    }
    let (mut left, mut right) = (*control, *control);
    for level in 1..5 {
        for k in 0..5 - level {
            right[k] = right[k] * (1.0 - x) + right[k + 1] * x;
        }
        left[level] = right[0];
    }
    (left, right)
}
