//! Where a motion comes closest to a pose.
//!
//! The first local minimum of the distance counts. A minimum is distinguished from rounding by the
//! rise of the distance after it. So a tool that rests, or turns on the spot, has one approach in
//! spite of rounding, and the same one in a part of a motion as in the whole.

use nalgebra::{Isometry3, Vector3};

use super::poly::{self, halve};
use super::span::Span;

/// Lengths (m) and angles (rad) below this count as zero.
pub const RESOLUTION: f64 = 1e-12;

/// A time of a motion, and the span that it is in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moment {
    /// The span, from 0.
    pub(crate) span: usize,
    /// Time since the start of the motion, s.
    pub(crate) time: f64,
}

impl Moment {
    /// The start of a motion.
    pub(crate) const START: Self = Self { span: 0, time: 0.0 };
}

/// First local closest approach to `pose` from `since` on; the end if there is none. If the start is
/// within `tolerance` (m) of the pose, it may be the approach.
pub(crate) fn closest(
    spans: &[Span],
    since: Moment,
    pose: &Isometry3<f64>,
    tolerance: f64,
) -> Moment {
    approach(spans, since, pose, tolerance).unwrap_or_else(|| match spans.last() {
        Some(last) => Moment {
            span: spans.len() - 1,
            time: last.end(),
        },
        None => Moment::START,
    })
}

/// First local closest approach that is followed by a rise, as [`closest`].
pub(crate) fn approach(
    spans: &[Span],
    since: Moment,
    pose: &Isometry3<f64>,
    tolerance: f64,
) -> Option<Moment> {
    let goal = pose.translation.vector;
    let mut search = Search::new(tolerance + RESOLUTION, goal.norm());
    for (index, span) in spans.iter().enumerate().skip(since.span) {
        let from = (since.time - span.start).clamp(0.0, span.duration);
        if from >= span.duration && index + 1 < spans.len() {
            continue;
        }
        let mut position = span.position_control(from, span.duration);
        for c in &mut position {
            *c -= goal;
        }
        let velocity = span.velocity_control(from, span.duration);
        let product = poly::dot(&position, &velocity);
        search.place = Moment {
            span: index,
            time: span.start,
        };
        if search.done(&product, &position, [from, span.duration]) {
            return Some(search.lowest.1);
        }
    }
    None
}

/// Rises of the distance (m) up to this count as rounding, not as the end of an approach.
const RISE: f64 = 1e-10;

/// Distances (m) that differ by less are the same.
const SAME: f64 = 1e-13;

/// State of the search along the distance to one pose.
struct Search {
    /// Within this distance the start of the search may be a crossing.
    near: f64,
    /// Rises up to this are rounding, m.
    rise: f64,
    /// Greatest distance since the start of the search, until an approach begins.
    high: Option<f64>,
    /// Least distance of the approach, and its time.
    lowest: (f64, Moment),
    /// The current span and its start.
    place: Moment,
}

impl Search {
    /// A search for a pose that is `far` from the origin.
    fn new(near: f64, far: f64) -> Self {
        Self {
            near,
            rise: RISE * (1.0 + 1e-3 * far),
            high: Some(f64::NEG_INFINITY),
            lowest: (f64::INFINITY, Moment::START),
            place: Moment::START,
        }
    }

    /// True when an approach ends in `interval`, given half the derivative of the squared
    /// distance and the offset from the pose in Bernstein form.
    fn done(&mut self, product: &[f64; 8], offset: &[Vector3<f64>; 5], interval: [f64; 2]) -> bool {
        let width = interval[1] - interval[0];
        let rising = product.iter().all(|c| *c >= 0.0);
        let falling = product.iter().all(|c| *c <= 0.0);
        let steepest = product.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let flat = 2.0 * steepest * width <= SAME * (offset[0].norm() + SAME);
        if rising || falling || flat || width < 1e-10 {
            return self.reached(offset[0].norm(), interval[0])
                || self.reached(offset[4].norm(), interval[1]);
        }
        if let Some(root) = poly::only_root(product) {
            // The distance falls to the root and rises after it, or the other way round.
            let [there, _] = poly::at_share(offset, root);
            return self.reached(offset[0].norm(), interval[0])
                || self.reached(there.norm(), interval[0] + root * width)
                || self.reached(offset[4].norm(), interval[1]);
        }
        let middle = 0.5 * (interval[0] + interval[1]);
        let (low, high) = (halve(product), halve(offset));
        self.done(&low.0, &high.0, [interval[0], middle])
            || self.done(&low.1, &high.1, [middle, interval[1]])
    }

    /// True when the approach has ended by a time of the span, where the distance is `d`.
    fn reached(&mut self, d: f64, local: f64) -> bool {
        let moment = Moment {
            span: self.place.span,
            time: self.place.time + local,
        };
        if let Some(high) = self.high {
            let began = d < high - self.rise;
            if began || (high == f64::NEG_INFINITY && d <= self.near) {
                self.high = None;
                self.lowest = (d, moment);
            } else {
                self.high = Some(high.max(d));
            }
        } else if d < self.lowest.0 - SAME {
            self.lowest = (d, moment);
        }
        self.high.is_none() && d > self.lowest.0 + self.rise
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    /// Straight motion along x, a cubic of time on each span: position, speed, half the
    /// acceleration, a sixth of the jerk, and the time of the span, m and s.
    fn along_x(pieces: &[([f64; 4], f64)]) -> Vec<Span> {
        let mut start = 0.0;
        let mut spans = Vec::new();
        for ([p, v, a, j], duration) in pieces {
            spans.push(Span {
                start,
                duration: *duration,
                point: [*p, *v, *a, *j, 0.0].map(|x| Vector3::x() * x),
                base: UnitQuaternion::identity(),
                turns: Vec::new(),
            });
            start += duration;
        }
        spans
    }

    /// The approach to a place on x from the start of the motion.
    fn seen(spans: &[Span], x: f64, tolerance: f64) -> Option<f64> {
        let pose = Isometry3::translation(x, 0.0, 0.0);
        approach(spans, Moment::START, &pose, tolerance).map(|moment| moment.time)
    }

    #[test]
    fn a_pose_on_the_way_is_approached_there() {
        let spans = along_x(&[([0.0, 1.0, 0.0, 0.0], 1.0)]);
        let time = seen(&spans, 0.3, 1e-3).unwrap();
        assert!((time - 0.3).abs() < 1e-6, "{time}");
        assert_eq!(seen(&spans, 1.5, 1e-3), None);
    }

    /// After the start, only a pose within the tolerance there counts as approached.
    #[test]
    fn behind_the_start_the_tolerance_decides() {
        let spans = along_x(&[([0.0, 1.0, 0.0, 0.0], 1.0)]);
        assert_eq!(seen(&spans, -0.01, 0.02), Some(0.0));
        assert_eq!(seen(&spans, -0.01, 0.005), None);
    }

    /// A rest before a pose is reached is not an approach, even if rounding gives the speed there
    /// the wrong sign; a step back is one.
    #[test]
    fn a_rest_on_the_way_is_no_approach() {
        for (back, expected) in [(-1e-15, false), (-1e-6, true)] {
            let spans = along_x(&[
                ([0.0, 1.0, 0.0, 0.0], 0.1),
                ([0.1, back, 0.0, 0.0], 0.5),
                ([0.1 + 0.5 * back, 1.0, 0.0, 0.0], 0.5),
            ]);
            let time = seen(&spans, 0.4, 1e-3).unwrap();
            assert_eq!((time - 0.1).abs() < 1e-6, expected, "{back} {time}");
        }
    }
}
