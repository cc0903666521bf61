//! The profile that goes to one constant velocity at once: its excess motion is the smallest.

use super::axis::Axis;
use super::extremal::{Bounds, End, pulse};
use super::profile::{BlendedProfile, Profile};

/// One pulse between a state of motion and a constant velocity.
#[derive(Clone, Copy)]
struct Ramp {
    phases: [f64; 3],
    /// +1 if the pulse rises first.
    sign: f64,
    time: f64,
    distance: f64,
}

impl Ramp {
    /// From `start` to `velocity` without acceleration, as fast as possible.
    fn new(start: End, velocity: f64, bounds: Bounds) -> Self {
        let a0 = start.acceleration;
        let coasting = start.velocity + 0.5 * a0 * a0.abs();
        if velocity < coasting {
            let mirror = Self::new(start.mirrored(), -velocity, bounds.mirrored());
            return Self {
                sign: -1.0,
                distance: -mirror.distance,
                ..mirror
            };
        }
        let from = start.velocity - 0.5 * a0 * a0;
        let (time, height) = pulse(velocity - from, bounds.rise.max(a0));
        Self {
            phases: [
                (height - a0).max(0.0),
                (time - 2.0 * height).max(0.0),
                height,
            ],
            sign: 1.0,
            time: time - a0,
            distance: 0.5 * time * (from + velocity) - a0 * (from + a0 * a0 / 6.0),
        }
    }
}

/// The profile of duration `time` that goes to a constant velocity as fast as possible, keeps it,
/// and leaves it as late as possible; `None` if there is none of this shape.
///
/// Among the profiles of the same duration it spends most time at the mean velocity, so it goes
/// least beyond start and target. [`Axis::blended_profile`] uses less jerk and exists for every
/// possible duration.
pub(crate) fn direct(axis: &Axis, time: f64) -> Option<BlendedProfile> {
    let (start, end, bounds, distance) = axis.parts();
    if !bounds.smooth {
        return None;
    }
    // The last part is the first part of the reversed motion.
    let reversed = End {
        velocity: end.velocity,
        acceleration: -end.acceleration,
    };
    let ramps = |velocity: f64| {
        (
            Ramp::new(start, velocity, bounds),
            Ramp::new(reversed, velocity, bounds.reversed()),
        )
    };
    let reach = |velocity: f64| {
        let (first, last) = ramps(velocity);
        let cruise = time - first.time - last.time;
        (first.distance + last.distance + velocity * cruise, cruise)
    };
    let (mut low, mut high) = (bounds.bottom.max(-1e150), bounds.top.min(1e150));
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if reach(middle).0 < distance {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (reached, cruise) = reach(high);
    if cruise < 0.0 || (reached - distance).abs() > 1e-12 * (1.0 + distance.abs() + time) {
        return None;
    }
    let (first, last) = ramps(high);
    let [a, b, c] = first.phases;
    let [g, f, e] = last.phases;
    let (up, down) = (first.sign as i8, last.sign as i8);
    let mut blended_profile = BlendedProfile::default();
    let signs = [up, 0, -up, 0, -down, 0, down];
    blended_profile.push(Profile::phases([a, b, c, cruise, e, f, g], signs), 1.0);
    Some(blended_profile)
}
