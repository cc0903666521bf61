//! The reference that one joint follows.

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

    /// After `time` (s) with a constant `jerk` (rad/s³).
    pub(crate) fn after(&self, time: f64, jerk: f64) -> Self {
        let (velocity, acceleration) = (self.velocity, self.acceleration);
        Self {
            position: self.position
                + (velocity + (acceleration / 2.0 + jerk * time / 6.0) * time) * time,
            velocity: velocity + (acceleration + jerk * time / 2.0) * time,
            acceleration: acceleration + jerk * time,
        }
    }

    /// The remaining speed when the acceleration has faded to zero with `jerk` (rad/s).
    pub(crate) fn coasting_speed(&self, jerk: f64) -> f64 {
        self.velocity + self.acceleration * self.acceleration.abs() / (2.0 * jerk)
    }

    /// The times (s) at which the speed is zero under a constant `jerk` (rad/s³), before or after
    /// now; NaN if there is none.
    pub(crate) fn turns(&self, jerk: f64) -> [f64; 2] {
        if jerk == 0.0 {
            return [-self.velocity / self.acceleration, f64::NAN];
        }
        let square = self.acceleration * self.acceleration - 2.0 * jerk * self.velocity;
        let root = square.sqrt();
        [-root, root].map(|root| (root - self.acceleration) / jerk)
    }

    /// A mixture: `share` of `other`, the rest of this.
    pub(crate) fn mixed(&self, other: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        Self {
            position: mix(self.position, other.position),
            velocity: mix(self.velocity, other.velocity),
            acceleration: mix(self.acceleration, other.acceleration),
        }
    }

    /// How far this is from `other`, in each quantity.
    pub(crate) fn beyond(&self, other: &Self) -> Self {
        Self {
            position: self.position - other.position,
            velocity: self.velocity - other.velocity,
            acceleration: self.acceleration - other.acceleration,
        }
    }

    /// The same seen in a mirror.
    pub(crate) fn mirrored(&self) -> Self {
        Self::default().beyond(self)
    }

    /// Whether it rests, but for rounding.
    pub(crate) fn rests(&self) -> bool {
        self.velocity.abs() < 1e-9 && self.acceleration.abs() < 1e-6
    }
}
