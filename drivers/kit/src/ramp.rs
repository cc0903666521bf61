//! The fastest change from one speed to another within acceleration and jerk limits.

use crate::Reference;

/// The motion of one joint to a constant speed: three phases of constant jerk.
///
/// # Source
/// The time-optimal law of a double integrator, applied to the speed: A. Bryson, Y. Ho, "Applied
/// Optimal Control", 1975, section 3.9; with a hold if the acceleration limit is reached.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ramp {
    /// How long (s), and with which jerk (rad/s³).
    phases: [(f64, f64); 3],
    /// The speed at the end (rad/s).
    speed: f64,
}

impl Ramp {
    /// From `from` to `speed` (rad/s) with at most `acceleration` (rad/s²) and `jerk` (rad/s³).
    /// An acceleration beyond the limit is brought back within it.
    pub(crate) fn new(from: &Reference, speed: f64, [acceleration, jerk]: [f64; 2]) -> Self {
        let toward = if speed >= from.coasting_speed(jerk) {
            1.0
        } else {
            -1.0
        };
        let missing = toward * (speed - from.velocity);
        let now = toward * from.acceleration;
        let mut peak = (jerk * missing + now * now / 2.0).max(0.0).sqrt();
        let mut hold = 0.0;
        if peak > acceleration {
            peak = acceleration;
            let gained = (peak * peak - now * now).abs() / (2.0 * jerk);
            hold = (missing - gained) / peak - peak / (2.0 * jerk);
        }
        let first = if peak >= now { jerk } else { -jerk };
        Self {
            phases: [
                ((peak - now).abs() / jerk, toward * first),
                (hold.max(0.0), 0.0),
                (peak / jerk, -toward * jerk),
            ],
            speed,
        }
    }

    /// State of the joint `time` (s) after it began in `from`.
    pub(crate) fn sample(&self, from: &Reference, time: f64) -> Reference {
        let (mut at, mut left) = (*from, time);
        for (duration, jerk) in self.phases {
            if left <= duration {
                return at.after(left, jerk);
            }
            at = at.after(duration, jerk);
            left -= duration;
        }
        Reference {
            position: at.position + self.speed * left,
            velocity: self.speed,
            acceleration: 0.0,
        }
    }

    /// Position of the joint when it reaches the speed (rad).
    pub(crate) fn end(&self, from: &Reference) -> f64 {
        let at = self.phases.iter();
        at.fold(*from, |at, (duration, jerk)| at.after(*duration, *jerk))
            .position
    }

    /// The highest position of the motion (rad).
    pub(crate) fn top(&self, from: &Reference) -> f64 {
        let (mut at, mut top) = (*from, from.position);
        for (duration, jerk) in self.phases {
            for time in at.turns(jerk) {
                if time > 0.0 && time < duration {
                    top = top.max(at.after(time, jerk).position);
                }
            }
            at = at.after(duration, jerk);
            top = top.max(at.position);
        }
        top
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(5), ..ProptestConfig::default() })]

        /// It gets there, within its limits, and the top is the highest place of fine samples.
        #[test]
        fn arrives_within_limits(
            position in -1.0..1.0_f64, velocity in -3.0..3.0_f64, share in -1.0..1.0_f64,
            speed in -3.0..3.0_f64, acceleration in 0.5..20.0_f64, jerk in 10.0..2000.0_f64,
        ) {
            let from = Reference { position, velocity, acceleration: share * acceleration };
            let ramp = Ramp::new(&from, speed, [acceleration, jerk]);
            let duration: f64 = ramp.phases.iter().map(|phase| phase.0).sum();
            let (mut before, mut top) = (from, position);
            let step = duration / 2000.0;
            for number in 1..=2000 {
                let at = ramp.sample(&from, step * f64::from(number));
                prop_assert!(at.acceleration.abs() <= acceleration * (1.0 + 1e-9));
                let change = (at.acceleration - before.acceleration).abs();
                prop_assert!(change <= jerk * step * (1.0 + 1e-6) + 1e-9);
                top = top.max(at.position);
                before = at;
            }
            prop_assert!((before.velocity - speed).abs() < 1e-9);
            prop_assert!(before.acceleration.abs() < 1e-9);
            prop_assert!((ramp.end(&from) - before.position).abs() < 1e-9);
            let found = ramp.top(&from);
            prop_assert!(found >= top - 1e-9 && found <= top + 3.0 * step, "{found} {top}");
        }
    }
}
