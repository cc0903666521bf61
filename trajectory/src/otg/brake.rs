//! Brakes a joint into its limits, if the start state breaks them.

use super::extremal::{Bounds, End};
use super::profile::Point;

/// The first part of a move whose start breaks a limit: the fastest motion back into the limits, in
/// at most three phases. Normalised like [`super::extremal::ExtremalFamily`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Brake {
    /// Time and jerk of each phase (acceleration in order two).
    phases: [(f64, f64); 3],
    count: usize,
    smooth: bool,
}

/// Relative overshoot of a limit that is rounding, not a reason to brake.
const ROUNDING: f64 = 1e-12;

impl Brake {
    /// The motion from `start` back into the acceleration bounds and, if `velocity`, the velocity
    /// bounds.
    pub(crate) fn new(start: End, bounds: Bounds, velocity: bool) -> Self {
        let mut brake = Self {
            smooth: bounds.smooth,
            ..Self::default()
        };
        if bounds.smooth {
            brake.accelerations(start, bounds);
        }
        if velocity {
            let now = brake.end(start);
            let before = brake.count;
            brake.velocities(now, bounds, 1.0);
            if brake.count == before {
                brake.velocities(now.mirrored(), bounds.mirrored(), -1.0);
            }
        }
        brake
    }

    fn accelerations(&mut self, start: End, bounds: Bounds) {
        let acceleration = start.acceleration;
        if acceleration > bounds.rise * (1.0 + ROUNDING) {
            self.push(acceleration - bounds.rise, -1.0);
        } else if -acceleration > bounds.fall * (1.0 + ROUNDING) {
            self.push(-acceleration - bounds.fall, 1.0);
        }
    }

    /// Slows down if the velocity is above the bound, or will unavoidably rise above it.
    fn velocities(&mut self, now: End, bounds: Bounds, sign: f64) {
        let End {
            velocity: v,
            acceleration: a,
        } = now;
        let rounding = ROUNDING * (1.0 + bounds.top.min(v.abs()));
        if !bounds.smooth {
            if v > bounds.top + rounding {
                self.push((v - bounds.top) / bounds.fall, -sign * bounds.fall);
            }
            return;
        }
        if v + 0.5 * a.max(0.0) * a.max(0.0) <= bounds.top + rounding {
            return;
        }
        // With jerk -1: v + a t - t²/2 = top; or, so that the lower bound is kept as well,
        // the moment from which jerk +1 to zero acceleration ends at that bound.
        let back = a + (a * a + 2.0 * (v - bounds.top)).max(0.0).sqrt();
        let low = a + (0.5 * a * a + v - bounds.bottom).max(0.0).sqrt();
        let ramp = back.min(low).min(a + bounds.fall).max(0.0);
        self.push(ramp, -sign);
        let after = Point {
            velocity: v,
            acceleration: a,
            ..Point::default()
        }
        .after(ramp, -1.0);
        if after.acceleration < 0.0 {
            let deceleration = -after.acceleration;
            let hold = (after.velocity - bounds.top) / deceleration;
            let reserve = 0.5 * deceleration * deceleration;
            let room = (after.velocity - reserve - bounds.bottom) / deceleration;
            self.push(hold.min(room), 0.0);
        }
    }

    fn push(&mut self, time: f64, control: f64) {
        if time > 0.0
            && let Some(place) = self.phases.get_mut(self.count)
        {
            *place = (time, control);
            self.count += 1;
        }
    }

    fn end(&self, start: End) -> End {
        let point = Point {
            velocity: start.velocity,
            acceleration: start.acceleration,
            ..Point::default()
        };
        let end = self.point(point, self.duration());
        End {
            velocity: end.velocity,
            acceleration: end.acceleration,
        }
    }

    /// How long it takes.
    pub(crate) fn duration(&self) -> f64 {
        self.parts().map(|(time, _)| time).sum()
    }

    /// Times and controls of the phases.
    pub(crate) fn parts(&self) -> impl Iterator<Item = (f64, f64)> {
        self.phases.iter().copied().take(self.count)
    }

    /// The point `time` after `start`, at most at the end of the last phase.
    pub(crate) fn point(&self, start: Point, time: f64) -> Point {
        let mut point = start;
        let mut rest = time;
        for (length, control) in self.parts() {
            let passed = length.min(rest);
            point = if self.smooth {
                point.after(passed, control)
            } else {
                Point {
                    acceleration: control,
                    ..point
                }
                .after(passed, 0.0)
            };
            if rest < length {
                return point;
            }
            rest -= length;
        }
        point
    }
}
