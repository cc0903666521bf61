//! Poses that a motion misses by their angle only: its orientations are turned to them, its way stays.
//!
//! A motion is planned through the corners of a list. Between them it may run ahead of its orientation, or behind: poses
//! on the legs are then passed in place and missed by the angle.

use nalgebra::Isometry3;

use super::certificate::certify;
use super::crossing::{Crossing, crossings_made};
use super::motion::Motion;
use super::options::SmoothOptions;
use super::span::{Span, stretch};
use super::spline::meet_spans;

/// Times that the passes are looked for and met.
const ROUNDS: usize = 3;
/// A ratio to a limit up to which the whole motion is slowed down.
const STRETCH: f64 = 1.1;

/// The motion with orientations that meet the poses, slowed down by a little where it turns too fast then; `None` where a
/// pose is missed in place, or orientations cannot be turned. `back` says that the motion is made from its end to its start.
pub(super) fn met(
    motion: &Motion,
    (poses, back): (&[Isometry3<f64>], bool),
    options: &SmoothOptions,
) -> Option<Motion> {
    let seen = |motion: &Motion| crossings_made(&motion.spans, (poses, back), options);
    let near = |pass: &Crossing| pass.deviation <= pass.tolerance;
    let mut next = motion.clone();
    let mut passes = seen(&next);
    for _ in 0..ROUNDS {
        if passes.iter().all(Crossing::holds) {
            break;
        }
        if !passes.iter().all(near) || !turn(&mut next, &passes, poses, options) {
            return None;
        }
        passes = seen(&next);
    }
    if !passes.iter().all(Crossing::holds) {
        return None;
    }
    let certificate = certify(&next.spans, poses, options).0;
    let over = certificate.worst_limit();
    if over > 1.0 && over <= STRETCH {
        let factor = certificate.stretch() * (1.0 + 1e-12);
        stretch(&mut next.spans, factor);
        for rest in &mut next.rests {
            rest.time *= factor;
        }
    }
    Some(next)
}

/// Some of the poses of a list with those that a motion misses beside them, in order; `None` if it misses no others.
///
/// The poses that are known are among those of the list, to the last digit. `back` says that the motion is made from its end
/// to its start.
pub(super) fn with(
    some: &[Isometry3<f64>],
    (poses, back): (&[Isometry3<f64>], bool),
    spans: &[Span],
    options: &SmoothOptions,
) -> Option<Vec<Isometry3<f64>>> {
    let passes = crossings_made(spans, (poses, back), options);
    let missed = |k: usize| k > 0 && passes.get(k - 1).is_some_and(|pass| !pass.holds());
    let mut next = some.iter().peekable();
    let mut result = Vec::with_capacity(some.len());
    for (k, pose) in poses.iter().enumerate() {
        if next.next_if(|known| *known == pose).is_some() || missed(k) {
            result.push(*pose);
        }
    }
    (result.len() > some.len() && next.peek().is_none()).then_some(result)
}

/// Turns the orientations of the parts that miss a pose; false where that is not possible.
fn turn(
    motion: &mut Motion,
    passes: &[Crossing],
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
) -> bool {
    let mut first = 0;
    for (_, count) in &motion.parts {
        let spans = &mut motion.spans[first..first + count];
        first += count;
        let Some((start, end)) = spans
            .first()
            .zip(spans.last())
            .map(|(a, b)| (a.start, b.end()))
        else {
            continue;
        };
        let inside = passes
            .iter()
            .filter(|pass| pass.time >= start && pass.time <= end);
        if inside.clone().all(Crossing::holds) {
            continue;
        }
        let inside: Vec<_> = inside.map(|pass| (pass.time, &poses[pass.index])).collect();
        if !meet_spans(spans, &inside, options.angular_tolerance()) {
            return false;
        }
    }
    true
}
