//! Limits of joints and tool.

pub use realtime::JointLimits;

use crate::TimingError;

/// Checks that every velocity, acceleration and jerk limit is positive.
///
/// # Errors
/// [`TimingError::BadJointLimit`] with the first joint whose limit is not.
pub(crate) fn check_joints<const N: usize>(limits: &JointLimits<N>) -> Result<(), TimingError> {
    let rows = [
        ("velocity", &limits.velocity),
        ("acceleration", &limits.acceleration),
        ("jerk", &limits.jerk),
    ];
    for (quantity, values) in rows {
        for (joint, &value) in values.iter().enumerate() {
            if value.is_nan() || value <= 0.0 {
                return Err(TimingError::BadJointLimit {
                    joint,
                    quantity,
                    value,
                });
            }
        }
    }
    Ok(())
}

/// Limits of the controlled point: norms of its linear and angular velocity and of their
/// derivatives. Infinity means: not limited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolLimits {
    /// Speed (m/s).
    pub speed: f64,
    /// Acceleration (m/s²).
    pub acceleration: f64,
    /// Jerk (m/s³).
    pub jerk: f64,
    /// Angular speed (rad/s).
    pub angular_speed: f64,
    /// Angular acceleration (rad/s²).
    pub angular_acceleration: f64,
    /// Angular jerk (rad/s³).
    pub angular_jerk: f64,
}

impl ToolLimits {
    /// No limit at all: the joints alone decide.
    pub const UNLIMITED: Self = Self {
        speed: f64::INFINITY,
        acceleration: f64::INFINITY,
        jerk: f64::INFINITY,
        angular_speed: f64::INFINITY,
        angular_acceleration: f64::INFINITY,
        angular_jerk: f64::INFINITY,
    };

    /// Whether there is any limit.
    pub(crate) fn limited(&self) -> bool {
        *self != Self::UNLIMITED
    }

    /// Checks that every limit is positive.
    ///
    /// # Errors
    /// [`TimingError::BadToolLimit`] with the first that is not.
    pub fn check(&self) -> Result<(), TimingError> {
        let rows = [
            ("speed", self.speed),
            ("acceleration", self.acceleration),
            ("jerk", self.jerk),
            ("angular_speed", self.angular_speed),
            ("angular_acceleration", self.angular_acceleration),
            ("angular_jerk", self.angular_jerk),
        ];
        for (quantity, value) in rows {
            if value.is_nan() || value <= 0.0 {
                return Err(TimingError::BadToolLimit { quantity, value });
            }
        }
        Ok(())
    }
}
