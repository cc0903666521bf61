//! One joint between two states: which durations are possible, and the profile for one of them.

use super::extremal::{Bounds, End, Extremal, ExtremalFamily};
use super::profile::{BlendedProfile, Profile};

/// Relative residual of positions and velocities that counts as rounding: planning from a sample of
/// a planned motion must find that motion again.
const SLACK: f64 = 3e-13;

/// The normalised problem of one joint: from `start` to `end`, which are `distance` apart.
///
/// For a duration `T` the displacements that can be reached are exactly the interval between the
/// farthest profile backward and the farthest forward ([`ExtremalFamily`]), because dynamics are linear and
/// limits convex. So `T` is possible if `distance` is in that interval, and then a weighted mean of
/// the two farthest profiles is a profile that keeps every limit and ends exactly at the target.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Axis {
    start: End,
    end: End,
    bounds: Bounds,
    distance: f64,
    /// How exactly `distance` is known.
    slack: f64,
    up: ExtremalFamily,
    down: ExtremalFamily,
    resting: bool,
}

/// Durations in which the velocities can be joined: `early` (if any) and all from `late` on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Windows {
    pub(crate) early: Option<(f64, f64)>,
    pub(crate) late: f64,
}

impl Axis {
    pub(crate) fn new(start: End, end: End, bounds: Bounds, distance: f64, noise: f64) -> Self {
        let still = |e: End| e.velocity == 0.0 && e.acceleration == 0.0;
        Self {
            start,
            end,
            bounds,
            distance,
            slack: 64.0 * noise + SLACK * (1.0 + distance.abs()),
            up: ExtremalFamily::new(start, end, bounds),
            down: ExtremalFamily::new(start.mirrored(), end.mirrored(), bounds.mirrored()),
            resting: still(start) && still(end),
        }
    }

    /// Start, end, bounds and distance.
    pub(crate) fn parts(&self) -> (End, End, Bounds, f64) {
        (self.start, self.end, self.bounds, self.distance)
    }

    /// Whether the joint can arrive after exactly `time`, by a quick test: `None` if it does not
    /// decide.
    fn glance(&self, time: f64) -> Option<bool> {
        if self.resting {
            let (family, distance) = self.leading();
            return Some(family.at(time).distance >= distance && time >= 0.0);
        }
        let up = self.up.at(time);
        let down = self.down.at(time);
        if !up.settled || !down.settled {
            return None;
        }
        Some(up.distance >= self.distance && down.distance >= -self.distance)
    }

    /// A cheap guess at the shortest duration.
    pub(crate) fn guess(&self) -> f64 {
        let way = self.distance.abs();
        let top = if self.distance < 0.0 {
            -self.bounds.bottom
        } else {
            self.bounds.top
        };
        let ramps = if self.bounds.smooth {
            rough_cube_root(32.0 * way)
        } else {
            0.0
        };
        ramps.max(2.0 * way.sqrt()).max(way / top)
    }

    /// The direction towards the target of a move between states at rest.
    fn leading(&self) -> (&ExtremalFamily, f64) {
        if self.distance < 0.0 {
            (&self.down, -self.distance)
        } else {
            (&self.up, self.distance)
        }
    }

    /// The shortest duration not below `from` after which the joint can be at the target, infinity
    /// if the numbers leave the range of floating point.
    pub(crate) fn next_possible(&self, from: f64) -> f64 {
        let from = from.max(0.0);
        if self.glance(from) == Some(true) {
            return from;
        }
        let windows = self.windows();
        let tiny = 1e-14 * (1.0 + from);
        if let Some((first, last)) = windows.early
            && from <= last + tiny
            && let Some(time) = self.first_in(from.max(first), last)
        {
            return time;
        }
        let late = if from + tiny >= windows.late {
            from
        } else {
            windows.late
        };
        self.first_in(late, f64::INFINITY).unwrap_or(f64::INFINITY)
    }

    /// The first possible duration in a window in which the velocities can be joined.
    fn first_in(&self, from: f64, last: f64) -> Option<f64> {
        let goal = |distance: f64| Goal {
            distance,
            slack: self.slack,
        };
        let mut time = from;
        for _ in 0..8 {
            let forward = first_above(&self.up, goal(self.distance), time, last)?;
            let both = first_above(&self.down, goal(-self.distance), forward, last)?;
            if both <= time || both <= forward {
                return Some(both);
            }
            time = both;
        }
        None
    }

    fn windows(&self) -> Windows {
        let (start, end) = (self.start, self.end);
        if !self.bounds.smooth {
            let change = end.velocity - start.velocity;
            let bound = if change > 0.0 {
                self.bounds.rise
            } else {
                self.bounds.fall
            };
            return Windows {
                early: None,
                late: change.abs() / bound,
            };
        }
        velocity_windows(start, end, self.bounds)
    }

    /// The profile of duration `time`, which must be possible.
    pub(crate) fn blended_profile(&self, time: f64) -> BlendedProfile {
        if self.resting {
            return self.resting_profile(time);
        }
        let up = self.up.at(time);
        let down = self.down.at(time);
        let (highest, lowest) = (up.distance, -down.distance);
        let weight = if self.distance >= highest - self.slack {
            1.0
        } else if self.distance <= lowest + self.slack {
            0.0
        } else {
            (self.distance - lowest) / (highest - lowest)
        };
        let mut blended_profile = BlendedProfile::default();
        if weight > 0.0 {
            blended_profile.push(self.profile(&self.up, &up, 1.0), weight);
        }
        if weight < 1.0 {
            blended_profile.push(self.profile(&self.down, &down, -1.0), 1.0 - weight);
        }
        blended_profile
    }

    fn resting_profile(&self, time: f64) -> BlendedProfile {
        let (family, distance) = self.leading();
        let mut blended_profile = BlendedProfile::default();
        if distance == 0.0 {
            return blended_profile;
        }
        let extremal = family.at(time);
        let weight = if distance >= extremal.distance {
            1.0
        } else {
            distance / extremal.distance
        };
        let sign = if self.distance < 0.0 { -1.0 } else { 1.0 };
        blended_profile.push(self.profile(family, &extremal, sign), weight);
        blended_profile
    }

    fn profile(&self, family: &ExtremalFamily, extremal: &Extremal, sign: f64) -> Profile {
        let times = family.phases(extremal);
        if self.bounds.smooth {
            Profile::jerks(times, sign)
        } else {
            let bounds = if sign < 0.0 {
                self.bounds.mirrored()
            } else {
                self.bounds
            };
            Profile::accelerations(times, sign * bounds.rise, -sign * bounds.fall)
        }
    }
}

/// The cube root to a few percent, as fast as a division: a third of the exponent.
fn rough_cube_root(value: f64) -> f64 {
    f64::from_bits(value.to_bits() / 3 + 0x2a9f_7893_0000_0000)
}

/// Durations after which the velocity and acceleration of `end` can be reached from `start`
/// within acceleration and jerk bounds, whatever the position.
///
/// # Source
/// The change of velocity in time T is largest for a pulse of height c = (T + a0 + af)/2, that is
/// c² - (a0² + af²)/2 without plateau; likewise the smallest in the mirror.
pub(crate) fn velocity_windows(start: End, end: End, bounds: Bounds) -> Windows {
    let (a0, af) = (start.acceleration, end.acceleration);
    let shortest = (af - a0).abs();
    let change = end.velocity - start.velocity;
    let half = 0.5 * (a0 * a0 + af * af);
    let rounding = 0.1 * SLACK * (1.0 + start.velocity.abs() + end.velocity.abs());
    // A start on the last phase: nothing is added to the direct motion.
    let snap = |square: f64, highest: f64| {
        let straight = highest * highest;
        if (square - straight).abs() <= rounding {
            straight
        } else {
            square
        }
    };
    let up = snap(change + half, a0.max(af));
    let down = snap(half - change, (-a0).max(-af));
    let (up_first, up_next) = pulse_windows(up, bounds.rise, a0, af);
    let (down_first, down_next) = pulse_windows(down, bounds.fall, -a0, -af);
    let (up_next, down_next) = (up_next.max(shortest), down_next.max(shortest));
    let window = |from: f64, last: f64| {
        (from <= last + 1e-14 * (1.0 + last)).then_some((from, last.max(from)))
    };
    let early = match (up_first, down_first) {
        (Some(last), _) => window(down_next, last),
        (_, Some(last)) => window(up_next, last),
        _ => None,
    };
    Windows {
        early,
        late: up_next.max(down_next),
    }
}

/// The durations for which the largest change of velocity is at least the wanted: up to the first
/// (if there are such), and from the second on.
fn pulse_windows(square: f64, bound: f64, a0: f64, af: f64) -> (Option<f64>, f64) {
    if square <= 0.0 {
        return (None, 0.0);
    }
    let height = square.sqrt();
    let bound = bound.max(a0).max(af);
    let next = if height <= bound {
        height
    } else {
        0.5 * (square / bound + bound)
    };
    let first = (a0.max(af) <= -height).then_some(-2.0 * height - a0 - af);
    (first, 2.0 * next - a0 - af)
}

/// A distance to be reached, and how exactly it is known.
#[derive(Clone, Copy)]
struct Goal {
    distance: f64,
    slack: f64,
}

/// A time, and the distance beyond the goal that is reached then.
#[derive(Clone, Copy)]
struct Excess {
    time: f64,
    distance: f64,
}

/// The first time in `from..=last` at which a member of the family gets at least as far as the goal.
///
/// The slope of the distance falls, then rises (until the velocity bound is reached, where it is
/// constant and positive): there is at most one hump before the last rise.
fn first_above(family: &ExtremalFamily, goal: Goal, from: f64, last: f64) -> Option<f64> {
    let Goal {
        distance: goal,
        slack,
    } = goal;
    let here = family.at(from);
    if here.distance >= goal - slack - family.noise(&here) {
        return Some(from);
    }
    let excess = |time: f64, distance: f64| Excess {
        time,
        distance: distance - goal,
    };
    let below = excess(from, here.distance);
    let until = |time: f64, distance: f64| root(family, goal, below, excess(time, distance));
    if !here.crossing
        && here.slope > 0.0
        && let Some(top) = hump(family, from, last)
    {
        let distance = family.at(top).distance;
        if distance >= goal {
            return Some(until(top, distance));
        }
    }
    if last.is_finite() {
        let distance = family.at(last).distance;
        return (distance >= goal).then(|| until(last, distance));
    }
    let cruise = family.cruise_time();
    if !cruise.is_finite() {
        return unbounded_root(family, goal, below);
    }
    let end = cruise.max(from);
    let distance = family.at(end).distance;
    if distance <= goal {
        return Some(end + (goal - distance) / family.top());
    }
    Some(until(end, distance))
}

/// The root where velocity has no bound: double the time until it is enclosed.
fn unbounded_root(family: &ExtremalFamily, goal: f64, below: Excess) -> Option<f64> {
    let mut step = 1.0 + below.time;
    for _ in 0..1100 {
        let time = below.time + step;
        let distance = family.at(time).distance - goal;
        if distance >= 0.0 {
            return Some(root(family, goal, below, Excess { time, distance }));
        }
        step *= 2.0;
    }
    None
}

/// The time of the local maximum of the distance in `from..=last`, if there is one.
fn hump(family: &ExtremalFamily, from: f64, last: f64) -> Option<f64> {
    let (mut low, mut high) = (from, family.slowest(from).min(last));
    if family.at(high).slope >= 0.0 {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if family.at(middle).slope > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}

/// The time between `below` (not far enough) and `above` (far enough) at which `goal` is reached.
fn root(family: &ExtremalFamily, goal: f64, below: Excess, above: Excess) -> f64 {
    let (mut low, mut high) = (below.time, above.time);
    let width = above.distance - below.distance;
    // Without limits but jerk, distance grows with the cube of time.
    let share = if width > 0.0 {
        -below.distance / width
    } else {
        1.0
    };
    let mut time = (low + (high - low) * rough_cube_root(share.max(0.0))).min(high);
    for _ in 0..100 {
        let here = family.at(time);
        let error = here.distance - goal;
        if error >= 0.0 {
            high = time;
        } else {
            low = time;
        }
        let step = error / here.slope;
        if step.abs() <= 4.0 * f64::EPSILON * time || high - low <= f64::EPSILON * high {
            return if error >= 0.0 || step.abs() <= 4.0 * f64::EPSILON * time {
                time
            } else {
                high
            };
        }
        let newton = time - step;
        time = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
    }
    high
}
