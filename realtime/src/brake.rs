//! Stops each joint independently: used only when the path cannot be followed any more.

use nalgebra::SVector;

use crate::approach::{Bounds, next_rate};
use crate::{JointLimits, Sample};

/// Where the joints are one `period` (s) after `now` when each brakes by itself within its
/// acceleration and jerk limits. Repeated, it ends at rest. It leaves the path.
///
/// ```
/// use nalgebra::vector;
/// use realtime::{JointLimits, Sample, brake};
///
/// let limits = JointLimits {
///     lower: vector![-3.0],
///     upper: vector![3.0],
///     velocity: vector![2.0],
///     acceleration: vector![5.0],
///     jerk: vector![50.0],
///     ends: None,
/// };
/// let mut now = Sample { velocity: vector![1.0], ..Sample::rest(vector![0.0]) };
/// for _ in 0..400 {
///     now = brake(&now, &limits, 0.001);
/// }
/// assert!(now.velocity[0].abs() < 1e-9 && now.acceleration[0] == 0.0);
/// ```
pub fn brake<const N: usize>(now: &Sample<N>, limits: &JointLimits<N>, period: f64) -> Sample<N> {
    let moving = now
        .velocity
        .zip_map(&now.acceleration, |velocity, acceleration| {
            [velocity, acceleration]
        });
    let next: SVector<f64, N> = moving.zip_zip_map(
        &limits.acceleration,
        &limits.jerk,
        |moving, rate, change| next_rate(moving, 0.0, Bounds { rate, change }, period),
    );
    let jerk = (next - now.acceleration) / period;
    let turn = now.acceleration * 0.5 + jerk * (period / 6.0);
    Sample {
        position: now.position + (now.velocity + turn * period) * period,
        velocity: now.velocity + (now.acceleration + next) * (period / 2.0),
        acceleration: next,
        jerk,
    }
}

/// Whether the joints of `now` rest, but for rounding.
pub fn at_rest<const N: usize>(now: &Sample<N>) -> bool {
    now.velocity.amax() < 1e-9 && now.acceleration.amax() < 1e-6
}
