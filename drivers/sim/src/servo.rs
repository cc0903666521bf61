//! One servo: a mass and the controller that chooses its acceleration.

use driver_kit::Reference;

/// One joint: a double integrator with a critically damped controller and acceleration
/// feed-forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Servo {
    /// Position (rad).
    pub(crate) position: f64,
    /// Velocity (rad/s).
    pub(crate) velocity: f64,
    /// The acceleration that acts since the last period (rad/s²).
    pub(crate) acceleration: f64,
}

impl Servo {
    pub(crate) const fn rest(position: f64) -> Self {
        Self {
            position,
            velocity: 0.0,
            acceleration: 0.0,
        }
    }

    /// Moves for `period` (s) with the acceleration chosen before.
    pub(crate) fn move_on(&mut self, period: f64) {
        self.position += (self.velocity + self.acceleration * period / 2.0) * period;
        self.velocity += self.acceleration * period;
    }

    /// Chooses the acceleration that follows `reference`, for natural frequency (rad/s) and
    /// damping ratio.
    pub(crate) fn control(&mut self, reference: &Reference, [frequency, damping]: [f64; 2]) {
        let error = reference.position - self.position;
        let slip = reference.velocity - self.velocity;
        self.acceleration = reference.acceleration
            + 2.0 * damping * frequency * slip
            + frequency * frequency * error;
    }
}
