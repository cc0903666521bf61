//! How fast a straight line in joint space can be left from rest: a bound of its speed.

use nalgebra::SVector;

use crate::JointLimits;

/// The largest `|d_j| / limit_j`.
pub(super) fn joint_ratio<const N: usize>(d: &SVector<f64, N>, limit: &SVector<f64, N>) -> f64 {
    d.component_div(limit).amax()
}

/// The same for speeds at a position (rad), whose limits may fall towards the ends of the range. A path
/// keeps this share of its largest speed at least, so that the law stays finite: bounds of the motion
/// refuse what is too fast then.
pub(super) fn speed_ratio<const N: usize>(
    position: &SVector<f64, N>,
    d: &SVector<f64, N>,
    limits: &JointLimits<N>,
) -> f64 {
    if limits.ends.is_none() {
        return joint_ratio(d, &limits.velocity);
    }
    let one = |j: usize| {
        let most = limits.speed(j, position[j], d[j]);
        d[j].abs() / most.max(LEAST * limits.velocity[j])
    };
    (0..N).map(one).fold(0.0, f64::max)
}

/// Least share of the largest speed.
const LEAST: f64 = 1e-4;

/// Bounds of the second and third derivative of `u(t)` along a path that is straight in joint space
/// and even in `u`: there `q'` is constant, so that each limit of a joint bounds `u` alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rise {
    acceleration: f64,
    jerk: f64,
    /// The cube root of `6 J^2`.
    root: f64,
    /// Where the acceleration reaches its limit, and half of the squared rate there.
    full: (f64, f64),
}

impl Rise {
    /// For joints that move by `step` for one unit of `u` (rad).
    pub(super) fn new<const N: usize>(step: &SVector<f64, N>, limits: &JointLimits<N>) -> Self {
        let acceleration = 1.0 / joint_ratio(step, &limits.acceleration);
        let jerk = 1.0 / joint_ratio(step, &limits.jerk);
        let root = (6.0 * jerk * jerk).cbrt();
        let full = acceleration * acceleration * acceleration / (6.0 * jerk * jerk);
        Self {
            acceleration,
            jerk,
            root,
            full: (full, half(root, full)),
        }
    }

    /// The largest `(du/dt)^2` at the distance `u` from an end at rest.
    ///
    /// To have the acceleration `a`, the law has to rise from zero for `a / J` at least, in which it
    /// moves by `a^3 / (6 J^2)` at least. So at the distance `u` it has `(6 J^2 u)^(1/3)` at most,
    /// and half of the squared rate is the integral of the acceleration over `u`.
    pub(super) fn square(&self, u: f64) -> f64 {
        let (a, j) = (self.acceleration, self.jerk);
        if !j.is_finite() {
            return 2.0 * a * u;
        }
        let (full, most) = self.full;
        if u >= full {
            return 2.0 * (most + a * (u - full));
        }
        2.0 * half(self.root, u)
    }
}

/// Half of the squared rate at the distance `u` while the acceleration rises.
fn half(root: f64, u: f64) -> f64 {
    0.75 * root * u.cbrt().powi(4)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along a bang-bang law with limited jerk the bound is the law itself.
    #[test]
    fn a_rise_with_full_jerk_meets_the_bound() {
        let step = SVector::<f64, 1>::new(2.0);
        let rise = Rise::new(&step, &JointLimits::uniform(9.0, 8.0, 40.0));
        let (jerk, most) = (20.0, 4.0);
        let ramp = most / jerk;
        for i in 1..=40 {
            let t = f64::from(i) * 0.025;
            let (u, rate) = if t < ramp {
                (jerk * t * t * t / 6.0, 0.5 * jerk * t * t)
            } else {
                let (x, v) = (t - ramp, 0.5 * most * ramp);
                let u = most * ramp * ramp / 6.0 + v * x + 0.5 * most * x * x;
                (u, v + most * x)
            };
            let square = rise.square(u);
            assert!(
                (square - rate * rate).abs() < 1e-12 * square,
                "{t}: {square} {}",
                rate * rate
            );
        }
    }
}
