//! Bounds of the motion between two samples, from the limits of the joints and the time between
//! samples alone.

use crate::robot::JointLimits;

/// How far a joint can move from rest, or before coming to rest, within `time` (s): position,
/// velocity, acceleration.
pub(super) fn from_rest(limits: &JointLimits, joint: usize, time: f64) -> [f64; 3] {
    let (velocity, acceleration, jerk) = (
        limits.velocity[joint],
        limits.acceleration[joint],
        limits.jerk[joint],
    );
    let cubic = jerk * time * time * time / 6.0;
    let square = acceleration * time * time / 2.0;
    [
        cubic.min(square).min(velocity * time),
        (jerk * time * time / 2.0)
            .min(acceleration * time)
            .min(velocity),
        (jerk * time).min(acceleration),
    ]
}

/// Largest distance of a joint from the quintic through two samples, in units of jerk limit times
/// the cube of the time between them: the integral of the Peano kernel, 1/161.
///
/// # Source
/// P. Davis, Interpolation and Approximation, 1963, section 3.7 (Peano's theorem).
const QUINTIC: f64 = 0.0063;

/// Largest distance of a joint from the [`Quintic`] between two samples `time` (s) apart.
pub(super) fn off_quintic(limits: &JointLimits, joint: usize, time: f64) -> f64 {
    (QUINTIC * limits.jerk[joint] * time * time * time).min(limits.velocity[joint] * time)
}

/// The quintic with given position, velocity and acceleration at both ends of an interval.
pub(super) struct Quintic([f64; 6]);

impl Quintic {
    /// From `[position, velocity, acceleration]` at both ends of an interval of `time` (s).
    pub(super) fn new(from: [f64; 3], to: [f64; 3], time: f64) -> Self {
        let scaled = |[q, v, a]: [f64; 3]| [q, v * time, a * time * time];
        let ([q0, v0, a0], [q1, v1, a1]) = (scaled(from), scaled(to));
        let way = q1 - q0 - v0 - a0 / 2.0;
        let (rate, change) = (v1 - v0 - a0, a1 - a0);
        Self([
            q0,
            v0,
            a0 / 2.0,
            10.0 * way - 4.0 * rate + change / 2.0,
            -15.0 * way + 7.0 * rate - change,
            6.0 * way - 3.0 * rate + change / 2.0,
        ])
    }

    /// Position at a share of the interval, 0 to 1.
    pub(super) fn at(&self, share: f64) -> f64 {
        self.0.iter().rev().fold(0.0, |sum, c| sum * share + c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quintic_meets_its_ends_and_polynomials_of_its_order() {
        let of = |t: f64| [t.powi(5) - t, 5.0 * t.powi(4) - 1.0, 20.0 * t.powi(3)];
        let quintic = Quintic::new(of(0.5), of(2.0), 1.5);
        for share in [0.0, 0.3, 0.7, 1.0] {
            let expected = of(0.5 + 1.5 * share)[0];
            assert!((quintic.at(share) - expected).abs() < 1e-12, "{share}");
        }
    }
}
