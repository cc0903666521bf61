//! A motion along the way of another one, as fast as the limits allow.
//!
//! A search of a spline changes way and time law together. Where the tolerance shows corners a change of the time alone
//! moves control points around them, which their corridor hardly allows, so a search may end far from the fastest law
//! along its own way. The path timing finds that law whatever the corners are.

use nalgebra::Isometry3;

use super::certificate::certify_slowed;
use super::dense;
use super::method::Method;
use super::motion::Motion;
use super::options::SmoothOptions;
use super::span::{Span, span_at};
use super::tool_law::tool_law;
use crate::{Boundary, TimingOptions, ToolCurve, ToolLimits, ToolPoint};

/// Greatest rate of the law, in the time of the motion that is known.
const FASTEST: f64 = 8.0;
/// A motion whose bounds are above the limits by no more than this is stretched in time.
const STRETCH: f64 = 1.15;

/// The fastest motion that is found along the way of one that rests only at its ends; perhaps not certified. `None` where
/// a limit is missing, or if it takes more than a share `most` of the time.
pub(super) fn motion(
    known: &Motion,
    (poses, options): (&[Isometry3<f64>], &SmoothOptions),
    most: f64,
) -> Option<Motion> {
    if !known.rests.is_empty() || known.spans.is_empty() || !dense::is_limited(options) {
        return None;
    }
    let way = Way(&known.spans);
    let resting = TimingOptions {
        start: Boundary::Free,
        end: Boundary::Free,
        rate_cap: Some(FASTEST),
        ..TimingOptions::default()
    };
    let limits = angular(options.limits, &known.spans);
    let most = most * known.duration();
    let law = tool_law(&way, &limits, &resting).ok()?.law;
    if law.duration() > most {
        return None;
    }
    let pose = |time: f64| way.at(law.sample(time).position[0]).pose;
    let ends = [&poses[0], &poses[poses.len() - 1]];
    let near = options.tolerance.min(options.corridor());
    let mut spans = dense::spans_along(&pose, law.duration(), ends, (near, options));
    certify_slowed(&mut spans, (poses, false), options, STRETCH);
    let motion = Motion {
        eased: known.eased,
        retried: known.retried,
        ..Motion::new(spans, Method::Spline)
    };
    (motion.duration() <= most).then_some(motion)
}

/// The limits, without those of the rotation where nothing turns.
fn angular(limits: ToolLimits, spans: &[Span]) -> ToolLimits {
    if spans.iter().any(|span| !span.turns.is_empty()) {
        return limits;
    }
    ToolLimits {
        angular_speed: f64::INFINITY,
        angular_acceleration: f64::INFINITY,
        angular_jerk: f64::INFINITY,
        ..limits
    }
}

/// The way of a motion: at least one span, over the time of that motion.
struct Way<'a>(&'a [Span]);

impl ToolCurve for Way<'_> {
    fn end(&self) -> f64 {
        self.0.last().map_or(0.0, Span::end)
    }

    fn knots(&self) -> Vec<f64> {
        let starts = self.0.iter().map(|span| span.start);
        starts.chain([self.end()]).collect()
    }

    fn at(&self, u: f64) -> ToolPoint {
        span_at(self.0, u).map_or_else(
            || ToolPoint::still(Isometry3::identity()),
            |(span, local)| span.at(local),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth::certificate::certify;
    use crate::smooth::choose::{Then, Window, from_rest};

    /// Along the way of a motion that was planned for half of the limits the fastest law takes as much less as the limits
    /// say, and keeps the way; a second one saves nothing.
    #[test]
    fn a_law_along_the_way_is_faster() {
        let limits = ToolLimits {
            speed: 0.5,
            acceleration: 5.0,
            jerk: 100.0,
            ..ToolLimits::UNLIMITED
        };
        let at = |i: u32| {
            let a = 0.3 * f64::from(i);
            Isometry3::translation(0.05 * a.cos(), 0.05 * a.sin(), 0.002 * f64::from(i % 2))
        };
        let poses: Vec<_> = (0..16).map(at).collect();
        let within = |limits| SmoothOptions::new(1e-3, limits).finite();
        // A quarter of the acceleration and an eighth of the jerk: the same motion in twice the time.
        let slow = ToolLimits {
            speed: 0.25,
            acceleration: 1.25,
            jerk: 12.5,
            ..limits
        };
        let known = from_rest(&Window::from_rest(&poses, &within(slow), Then::Stop));
        let faster = motion(&known, (&poses, &within(limits)), 0.998).unwrap();
        let ratio = faster.duration() / known.duration();
        assert!((0.49..0.51).contains(&ratio), "{ratio}");
        let (certificate, _) = certify(&faster.spans, &poses, &within(limits));
        assert!(certificate.worst_limit() <= 1.0 + 1e-9);
        assert!(motion(&faster, (&poses, &within(limits)), 0.99).is_none());
    }
}
