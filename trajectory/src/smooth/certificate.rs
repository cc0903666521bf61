//! What is proved of a motion for all times, as data.

use nalgebra::{Isometry3, Vector3};

use super::angular_bounds::{ACTIVE, angular_bounds};
use super::crossing::{self, Crossing, RESOLUTION, backwards, forwards};
use super::options::SmoothOptions;
use super::poly::{halve, hull};
use super::span::{Span, stretch};
use crate::ToolPoint;
use crate::active::Active;
use crate::timing::{ActiveSpan, Limit};

/// Greatest ratio of a quantity to its limit, and when.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peak {
    /// Upper bound of quantity / limit over the whole motion.
    pub ratio: f64,
    /// Middle of the interval in which the bound is reached, s.
    pub time: f64,
}

impl Peak {
    fn raise(&mut self, ratio: f64, time: f64) {
        // NaN must fail the certificate.
        if ratio > self.ratio || ratio.is_nan() {
            *self = Self { ratio, time };
        }
    }
}

/// What holds for all times of a smooth motion, not only at samples: bounds come from the convex
/// hull of Bernstein coefficients.
///
/// # Source
/// Convex hull property and subdivision: G. Farin, "Curves and Surfaces for
/// CAGD", 5th edition 2002, chapter 5.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Certificate {
    /// Each intermediate pose is passed within tolerance, in order, on its
    /// first local closest approach.
    pub in_order: bool,
    /// Distance from the leg travelled / half width of the corridor.
    pub corridor: Peak,
    /// Largest jump of the pose, velocity or acceleration, also from rest at the start and to rest at
    /// the end / what rounding may make of it.
    pub jump: Peak,
    /// Speed of the controlled point / limit.
    pub speed: Peak,
    /// Acceleration of the controlled point / limit.
    pub acceleration: Peak,
    /// Jerk of the controlled point / limit.
    pub jerk: Peak,
    /// Angular speed / limit.
    pub angular_speed: Peak,
    /// Angular acceleration / limit.
    pub angular_acceleration: Peak,
    /// Angular jerk / limit.
    pub angular_jerk: Peak,
    /// The intervals in which a limit is used to 98 % or more, in the order of time; those of
    /// different limits may overlap. Where no limit is active, the tolerance or the corridor limits
    /// the motion, or the change from one limit to the next.
    pub active: Vec<ActiveSpan>,
    /// Time of the motion, s.
    pub duration: f64,
    /// No motion through these poses within these limits and tolerances is
    /// shorter, s.
    pub lower_bound: f64,
}

/// Limits in the order of the ratios.
const LIMITS: [Limit; 6] = [
    Limit::ToolSpeed,
    Limit::ToolAcceleration,
    Limit::ToolJerk,
    Limit::AngularSpeed,
    Limit::AngularAcceleration,
    Limit::AngularJerk,
];

/// Share of a limit by which a quantity may jump: between splines, each solved for itself, rounding is
/// the larger the shorter the knots are.
const JUMP: f64 = 1e-6;
/// Jump of a pose that rounding may make, in the unit of length and rad, for each unit of its distance from
/// the origin.
const POSE_JUMP: f64 = 1e-8;

/// Room for rounding in a ratio: 1 part in 1e9.
const ROUNDING: f64 = 1.0 + 1e-9;

impl Certificate {
    /// True when the order, the tolerances, the corridor and all limits hold, and nothing jumps.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.holds_within(ROUNDING)
    }

    /// The same, but limits may be exceeded up to a ratio.
    pub(super) fn holds_within(&self, ratio: f64) -> bool {
        let whole = self.in_order && self.jump.ratio <= 1.0;
        whole && self.corridor.ratio <= ROUNDING && self.worst_limit() <= ratio
    }

    /// The greatest ratio over the six limits of motion.
    #[must_use]
    pub fn worst_limit(&self) -> f64 {
        let mut worst = Peak::default();
        for peak in self.limits() {
            worst.raise(peak.ratio, 0.0);
        }
        worst.ratio
    }

    /// Duration over its lower bound, 1 at best.
    #[must_use]
    pub fn optimality(&self) -> f64 {
        if self.lower_bound > 0.0 {
            self.duration / self.lower_bound
        } else {
            1.0
        }
    }

    /// The factor by which time must be stretched so that all limits hold; 1 when they do.
    /// Stretching does not change the path.
    pub(crate) fn stretch(&self) -> f64 {
        let second = self
            .acceleration
            .ratio
            .max(self.angular_acceleration.ratio)
            .sqrt();
        let third = self.jerk.ratio.max(self.angular_jerk.ratio).cbrt();
        self.speed
            .ratio
            .max(self.angular_speed.ratio)
            .max(second)
            .max(third)
            .max(1.0)
    }

    fn limits(&self) -> [Peak; 6] {
        [
            self.speed,
            self.acceleration,
            self.jerk,
            self.angular_speed,
            self.angular_acceleration,
            self.angular_jerk,
        ]
    }
}

/// Certificate and passes of a motion.
pub(crate) fn certify(
    spans: &[Span],
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
) -> (Certificate, Vec<Crossing>) {
    let crossings = crossing::crossings(spans, poses, options);
    certify_passes(spans, poses, options, crossings)
}

/// The same of a motion whose passes are known.
fn certify_passes(
    spans: &[Span],
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    crossings: Vec<Crossing>,
) -> (Certificate, Vec<Crossing>) {
    let mut certificate = Certificate {
        duration: spans.last().map_or(0.0, Span::end),
        ..Certificate::default()
    };
    let mut active = Active::new(LIMITS.to_vec(), ACTIVE);
    for span in spans {
        active.add(span.start, &limits_of(span, options, &mut certificate));
    }
    certificate.active = active.finish(certificate.duration);
    certificate.jump = jumps(spans, options);
    certificate.in_order = crossings.iter().all(Crossing::holds);
    certificate.corridor = corridor(spans, poses, &crossings, options.corridor());
    (certificate, crossings)
}

/// The same, `back` if the motion is made from its end to its start: its passes are those that are seen then.
pub(super) fn certify_made(
    spans: &[Span],
    (poses, back): (&[Isometry3<f64>], bool),
    options: &SmoothOptions,
) -> (Certificate, Vec<Crossing>) {
    if !back {
        return certify(spans, poses, options);
    }
    let (reversed, poses) = backwards(spans, poses);
    let (certificate, passes) = certify(&reversed, &poses, options);
    (certificate, forwards(passes, spans))
}

/// The same of a motion that is slowed down by a little first where its bounds are above a limit, by less than a factor
/// `most`.
pub(super) fn certify_slowed(
    spans: &mut [Span],
    poses: (&[Isometry3<f64>], bool),
    options: &SmoothOptions,
    most: f64,
) -> (Certificate, Vec<Crossing>) {
    let first = certify_made(spans, poses, options);
    let over = first.0.worst_limit();
    if over <= 1.0 || over >= most {
        return first;
    }
    stretch(spans, first.0.stretch() * (1.0 + 1e-12));
    certify_made(spans, poses, options)
}

/// The same of a motion from rest to rest.
pub(super) fn certify_whole(
    spans: &[Span],
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
) -> (Certificate, Vec<Crossing>) {
    at_rest(certify(spans, poses, options), spans, options)
}

/// The same of one that passes all poses. `None` where it misses one: that is seen long before the limits of a tool that turns are
/// bounded.
pub(super) fn certify_passing(
    spans: &[Span],
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
) -> Option<(Certificate, Vec<Crossing>)> {
    let passes = crossing::crossings(spans, poses, options);
    let all = passes.iter().all(Crossing::holds);
    all.then(|| {
        at_rest(
            certify_passes(spans, poses, options, passes),
            spans,
            options,
        )
    })
}

/// A certificate that has how far both ends of the motion are from rest, too.
fn at_rest(
    mut whole: (Certificate, Vec<Crossing>),
    spans: &[Span],
    options: &SmoothOptions,
) -> (Certificate, Vec<Crossing>) {
    if let (Some(first), Some(last)) = (spans.first(), spans.last()) {
        for end in [first.at(0.0), last.at(last.duration)] {
            let off = jump(&end, &ToolPoint::still(end.pose), options);
            whole.0.jump.raise(off, whole.0.duration);
        }
    }
    whole
}

/// The largest jump between the spans of a motion.
fn jumps(spans: &[Span], options: &SmoothOptions) -> Peak {
    let mut worst = Peak::default();
    for pair in spans.windows(2) {
        let (one, other) = (pair[0].at(pair[0].duration), pair[1].at(0.0));
        worst.raise(jump(&one, &other, options), pair[1].start);
    }
    worst
}

/// The largest part of a jump over what rounding may make of it.
fn jump(one: &ToolPoint, other: &ToolPoint, options: &SmoothOptions) -> f64 {
    let limits = &options.limits;
    let caps = [
        [limits.speed, limits.acceleration],
        [limits.angular_speed, limits.angular_acceleration],
    ];
    let mut worst = Peak::default();
    let place = other.pose.translation.vector;
    let off = (one.pose.translation.vector - place).norm();
    let turned = one.pose.rotation.angle_to(&other.pose.rotation);
    worst.raise(off.max(turned) / (POSE_JUMP * (1.0 + place.norm())), 0.0);
    let rates = [[&one.linear, &other.linear], [&one.angular, &other.angular]];
    for (caps, [one, other]) in caps.iter().zip(rates) {
        for k in 0..2 {
            let off = (one[k] - other[k]).norm();
            worst.raise(off / (JUMP * caps[k]), 0.0);
        }
    }
    worst.ratio
}

/// Raises the six peaks by one span; its own six ratios.
fn limits_of(span: &Span, options: &SmoothOptions, certificate: &mut Certificate) -> [f64; 6] {
    let (limits, d) = (&options.limits, span.duration);
    let velocity = span.velocity_control(0.0, d);
    let acceleration = span.acceleration_control(0.0, d);
    let bounds = [
        hull(&velocity, limits.speed, 6),
        hull(&acceleration, limits.acceleration, 6),
        hull(&span.jerk_control(0.0, d), limits.jerk, 0),
    ];
    let time = span.start + d / 2.0;
    certificate.speed.raise(bounds[0], time);
    certificate.acceleration.raise(bounds[1], time);
    certificate.jerk.raise(bounds[2], time);
    let mut angular = [0.0; 3];
    if !span.turns.is_empty() {
        let known = [
            certificate.angular_speed.ratio,
            certificate.angular_acceleration.ratio,
            certificate.angular_jerk.ratio,
        ];
        angular = angular_bounds(span, options, known);
        certificate.angular_speed.raise(angular[0], time);
        certificate.angular_acceleration.raise(angular[1], time);
        certificate.angular_jerk.raise(angular[2], time);
    }
    let [a, b, c] = angular;
    [bounds[0], bounds[1], bounds[2], a, b, c]
}

/// Greatest distance from the leg being travelled over the half width.
fn corridor(spans: &[Span], poses: &[Isometry3<f64>], crossings: &[Crossing], width: f64) -> Peak {
    let mut peak = Peak::default();
    along_legs(spans, poses, crossings, width, |_, ratio, time| {
        peak.raise(ratio, time);
    });
    peak
}

/// The same by leg, at the index of the pose at its end.
pub(super) fn corridor_of_legs(
    spans: &[Span],
    poses: &[Isometry3<f64>],
    crossings: &[Crossing],
    width: f64,
) -> Vec<f64> {
    let mut most = vec![0.0_f64; poses.len()];
    along_legs(spans, poses, crossings, width, |leg, ratio, _| {
        most[leg] = most[leg].max(ratio);
    });
    most
}

/// Tells each part of a span that is travelled on one leg: the index of the pose at the end of the leg, the greatest distance
/// from the leg over the half width, and the time in the middle of the part (s).
fn along_legs(
    spans: &[Span],
    poses: &[Isometry3<f64>],
    crossings: &[Crossing],
    width: f64,
    mut tell: impl FnMut(usize, f64, f64),
) {
    if width.is_infinite() {
        return;
    }
    let room = width + RESOLUTION;
    let mut at = 0;
    let end = spans.last().map_or(0.0, Span::end);
    for leg in 1..poses.len() {
        let until = crossings.get(leg - 1).map_or(end, |crossing| crossing.time);
        let ends = [
            poses[leg - 1].translation.vector,
            poses[leg].translation.vector,
        ];
        let since = if leg == 1 {
            0.0
        } else {
            crossings[leg - 2].time
        };
        while at < spans.len() {
            let span = &spans[at];
            let from = (since - span.start).clamp(0.0, span.duration);
            let to = (until - span.start).clamp(0.0, span.duration);
            if to > from {
                let control = span.position_control(from, to);
                let ratio = away(&control, &ends, room, 5) / room;
                tell(leg, ratio, span.start + (from + to) / 2.0);
            }
            if span.end() > until || at + 1 == spans.len() {
                break;
            }
            at += 1;
        }
    }
}

/// Upper bound of the distance of a Bernstein form from a segment: the
/// distance to a convex set is convex, so the control points bound it.
fn away(control: &[Vector3<f64>; 5], ends: &[Vector3<f64>; 2], room: f64, depth: u32) -> f64 {
    let mut bound = 0.0;
    for c in control {
        let distance = off_segment(c, ends);
        if distance > bound || distance.is_nan() {
            bound = distance;
        }
    }
    if depth == 0 || bound <= 0.98 * room {
        return bound;
    }
    let (left, right) = halve(control);
    away(&left, ends, room, depth - 1).max(away(&right, ends, room, depth - 1))
}

/// Distance of a point from a segment that is given by its ends, all in m in one frame.
///
/// ```
/// use nalgebra::Vector3;
/// use trajectory::smooth::off_segment;
///
/// let leg = [Vector3::zeros(), Vector3::x()];
/// assert_eq!(off_segment(&Vector3::new(0.5, 0.2, 0.0), &leg), 0.2);
/// assert_eq!(off_segment(&Vector3::new(4.0, 4.0, 0.0), &leg), 5.0);
/// ```
#[must_use]
pub fn off_segment(point: &Vector3<f64>, ends: &[Vector3<f64>; 2]) -> f64 {
    let way = ends[1] - ends[0];
    let square = way.norm_squared();
    let share = if square > 0.0 {
        ((point - ends[0]).dot(&way) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (point - ends[0] - way * share).norm()
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::ToolLimits;

    /// A straight span (m, m/s, m/s²) of one second.
    fn span(start: f64, at: f64, speed: f64, acceleration: f64) -> Span {
        let x = |value: f64| Vector3::x() * value;
        Span {
            start,
            duration: 1.0,
            point: [x(at), x(speed), x(acceleration / 2.0), x(0.0), x(0.0)],
            base: UnitQuaternion::identity(),
            turns: Vec::new(),
        }
    }

    /// Jumps of place, velocity and acceleration are no motion, whatever the limits; rounding is.
    #[test]
    fn a_jump_is_not_certified() {
        let limits = ToolLimits {
            speed: 1.0,
            acceleration: 10.0,
            jerk: 100.0,
            angular_speed: 1.0,
            angular_acceleration: 10.0,
            angular_jerk: 100.0,
        };
        let options = SmoothOptions::new(1e-3, limits);
        let poses = [0.0, 1.0].map(|x| Isometry3::translation(x, 0.0, 0.0));
        let jump = |second: Span| {
            let spans = [span(0.0, 0.0, 0.5, 0.0), second];
            certify(&spans, &poses, &options).0
        };
        assert!(jump(span(1.0, 0.5 + 1e-12, 0.5, 1e-9)).holds());
        for broken in [
            span(1.0, 0.5001, 0.5, 0.0),
            span(1.0, 0.5, 0.5001, 0.0),
            span(1.0, 0.5, 0.4999, 0.0),
            span(1.0, 0.5, 0.5, 0.001),
        ] {
            let found = jump(broken);
            assert!(!found.holds() && found.worst_limit() <= 1.0, "{found:?}");
            assert_eq!(found.jump.time, 1.0);
        }
        // From motion to motion, so not whole.
        let spans = [span(0.0, 0.0, 0.5, 0.0), span(1.0, 0.5, 0.5, 0.0)];
        assert!(!certify_whole(&spans, &poses, &options).0.holds());
    }
}
