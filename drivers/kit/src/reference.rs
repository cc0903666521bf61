//! What one joint follows: the setpoint, or what the driver makes up without one.

use realtime::{Bounds, next_rate};

/// Position (rad), velocity (rad/s) and acceleration (rad/s²) to follow.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reference {
    /// Position (rad).
    pub position: f64,
    /// Velocity (rad/s).
    pub velocity: f64,
    /// Acceleration (rad/s²).
    pub acceleration: f64,
}

impl Reference {
    /// At rest in a position (rad).
    pub const fn rest(position: f64) -> Self {
        Self {
            position,
            velocity: 0.0,
            acceleration: 0.0,
        }
    }

    /// Goes on for `period` (s) as it was going; the acceleration fades with `jerk` (rad/s³), so
    /// that the speed stays near what it was.
    pub(crate) fn go_on(&mut self, jerk: f64, period: f64) {
        let fade = (jerk * period).min(self.acceleration.abs());
        self.follow(self.acceleration - fade.copysign(self.acceleration), period);
    }

    /// Brakes for `period` (s) within `bounds`: acceleration (rad/s²) and jerk (rad/s³).
    pub(crate) fn brake(&mut self, bounds: Bounds, period: f64) {
        let next = next_rate([self.velocity, self.acceleration], 0.0, bounds, period);
        self.follow(next, period);
    }

    /// Moves for `period` (s) while the acceleration goes linearly to `next` (rad/s²).
    fn follow(&mut self, next: f64, period: f64) {
        let mean = (2.0 * self.acceleration + next) / 6.0;
        self.position += (self.velocity + mean * period) * period;
        self.velocity += (self.acceleration + next) / 2.0 * period;
        self.acceleration = next;
    }

    /// Whether it rests, but for rounding.
    pub(crate) fn rests(&self) -> bool {
        self.velocity.abs() < 1e-9 && self.acceleration.abs() < 1e-6
    }
}
