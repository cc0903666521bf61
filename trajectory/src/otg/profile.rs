//! A normalised profile as a few phases, and the weighted mean of two profiles.

/// Position, velocity, acceleration and jerk of one joint, normalised.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Point {
    pub(crate) position: f64,
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
}

impl Point {
    /// After `time` of constant jerk.
    pub(crate) fn after(self, time: f64, jerk: f64) -> Self {
        let Self {
            position,
            velocity,
            acceleration,
            ..
        } = self;
        let third = 1.0 / 3.0;
        Self {
            position: position
                + time * (velocity + 0.5 * time * (acceleration + third * time * jerk)),
            velocity: velocity + time * (acceleration + 0.5 * time * jerk),
            acceleration: acceleration + time * jerk,
            jerk,
        }
    }
}

/// Seven phases, each of constant jerk (order three) or constant acceleration (order two).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Profile {
    pub(crate) times: [f64; 7],
    /// Jerks are the signs; accelerations are `levels` of the signs.
    signs: [i8; 7],
    /// Accelerations for sign +1 and -1 in order two; `None` in order three.
    levels: Option<(f64, f64)>,
}

impl Profile {
    /// Phases of jerk `sign` times (+1, 0, -1, 0, -1, 0, +1).
    pub(crate) fn jerks(times: [f64; 7], sign: f64) -> Self {
        let signs = if sign < 0.0 {
            [-1, 0, 1, 0, 1, 0, -1]
        } else {
            [1, 0, -1, 0, -1, 0, 1]
        };
        Self {
            times,
            signs,
            levels: None,
        }
    }

    /// Phases of the acceleration `first`, zero and `second` (phases 1, 3 and 5, the others of no
    /// length).
    pub(crate) fn accelerations(times: [f64; 7], first: f64, second: f64) -> Self {
        Self {
            times,
            signs: [0, 1, 0, 0, 0, -1, 0],
            levels: Some((first, second)),
        }
    }

    /// Phases of jerk -1, 0 or +1.
    pub(crate) fn phases(times: [f64; 7], signs: [i8; 7]) -> Self {
        Self {
            times,
            signs,
            levels: None,
        }
    }

    /// The first three phases with the given signs of the jerk.
    pub(crate) fn three(times: [f64; 3], signs: [i8; 3]) -> Self {
        let mut profile = Self::default();
        profile.times[..3].copy_from_slice(&times);
        profile.signs[..3].copy_from_slice(&signs);
        profile
    }

    fn phase(&self, point: Point, sign: i8, time: f64) -> Point {
        let Some((first, second)) = self.levels else {
            return point.after(time, f64::from(sign));
        };
        let acceleration = match sign {
            1 => first,
            -1 => second,
            _ => 0.0,
        };
        Point {
            acceleration,
            ..point
        }
        .after(time, 0.0)
    }

    /// The point at `time`, from `start` on. A switching instant belongs to the later phase.
    pub(crate) fn point(&self, start: Point, time: f64) -> Point {
        let mut point = start;
        let mut rest = time;
        let mut last = 0;
        for (phase, (&length, &sign)) in self.times.iter().zip(&self.signs).enumerate() {
            if length <= 0.0 {
                continue;
            }
            if rest < length {
                return self.phase(point, sign, rest);
            }
            point = self.phase(point, sign, length);
            rest -= length;
            last = phase;
        }
        self.phase(point, self.signs[last], 0.0)
    }
}

/// A joint's profile: the weighted sum of up to two profiles of the same duration. The weights add
/// up to one, or to less if the rest is zero motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BlendedProfile {
    profiles: [Profile; 2],
    weights: [f64; 2],
    count: usize,
}

impl BlendedProfile {
    pub(crate) fn push(&mut self, profile: Profile, weight: f64) {
        if let Some(place) = self.profiles.get_mut(self.count) {
            *place = profile;
            self.weights[self.count] = weight;
            self.count += 1;
        }
    }

    /// The profiles with their weights.
    pub(crate) fn parts(&self) -> impl Iterator<Item = (&Profile, f64)> {
        self.profiles.iter().zip(self.weights).take(self.count)
    }

    /// The point at `time` after `start`.
    pub(crate) fn point(&self, start: Point, time: f64) -> Point {
        let mut sum = Point::default();
        for (profile, weight) in self.parts() {
            let point = profile.point(start, time);
            sum.position += weight * point.position;
            sum.velocity += weight * point.velocity;
            sum.acceleration += weight * point.acceleration;
            sum.jerk += weight * point.jerk;
        }
        sum
    }
}
