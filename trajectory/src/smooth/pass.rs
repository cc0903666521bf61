//! When and how close a motion passes each intermediate pose.

use nalgebra::{Isometry3, Vector3};

use super::options::SmoothOptions;
use super::poly::{self, halve};
use super::span::Span;

/// Lengths (m) and angles (rad) below this are not told apart from zero.
pub const RESOLUTION: f64 = 1e-12;

/// How one intermediate pose is passed.
///
/// The rule of the language: poses are passed in order, each on its first
/// local closest approach after the pass of the pose before; a later approach
/// never repairs a miss. A pose already within tolerance at the moment of the
/// pass before, and from there on farther away, is passed at that moment.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Pass {
    /// Index of the pose in the list; the start is 0, so the first is 1.
    pub index: usize,
    /// Distance of the controlled point at its closest approach, m.
    pub deviation: f64,
    /// Tolerance in force, m.
    pub tolerance: f64,
    /// Angle between the orientations at the closest approach, rad.
    pub angle: f64,
    /// Angular tolerance in force, rad.
    pub angular_tolerance: f64,
    /// Time of the closest approach, s.
    pub time: f64,
}

impl Pass {
    /// True when the pose is passed within both tolerances.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.deviation <= self.tolerance + RESOLUTION
            && self.angle <= self.angular_tolerance + 1e3 * RESOLUTION
    }
}

/// The passes of all intermediate poses, in order.
pub(crate) fn passes(
    spans: &[Span],
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
) -> Vec<Pass> {
    let inner = poses
        .get(1..poses.len().saturating_sub(1))
        .unwrap_or_default();
    let mut result = Vec::with_capacity(inner.len());
    let (mut at, mut time) = (0, 0.0);
    for (i, pose) in inner.iter().enumerate() {
        let since = (at, time);
        (at, time) = closest(spans, at, time, pose, options);
        let (mut deviation, mut angle) = apart(spans, &poses[0], (at, time), pose);
        if angle > options.angular_tolerance() {
            let near = deviation + (0.02 * options.tolerance).max(1e3 * RESOLUTION);
            if let Some(better) = turned(
                spans,
                since,
                (at, time),
                pose,
                [near, options.angular_tolerance()],
            ) {
                (at, time) = better;
                (deviation, angle) = apart(spans, &poses[0], better, pose);
            }
        }
        result.push(Pass {
            index: i + 1,
            deviation,
            tolerance: options.tolerance,
            angle,
            angular_tolerance: options.angular_tolerance(),
            time,
        });
    }
    result
}

/// Distance (m) and angle (rad) between the motion at (span, time) and a pose.
fn apart(
    spans: &[Span],
    start: &Isometry3<f64>,
    (at, time): (usize, f64),
    pose: &Isometry3<f64>,
) -> (f64, f64) {
    let (point, rotation) = match spans.get(at) {
        Some(span) => {
            let local = (time - span.start).clamp(0.0, span.duration);
            (span.motion(local)[0], span.rotation(local))
        }
        None => (start.translation.vector, start.rotation),
    };
    let angle = crate::line::body_turn(&rotation, &pose.rotation).norm();
    ((point - pose.translation.vector).norm(), angle)
}

/// Samples of one span in the search of [`turned`].
const STEPS: u32 = 8;

/// Where the controlled point (nearly) rests at its closest approach while the
/// tool turns, the moment of the pass is the first one in that stretch at which
/// the angle is smallest: first (span, time) in the stretch from `since` to
/// `until` whose distance is below `near[0]` and whose angle is a local minimum
/// below `near[1]`.
fn turned(
    spans: &[Span],
    since: (usize, f64),
    until: (usize, f64),
    pose: &Isometry3<f64>,
    near: [f64; 2],
) -> Option<(usize, f64)> {
    let mut best: Option<((usize, f64), f64)> = None;
    for (at, span) in spans.iter().enumerate().take(until.0 + 1).skip(since.0) {
        let from = (since.1 - span.start).clamp(0.0, span.duration);
        let to = (until.1 - span.start).clamp(0.0, span.duration);
        for step in 0..=STEPS {
            let local = from + (to - from) * f64::from(step) / f64::from(STEPS);
            let moment = (at, span.start + local);
            let (distance, angle) = apart(spans, pose, moment, pose);
            if distance > near[0] {
                continue;
            }
            match best {
                Some((found, least)) if angle > least + 1e-9 && least <= near[1] => {
                    return Some(found);
                }
                Some((_, least)) if angle >= least => {}
                _ => best = Some((moment, angle)),
            }
        }
    }
    best.map(|(found, _)| found)
}

/// First local closest approach to `pose` from `time` on, in span `at` or
/// later: (span, time).
fn closest(
    spans: &[Span],
    at: usize,
    time: f64,
    pose: &Isometry3<f64>,
    options: &SmoothOptions,
) -> (usize, f64) {
    let goal = pose.translation.vector;
    let rounding = 1e-14 * (1.0 + goal.norm());
    let mut search = Search {
        falling: false,
        near: options.tolerance + RESOLUTION,
        noise: 0.0,
    };
    for (index, span) in spans.iter().enumerate().skip(at) {
        let from = (time - span.start).clamp(0.0, span.duration);
        if from >= span.duration && index + 1 < spans.len() {
            continue;
        }
        let mut position = span.position_control(from, span.duration);
        for c in &mut position {
            *c -= goal;
        }
        let velocity = span.velocity_control(from, span.duration);
        // Where the motion is slow, so is the change of the distance.
        let speed = velocity.iter().map(Vector3::norm).fold(0.0, f64::max);
        search.noise = rounding * speed;
        let product = poly::dot(&position, &velocity);
        let found = search.first_rise(&product, &position, [from, span.duration]);
        if let Some(local) = found {
            return (index, span.start + local);
        }
    }
    // Nothing rises any more: the end is the closest approach.
    match spans.last() {
        Some(last) => (spans.len() - 1, last.end()),
        None => (0, 0.0),
    }
}

/// State of the walk along the distance to one pose.
struct Search {
    /// The distance has fallen since the walk began.
    falling: bool,
    /// Within this distance a rise from the start of the walk is a pass.
    near: f64,
    /// Products below this are rounding.
    noise: f64,
}

impl Search {
    /// First time in `interval` at which the distance starts to rise, given
    /// half the derivative of its square and the offset in Bernstein form.
    fn first_rise(
        &mut self,
        product: &[f64; 8],
        offset: &[Vector3<f64>; 5],
        interval: [f64; 2],
    ) -> Option<f64> {
        if product.iter().all(|c| *c <= self.noise) {
            self.falling |= product.iter().any(|c| *c < -self.noise);
            return None;
        }
        let rising = product.iter().all(|c| *c >= -self.noise);
        if rising || interval[1] - interval[0] < 1e-10 {
            let passed = self.falling || offset[0].norm() <= self.near;
            return passed.then_some(interval[0]);
        }
        let middle = 0.5 * (interval[0] + interval[1]);
        let (low, high) = (halve(product), halve(offset));
        self.first_rise(&low.0, &high.0, [interval[0], middle])
            .or_else(|| self.first_rise(&low.1, &high.1, [middle, interval[1]]))
    }
}
