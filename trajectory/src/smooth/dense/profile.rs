//! About how fast a curve can be travelled: its time at each place without limits of the jerk.
//!
//! # Source
//! J. E. Bobrow, S. Dubowsky, J. S. Gibson, "Time-optimal control of robotic manipulators along
//! specified paths", International Journal of Robotics Research 4(3), 1985: the square of the rate has
//! a greatest value at each place, and rises and falls at most so fast.

use nalgebra::Vector3;

use super::curve::Curve;
use crate::{ToolCurve, ToolLimits};

/// Places in a knot interval.
const PLACES: f64 = 2.0;

/// Time against the parameter of a curve.
#[derive(Clone, Debug)]
pub(super) struct Profile {
    /// Change of the parameter from one time to the next.
    step: f64,
    time: Vec<f64>,
}

/// Speed and curvature of place or orientation at one parameter, over their limits.
#[derive(Clone, Copy, Debug)]
struct Motion {
    /// Rate of change over the largest acceleration.
    slope: f64,
    /// Second derivative along the direction of motion and across it, over the largest acceleration.
    along: f64,
    across: f64,
    /// Greatest square of the rate.
    most: f64,
}

impl Motion {
    fn new(first: &Vector3<f64>, second: &Vector3<f64>, speed: f64, acceleration: f64) -> Self {
        let size = first.norm();
        let along = if size > 0.0 {
            second.dot(first) / size
        } else {
            0.0
        };
        let across = (second.norm_squared() - along * along).max(0.0).sqrt();
        let fast = (speed / size).powi(2);
        Self {
            slope: size / acceleration,
            along: along / acceleration,
            across: across / acceleration,
            most: fast.min(acceleration / across),
        }
    }

    /// How fast the square of the rate may grow to both sides, at most, from a value.
    fn growth(&self, square: f64, forwards: f64) -> f64 {
        let bent = self.across * square;
        let room = (1.0 - bent * bent).max(0.0).sqrt();
        (2.0 * (room - forwards * self.along * square) / self.slope).max(0.0)
    }
}

impl Profile {
    /// The fastest profile of a curve under the limits of the tool, from rest to rest.
    pub(super) fn new<const D: usize>(curve: &Curve<D>, limits: &ToolLimits) -> Self {
        let end = curve.end();
        let count = (PLACES * end).ceil().max(2.0) as usize;
        let step = end / count as f64;
        // What is seen of the curve at a place is not kept: it would be most of the memory.
        let seen = |k: usize| {
            let tool = curve.at(k as f64 * step);
            let [first, second, _] = tool.linear;
            let [turn, bend, _] = tool.angular;
            [
                Motion::new(&first, &second, limits.speed, limits.acceleration),
                Motion::new(
                    &turn,
                    &bend,
                    limits.angular_speed,
                    limits.angular_acceleration,
                ),
            ]
        };
        let grown = |[a, b]: &[Motion; 2], square: f64, forwards: f64| {
            let growth = a.growth(square, forwards).min(b.growth(square, forwards));
            square + growth * step
        };
        let mut squares = vec![0.0; count + 1];
        let mut here = seen(0);
        for k in 0..count {
            let most = grown(&here, squares[k], 1.0);
            here = seen(k + 1);
            let [a, b] = &here;
            squares[k + 1] = a.most.min(b.most).min(most);
        }
        squares[count] = 0.0;
        for k in (0..count).rev() {
            squares[k] = squares[k].min(grown(&seen(k + 1), squares[k + 1], -1.0));
        }
        let mut time = Vec::with_capacity(count + 1);
        time.push(0.0);
        for pair in squares.windows(2) {
            let rate = 0.5 * (pair[0].sqrt() + pair[1].sqrt());
            time.push(time[time.len() - 1] + step / rate.max(1e-12));
        }
        Self { step, time }
    }

    /// The whole time, s.
    pub(super) fn duration(&self) -> f64 {
        self.time[self.time.len() - 1]
    }

    /// The parameter at a time (s).
    pub(super) fn parameter(&self, time: f64) -> f64 {
        let last = self.time.len() - 1;
        let next = self.time.partition_point(|t| *t <= time).clamp(1, last);
        let [from, to] = [self.time[next - 1], self.time[next]];
        let share = ((time - from) / (to - from).max(1e-300)).clamp(0.0, 1.0);
        (next as f64 - 1.0 + share) * self.step
    }
}
