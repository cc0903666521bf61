//! The last check of each setpoint before it is published, and the check of the measured state.

use nalgebra::SVector;

use crate::piece::of;
use crate::{JointLimits, Sample};

/// The quantity whose limit was broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A number that is not finite.
    Finite,
    /// Position (rad).
    Position,
    /// Velocity (rad/s).
    Velocity,
    /// Acceleration (rad/s²).
    Acceleration,
    /// Jerk (rad/s³).
    Jerk,
    /// Positions that do not follow from the velocities (rad).
    Step,
    /// Distance between commanded and measured position (rad).
    Following,
    /// Distance between setpoint and the position that the driver commands (rad).
    Commanded,
}

impl Quantity {
    /// The quantity's name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Finite => "finite number",
            Self::Position => "position",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
            Self::Jerk => "jerk",
            Self::Step => "position step",
            Self::Following => "following error",
            Self::Commanded => "deviation of the driver's command from the setpoint",
        }
    }

    /// The unit, for a revolute joint.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Finite => "",
            Self::Position | Self::Step | Self::Following | Self::Commanded => "rad",
            Self::Velocity => "rad/s",
            Self::Acceleration => "rad/s2",
            Self::Jerk => "rad/s3",
        }
    }
}

/// A limit that was broken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trip {
    /// The joint, from 0.
    pub joint: usize,
    /// What was broken.
    pub quantity: Quantity,
    /// The value that was found.
    pub value: f64,
    /// The limit.
    pub limit: f64,
}

/// Tolerance for rounding, as a fraction of a limit.
const ROUNDING: f64 = 1e-3;

/// Tolerance for rounding of positions (rad).
const POSITION_ROUNDING: f64 = 1e-6;

/// What is wrong with going from the setpoint `previous` to `next` within `period` (s): numbers
/// that are not finite, position, velocity, acceleration, jerk, or positions that jump.
pub fn check<const N: usize>(
    previous: &Sample<N>,
    next: &Sample<N>,
    limits: &JointLimits<N>,
    period: f64,
) -> Option<Trip> {
    (0..N).find_map(|joint| {
        check_range(joint, next, limits).or_else(|| {
            let (v0, v1) = (of(&previous.velocity, joint), of(&next.velocity, joint));
            let (a0, a1) = (
                of(&previous.acceleration, joint),
                of(&next.acceleration, joint),
            );
            let moved = of(&next.position, joint) - of(&previous.position, joint);
            let most = of(&limits.jerk, joint);
            let curve = most * period * period * period / 6.0 + POSITION_ROUNDING;
            let speed = limits.speed(joint, of(&next.position, joint), v1);
            [
                (Quantity::Velocity, v1, speed),
                (Quantity::Acceleration, a1, of(&limits.acceleration, joint)),
                (Quantity::Jerk, (a1 - a0) / period, most),
                (Quantity::Step, moved - (v0 + v1) * (period / 2.0), curve),
            ]
            .into_iter()
            .find(|(_, value, limit)| libm::fabs(*value) > limit * (1.0 + ROUNDING))
            .map(|(quantity, value, limit)| Trip {
                joint,
                quantity,
                value,
                limit,
            })
        })
    })
}

/// What is wrong with one joint of a setpoint by itself: a number that is not finite, or a
/// position out of range.
fn check_range<const N: usize>(
    joint: usize,
    next: &Sample<N>,
    limits: &JointLimits<N>,
) -> Option<Trip> {
    let position = of(&next.position, joint);
    let trip = |quantity, limit| {
        Some(Trip {
            joint,
            quantity,
            value: position,
            limit,
        })
    };
    let (velocity, acceleration) = (of(&next.velocity, joint), of(&next.acceleration, joint));
    let (lower, upper) = (of(&limits.lower, joint), of(&limits.upper, joint));
    if !(position.is_finite() && velocity.is_finite() && acceleration.is_finite()) {
        trip(Quantity::Finite, f64::INFINITY)
    } else if position < lower - POSITION_ROUNDING {
        trip(Quantity::Position, lower)
    } else if position > upper + POSITION_ROUNDING {
        trip(Quantity::Position, upper)
    } else {
        None
    }
}

/// How far one position may be from another that it follows late.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Following {
    /// At rest (rad).
    pub base: f64,
    /// More for each rad/s of speed: the delay that is allowed for (s).
    pub delay: f64,
}

impl Following {
    /// The first joint of `found` that is too far from `wanted` (both rad, m), where the joints moved
    /// with up to `speed` (rad/s, m/s) in the time that counts, as a [`Quantity::Following`].
    ///
    /// # Example
    /// ```
    /// use nalgebra::vector;
    /// use realtime::Following;
    ///
    /// let allowed = Following { base: 0.01, delay: 0.02 };
    /// let (wanted, found) = (vector![0.0, 0.0], vector![0.0, 0.02]);
    /// let trip = allowed.check(&wanted, &found, &vector![0.0, 0.0]);
    /// assert_eq!(trip.map(|trip| trip.joint), Some(1));
    /// let moving = allowed.check(&wanted, &found, &vector![0.0, 1.0]);
    /// assert_eq!(moving, None);
    /// ```
    #[inline(never)]
    pub fn check<const N: usize>(
        self,
        wanted: &SVector<f64, N>,
        found: &SVector<f64, N>,
        speed: &SVector<f64, N>,
    ) -> Option<Trip> {
        (0..N).find_map(|joint| {
            let value = of(found, joint) - of(wanted, joint);
            let limit = self.base + self.delay * libm::fabs(of(speed, joint));
            let bad = !value.is_finite() || libm::fabs(value) > limit;
            bad.then_some(Trip {
                joint,
                quantity: Quantity::Following,
                value,
                limit,
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    fn limits() -> JointLimits<2> {
        JointLimits {
            lower: vector![-3.0, -3.0],
            upper: vector![3.0, 3.0],
            velocity: vector![2.0, 2.0],
            acceleration: vector![5.0, 5.0],
            jerk: vector![50.0, 50.0],
            ends: None,
        }
    }

    #[test]
    fn less_speed_is_allowed_near_an_end() {
        let near = crate::EndSpeeds {
            lower: vector![-3.0, -3.0],
            upper: vector![3.0, 3.0],
            deceleration: vector![2.0, 2.0],
            offset: vector![0.2, 0.2],
        };
        let limits = JointLimits {
            ends: Some(near),
            ..limits()
        };
        // 0.04 rad before the end: sqrt(2 * 2 * 0.04) - 0.2 = 0.2 rad/s.
        let at = |speed: f64| Sample {
            velocity: vector![0.0, speed],
            ..Sample::rest(vector![0.0, 2.96])
        };
        let moved = |speed: f64| {
            let (from, mut next) = (at(speed), at(speed));
            next.position[1] += speed * 0.001;
            check(&from, &next, &limits, 0.001)
        };
        assert_eq!(moved(0.19), None);
        assert_eq!(moved(-1.9), None);
        let trip = moved(0.21).unwrap();
        assert_eq!((trip.joint, trip.quantity), (1, Quantity::Velocity));
        assert!((trip.limit - 0.2).abs() < 2e-3, "{trip:?}");
    }

    #[test]
    fn each_limit_trips_and_names_its_joint() {
        let rest = Sample::rest(vector![0.0, 2.9999]);
        assert_eq!(check(&rest, &rest, &limits(), 0.001), None);
        let found = |next: Sample<2>, from: &Sample<2>| check(from, &next, &limits(), 0.001);
        let mut bad = rest;
        bad.position[1] = f64::NAN;
        assert_eq!(found(bad, &rest).unwrap().quantity, Quantity::Finite);
        bad.position[1] = 3.0001;
        let trip = found(bad, &rest).unwrap();
        assert_eq!(
            (trip.joint, trip.quantity, trip.limit),
            (1, Quantity::Position, 3.0)
        );
        let mut bad = rest;
        bad.velocity[0] = -2.1;
        assert_eq!(found(bad, &rest).unwrap().quantity, Quantity::Velocity);
        let mut bad = rest;
        bad.acceleration[0] = 5.1;
        assert_eq!(found(bad, &rest).unwrap().quantity, Quantity::Acceleration);
        bad.acceleration[0] = 0.06;
        assert_eq!(found(bad, &rest).unwrap().quantity, Quantity::Jerk);
        let mut bad = rest;
        bad.position[0] = 1e-4;
        assert_eq!(found(bad, &rest).unwrap().quantity, Quantity::Step);
    }

    #[test]
    fn the_following_error_scales_with_velocity() {
        let allowed = Following {
            base: 0.01,
            delay: 0.02,
        };
        let (rest, measured) = (vector![0.0, 0.0], vector![0.0, 0.02]);
        let found = |measured, speed: SVector<f64, 2>| allowed.check(&rest, &measured, &speed);
        assert!(found(measured, rest).is_some());
        assert!(found(measured, vector![0.0, 1.0]).is_none());
        assert!(found(vector![f64::NAN, 0.0], rest).is_some());
    }
}
