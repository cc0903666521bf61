//! The planned motion.

use nalgebra::{Isometry3, Vector3};

use super::certificate::Certificate;
use super::crossing::Crossing;
use super::method::Method;
use super::motion::Motion;
use super::rest::{Rest, RestCause};
use super::span::{Span, span_at};
use super::turning_back::turns_back;
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
    pub(super) spans: Vec<Span>,
    crossings: Vec<Crossing>,
    pub(super) certificate: Certificate,
    pub(super) parts: Vec<(Method, usize)>,
    rests: Vec<Rest>,
    exact_stop: f64,
}

impl SmoothPlan {
    /// A motion through `poses` with its certificate and passes.
    pub(crate) fn new(
        poses: &[Isometry3<f64>],
        motion: Motion,
        whole: (Certificate, Vec<Crossing>),
        exact_stop: f64,
    ) -> Self {
        let (certificate, crossings) = whole;
        let (start, goal) = (poses[0], poses[poses.len() - 1]);
        let rests = named(motion.rests, &motion.spans, poses, &crossings);
        Self {
            start,
            goal,
            spans: motion.spans,
            rests,
            crossings,
            certificate,
            parts: motion.parts,
            exact_stop,
        }
    }

    /// Time of the whole motion, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.spans.last().map_or(0.0, Span::end)
    }

    /// Number of polynomial spans.
    #[must_use]
    pub fn spans(&self) -> usize {
        self.spans.len()
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

    /// The rests between the start and the end, in the order of time, each with its pose: where the way
    /// turns back, at exact stops, and where a list was divided.
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
        span_at(&self.spans, time)
    }
}

/// The rests with the poses at which they are, and those where the way turns back, and no others, said to be there.
fn named(
    mut rests: Vec<Rest>,
    spans: &[Span],
    poses: &[Isometry3<f64>],
    crossings: &[Crossing],
) -> Vec<Rest> {
    for rest in &mut rests {
        let after = crossings.partition_point(|pass| pass.time < rest.time);
        let off = |pass: &&Crossing| (pass.time - rest.time).abs();
        let near = &crossings[after.saturating_sub(1)..(after + 1).min(crossings.len())];
        let Some(pass) = near.iter().min_by(|a, b| off(a).total_cmp(&off(b))) else {
            continue;
        };
        rest.pose = pass.index;
        let tolerances = [pass.tolerance, pass.angular_tolerance];
        let passed = 1 + crossings.partition_point(|pass| pass.time <= rest.time);
        let next = spans.partition_point(|span| span.start < rest.time);
        let Some(span) = spans.get(next.saturating_sub(1)) else {
            continue;
        };
        let place = span
            .at((rest.time - span.start).clamp(0.0, span.duration))
            .pose;
        let back = turns_back(&place, poses, passed, tolerances);
        rest.cause = match rest.cause {
            _ if back => RestCause::TurnsBack,
            RestCause::TurnsBack => RestCause::Division,
            other => other,
        };
    }
    rests
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
