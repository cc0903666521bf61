//! Limits of the joints.

use nalgebra::SVector;

use crate::piece::of;

/// Limits of `N` joints (rad, rad/s, rad/s², rad/s³; metres for a prismatic joint). Infinity
/// means: not limited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits<const N: usize> {
    /// Lowest positions (rad).
    pub lower: SVector<f64, N>,
    /// Highest positions (rad).
    pub upper: SVector<f64, N>,
    /// Highest speeds (rad/s).
    pub velocity: SVector<f64, N>,
    /// Highest accelerations (rad/s²), up and down.
    pub acceleration: SVector<f64, N>,
    /// Highest jerks (rad/s³), up and down.
    pub jerk: SVector<f64, N>,
    /// Less speed near the ends of the range; `None`: the same speed everywhere.
    pub ends: Option<EndSpeeds<N>>,
}

/// Speed limits that fall towards the ends of the range. A joint that moves towards an end, and is
/// `x` away from it, may have the speed `sqrt(2 deceleration x) - offset`: what it can lose before
/// the end by that deceleration, less an offset. Away from the end they do not hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndSpeeds<const N: usize> {
    /// Lower ends (rad); minus infinity: no such limit there.
    pub lower: SVector<f64, N>,
    /// Upper ends (rad); infinity: no such limit there.
    pub upper: SVector<f64, N>,
    /// Decelerations (rad/s²).
    pub deceleration: SVector<f64, N>,
    /// Offsets (rad/s).
    pub offset: SVector<f64, N>,
}

impl<const N: usize> EndSpeeds<N> {
    /// The largest speed (rad/s) of a joint at `position` (rad) upwards, or downwards; at least 0.
    ///
    /// # Example
    /// ```
    /// use nalgebra::vector;
    /// use realtime::EndSpeeds;
    ///
    /// let ends = EndSpeeds {
    ///     lower: vector![-3.0],
    ///     upper: vector![3.0],
    ///     deceleration: vector![8.0],
    ///     offset: vector![0.5],
    /// };
    /// assert_eq!(ends.speed(0, 2.0, true), 3.5);
    /// assert_eq!(ends.speed(0, 3.0, true), 0.0);
    /// ```
    pub fn speed(&self, joint: usize, position: f64, upwards: bool) -> f64 {
        let room = if upwards {
            of(&self.upper, joint) - position
        } else {
            position - of(&self.lower, joint)
        };
        let square = 2.0 * of(&self.deceleration, joint) * room.max(0.0);
        (libm::sqrt(square) - of(&self.offset, joint)).max(0.0)
    }

    /// The same limits times `share`.
    #[must_use]
    pub fn scaled(self, share: f64) -> Self {
        Self {
            deceleration: self.deceleration * (share * share),
            offset: self.offset * share,
            ..self
        }
    }
}

impl<const N: usize> JointLimits<N> {
    /// The same velocity (rad/s), acceleration (rad/s²) and jerk (rad/s³) for every joint, any
    /// position.
    pub fn uniform(velocity: f64, acceleration: f64, jerk: f64) -> Self {
        Self {
            lower: SVector::repeat(f64::NEG_INFINITY),
            upper: SVector::repeat(f64::INFINITY),
            velocity: SVector::repeat(velocity),
            acceleration: SVector::repeat(acceleration),
            jerk: SVector::repeat(jerk),
            ends: None,
        }
    }

    /// The largest speed (rad/s) of a joint at `position` (rad) in the direction of `velocity`.
    pub fn speed(&self, joint: usize, position: f64, velocity: f64) -> f64 {
        let most = of(&self.velocity, joint);
        match &self.ends {
            Some(ends) => most.min(ends.speed(joint, position, velocity > 0.0)),
            None => most,
        }
    }

    /// The same limits times a share of velocity, of acceleration and of jerk.
    #[must_use]
    pub fn scaled(self, velocity: f64, acceleration: f64, jerk: f64) -> Self {
        Self {
            velocity: self.velocity * velocity,
            acceleration: self.acceleration * acceleration,
            jerk: self.jerk * jerk,
            ends: self.ends.map(|ends| ends.scaled(velocity)),
            ..self
        }
    }
}
