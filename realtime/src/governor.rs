//! The one mechanism for pause, resume, override, stop and starvation: the speed along the path.
//!
//! The path factor `l` is planned time per time (time scaling), `r` its derivative, `u` the
//! derivative of `r`, constant within a period. With `q', q'', q'''` the derivatives of the plan
//! with respect to planned time, a joint's velocity is `q' l`, its acceleration `q'' l² + q' r` and
//! its jerk `q''' l³ + 3 q'' l r + q' u`. The plan keeps the limits at `l = 1`, so any constant `l
//! <= 1` keeps them too: that is the safe state. Each period the governor takes the strongest `u`
//! towards its target for which a simulation shows that `r` can be brought back to zero within all
//! limits; if none passes, it continues the ramp that was shown to be safe a period before.
//!
//! # Source
//! The scheme is a reference governor with a verified fallback: E. Gilbert, I. Kolmanovsky,
//! "Nonlinear tracking control in the presence of state and control constraints: a generalized
//! reference governor", Automatica 38(12), 2002; the factor along a path is due to O. Dahl and
//! L. Nielsen, "Torque-limited path following by online trajectory time scaling", IEEE Trans.
//! Robotics and Automation 6(5), 1990. The discrete law is our own.

use crate::approach::{Bounds, next_rate, ramp_periods};
use crate::buffer::{Buffer, Cursor};
use crate::piece::of;
use crate::{JointLimits, Sample};

/// How hard the path factor is changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopCategory {
    /// For pause, resume, override: a full stop takes about a third of a second if the joint limits
    /// allow it.
    Gentle,
    /// For stops: as fast as the joints can.
    Fast,
}

impl StopCategory {
    const fn bounds(self) -> (Bounds, f64) {
        match self {
            Self::Gentle => (
                Bounds {
                    rate: 4.0,
                    change: 60.0,
                },
                0.5,
            ),
            Self::Fast => (
                Bounds {
                    rate: 100.0,
                    change: 20_000.0,
                },
                0.95,
            ),
        }
    }
}

/// How long a ramp back to rate zero may be (s): the look-ahead of the simulation.
const LOOK_AHEAD: f64 = 0.064;

/// How many samples of a ramp are simulated at most.
const SAMPLES: f64 = 64.0;

/// Fractions of the wanted change that are tried, strongest first.
const SHARES: [f64; 3] = [1.0, 0.5, 0.15];

/// The path factor with its rate, and the ramp to rate zero that was shown to be safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Governor {
    /// Planned seconds per second, 0..=1.
    pub(crate) factor: f64,
    /// Its rate (1/s).
    pub(crate) rate: f64,
    /// Periods that the safe ramp still takes.
    ramp: f64,
}

/// What the governor aims at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aim {
    pub(crate) target: f64,
    pub(crate) category: StopCategory,
    pub(crate) period: f64,
}

/// The plan from a place on, and the limits to keep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outlook<'a, const N: usize, const B: usize> {
    pub(crate) buffer: &'a Buffer<N, B>,
    pub(crate) at: Cursor,
    pub(crate) limits: &'a JointLimits<N>,
}

/// A candidate: the rate after this period, and how many periods the ramp to zero takes from there.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    rate: f64,
    ramp: f64,
}

/// A state of the simulation.
#[derive(Clone, Copy, Debug)]
struct ScalingState {
    factor: f64,
    rate: f64,
    change: f64,
}

impl Governor {
    pub(crate) const fn new(factor: f64) -> Self {
        Self {
            factor,
            rate: 0.0,
            ramp: 0.0,
        }
    }

    /// Planned time that passes in a period in which the rate becomes `next` (s).
    fn advance(&self, next: f64, period: f64) -> f64 {
        (self.factor + (2.0 * self.rate + next) * period / 6.0) * period
    }

    /// One period: changes factor and rate, returns the planned time that passes (s).
    pub(crate) fn step<const N: usize, const B: usize>(
        &mut self,
        outlook: &Outlook<'_, N, B>,
        aim: Aim,
    ) -> f64 {
        let settled = self.rate == 0.0 && self.factor == aim.target;
        let choice = if settled {
            Candidate {
                rate: 0.0,
                ramp: 0.0,
            }
        } else {
            self.choose(outlook, aim)
        };
        let passed = self.advance(choice.rate, aim.period);
        self.factor += (self.rate + choice.rate) / 2.0 * aim.period;
        self.rate = choice.rate;
        self.ramp = choice.ramp;
        if self.rate == 0.0 && libm::fabs(self.factor - aim.target) < 1e-9 {
            self.factor = aim.target;
        }
        self.factor = self.factor.clamp(0.0, 1.0);
        passed.max(0.0)
    }

    /// The strongest candidate that passes the simulation, otherwise the ramp that passed before.
    fn choose<const N: usize, const B: usize>(
        &self,
        outlook: &Outlook<'_, N, B>,
        aim: Aim,
    ) -> Candidate {
        let bounds = self.bounds(outlook, aim);
        let wanted = next_rate([self.factor, self.rate], aim.target, bounds, aim.period);
        for share in SHARES {
            let rate = self.rate + (wanted - self.rate) * share;
            let ramp = ramp_periods(rate, bounds.change, aim.period);
            for stretch in [1.0, 2.5] {
                let candidate = Candidate {
                    rate,
                    ramp: libm::ceil(ramp * stretch),
                };
                if self.is_safe(outlook, candidate, aim.period) {
                    return candidate;
                }
            }
        }
        let left = self.ramp - 1.0;
        if left > 0.0 {
            Candidate {
                rate: self.rate * left / self.ramp,
                ramp: left,
            }
        } else {
            Candidate {
                rate: 0.0,
                ramp: 0.0,
            }
        }
    }

    /// Bounds of the rate and its derivative that keep the joints within acceleration and jerk,
    /// computed at this place alone.
    fn bounds<const N: usize, const B: usize>(
        &self,
        outlook: &Outlook<'_, N, B>,
        aim: Aim,
    ) -> Bounds {
        let (mut bounds, share) = aim.category.bounds();
        if let Some(plan) = outlook.buffer.sample(outlook.at) {
            let limits = outlook.limits;
            let limits = limits
                .acceleration
                .as_slice()
                .iter()
                .zip(limits.jerk.as_slice());
            for (speed, (acceleration, jerk)) in plan.velocity.as_slice().iter().zip(limits) {
                let speed = libm::fabs(*speed).max(1e-9);
                bounds.rate = bounds.rate.min(share * acceleration / speed);
                bounds.change = bounds.change.min(share * jerk / speed);
            }
        }
        bounds.rate = bounds.rate.min(bounds.change * LOOK_AHEAD);
        bounds
    }

    /// Whether the candidate's period and the ramp after it keep all limits.
    fn is_safe<const N: usize, const B: usize>(
        &self,
        outlook: &Outlook<'_, N, B>,
        candidate: Candidate,
        period: f64,
    ) -> bool {
        let factor = self.factor + (self.rate + candidate.rate) / 2.0 * period;
        let end = factor + candidate.rate * candidate.ramp * period / 2.0;
        if !(-1e-9..=1.0 + 1e-9).contains(&end) || !(-1e-9..=1.0 + 1e-9).contains(&factor) {
            return false;
        }
        let change = (candidate.rate - self.rate) / period;
        let now = ScalingState {
            factor: self.factor,
            rate: self.rate,
            change,
        };
        let after = ScalingState {
            factor,
            rate: candidate.rate,
            change,
        };
        let (at, starved) = outlook
            .buffer
            .advance(outlook.at, self.advance(candidate.rate, period));
        !starved
            && keeps(outlook, outlook.at, now)
            && keeps(outlook, at, after)
            && ramp_is_safe(&Outlook { at, ..*outlook }, after, candidate.ramp * period)
    }
}

/// Whether a ramp of `duration` (s) from `start` to rate zero keeps all limits.
fn ramp_is_safe<const N: usize, const B: usize>(
    outlook: &Outlook<'_, N, B>,
    start: ScalingState,
    duration: f64,
) -> bool {
    if duration <= 0.0 {
        return true;
    }
    let change = -start.rate / duration;
    let samples = libm::ceil(duration / LOOK_AHEAD * SAMPLES).clamp(4.0, SAMPLES);
    let step = duration / samples;
    let mut pace = ScalingState { change, ..start };
    let mut at = outlook.at;
    for _ in 0..samples as u32 {
        if !keeps(outlook, at, pace) {
            return false;
        }
        let next = pace.rate + change * step;
        let passed = (pace.factor + (2.0 * pace.rate + next) * step / 6.0) * step;
        pace.factor += (pace.rate + next) / 2.0 * step;
        pace.rate = next;
        let (place, starved) = outlook.buffer.advance(at, passed.max(0.0));
        if starved {
            return false;
        }
        at = place;
    }
    pace.rate = 0.0;
    keeps(outlook, at, pace)
}

/// Whether the joints keep velocity, acceleration and jerk at a place with a given state of the
/// path factor. A joint that the plan itself has at its limit may stay there.
fn keeps<const N: usize, const B: usize>(
    outlook: &Outlook<'_, N, B>,
    at: Cursor,
    pace: ScalingState,
) -> bool {
    // The limits must hold between the samples of a simulation too; the peaks of the jerk are
    // there.
    const MARGIN: f64 = 0.97;
    let Some(plan) = outlook.buffer.sample(at) else {
        return false;
    };
    let scaled = scale(&plan, [pace.factor, pace.rate, pace.change]);
    let square = pace.factor * pace.factor;
    let cube = square * pace.factor;
    let limits = outlook.limits;
    let within = |value: f64, limit: f64, plan: f64| {
        let bound = (limit * MARGIN).max(libm::fabs(plan).min(limit)) * (1.0 + 1e-9);
        libm::fabs(value) <= bound
    };
    (0..N).all(|joint| {
        within(
            of(&scaled.acceleration, joint),
            of(&limits.acceleration, joint),
            of(&plan.acceleration, joint) * square,
        ) && within(
            of(&scaled.jerk, joint),
            of(&limits.jerk, joint),
            of(&plan.jerk, joint) * cube,
        )
    })
}

/// A sample of the plan as motion in time, for a path factor with its first and second derivative.
pub(crate) fn scale<const N: usize>(plan: &Sample<N>, [l, r, u]: [f64; 3]) -> Sample<N> {
    Sample {
        position: plan.position,
        velocity: plan.velocity * l,
        acceleration: plan.acceleration * (l * l) + plan.velocity * r,
        jerk: plan.jerk * (l * l * l) + plan.acceleration * (3.0 * l * r) + plan.velocity * u,
    }
}
