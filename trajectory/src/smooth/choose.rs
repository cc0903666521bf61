//! The fastest certified motion through one window of poses.

use nalgebra::Isometry3;

use super::certificate::{Certificate, certify};
use super::crossing::{Crossing, RESOLUTION, settled};
use super::exact_stop;
use super::options::SmoothOptions;
use super::plan::Method;
use super::span::Span;
use super::spline::{self, Effort, Moving, Request};

/// Effort of one spline: a time within 0.1 % of the optimum.
const EFFORT: Effort = Effort {
    steps: 90,
    search: 72,
    spread: Some(1.0),
    gap: 3e-3,
    most: f64::INFINITY,
};

/// An attempt that breaks a bound by more than this (its first, a later one)
/// is not followed by another.
const HOPELESS: [f64; 2] = [10.0, 3.5];

/// Spread of a start in motion that was too fast.
const SPREAD: f64 = 1.2;

/// Fraction of the speed limit used by splines that others follow: the hull of a start in motion on
/// a bend is a little larger than the speed.
const JOIN_SPEED: f64 = 0.998;

/// A certified motion through a window.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pub(crate) spans: Vec<Span>,
    /// How each part was made, and how many spans it has.
    pub(crate) parts: Vec<(Method, usize)>,
}

impl Motion {
    fn new(spans: Vec<Span>, method: Method) -> Self {
        let parts = if spans.is_empty() {
            Vec::new()
        } else {
            vec![(method, spans.len())]
        };
        Self { spans, parts }
    }

    /// Time of the motion, s.
    pub(crate) fn duration(&self) -> f64 {
        self.spans.last().map_or(0.0, Span::end)
    }

    /// Adds a motion that starts where this one ends.
    pub(crate) fn append(&mut self, other: Motion) {
        let offset = self.duration();
        self.spans.extend(other.spans.into_iter().map(|mut span| {
            span.start += offset;
            span
        }));
        self.parts.extend(other.parts);
    }
}

/// What comes after a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Then {
    /// Nothing: the last pose is the goal.
    Stop,
    /// More motion, which must not change how the earlier poses were passed.
    More,
}

/// Fastest certified motion from rest in the first pose to rest in the last.
pub(crate) fn from_rest(poses: &[Isometry3<f64>], options: &SmoothOptions, then: Then) -> Motion {
    let stop = corners(poses, options);
    if poses.len() < 3 {
        return stop;
    }
    if let Some(spans) = spline(poses, options, (None, then), stop.duration())
        && spans.last().map_or(0.0, Span::end) <= stop.duration()
    {
        return Motion::new(spans, Method::Spline);
    }
    // A stop in the middle splits the window into two easier ones.
    let middle = poses.len() / 2;
    let mut halves = from_rest(&poses[..=middle], options, Then::More);
    halves.append(from_rest(&poses[middle..], options, then));
    if halves.duration() < stop.duration() {
        halves
    } else {
        stop
    }
}

/// Straight legs with a stop at each corner. There is no stop at poses on a straight line, unless
/// the tolerance requires a stop at every pose.
pub(crate) fn corners(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Motion {
    let spans = if options.tolerance > RESOLUTION {
        exact_stop::plan(&exact_stop::corners(poses), &options.limits)
    } else {
        exact_stop::plan(poses, &options.limits)
    };
    Motion::new(spans, Method::ExactStop)
}

/// Certified spline from a state in motion to rest in the last pose, if one is
/// found that takes at most `most` seconds. The first pose is the one passed
/// last.
pub(crate) fn from_motion(
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    (moving, then): (&Moving, Then),
    most: f64,
) -> Option<Motion> {
    let spans = spline(poses, options, (Some(moving), then), most)?;
    (spans.last()?.end() <= most).then(|| Motion::new(spans, Method::Spline))
}

/// A certified spline of at most about `most` seconds; bounds that a first
/// attempt breaks are narrowed for the next one.
fn spline(
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    (moving, then): (Option<&Moving>, Then),
    most: f64,
) -> Option<Vec<Span>> {
    if options.tolerance <= RESOLUTION || options.corridor() <= RESOLUTION {
        return None;
    }
    let mut inner = options.clone();
    if then == Then::More {
        inner.limits.speed *= JOIN_SPEED;
        inner.limits.angular_speed *= JOIN_SPEED;
    }
    let full = Effort { most, ..EFFORT };
    let (mut coupled, mut effort) = (None, full);
    for attempt in 0..5_usize {
        let narrowed = inner.clone();
        let mut request = Request {
            poses,
            options: &narrowed,
            moving,
            effort,
            coupled: false,
        };
        request.coupled = coupled.unwrap_or(!request.can_follow());
        let Some(mut spans) = spline::plan(&request) else {
            if moving.is_some() && effort.spread.is_some() {
                effort.spread = effort.spread.filter(|x| *x < SPREAD).map(|_| SPREAD);
            } else if !request.coupled && request.moves()[1] {
                (coupled, effort) = (Some(true), full);
            } else {
                return None;
            }
            continue;
        };
        let (mut certificate, mut crossings) = certify(&spans, poses, options);
        let over = certificate.worst_limit();
        if over > 1.0 && over < 1.3 && moving.is_none() {
            stretch(&mut spans, certificate.stretch() * (1.0 + 1e-12));
            (certificate, crossings) = certify(&spans, poses, options);
        }
        let settled = then == Then::Stop || settled(&spans, poses, &crossings, options);
        if certificate.holds() && settled {
            return Some(spans);
        }
        // Narrower bounds make it slower still.
        let slow = spans.last().map_or(0.0, Span::end) > most;
        let last = request.coupled || !request.moves()[1];
        if last && (slow || broken(&certificate, &crossings) > HOPELESS[attempt.min(1)]) {
            return None;
        }
        narrow(&mut inner, &certificate, &crossings, request.coupled);
        if certificate.in_order && !settled {
            inner.tolerance *= 0.5;
        }
        coupled = Some(request.coupled || ((attempt == 1 || over > 1.3) && request.moves()[1]));
    }
    None
}

/// The greatest ratio of a quantity to its bound.
fn broken(certificate: &Certificate, crossings: &[Crossing]) -> f64 {
    let miss = |crossing: &Crossing| {
        (crossing.deviation / crossing.tolerance)
            .max(crossing.angle / crossing.angular_tolerance.max(RESOLUTION))
    };
    let bounds = [certificate.corridor.ratio, certificate.worst_limit()];
    bounds
        .into_iter()
        .chain(crossings.iter().map(miss))
        .fold(0.0, f64::max)
}

/// Narrows the options by what a motion exceeded.
fn narrow(
    options: &mut SmoothOptions,
    certificate: &Certificate,
    crossings: &[Crossing],
    coupled: bool,
) {
    if certificate.corridor.ratio > 1.0 {
        options.corridor = Some(options.corridor() * 0.98 / certificate.corridor.ratio.min(4.0));
    }
    let (mut far, mut turned) = (1.0_f64, 1.0_f64);
    for crossing in crossings.iter().filter(|crossing| !crossing.holds()) {
        far = far.max(crossing.deviation / crossing.tolerance);
        turned = turned.max(crossing.angle / crossing.angular_tolerance);
    }
    if turned > 1.0 && coupled {
        options.angular_tolerance = Some(options.angular_tolerance() * 0.9 / turned.min(10.0));
    } else {
        // An orientation that follows the path cuts corners as the path does.
        far = far.max(turned);
    }
    if far > 1.0 {
        options.tolerance *= 0.9 / far.min(10.0);
    }
    let over = certificate.worst_limit();
    if over > 1.0 {
        let limits = &mut options.limits;
        for limit in [
            &mut limits.angular_speed,
            &mut limits.angular_acceleration,
            &mut limits.angular_jerk,
        ] {
            *limit *= 0.99 / over.min(4.0);
        }
        for limit in [
            &mut limits.speed,
            &mut limits.acceleration,
            &mut limits.jerk,
        ] {
            *limit *= 0.99 / over.min(4.0);
        }
    }
}

/// Slows a motion down by a factor; its path does not change.
fn stretch(spans: &mut [Span], factor: f64) {
    for span in spans {
        span.start *= factor;
        span.duration *= factor;
        let mut scale = 1.0;
        for k in 0..5 {
            span.point[k] /= scale;
            for turn in &mut span.turns {
                turn.angle[k] /= scale;
            }
            scale *= factor;
        }
    }
}
