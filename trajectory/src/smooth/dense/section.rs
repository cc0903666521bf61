//! A part of a dense list that begins and ends at rest.

use nalgebra::Isometry3;

use super::chords::Chords;
use super::curve::Curve;
use super::fit::{Balls, Fit, Orientation};
use super::places::Units;
use super::spans::spans_along;
use super::time_parameter::TimeParameter;
use crate::smooth::certificate::{Certificate, certify_slowed};
use crate::smooth::choose::{Then, Window, corners, from_rest};
use crate::smooth::crossing::Crossing;
use crate::smooth::method::Method;
use crate::smooth::motion::Motion;
use crate::smooth::options::SmoothOptions;
use crate::smooth::rest::RestCause;
use crate::smooth::span::Span;
use crate::smooth::tool_law::tool_law;
use crate::timing::Timed;
use crate::{Boundary, TimingOptions, ToolLimits};

/// Times that the curve is fitted over the time of the law before, at most.
const REFITS: usize = 8;
/// Shares of the time that the first refit and a later one have to gain for another one to be worth while.
const GAINS: [f64; 2] = [1e-3, 5e-3];
/// A refit with this many times fewer knots than the first fit may have too few.
const MANY: usize = 3;
/// Times that a section is fitted with smaller balls where they were missed.
const ATTEMPTS: usize = 8;
/// Knots of a fit in a ramp of the acceleration.
pub(super) const FIT_KNOTS: f64 = 6.0;
/// Most knots of a refit over time, in those of the curve before: with more, where a ramp is very short, a curve waves.
const MOST_KNOTS: f64 = 4.0;
/// Sections of so few poses that cannot be fitted are left to the time-optimal spline.
const FEW: usize = 12;
/// Times that a section is divided, and times where a motion is known that rests nowhere.
const DIVISIONS: usize = 10;
const FEW_DIVISIONS: usize = 3;
/// Poses around one that was missed whose balls become smaller.
const NEAR: usize = 3;
/// A ratio to a limit up to this is met by stretching time; for more a law is computed again with
/// limits that are lower by the ratio, and by this factor, but not below this share.
const STRETCH: f64 = 1.15;
const LOWER: f64 = 0.98;
const LEAST: f64 = 0.2;
/// Factors on the number of knots, one after the other until a fit succeeds.
pub(super) const DENSITIES: [f64; 3] = [1.0, 1.6, 2.6];
/// Where the orientation counts, one after the other, each with all densities.
pub(super) const ORIENTATIONS: [Orientation; 2] = [Orientation::Along, Orientation::AtPoses];

/// A part of a dense list that begins and ends at rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section<'a, const D: usize> {
    poses: &'a [Isometry3<f64>],
    options: &'a SmoothOptions,
    units: Units,
    /// How often it may be divided where a fit fails, and whether it stops at each pose then: else there is no motion.
    divisions: usize,
    stops: bool,
}

/// Why no curve was found.
#[derive(Clone, Copy, Debug)]
enum Failure {
    /// A pose is missed, this one most.
    Missed(usize),
    /// The bounds of the motion are far above its limits: orientations that turn about changing
    /// axes are bounded with room.
    TooFast,
}

/// A curve and its time law.
struct TimedCurve<const D: usize> {
    curve: Curve<D>,
    timed: Timed<1>,
}

impl<'a, const D: usize> Section<'a, D> {
    /// The section through `poses`, which may be `divided` as often as needed where a fit fails.
    pub(super) fn new(
        poses: &'a [Isometry3<f64>],
        options: &'a SmoothOptions,
        (units, divided): (Units, bool),
    ) -> Self {
        Self {
            poses,
            options,
            units,
            divisions: if divided { DIVISIONS } else { FEW_DIVISIONS },
            stops: divided,
        }
    }

    /// A motion from rest to rest: fitted, or divided where a fit fails; `None` where the way of
    /// planning does not suit the list.
    pub(super) fn motion(self) -> Option<Motion> {
        let last = self.poses.len() - 1;
        if last < 2 {
            return Some(corners(self.poses, self.options));
        }
        match self.fitted() {
            Ok(motion) => Some(motion),
            Err(Failure::TooFast) => None,
            Err(_) if self.divisions == 0 && !self.stops => None,
            Err(_) if last < FEW => Some(from_rest(&Window::from_rest(
                self.poses,
                self.options,
                Then::More,
            ))),
            Err(_) if self.divisions == 0 => Some(corners(self.poses, self.options)),
            Err(Failure::Missed(worst)) => {
                let at = worst.clamp(1, last - 1);
                let part = |poses| Section {
                    poses,
                    divisions: self.divisions - 1,
                    ..self
                };
                let mut motion = part(&self.poses[..=at]).motion()?;
                motion.append(part(&self.poses[at..]).motion()?, RestCause::Division);
                motion.eased = true;
                Some(motion)
            }
        }
    }

    /// A certified motion along one curve; the knots are closer together where that fails.
    fn fitted(&self) -> Result<Motion, Failure> {
        let points = self.units.points::<D>(self.poses);
        let chords = Chords::new(&points);
        let parameters = chords.parameters(&points);
        // Where the tolerance shows the corner at each pose, the curve is not nearly known; orientations
        // are better fitted all the same.
        let coarse = chords.shows_corners(&points);
        let mut failure = Failure::Missed(self.poses.len() / 2);
        let ways = ORIENTATIONS.map(|way| DENSITIES.map(|density| (density, way)));
        for (density, orientation) in ways.into_iter().flatten() {
            if D == 3 && orientation == Orientation::AtPoses {
                continue;
            }
            match self.fitted_with(&parameters, density, orientation) {
                Ok(mut motion) => {
                    motion.eased |= coarse;
                    return Ok(motion);
                }
                Err(error) => failure = error,
            }
        }
        Err(failure)
    }

    /// The same with `density` times as many knots as the chords need.
    fn fitted_with(
        &self,
        parameters: &[f64],
        density: f64,
        orientation: Orientation,
    ) -> Result<Motion, Failure> {
        let radii = vec![1.0; self.poses.len()];
        let mut balls = Balls { radii, orientation };
        let (mut limits, mut eased) = (self.limits(), false);
        let mut best = self.first(&scaled(parameters, density), density, &balls)?;
        let mut failure = Failure::Missed(self.poses.len() / 2);
        for attempt in 0..ATTEMPTS {
            let (spans, certificate, crossings) = self.certified(&best);
            if certificate.holds() {
                return Ok(Motion {
                    eased,
                    retried: attempt > 0 || density > 1.0,
                    ..Motion::new(spans, Method::Fit)
                });
            }
            if certificate.worst_limit() > STRETCH {
                (failure, eased) = (Failure::TooFast, true);
                lower(&mut limits, &certificate);
                best.timed = self.law(&best.curve, &limits)?;
                continue;
            }
            if let Some(worst) = self.narrow(&mut balls.radii, &certificate, &crossings) {
                failure = Failure::Missed(worst);
            }
            best = self.timed(&best.curve.fit.parameters, &balls, &limits)?;
        }
        Err(failure)
    }

    /// A curve over the time of its own law, as far as that helps.
    fn first(
        &self,
        parameters: &[f64],
        density: f64,
        balls: &Balls,
    ) -> Result<TimedCurve<D>, Failure> {
        let limits = self.limits();
        let mut best = self.timed(parameters, balls, &limits)?;
        let many = best.curve.fit.spans();
        // A tight bend takes little time, so it may need more knots over time than over its chords. Orientations may turn
        // between poses then, which poses on the legs do not allow.
        let mut densities = &DENSITIES[..if D == 3 { DENSITIES.len() } else { 1 }];
        for round in 0..REFITS {
            let before = best.timed.certificate.duration;
            let refitted = |more: &f64| {
                let parameters = self.time_parameters(&best, [density, *more]);
                self.timed(&parameters, balls, &limits).ok()
            };
            let faster = |next: &TimedCurve<D>| next.timed.certificate.duration < before;
            if let Some(next) = densities.iter().find_map(refitted).filter(faster) {
                best = next;
            }
            let gain = GAINS[usize::from(round > 0)];
            if best.timed.certificate.duration <= before * (1.0 - gain) {
                continue;
            }
            // A curve of far fewer knots than the first may be too stiff.
            let stiff = MANY * best.curve.fit.spans() < many;
            match densities {
                [_, more @ ..] if stiff && !more.is_empty() => densities = more,
                _ => break,
            }
        }
        Ok(best)
    }

    /// The spans of the motion along a curve, slowed down by a little where their bounds are above a
    /// limit, with their certificate and passes.
    fn certified(&self, best: &TimedCurve<D>) -> (Vec<Span>, Certificate, Vec<Crossing>) {
        let mut spans = self.spans(best);
        let (certificate, crossings) =
            certify_slowed(&mut spans, (self.poses, false), self.options, STRETCH);
        (spans, certificate, crossings)
    }

    /// The limits of the tool that rule the time law.
    fn limits(&self) -> ToolLimits {
        let mut limits = self.options.limits;
        if D == 3 {
            limits.angular_speed = f64::INFINITY;
            limits.angular_acceleration = f64::INFINITY;
            limits.angular_jerk = f64::INFINITY;
        }
        limits
    }

    /// A curve that passes the poses about at `parameters`, with its law, or the pose at which that
    /// fails.
    fn timed(
        &self,
        parameters: &[f64],
        balls: &Balls,
        limits: &ToolLimits,
    ) -> Result<TimedCurve<D>, Failure> {
        let points = self.units.points::<D>(self.poses);
        let fit = Fit::new(&points, parameters, balls).map_err(Failure::Missed)?;
        let curve = Curve::new(fit, self.units, &self.poses[0]);
        let timed = self.law(&curve, limits)?;
        Ok(TimedCurve { curve, timed })
    }

    /// The fastest law of a curve.
    fn law(&self, curve: &Curve<D>, limits: &ToolLimits) -> Result<Timed<1>, Failure> {
        let options = TimingOptions {
            start: Boundary::Rest,
            end: Boundary::Rest,
            ..TimingOptions::default()
        };
        tool_law(curve, limits, &options).map_err(|_| Failure::Missed(self.poses.len() / 2))
    }

    /// Parameters for the poses that run like the time of a law.
    fn time_parameters(&self, best: &TimedCurve<D>, [density, more]: [f64; 2]) -> Vec<f64> {
        let ramp = self.options.limits.acceleration / self.options.limits.jerk;
        let law = &best.timed.law;
        let timed = (|time| law.sample(time).position[0], law.duration());
        let knots = [density * more * FIT_KNOTS, more * MOST_KNOTS];
        TimeParameter::new(&best.curve, timed, ramp, knots).map(&best.curve.fit.parameters)
    }

    /// Spans of the motion along a curve.
    fn spans(&self, best: &TimedCurve<D>) -> Vec<Span> {
        let law = &best.timed.law;
        let pose = |time: f64| best.curve.pose(law.sample(time).position[0]);
        let ends = [&self.poses[0], &self.poses[self.poses.len() - 1]];
        let near = (self.units.length, self.options);
        spans_along(&pose, law.duration(), ends, near)
    }

    /// Makes the balls smaller where a motion missed them or left the corridor; the pose that is
    /// worst.
    fn narrow(
        &self,
        radii: &mut [f64],
        certificate: &Certificate,
        crossings: &[Crossing],
    ) -> Option<usize> {
        let mut worst: Option<(f64, usize)> = None;
        let mut miss = |index: usize, over: f64| {
            let near = index.saturating_sub(NEAR)..(index + NEAR + 1).min(radii.len());
            for radius in &mut radii[near] {
                *radius *= (0.95 / over).max(0.5);
            }
            if worst.is_none_or(|(most, _)| over > most) {
                worst = Some((over, index));
            }
        };
        for crossing in crossings.iter().filter(|crossing| !crossing.holds()) {
            let far = crossing.deviation / crossing.tolerance;
            miss(
                crossing.index,
                far.max(crossing.angle / crossing.angular_tolerance),
            );
        }
        if certificate.corridor.ratio > 1.0 {
            let after =
                crossings.partition_point(|crossing| crossing.time <= certificate.corridor.time);
            miss(after, certificate.corridor.ratio);
        }
        worst.map(|(_, index)| index)
    }
}

/// Lowers the limits that a motion exceeds.
fn lower(limits: &mut ToolLimits, certificate: &Certificate) {
    for (limit, peak) in [
        (&mut limits.speed, certificate.speed),
        (&mut limits.acceleration, certificate.acceleration),
        (&mut limits.jerk, certificate.jerk),
        (&mut limits.angular_speed, certificate.angular_speed),
        (
            &mut limits.angular_acceleration,
            certificate.angular_acceleration,
        ),
        (&mut limits.angular_jerk, certificate.angular_jerk),
    ] {
        if peak.ratio > 1.0 {
            *limit *= (LOWER / peak.ratio).max(LEAST);
        }
    }
}

/// Parameters that have so many times the knots.
pub(super) fn scaled(parameters: &[f64], density: f64) -> Vec<f64> {
    let end = parameters.last().copied().unwrap_or(1.0);
    let factor = (density * end).round() / end;
    parameters.iter().map(|x| x * factor).collect()
}
