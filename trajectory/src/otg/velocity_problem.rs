//! One joint between two velocities.

use super::axis::velocity_windows;
use super::extremal::{Bounds, End};
use super::profile::{BlendedProfile, Profile};

/// The normalised velocity problem of one joint: from the velocity and acceleration of `start` to
/// those of `end`, at any position.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct VelocityProblem {
    start: End,
    end: End,
    bounds: Bounds,
}

impl VelocityProblem {
    pub(crate) fn new(start: End, end: End, bounds: Bounds) -> Self {
        Self { start, end, bounds }
    }

    fn change(&self) -> f64 {
        self.end.velocity - self.start.velocity
    }

    /// The shortest possible duration not below `from`.
    pub(crate) fn next_possible(&self, from: f64) -> f64 {
        let from = from.max(0.0);
        if !self.bounds.smooth {
            let bound = if self.change() > 0.0 {
                self.bounds.rise
            } else {
                self.bounds.fall
            };
            return from.max(self.change().abs() / bound);
        }
        let windows = velocity_windows(self.start, self.end, self.bounds);
        let tiny = 1e-14 * (1.0 + from);
        match windows.early {
            Some((first, last)) if from <= last + tiny => from.max(first),
            _ if from + tiny >= windows.late => from,
            _ => windows.late,
        }
    }

    /// The profile of duration `time`, which must be possible: to one constant acceleration as
    /// fast as possible, and from there to the target's.
    ///
    /// # Source
    /// With ramps of jerk 1 the change of velocity is
    /// `c T - (c-a0)|c-a0|/2 - (c-af)|c-af|/2`, which grows with the held acceleration `c`.
    pub(crate) fn blended_profile(&self, time: f64) -> BlendedProfile {
        let mut blended_profile = BlendedProfile::default();
        if !self.bounds.smooth {
            if time > 0.0 {
                let times = [0.0, time, 0.0, 0.0, 0.0, 0.0, 0.0];
                blended_profile.push(
                    Profile::accelerations(times, self.change() / time, 0.0),
                    1.0,
                );
            }
            return blended_profile;
        }
        let (a0, af) = (self.start.acceleration, self.end.acceleration);
        let held = self.held(time);
        let (first, last) = ((held - a0).abs(), (held - af).abs());
        let times = [first, (time - first - last).max(0.0), last];
        let sign = |rising: bool| if rising { 1 } else { -1 };
        blended_profile.push(
            Profile::three(times, [sign(held >= a0), 0, sign(af >= held)]),
            1.0,
        );
        blended_profile
    }

    fn held(&self, time: f64) -> f64 {
        let (a0, af) = (self.start.acceleration, self.end.acceleration);
        let (low, high) = (a0.min(af), a0.max(af));
        let change = self.change();
        let half = 0.5 * (a0 * a0 + af * af);
        let between = 0.5 * (high - low) * (high + low);
        let wait = time - (high - low);
        if change > high * wait + between {
            let middle = 0.5 * (time + a0 + af);
            let root = (middle * middle - half - change).max(0.0).sqrt();
            (middle - root).clamp(high, self.bounds.rise.max(high))
        } else if change < low * wait + between {
            let middle = 0.5 * (time - a0 - af);
            let root = (middle * middle - half + change).max(0.0).sqrt();
            (root - middle).clamp((-self.bounds.fall).min(low), low)
        } else if wait > 0.0 {
            ((change - between) / wait).clamp(low, high)
        } else {
            low
        }
    }
}
