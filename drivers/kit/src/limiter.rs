//! The limiter of a joint: its reference keeps the limits, whatever setpoint is received.
//!
//! The state of a joint is its last reference. In one period the joint can reach the positions
//! between two motions: the fastest towards its largest downward speed and the fastest towards its
//! largest upward speed. Each mixture of the two keeps speed, acceleration and jerk limits. So one
//! number per period is chosen: the share of the mixture. A share is refused if even the hardest
//! braking after it would pass an end of the range; the hardest braking itself is always possible.
//! Where less speed is allowed near the ends of the range, a share is refused too if the hardest braking
//! after it would be too fast there.
//! A setpoint that continues the last reference within the limits is used as it is, bit for bit.
//!
//! # Source
//! Own derivation. The share is chosen so that the distance to the target, with its rate of change
//! braked as fast as allowed, ends at zero: the switching surface of a third-order time-optimal
//! law, as in R. Zanasi, C. Guarino Lo Bianco, A. Tonielli, "Nonlinear filters for the generation
//! of smooth trajectories", Automatica 36(3), 2000.

use crate::{NearEnds, Ramp, Reference};

/// Room for rounding, as a share of a limit.
const ROUNDING: f64 = 1e-3;

/// Tolerance for rounding (rad, rad/s), and at an end of the range (rad).
const SMALL: f64 = 1e-9;
const AT_END: f64 = 1e-6;

/// Tolerance for rounding of moments of the jerk, as a share, and of positions (rad).
const TINY: f64 = 1e-6;
const ROUNDED: f64 = 1e-13;

/// Fraction of the jerk limit, and least fraction of the acceleration limit, used to approach the
/// target; the rest is for the motion of the target itself.
const CLOSING: [f64; 2] = [0.3, 0.2];

/// Bisection steps of a share: to a 64 000th for an end of the range, to floating-point precision
/// for a target.
const COARSE: u32 = 16;
const FINE: u32 = 44;

/// Places at which braking is compared with the speed that is allowed, in each of its two parts.
const PARTS: usize = 8;

/// The limits of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limiter {
    /// Lower and upper end of the range (rad).
    pub(crate) range: [f64; 2],
    /// Largest speed (rad/s).
    pub(crate) velocity: f64,
    /// Largest acceleration (rad/s²).
    pub(crate) acceleration: f64,
    /// Largest jerk (rad/s³).
    pub(crate) jerk: f64,
    /// Less speed near the ends of the range.
    pub(crate) near_ends: Option<NearEnds>,
}

impl Limiter {
    /// One period (s) from `from` towards `target`, the wanted state at its end.
    pub(crate) fn approach(&self, from: &Reference, target: &Reference, period: f64) -> Reference {
        if self.follows(from, target, period) {
            return *target;
        }
        let [low, high] = self.extremes(from, period);
        let acceleration =
            (self.acceleration - target.acceleration.abs()).max(CLOSING[1] * self.acceleration);
        let closing = [acceleration, CLOSING[0] * self.jerk];
        // The distance beyond the target at which its rate of change, braked from now on, reaches
        // zero.
        let beyond = |share: f64| {
            let distance = low.mixed(&high, share).beyond(target);
            Ramp::new(&distance, 0.0, closing).end(&distance)
        };
        let share = if beyond(0.0) >= 0.0 {
            0.0
        } else if beyond(1.0) <= 0.0 {
            1.0
        } else {
            before_share(|share| beyond(share) > 0.0, FINE)
        };
        self.within_range(&low, &high, share)
    }

    /// One period (s) without a new setpoint: braking continues, a constant speed is kept, and the
    /// joint brakes early enough to rest within the range.
    pub(crate) fn go_on(&self, from: &Reference, period: f64) -> Reference {
        let (acceleration, velocity) = (from.acceleration, from.velocity);
        let next = if acceleration * velocity < 0.0 {
            let bounds = [acceleration.abs().min(self.acceleration), self.jerk];
            Ramp::new(from, 0.0, bounds).sample(from, period)
        } else {
            let speed = from.coasting_speed(self.jerk);
            let speed = speed.clamp(-self.velocity, self.velocity);
            Ramp::new(from, speed, self.bounds()).sample(from, period)
        };
        let [lower, upper] = self.range;
        let rest = Ramp::new(&next, 0.0, self.bounds()).end(&next);
        if rest < lower || rest > upper {
            return self.stop(from, period);
        }
        self.or_brake(from, next, period)
    }

    /// One period (s) of the fastest stop within the range.
    pub(crate) fn stop(&self, from: &Reference, period: f64) -> Reference {
        let next = Ramp::new(from, 0.0, self.bounds()).sample(from, period);
        self.or_brake(from, next, period)
    }

    /// `next`, or the hardest braking if only that stays within the range.
    fn or_brake(&self, from: &Reference, next: Reference, period: f64) -> Reference {
        let [low, high] = self.extremes(from, period);
        if !self.stays_below(&next, AT_END) {
            low
        } else if !self.stays_above(&next, AT_END) {
            high
        } else {
            next
        }
    }

    fn bounds(&self) -> [f64; 2] {
        [self.acceleration, self.jerk]
    }

    /// The lowest and the highest that can be reached in a period (s).
    fn extremes(&self, from: &Reference, period: f64) -> [Reference; 2] {
        [-self.velocity, self.velocity]
            .map(|speed| Ramp::new(from, speed, self.bounds()).sample(from, period))
    }

    /// Whether `next` is a motion of one period (s) from `from` within all limits, after which the
    /// limits can still be kept.
    fn follows(&self, from: &Reference, next: &Reference, period: f64) -> bool {
        let room = 1.0 + ROUNDING;
        next.velocity.abs() <= self.velocity * room
            && next.acceleration.abs() <= self.acceleration * room
            && self.keeps_jerk(from, next, period)
            && self.keeps_acceleration(from, next, period)
            && self.stays_below(next, AT_END)
            && self.stays_above(next, AT_END)
    }

    /// Whether a motion within the jerk limit leads from one to the other in a period (s): then differences of positions
    /// keep it too. `u` is the share of the jerk between its limits over the time of the period, both from 0 to 1; its
    /// moments are those that the change of acceleration, velocity and position ask for.
    ///
    /// # Source
    /// Moments of a density between 0 and 1 (A. A. Markov): M. G. Krein, A. A. Nudelman, "The Markov moment problem and
    /// extremal problems", 1977; with the first two given, the third is least for an interval and largest for
    /// the rest of one.
    fn keeps_jerk(&self, from: &Reference, next: &Reference, period: f64) -> bool {
        let jerk = self.jerk * (1.0 + ROUNDING);
        let gained = next.acceleration - from.acceleration;
        let sped = next.velocity - from.velocity - from.acceleration * period;
        let halfway = from.velocity + from.acceleration * period / 2.0;
        let moved = next.position - from.position - halfway * period;
        let per_period = jerk * period;
        let zeroth = (gained / per_period + 1.0) / 2.0;
        let first = zeroth - (sped / (per_period * period) + 0.5) / 2.0;
        let last = moved / (per_period * period * period) + 1.0 / 6.0;
        let second = last - zeroth + 2.0 * first;
        // An interval of that length and centre, if it fits into the period.
        let least = |zeroth: f64, first: f64| {
            let wide = zeroth.clamp(0.0, 1.0);
            let centre = if wide > TINY { first / wide } else { 0.5 };
            let fits = (centre - 0.5).abs() <= (1.0 - wide) / 2.0 + TINY;
            fits.then_some(wide * (centre * centre + wide * wide / 12.0))
        };
        let most = least(1.0 - zeroth, 0.5 - first).map(|rest| 1.0 / 3.0 - rest);
        let room = TINY + ROUNDED / (per_period * period * period);
        let inside = -room <= zeroth && zeroth <= 1.0 + room;
        inside
            && least(zeroth, first).is_some_and(|least| second >= least - room)
            && most.is_some_and(|most| second <= most + room)
    }

    /// Whether the acceleration limit holds within the period too, so that differences of positions keep
    /// it: a controller may measure these.
    fn keeps_acceleration(&self, from: &Reference, next: &Reference, period: f64) -> bool {
        let most = self.acceleration * (1.0 + ROUNDING) * period;
        let (moved, half) = (next.position - from.position, most * period / 2.0 + SMALL);
        (next.velocity - from.velocity).abs() <= most + SMALL
            && (moved - from.velocity * period).abs() <= half
            && (moved - next.velocity * period).abs() <= half
    }

    /// The mixture of `low` and `high` that is nearest to `share` and can stay within the range.
    fn within_range(&self, low: &Reference, high: &Reference, share: f64) -> Reference {
        let wanted = low.mixed(high, share);
        if !self.stays_below(&wanted, 0.0) {
            let passes = |part: f64| !self.stays_below(&low.mixed(high, part * share), 0.0);
            return low.mixed(high, before_share(passes, COARSE) * share);
        }
        if !self.stays_above(&wanted, 0.0) {
            let part = |part: f64| low.mixed(high, 1.0 - part * (1.0 - share));
            let passes = |value: f64| !self.stays_above(&part(value), 0.0);
            return part(before_share(passes, COARSE));
        }
        wanted
    }

    /// Whether the hardest braking from `from` stays below the upper end plus `room` (rad).
    fn stays_below(&self, from: &Reference, room: f64) -> bool {
        let bounds @ [acceleration, jerk] = self.bounds();
        // A quick bound: the largest distance that fading and braking together take.
        let speed = from.velocity.abs() + from.acceleration * from.acceleration / (2.0 * jerk);
        let most = speed * (speed / (2.0 * acceleration) + 2.0 * acceleration / jerk);
        let end = self.range[1];
        let inside = from.position + most <= end
            || Ramp::new(from, -self.velocity, bounds).top(from) <= end + room;
        inside && self.is_slow_enough(from, (speed, most))
    }

    /// Whether the hardest braking from `from` keeps the speed that is allowed near the upper end; it is
    /// not faster than `speed` (rad/s), and does not go farther than `most` (rad).
    fn is_slow_enough(&self, from: &Reference, (speed, most): (f64, f64)) -> bool {
        let Some(near) = &self.near_ends else {
            return true;
        };
        if speed <= near.upwards(from.position + most) {
            return true;
        }
        let [acceleration, jerk] = self.bounds();
        let ramp = Ramp::new(from, -self.velocity, [acceleration, jerk]);
        let turns = 2.0 * acceleration / jerk;
        let braked = turns + speed / acceleration;
        // First where the braking builds up, then where it lasts.
        let part = |number: usize, time: f64| time * number as f64 / PARTS as f64;
        let times = (0..PARTS).map(|number| part(number, turns));
        let times = times.chain((0..=PARTS).map(|number| turns + part(number, braked - turns)));
        let slow = |at: Reference| at.velocity <= near.upwards(at.position) + SMALL;
        times.into_iter().all(|time| slow(ramp.sample(from, time)))
    }

    /// Whether the hardest braking from `from` stays above the lower end minus `room` (rad).
    fn stays_above(&self, from: &Reference, room: f64) -> bool {
        let [lower, upper] = self.range;
        let range = [-upper, -lower];
        let near_ends = self.near_ends.map(NearEnds::mirrored);
        let mirrored = Self {
            range,
            near_ends,
            ..*self
        };
        mirrored.stays_below(&from.mirrored(), room)
    }
}

/// The largest share in 0..1 for which `is_beyond` is false; above it, it is true. 0 if there is
/// none.
fn before_share(is_beyond: impl Fn(f64) -> bool, halvings: u32) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..halvings {
        let middle = (low + high) / 2.0;
        if is_beyond(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    low
}
