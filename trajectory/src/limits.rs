//! Limits of joints and tool.

pub use realtime::{EndSpeeds, JointLimits};

use crate::TimingError;

/// Checks that every velocity, acceleration and jerk limit is positive, and the decelerations near the ends of
/// the ranges, and that the offsets there are not negative.
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
    let ends = limits.ends.iter();
    let pairs = ends.flat_map(|ends| ends.deceleration.iter().zip(&ends.offset).enumerate());
    for (joint, (&deceleration, &offset)) in pairs {
        let bad = |value: f64, least: f64| value.is_nan() || value < least;
        let rows = [
            (
                "deceleration near the ends of the range",
                deceleration,
                bad(deceleration, f64::MIN_POSITIVE),
            ),
            (
                "offset of the speed near the ends of the range",
                offset,
                bad(offset, 0.0),
            ),
        ];
        if let Some(&(quantity, value, _)) = rows.iter().find(|row| row.2) {
            return Err(TimingError::BadJointLimit {
                joint,
                quantity,
                value,
            });
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

    /// A share of the limits along the path and one of those about an axis.
    ///
    /// ```
    /// use trajectory::ToolLimits;
    /// let limits = ToolLimits {
    ///     speed: 2.0,
    ///     angular_jerk: 8.0,
    ///     ..ToolLimits::UNLIMITED
    /// };
    /// let slower = limits.scaled(0.5, 0.25);
    /// assert_eq!((slower.speed, slower.angular_jerk), (1.0, 2.0));
    /// ```
    #[must_use]
    pub fn scaled(&self, along: f64, about: f64) -> Self {
        Self {
            speed: self.speed * along,
            acceleration: self.acceleration * along,
            jerk: self.jerk * along,
            angular_speed: self.angular_speed * about,
            angular_acceleration: self.angular_acceleration * about,
            angular_jerk: self.angular_jerk * about,
        }
    }

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
