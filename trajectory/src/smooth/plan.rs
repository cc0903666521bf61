//! The planned motion, and how it is chosen.

use nalgebra::{Isometry3, Vector3};

use super::certificate::{Certificate, certify};
use super::crossing::Crossing;
use super::lower_bound::lower_bound;
use super::method::Method;
use super::motion::Motion;
use super::options::{SmoothError, SmoothOptions};
use super::rest::Rest;
use super::span::Span;
use super::windows::Windows;
use super::{dense, exact_stop};
use crate::{ToolCurve, ToolPoint};

/// A certified motion through a list of poses, as a curve of time.
///
/// As a [`ToolCurve`] its parameter is time in s, from 0 to
/// [`SmoothPlan::duration`]; it is at rest at both ends, and the derivatives
/// are velocity, acceleration and jerk (m/s^k, rad/s^k).
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothPlan {
    start: Isometry3<f64>,
    goal: Isometry3<f64>,
    spans: Vec<Span>,
    crossings: Vec<Crossing>,
    certificate: Certificate,
    parts: Vec<(Method, usize)>,
    rests: Vec<Rest>,
    exact_stop: f64,
}

impl SmoothPlan {
    /// A motion through `poses` with its certificate and passes.
    pub(crate) fn new(
        poses: &[Isometry3<f64>],
        motion: Motion,
        (certificate, crossings): (Certificate, Vec<Crossing>),
        exact_stop: f64,
    ) -> Self {
        let (start, goal) = (poses[0], poses[poses.len() - 1]);
        Self {
            start,
            goal,
            spans: motion.spans,
            crossings,
            certificate,
            parts: motion.parts,
            rests: motion.rests,
            exact_stop,
        }
    }

    /// Time of the whole motion, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.spans.last().map_or(0.0, Span::end)
    }

    /// How each intermediate pose is passed, in order.
    #[must_use]
    pub fn crossings(&self) -> &[Crossing] {
        &self.crossings
    }

    /// What holds for every moment of the motion.
    #[must_use]
    pub fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// How the motion was planned: as the time-optimal spline if every part was.
    #[must_use]
    pub fn method(&self) -> Method {
        let made = |method| self.parts.iter().any(|part| part.0 == method);
        if self.parts.is_empty() {
            Method::Still
        } else if made(Method::ExactStop) {
            Method::ExactStop
        } else if made(Method::Fit) {
            Method::Fit
        } else {
            Method::Spline
        }
    }

    /// The rests between the start and the end, in the order of time: where the way turns back,
    /// at exact stops, and where a list was divided.
    #[must_use]
    pub fn rests(&self) -> &[Rest] {
        &self.rests
    }

    /// Number of [`SmoothPlan::rests`].
    #[must_use]
    pub fn fallbacks(&self) -> usize {
        self.rests.len()
    }

    /// Time the motion would take with a stop at each pose, s.
    #[must_use]
    pub fn exact_stop(&self) -> f64 {
        self.exact_stop
    }

    /// The span of a time and the time within it.
    fn span(&self, time: f64) -> Option<(&Span, f64)> {
        let next = self.spans.partition_point(|span| span.start <= time);
        let span = self.spans.get(next.saturating_sub(1))?;
        Some((span, (time - span.start).clamp(0.0, span.duration)))
    }
}

impl ToolCurve for SmoothPlan {
    fn end(&self) -> f64 {
        self.duration()
    }

    fn knots(&self) -> Vec<f64> {
        let starts = self.spans.iter().map(|span| span.start);
        starts.chain([self.duration()]).collect()
    }

    fn at(&self, u: f64) -> ToolPoint {
        let still = |pose| ToolPoint {
            pose,
            linear: [Vector3::zeros(); 3],
            angular: [Vector3::zeros(); 3],
        };
        match self.span(u) {
            _ if u >= self.duration() => still(self.goal),
            Some((span, local)) => span.at(local),
            None => still(self.start),
        }
    }
}

/// Plans a motion from the first pose to the last that passes those between in
/// order, each within tolerance: the fastest motion that is certified.
///
/// Poses are in one frame of the caller's choice, lengths in m. It is at rest
/// at both ends. A list of one pose, or of equal poses, gives a plan of no
/// duration.
///
/// # Errors
/// [`SmoothError`] when a number of the input is unusable; never because a
/// motion is hard.
///
/// ```
/// use nalgebra::Isometry3;
/// use trajectory::{ToolLimits, smooth};
/// let limits = ToolLimits {
///     speed: 0.5, acceleration: 5.0, jerk: 100.0,
///     angular_speed: 2.0, angular_acceleration: 20.0, angular_jerk: 400.0,
/// };
/// let corner = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]];
/// let poses = corner.map(|[x, y]| Isometry3::translation(x, y, 0.0));
/// let plan = smooth::plan(&poses, &smooth::SmoothOptions::new(0.001, limits))?;
/// assert!(plan.certificate().holds());
/// assert!(plan.crossings()[0].deviation <= 0.001);
/// assert!(plan.duration() <= plan.exact_stop());
/// # Ok::<(), smooth::SmoothError>(())
/// ```
pub fn plan(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Result<SmoothPlan, SmoothError> {
    options.check(poses)?;
    let finite = options.finite();
    match options.fit.then(|| fitted(poses, &finite)).flatten() {
        Some(fitted) if dense::suffices(poses, &finite) => Ok(fitted),
        Some(fitted) => {
            let plan = by_spline(poses, options)?;
            let better = fitted.duration() < plan.duration();
            Ok(if better { fitted } else { plan })
        }
        None => by_spline(poses, options),
    }
}

/// The certified motion along a fitted curve, where the list is dense in poses.
fn fitted(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Option<SmoothPlan> {
    let motion = dense::plan(poses, options)?;
    let exact_stop = exact_stop::duration(poses, &options.limits);
    let mut whole = certify(&motion.spans, poses, options);
    whole.0.lower_bound = lower_bound(poses, options);
    let good = whole.0.holds() && motion.duration() <= exact_stop;
    good.then(|| SmoothPlan::new(poses, motion, whole, exact_stop))
}

/// The motion by time-optimal splines, window by window.
fn by_spline(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Result<SmoothPlan, SmoothError> {
    let plan = Windows::new(poses, options)?.finish();
    // A motion within half of the tolerance is within all of it. A second motion is cheap if poses
    // are close to each other and fit in one window.
    let costly = plan.spans.len() > SPANS_PER_POSE * poses.len() || plan.parts.len() > 1;
    if costly || poses.len() <= SHORT || plan.method() != Method::Spline {
        return Ok(plan);
    }
    let mut half = options.clone();
    half.tolerance *= 0.5;
    let half = Windows::new(poses, &half)?.finish_for(options);
    let better = half.certificate.holds() && half.duration() < plan.duration();
    Ok(if better { half } else { plan })
}

/// Lists up to this length are planned once.
const SHORT: usize = 5;

/// Longer lists are planned twice if they need no more than this many spans per pose.
const SPANS_PER_POSE: usize = 24;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ToolLimits;

    fn limits() -> ToolLimits {
        ToolLimits {
            speed: 0.5,
            acceleration: 5.0,
            jerk: 100.0,
            angular_speed: 2.0,
            angular_acceleration: 20.0,
            angular_jerk: 400.0,
        }
    }

    fn check(poses: &[Isometry3<f64>], tolerance: f64) -> SmoothPlan {
        let plan = plan(poses, &SmoothOptions::new(tolerance, limits())).unwrap();
        assert!(
            plan.certificate().holds(),
            "{:?} {:?}",
            plan.certificate(),
            plan.crossings()
        );
        assert!(plan.duration() <= plan.exact_stop());
        plan
    }

    #[test]
    fn degenerate_lists() {
        let at = |x: f64, y: f64| Isometry3::translation(x, y, 0.0);
        let turned =
            |x: f64, angle: f64| Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::z() * angle);
        for tolerance in [0.0, 1e-5, 1e-3, 10.0] {
            check(&[at(0.0, 0.0)], tolerance);
            check(&[at(0.1, 0.0); 4], tolerance);
            check(&[at(0.0, 0.0), at(0.1, 0.0)], tolerance);
            check(
                &[at(0.0, 0.0), at(0.1, 0.0), at(0.1, 0.0), at(0.2, 0.0)],
                tolerance,
            );
            check(&[at(0.0, 0.0), at(0.1, 0.0), at(0.0, 0.0)], tolerance);
            check(&[at(0.0, 0.0), at(0.1, 0.0), at(0.0, 1e-4)], tolerance);
            check(
                &[at(0.0, 0.0), at(1e-6, 0.0), at(0.0, 1e-6), at(1e-6, 1e-6)],
                tolerance,
            );
            check(
                &[turned(0.0, 0.0), turned(0.0, 0.5), turned(0.0, 1.0)],
                tolerance,
            );
            check(
                &[turned(0.0, 0.0), turned(0.0, 0.5), turned(0.0, 0.0)],
                tolerance,
            );
            check(
                &[
                    turned(0.0, 0.0),
                    turned(0.1, 0.5),
                    turned(0.1, 1.0),
                    turned(0.2, 0.0),
                ],
                tolerance,
            );
        }
    }

    #[test]
    fn bad_input_is_named() {
        let options = SmoothOptions::new(0.001, limits());
        assert_eq!(plan(&[], &options).unwrap_err(), SmoothError::NoPose);
        let bad = [
            Isometry3::identity(),
            Isometry3::translation(f64::NAN, 0.0, 0.0),
        ];
        assert!(matches!(
            plan(&bad, &options),
            Err(SmoothError::BadPose { index: 1, .. })
        ));
        let negative = SmoothOptions::new(-1.0, limits());
        assert!(matches!(
            plan(&bad[..1], &negative),
            Err(SmoothError::BadTolerance { .. })
        ));
    }

    /// Three legs and more, then a turn on the spot at the last point: a part of a leg without
    /// motion must not limit the speed at which the leg begins.
    #[test]
    fn a_turn_on_the_spot_at_the_end() {
        let at = |y: f64, z: f64, angle: f64| {
            Isometry3::new(Vector3::new(0.45, y, z), Vector3::x() * angle)
        };
        let way = [
            at(-0.15, 0.3, 0.0),
            at(-0.07, 0.3, 0.0),
            at(0.01, 0.35, 0.0),
            at(0.09, 0.3, 0.0),
            at(0.09, 0.3, 0.1),
        ];
        for first in 0..4 {
            for tolerance in [1e-5, 5e-4, 1e-3, 2e-2] {
                check(&way[first..], tolerance);
                let back: Vec<_> = way[first..].iter().rev().copied().collect();
                check(&back, tolerance);
            }
        }
        // The same turn between legs, and each pose twice.
        check(&[way[1], way[2], way[3], way[4], at(0.2, 0.3, 0.1)], 1e-3);
        let twice: Vec<_> = way.iter().flat_map(|pose| [*pose; 2]).collect();
        check(&twice, 5e-4);
    }
}
