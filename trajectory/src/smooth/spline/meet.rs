//! Control orientations turned so that a motion meets poses which it passes in place.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::band::Band;
use super::basis::{THIRD, power, weights};
use super::turns::turns;
use crate::line::body_turn;
use crate::smooth::span::{Span, Turn};

/// Rounds over all passes; the share of the angular tolerance up to which a pose is met, and that to which it is turned.
const ROUNDS: usize = 12;
const MET: [f64; 2] = [0.97, 0.9];

/// Rounds of the smoothest change; the weight that a pass has where it is missed first, and its growth while it is. A weight
/// of one is that of a third difference of a tolerance in one knot.
const SMOOTH_ROUNDS: usize = 24;
const WEIGHT: f64 = 1e-6;
const GROWTH: f64 = 8.0;
/// Weight of the change itself: it fades out over some fifty knots.
const FADING: f64 = 1e-10;
/// Weight of the control orientations that stay.
const FIXED: f64 = 1e12;
/// Diagonals of the system, with those that its solver needs free.
const BAND: usize = 8;

/// Relative difference of two numbers that are the same but for rounding.
const SAME: f64 = 1e-9;

/// A pass: the first of the five control orientations that rule it, the share of its span, and the pose.
pub(super) type Pass<'a> = (usize, f64, &'a Isometry3<f64>);

/// The turn from a pose to the motion of five control orientations, a share of its span (s) after its start.
pub(super) fn seen(
    control: &[UnitQuaternion<f64>],
    share: f64,
    h: f64,
    pose: &Isometry3<f64>,
) -> Vector3<f64> {
    let span = Span {
        start: 0.0,
        duration: h,
        point: [Vector3::zeros(); 5],
        base: control[0],
        turns: turns(control, h),
    };
    body_turn(&pose.rotation, &span.rotation(share * h))
}

/// Turns control orientations, knots `h` (s) apart, so that passes are met within `most` (rad): the five around each
/// pass that misses by the least change of them, in turn. Four at each end stay.
pub(super) fn meet(
    control: &mut [UnitQuaternion<f64>],
    passes: &[Pass<'_>],
    (h, most): (f64, f64),
) {
    let free = 4..control.len().saturating_sub(4);
    for _ in 0..ROUNDS {
        let mut missed = false;
        for (first, share, pose) in passes {
            let off = seen(&control[*first..first + 5], *share, h, pose);
            if off.norm() <= MET[0] * most {
                continue;
            }
            missed = true;
            let way = off * (1.0 - MET[1] * most / off.norm());
            let weights = weights(*share)[0];
            let square: f64 = weights.iter().map(|w| w * w).sum();
            for (k, weight) in (*first..).zip(weights) {
                if free.contains(&k) {
                    control[k] *= UnitQuaternion::from_scaled_axis(-way * (weight / square));
                }
            }
        }
        if !missed {
            break;
        }
    }
}

/// The same for the spans of one uniform spline and passes by their times (s); false, and nothing is changed, where the
/// spans are others.
pub(crate) fn meet_spans(spans: &mut [Span], passes: &[(f64, &Isometry3<f64>)], most: f64) -> bool {
    let Some(mut control) = control(spans) else {
        return false;
    };
    let h = spans[0].duration;
    let place = |(time, _): &(f64, &Isometry3<f64>)| {
        let next = spans.partition_point(|span| span.start <= *time);
        let first = next.saturating_sub(1);
        let share = ((time - spans[first].start) / h).clamp(0.0, 1.0);
        (first, share)
    };
    let placed: Vec<_> = passes.iter().map(place).collect();
    let passes: Vec<Pass<'_>> = placed
        .into_iter()
        .zip(passes)
        .map(|((first, share), (_, pose))| (first, share, *pose))
        .collect();
    Smoothest::new(control.len()).meet(&mut control, &passes, (h, most));
    for (span, control) in spans.iter_mut().zip(control.windows(5)) {
        span.base = control[0];
        span.turns = turns(control, h);
    }
    true
}

/// The change of control orientations with the least third differences, squared and summed, with which passes are met: the
/// least of angular jerk.
///
/// # Source
/// Weights that rise where a pass is missed: C. L. Lawson, "Contributions to the theory of linear least maximum
/// approximation", 1961.
struct Smoothest {
    /// Rotation vector by which each control orientation is turned.
    change: Vec<Vector3<f64>>,
    band: Band<BAND>,
    sides: [Vec<f64>; 3],
}

impl Smoothest {
    fn new(count: usize) -> Self {
        Self {
            change: vec![Vector3::zeros(); count],
            band: Band::zeros(count),
            sides: std::array::from_fn(|_| vec![0.0; count + BAND]),
        }
    }

    /// Turns the control orientations, knots `h` (s) apart, until all passes are met within `most` (rad), or for so many
    /// rounds. Four at each end stay.
    fn meet(
        &mut self,
        control: &mut [UnitQuaternion<f64>],
        passes: &[Pass<'_>],
        (h, most): (f64, f64),
    ) {
        let before = control.to_vec();
        let mut wanted = vec![(0.0, Vector3::zeros()); passes.len()];
        for _ in 0..SMOOTH_ROUNDS {
            let mut missed = false;
            for ((first, share, pose), wanted) in passes.iter().zip(&mut wanted) {
                let off = seen(&control[*first..first + 5], *share, h, pose);
                if off.norm() > MET[0] * most {
                    missed = true;
                    wanted.0 = (GROWTH * wanted.0).max(WEIGHT);
                }
                let changes = self.change[*first..].iter().zip(weights(*share)[0]);
                let changed: Vector3<f64> = changes.map(|(change, weight)| change * weight).sum();
                let kept = (MET[1] * most / off.norm().max(1e-300)).min(1.0);
                wanted.1 = changed - off * (1.0 - kept);
            }
            if !missed || !self.solve(passes, &wanted) {
                break;
            }
            for ((to, from), change) in control.iter_mut().zip(&before).zip(&self.change) {
                *to = from * UnitQuaternion::from_scaled_axis(*change);
            }
        }
    }

    /// Solves for the change at passes with the weights and changes that are wanted; false where that is not possible.
    fn solve(&mut self, passes: &[Pass<'_>], wanted: &[(f64, Vector3<f64>)]) -> bool {
        let count = self.change.len();
        self.band.clear();
        for side in &mut self.sides {
            side.fill(0.0);
        }
        for first in 0..count - 3 {
            self.add(first, &THIRD, (1.0, &Vector3::zeros()));
        }
        for ((first, share, _), (weight, change)) in passes.iter().zip(wanted) {
            if *weight > 0.0 {
                self.add(*first, &weights(*share)[0], (*weight, change));
            }
        }
        for (k, column) in self.band.columns.iter_mut().enumerate() {
            let fixed = k < 4 || k + 4 >= count;
            column[0] += if fixed { FIXED } else { FADING };
        }
        if !self.band.factor() {
            return false;
        }
        let [a, b, c] = &mut self.sides;
        self.band.solve([&mut a[..], &mut b[..], &mut c[..]]);
        for (k, change) in self.change.iter_mut().enumerate() {
            *change = if k < 4 || k + 4 >= count {
                Vector3::zeros()
            } else {
                Vector3::from_fn(|d, _| self.sides[d][k])
            };
        }
        true
    }

    /// Adds a weight on the square of a sum of changes less a wanted one.
    fn add(&mut self, first: usize, factors: &[f64], (weight, wanted): (f64, &Vector3<f64>)) {
        for (i, a) in factors.iter().enumerate() {
            for (j, b) in factors[i..].iter().enumerate() {
                self.band.columns[first + i][j] += weight * a * b;
            }
            for (side, wanted) in self.sides.iter_mut().zip(wanted.iter()) {
                side[first + i] += weight * a * wanted;
            }
        }
    }
}

/// The control orientations of the spans of one uniform spline that turns.
fn control(spans: &[Span]) -> Option<Vec<UnitQuaternion<f64>>> {
    let h = spans.first()?.duration;
    let whole = spans.iter().all(|span| is_whole(span, h));
    let turned = |span: &Span| match span.turns.first() {
        Some(turn) => span.base * UnitQuaternion::from_scaled_axis(turn.axis),
        None => span.base,
    };
    let joins = |pair: &[Span]| turned(&pair[0]).angle_to(&pair[1].base) <= SAME;
    if !whole || !spans.windows(2).all(joins) || spans.iter().all(|span| span.turns.is_empty()) {
        return None;
    }
    let mut control: Vec<_> = spans.iter().map(|span| span.base).collect();
    let last = &spans[spans.len() - 1];
    let mut rotation = last.base;
    for j in 0..4 {
        if let Some(turn) = last.turns.get(j) {
            rotation *= UnitQuaternion::from_scaled_axis(turn.axis);
        }
        control.push(rotation);
    }
    Some(control)
}

/// Whether a span is that of five control orientations `h` (s) apart.
fn is_whole(span: &Span, h: f64) -> bool {
    let as_ruled = |(j, turn): (usize, &Turn)| {
        let mut sums = [0.0; 5];
        sums[j + 1..].fill(1.0);
        let mut scale = 1.0;
        power(&sums, h).iter().zip(turn.angle).all(|(one, other)| {
            let off = (one - other).abs() * scale;
            scale *= h;
            off <= SAME
        })
    };
    let turns = span.turns.is_empty() || span.turns.len() == 4;
    (span.duration - h).abs() <= SAME * h && turns && span.turns.iter().enumerate().all(as_ruled)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spline that turns, ten spans of 0.1 s.
    fn spans() -> Vec<Span> {
        let turn = |k: usize| {
            let x = (k as f64 / 13.0).clamp(0.0, 1.0);
            UnitQuaternion::from_scaled_axis(Vector3::new(0.3 * x, 0.1 * x * x, -0.2))
        };
        let control: Vec<_> = (0..14).map(turn).collect();
        let span = |(k, control): (usize, &[UnitQuaternion<f64>])| Span {
            start: 0.1 * k as f64,
            duration: 0.1,
            point: [Vector3::zeros(); 5],
            base: control[0],
            turns: turns(control, 0.1),
        };
        control.windows(5).enumerate().map(span).collect()
    }

    /// Poses that are missed are met; the ends stay, and the spans join still.
    #[test]
    fn missed_poses_are_met() {
        let before = spans();
        let mut after = before.clone();
        let wanted = [(0.43, 0.004), (0.47, 0.004), (0.58, -0.003)].map(|(time, off)| {
            let span = &before[(time / 0.1) as usize];
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, off, 0.5 * off));
            (
                time,
                Isometry3::from_parts(
                    Vector3::zeros().into(),
                    span.rotation(time - span.start) * turn,
                ),
            )
        });
        let passes: Vec<_> = wanted.iter().map(|(time, pose)| (*time, pose)).collect();
        assert!(meet_spans(&mut after, &passes, 1e-3));
        for (time, pose) in &wanted {
            let span = &after[(time / 0.1) as usize];
            assert!(body_turn(&span.rotation(time - span.start), &pose.rotation).norm() <= 1e-3);
        }
        for (span, time) in [(0, 0.0), (9, 0.1)] {
            let (one, other) = (before[span].at(time), after[span].at(time));
            assert!(one.pose.rotation.angle_to(&other.pose.rotation) < 1e-12);
            for k in 0..3 {
                assert!((one.angular[k] - other.angular[k]).norm() < 1e-9);
            }
        }
        for pair in after.windows(2) {
            let (one, other) = (pair[0].at(0.1), pair[1].at(0.0));
            assert!(one.pose.rotation.angle_to(&other.pose.rotation) < 1e-12);
            for k in 0..2 {
                assert!((one.angular[k] - other.angular[k]).norm() < 1e-9);
            }
        }
    }

    /// Spans that are cut are not those of one spline.
    #[test]
    fn cut_spans_stay() {
        let mut spans = spans();
        spans[4] = spans[4].part(0.41, 0.5);
        let before = spans.clone();
        assert!(!meet_spans(&mut spans, &[], 1e-3));
        assert_eq!(spans, before);
    }
}
