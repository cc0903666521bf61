//! The largest displacement of a joint in a given time, in one direction, in closed form.

/// One direction of the normalised problem of one joint: how far can it get in a given time?
///
/// Unit of jerk 1 (order three) or unit of acceleration 1 (order two). The other direction is the
/// same problem with every sign changed, see [`ExtremalFamily::new`].
///
/// The profile that gets farthest rises to an acceleration `high`, falls through zero to `low` and
/// rises to the target's. Follow the line of jerk +1 through the start back to where its
/// acceleration is zero, and the one through the target as well: between these two virtual states
/// the profile is two symmetric pulses. The displacement of a symmetric pulse is its time times the
/// mean of its end velocities. Everything below follows from these two facts.
///
/// # Source
/// Pontryagin's principle for the triple integrator with bounds on acceleration and velocity; the
/// virtual states at zero acceleration are this project's own derivation.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ExtremalFamily {
    /// Velocity of the virtual start and of the virtual end.
    start: f64,
    end: f64,
    /// Accelerations at the real start and end.
    a0: f64,
    af: f64,
    /// Bounds: acceleration up, acceleration down (positive), velocity.
    rise: f64,
    fall: f64,
    top: f64,
    /// Displacement of the virtual parts.
    offset: f64,
    /// Whether jerk is limited (order three).
    smooth: bool,
}

/// Velocity and acceleration at one end of a normalised problem.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct End {
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
}

/// Bounds of a normalised problem; `fall` is positive, `bottom` negative.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bounds {
    pub(crate) rise: f64,
    pub(crate) fall: f64,
    pub(crate) top: f64,
    pub(crate) bottom: f64,
    pub(crate) smooth: bool,
}

impl Bounds {
    /// The same bounds for the motion run backward: rising and falling are exchanged.
    pub(crate) fn reversed(self) -> Self {
        Self {
            rise: self.fall,
            fall: self.rise,
            ..self
        }
    }

    /// The same bounds seen in a mirror.
    pub(crate) fn mirrored(self) -> Self {
        Self {
            rise: self.fall,
            fall: self.rise,
            top: -self.bottom,
            bottom: -self.top,
            smooth: self.smooth,
        }
    }
}

impl End {
    /// The same end seen in a mirror.
    pub(crate) fn mirrored(self) -> Self {
        Self {
            velocity: -self.velocity,
            acceleration: -self.acceleration,
        }
    }
}

/// The profile of one [`ExtremalFamily`] for one time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extremal {
    /// Highest and lowest acceleration of the two pulses.
    pub(crate) high: f64,
    pub(crate) low: f64,
    /// Times of the rising pulse, at constant velocity, and of the falling pulse.
    pub(crate) rising: f64,
    pub(crate) cruise: f64,
    pub(crate) falling: f64,
    /// Velocity between the pulses.
    pub(crate) peak: f64,
    /// Displacement from start to end.
    pub(crate) distance: f64,
    /// Derivative of the distance with respect to the time.
    pub(crate) slope: f64,
    /// The pulses join at zero acceleration and fit both ends: every longer time fits as well.
    pub(crate) settled: bool,
    /// The pulses join at zero acceleration.
    pub(crate) crossing: bool,
}

/// Time and height of the acceleration pulse that changes the velocity by `change` >= 0.
pub(crate) fn pulse(change: f64, bound: f64) -> (f64, f64) {
    if change <= bound * bound {
        let height = change.max(0.0).sqrt();
        (2.0 * height, height)
    } else {
        (change / bound + bound, bound)
    }
}

impl ExtremalFamily {
    /// The direction of increasing position. For the other one, mirror all three arguments.
    pub(crate) fn new(start: End, end: End, bounds: Bounds) -> Self {
        let (v0, a0) = (start.velocity, start.acceleration);
        let (vf, af) = (end.velocity, end.acceleration);
        if !bounds.smooth {
            return Self {
                start: v0,
                end: vf,
                rise: bounds.rise,
                fall: bounds.fall,
                top: bounds.top.max(v0).max(vf),
                ..Self::default()
            };
        }
        let virtual_start = v0 - 0.5 * a0 * a0;
        let virtual_end = vf - 0.5 * af * af;
        let cube = 1.0 / 6.0;
        Self {
            start: virtual_start,
            end: virtual_end,
            a0,
            af,
            rise: bounds.rise.max(a0),
            fall: bounds.fall.max(-af),
            top: bounds
                .top
                .max(v0 + 0.5 * a0 * a0.abs())
                .max(vf - 0.5 * af * af.abs()),
            offset: af * (virtual_end + cube * af * af) - a0 * (virtual_start + cube * a0 * a0),
            smooth: true,
        }
    }

    /// The farthest profile of duration `time`. For times in which the velocities cannot be joined,
    /// the numbers have no meaning (and `settled` is false).
    #[inline]
    pub(crate) fn at(&self, time: f64) -> Extremal {
        let span = time + self.a0 - self.af;
        let free = if self.smooth {
            self.free_smooth(span)
        } else {
            self.free_abrupt(span)
        };
        if free.crossing && free.peak > self.top {
            return self.cruising(span);
        }
        let Free {
            high,
            low,
            rising,
            falling,
            peak,
            crossing,
        } = free;
        let distance = 0.5 * (rising * (self.start + peak) + falling * (peak + self.end));
        let tiny = 1e-14 * (1.0 + time);
        let fits = if self.smooth {
            high >= self.a0 - tiny && low <= self.af + tiny
        } else {
            rising >= -tiny && falling >= -tiny
        };
        Extremal {
            high,
            low,
            rising,
            cruise: 0.0,
            falling,
            peak,
            distance: distance + self.offset,
            slope: peak - 0.5 * high * low,
            settled: crossing && fits,
            crossing,
        }
    }

    /// The profile without a bound on velocity. `span` is the time between the virtual states.
    #[inline]
    fn free_smooth(&self, span: f64) -> Free {
        let change = self.end - self.start;
        let half = 0.5 * span;
        if half <= 1e-14 {
            return self.straight();
        }
        let ratio = change / half;
        let (high, low) = (0.5 * (half + ratio), 0.5 * (ratio - half));
        if high <= self.rise && low >= -self.fall {
            return Free {
                high,
                low,
                rising: 2.0 * high,
                falling: -2.0 * low,
                peak: self.start + high * high,
                crossing: high >= 0.0 && low <= 0.0,
            };
        }
        self.free_bounded(half, change, high > self.rise)
    }

    /// Nothing but jerk +1 from start to end.
    fn straight(&self) -> Free {
        let a0 = self.a0;
        Free {
            high: a0,
            low: a0,
            rising: 2.0 * a0,
            falling: -2.0 * a0,
            peak: self.start + a0 * a0,
            crossing: false,
        }
    }

    /// The same where an acceleration bound is reached; `upper` if the upper one may be.
    fn free_bounded(&self, half: f64, change: f64, upper: bool) -> Free {
        let (rise, fall) = (self.rise, self.fall);
        if upper {
            let low = rise - (2.0 * rise * half - change).max(0.0).sqrt();
            if low >= -fall {
                return Free {
                    high: rise,
                    low,
                    rising: 2.0 * (half + low),
                    falling: -2.0 * low,
                    peak: self.end + low * low,
                    crossing: low <= 0.0,
                };
            }
        }
        let high = (2.0 * fall * half + change).max(0.0).sqrt() - fall;
        if high <= rise {
            return Free {
                high,
                low: -fall,
                rising: 2.0 * high,
                falling: 2.0 * (half - high),
                peak: self.start + high * high,
                crossing: high >= 0.0,
            };
        }
        self.two_plateaus(2.0 * half - rise - fall, rise, fall)
    }

    /// Both accelerations are held. `span` is the time of two pulses without rounded corners.
    fn two_plateaus(&self, span: f64, high: f64, low: f64) -> Free {
        let (rise, fall) = (self.rise, self.fall);
        // (peak - start) / rise + (peak - end) / fall = span
        let gain = (span * fall + self.end - self.start) / (rise + fall);
        let peak = self.start + gain * rise;
        Free {
            high,
            low: -low,
            rising: gain + high,
            falling: (peak - self.end) / fall + low,
            peak,
            crossing: true,
        }
    }

    fn free_abrupt(&self, span: f64) -> Free {
        self.two_plateaus(span, 0.0, 0.0)
    }

    /// The profile that holds the velocity bound for a while.
    fn cruising(&self, span: f64) -> Extremal {
        let (rising, high) = self.pulse_up();
        let (falling, low) = self.pulse_down();
        let cruise = span - rising - falling;
        let top = self.top;
        let distance = 0.5 * (rising * (self.start + top) + falling * (top + self.end));
        Extremal {
            high,
            low: -low,
            rising,
            cruise: cruise.max(0.0),
            falling,
            peak: top,
            distance: distance + cruise * top + self.offset,
            slope: top,
            settled: true,
            crossing: true,
        }
    }

    fn pulse_up(&self) -> (f64, f64) {
        let change = self.top - self.start;
        if self.smooth {
            pulse(change, self.rise)
        } else {
            (change / self.rise, 0.0)
        }
    }

    fn pulse_down(&self) -> (f64, f64) {
        let change = self.top - self.end;
        if self.smooth {
            pulse(change, self.fall)
        } else {
            (change / self.fall, 0.0)
        }
    }

    /// From this time on the velocity bound is reached.
    pub(crate) fn cruise_time(&self) -> f64 {
        self.pulse_up().0 + self.pulse_down().0 - self.a0 + self.af
    }

    /// Velocity bound, raised to what start and end make unavoidable.
    pub(crate) fn top(&self) -> f64 {
        self.top
    }

    /// The rounding error of the distance of `extremal`.
    pub(crate) fn noise(&self, extremal: &Extremal) -> f64 {
        let total = extremal.rising.abs() + extremal.falling.abs() + extremal.cruise;
        let fastest = extremal.peak.abs() + self.start.abs() + self.end.abs();
        16.0 * f64::EPSILON * (total * fastest + self.offset.abs())
    }

    /// The time at which the slope is smallest, while the pulses do not join at zero; `from` if
    /// the slope grows from there on.
    ///
    /// # Source
    /// Zero of the derivative of `slope`: with `k` = change of velocity and `s` = half the span,
    /// slope = mean + 3 s²/8 + k²/(8 s²), so s⁴ = k²/3; on a plateau low = rise/4 or
    /// high = -fall/4.
    pub(crate) fn slowest(&self, from: f64) -> f64 {
        if !self.smooth {
            return from;
        }
        let change = self.end - self.start;
        let half = (change.abs() / 3f64.sqrt()).sqrt();
        if half <= 0.0 {
            return from;
        }
        let ratio = change / half;
        let (high, low) = (0.5 * (half + ratio), 0.5 * (ratio - half));
        let half = if high > self.rise {
            (0.5625 * self.rise * self.rise + change) / (2.0 * self.rise)
        } else if low < -self.fall {
            (0.5625 * self.fall * self.fall - change) / (2.0 * self.fall)
        } else {
            half
        };
        (2.0 * half - self.a0 + self.af).max(from)
    }

    /// The times of the seven phases with jerk +, 0, -, 0, -, 0, +.
    pub(crate) fn phases(&self, e: &Extremal) -> [f64; 7] {
        if !self.smooth {
            return [
                0.0,
                e.rising.max(0.0),
                0.0,
                e.cruise,
                0.0,
                e.falling.max(0.0),
                0.0,
            ];
        }
        // Rounding may put a pulse beyond an end; its two accelerations move together, so that
        // the time between them stays.
        let shift = (self.a0 - e.high).max(0.0) + (self.af - e.low).min(0.0);
        let (high, low) = (e.high + shift, e.low + shift);
        let (third, fifth) = if high >= 0.0 && low <= 0.0 {
            (high, -low)
        } else {
            (high - low, 0.0)
        };
        [
            (high - self.a0).max(0.0),
            (e.rising - 2.0 * e.high).max(0.0),
            third.max(0.0),
            e.cruise,
            fifth.max(0.0),
            (e.falling + 2.0 * e.low).max(0.0),
            (self.af - low).max(0.0),
        ]
    }
}

/// Two pulses without a bound on velocity.
struct Free {
    high: f64,
    low: f64,
    rising: f64,
    falling: f64,
    peak: f64,
    crossing: bool,
}
