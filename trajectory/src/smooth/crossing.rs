//! When and how close a motion passes each intermediate pose.

use nalgebra::Isometry3;

pub use super::approach::RESOLUTION;
use super::approach::{Moment, approach, closest};
use super::options::SmoothOptions;
use super::span::{Span, reversed};
use crate::line::body_turn;

/// Times in knots that are nearer to each other than this are the same.
const SAME: f64 = 0.1;

/// How one intermediate pose is passed.
///
/// The rule of the language: poses are passed in order, each on its first local closest approach
/// after the pass of the pose before; a later approach does not replace it. A pose that is already
/// within tolerance at the time of the pass before, and farther away after it, is passed at that
/// time.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Crossing {
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

impl Crossing {
    /// True when the pose is passed within both tolerances.
    #[must_use]
    pub fn holds(&self) -> bool {
        let [place, turn] = Self::accepted(self.tolerance, self.angular_tolerance);
        self.deviation <= place && self.angle <= turn
    }

    /// Whether it is at another time than that of a search, in knots of a spacing (s): the search then passes the pose on a
    /// later approach than the first.
    pub(super) fn is_apart(&self, searched: f64, spacing: f64) -> bool {
        (self.time / spacing - searched).abs() >= SAME
    }

    /// Deviation and angle in their tolerances.
    pub(super) fn in_tolerances(&self) -> [f64; 2] {
        [
            self.deviation / self.tolerance,
            self.angle / self.angular_tolerance.max(RESOLUTION),
        ]
    }

    /// Largest deviation (m) and angle (rad) with which a pose is passed within these tolerances.
    pub(super) fn accepted(tolerance: f64, angular_tolerance: f64) -> [f64; 2] {
        [tolerance + RESOLUTION, angular_tolerance + 1e3 * RESOLUTION]
    }
}

/// The passes of all intermediate poses, in order.
pub(crate) fn crossings(
    spans: &[Span],
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
) -> Vec<Crossing> {
    crossings_after(spans, poses, options, |_, before| before)
}

/// The same; `after` tells from which moment on an inner pose, 0 being the first, is looked for, given the pass of the one before.
fn crossings_after(
    spans: &[Span],
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    after: impl Fn(usize, Moment) -> Moment,
) -> Vec<Crossing> {
    let inner = poses
        .get(1..poses.len().saturating_sub(1))
        .unwrap_or_default();
    let mut result = Vec::with_capacity(inner.len());
    let mut at = Moment::START;
    for (i, pose) in inner.iter().enumerate() {
        let since = after(i, at);
        let approach = closest(spans, since, pose, options.tolerance);
        let (deviation, angle) = apart(spans, &poses[0], approach, pose);
        // If the tool turns out of its tolerance meanwhile, a larger distance counts as a rest.
        let rest = if angle > options.angular_tolerance() {
            (0.02 * options.tolerance).max(1e3 * RESOLUTION)
        } else {
            1e3 * RESOLUTION
        };
        let near = (deviation + rest).min(deviation.max(options.tolerance));
        let wanted = [near, options.angular_tolerance()];
        at = turned(spans, since, approach, pose, wanted);
        // Not earlier than the previous pass by rounding.
        at.time = at.time.max(since.time);
        let (deviation, angle) = apart(spans, &poses[0], at, pose);
        result.push(Crossing {
            index: i + 1,
            deviation,
            tolerance: options.tolerance,
            angle,
            angular_tolerance: options.angular_tolerance(),
            time: at.time,
        });
    }
    result
}

/// The same, `back` if the motion is made from its end to its start: the first approaches may be others then.
pub(super) fn crossings_made(
    spans: &[Span],
    (poses, back): (&[Isometry3<f64>], bool),
    options: &SmoothOptions,
) -> Vec<Crossing> {
    if !back {
        return crossings(spans, poses, options);
    }
    let (back, poses) = backwards(spans, poses);
    forwards(crossings(&back, &poses, options), spans)
}

/// The same, each looked for from the time (s) on at which a search has `passed` the pose before: one that is passed elsewhere than
/// the search has it does not move the passes after it.
pub(super) fn crossings_since(
    spans: &[Span],
    (poses, back): (&[Isometry3<f64>], bool),
    options: &SmoothOptions,
    passed: &[f64],
) -> Vec<Crossing> {
    let seen = |spans: &[Span], poses: &[Isometry3<f64>], passed: &[f64]| {
        let before = |i: usize| i.checked_sub(1).and_then(|i| passed.get(i)).copied();
        let since = |i| moment(spans, before(i).unwrap_or(0.0));
        crossings_after(spans, poses, options, |i, _| since(i))
    };
    if !back {
        return seen(spans, poses, passed);
    }
    let (back, poses) = backwards(spans, poses);
    let total = spans.last().map_or(0.0, Span::end);
    let passed: Vec<f64> = passed.iter().rev().map(|time| total - time).collect();
    forwards(seen(&back, &poses, &passed), spans)
}

/// A time (s) of a motion, and the span that it is in.
fn moment(spans: &[Span], time: f64) -> Moment {
    let next = spans.partition_point(|span| span.start <= time);
    Moment {
        span: next.saturating_sub(1),
        time,
    }
}

/// A motion and its poses from their end to their start.
pub(super) fn backwards(
    spans: &[Span],
    poses: &[Isometry3<f64>],
) -> (Vec<Span>, Vec<Isometry3<f64>>) {
    (reversed(spans), poses.iter().rev().copied().collect())
}

/// Passes of the motion that goes through `spans` from its end to its start, as seen from their start.
pub(super) fn forwards(mut passes: Vec<Crossing>, spans: &[Span]) -> Vec<Crossing> {
    let (total, last) = (spans.last().map_or(0.0, Span::end), passes.len() + 1);
    passes.reverse();
    for pass in &mut passes {
        pass.index = last - pass.index;
        pass.time = total - pass.time;
    }
    passes
}

/// Distance (m) and angle (rad) between the motion at a moment and a pose.
fn apart(spans: &[Span], start: &Isometry3<f64>, at: Moment, pose: &Isometry3<f64>) -> (f64, f64) {
    let Some(span) = spans.get(at.span) else {
        let angle = body_turn(&start.rotation, &pose.rotation).norm();
        return (
            (start.translation.vector - pose.translation.vector).norm(),
            angle,
        );
    };
    (distance(span, at.time, pose), angle(span, at.time, pose))
}

/// Distance (m) between the motion in a span at a time of the motion and a pose.
fn distance(span: &Span, time: f64, pose: &Isometry3<f64>) -> f64 {
    let local = (time - span.start).clamp(0.0, span.duration);
    (span.motion(local)[0] - pose.translation.vector).norm()
}

/// The same angle, rad.
fn angle(span: &Span, time: f64, pose: &Isometry3<f64>) -> f64 {
    let local = (time - span.start).clamp(0.0, span.duration);
    body_turn(&span.rotation(local), &pose.rotation).norm()
}

/// Samples of one span in the search of [`turned`].
const STEPS: u32 = 32;

/// If the controlled point (nearly) rests at its closest approach while the tool turns, the time of
/// the pass is the first time of that rest at which the angle is smallest: the first moment
/// whose angle is a local minimum below `near[1]`, in the interval around `approach` that begins not
/// before `since` and keeps the distance below `near[0]`.
fn turned(
    spans: &[Span],
    since: Moment,
    approach: Moment,
    pose: &Isometry3<f64>,
    near: [f64; 2],
) -> Moment {
    if spans.is_empty() {
        return approach;
    }
    let is_near = |at: &Moment| distance(&spans[at.span], at.time, pose) <= near[0];
    let seen = |at: Moment| (at, angle(&spans[at.span], at.time, pose));
    // Times of a span, from the first to the last one wanted.
    let moments = |at: usize| {
        let (span, share) = (&spans[at], 1.0 / f64::from(STEPS));
        let from = if at == since.span {
            since.time
        } else {
            span.start
        };
        (0..=STEPS).map(move |step| Moment {
            span: at,
            time: from + (span.end() - from) * f64::from(step) * share,
        })
    };
    let back = (since.span..=approach.span)
        .rev()
        .flat_map(|at| moments(at).rev());
    let mut rest: Vec<_> = back
        .filter(|moment| moment.time < approach.time)
        .take_while(is_near)
        .collect();
    rest.reverse();
    // Looked at only as far as it matters: a point may rest for long.
    let ahead = (approach.span..spans.len()).flat_map(moments);
    let ahead = ahead
        .filter(|moment| moment.time > approach.time)
        .take_while(is_near);
    let mut rest = rest.into_iter().chain(ahead).peekable();
    let here = if is_near(&approach) {
        angle(&spans[approach.span], approach.time, pose)
    } else {
        0.0
    };
    // A point that rests from the pass before until the end has no approach of its own.
    let end = spans.last().map_or(0.0, Span::end);
    let first = rest.peek().map(|moment| moment.time);
    let still = approach.time >= end && first.is_some_and(|time| time <= since.time);
    let mut best = (approach, if still { f64::INFINITY } else { here - 1e-9 });
    for (moment, angle) in rest.map(seen) {
        if angle > best.1 + 1e-9 && best.0 != approach && best.1 <= near[1] {
            break;
        }
        if angle < best.1 {
            best = (moment, angle);
        }
    }
    best.0
}

/// True if the passes do not change when the motion continues after its end, where it passes the
/// last pose: none of them is at the end only because the motion ends there.
pub(crate) fn settled(
    spans: &[Span],
    poses: &[Isometry3<f64>],
    crossings: &[Crossing],
    options: &SmoothOptions,
) -> bool {
    let Some(goal) = poses.last() else {
        return true;
    };
    let mut since = moment(spans, 0.0);
    for (crossing, pose) in crossings.iter().zip(&poses[1..]) {
        let at_end = (pose.translation.vector - goal.translation.vector).norm();
        if at_end > RESOLUTION
            && at_end <= crossing.deviation + 1e3 * RESOLUTION
            && approach(spans, since, pose, options.tolerance).is_none()
        {
            return false;
        }
        since = moment(spans, crossing.time);
    }
    approach(spans, since, goal, options.tolerance).is_none()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ToolLimits;
    use crate::smooth::span::Turn;
    use nalgebra::{UnitQuaternion, Vector3};

    /// One second of an even turn on the spot.
    fn turn(from: &Isometry3<f64>, to: &Isometry3<f64>, start: f64) -> Span {
        Span {
            start,
            duration: 1.0,
            point: [Vector3::zeros(); 5],
            base: from.rotation,
            turns: vec![Turn {
                axis: body_turn(&from.rotation, &to.rotation),
                angle: [0.0, 1.0, 0.0, 0.0, 0.0],
            }],
        }
    }

    /// A motion that goes past a pose and comes back passes it on the way there; made from its end to its start, on the
    /// way that was the one back.
    #[test]
    fn the_first_approach_depends_on_the_direction() {
        let straight = |from: f64, to: f64, start: f64| {
            let mut span = turn(&Isometry3::identity(), &Isometry3::identity(), start);
            (span.turns, span.point[0].x, span.point[1].x) = (Vec::new(), from, to - from);
            span
        };
        let spans = [straight(0.0, 1.0, 0.0), straight(1.0, 0.4, 1.0)];
        let poses = [0.0, 0.5, 0.4].map(|x| Isometry3::translation(x, 0.0, 0.0));
        let options = SmoothOptions::new(0.01, ToolLimits::UNLIMITED);
        let pass = |back: bool| crossings_made(&spans, (&poses, back), &options)[0];
        assert_eq!([pass(false), pass(true)].map(|pass| pass.index), [1, 1]);
        assert!((pass(false).time - 0.5).abs() < 1e-9);
        assert!((pass(true).time - (1.0 + 0.5 / 0.6)).abs() < 1e-9);
        assert!(pass(false).holds() && pass(true).holds());
    }

    /// A tool that only turns passes each pose where it is first turned towards it within the
    /// tolerance, also if the goal is turned like that pose even more.
    #[test]
    fn turns_on_the_spot_are_passed_in_order() {
        let at = |x: f64, y: f64| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x, y, 0.0));
            Isometry3::from_parts(Vector3::zeros().into(), turn)
        };
        let poses = [at(0.0, 0.0), at(0.3, 0.15), at(0.6, 0.0), at(0.3, 0.1)];
        let spans = [
            turn(&poses[0], &poses[2], 0.0),
            turn(&poses[2], &poses[3], 1.0),
        ];
        let options = SmoothOptions::new(0.01, ToolLimits::UNLIMITED);
        let passes = crossings(&spans, &poses, &options);
        assert!(passes.iter().all(Crossing::holds), "{passes:?}");
        assert!((passes[0].time - 0.5).abs() < 0.05, "{passes:?}");
        assert!((passes[1].time - 1.0).abs() < 0.05, "{passes:?}");
    }
}
