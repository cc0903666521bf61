//! The coarse shape of a list: long chords that stay near all poses between their ends.
//!
//! They tell where the way bends and how finely the fit has to be divided, and do not see what is
//! small beside the tolerance.

use std::ops::Range;

use nalgebra::SVector;

use super::places::size;

/// How far a pose may lie from the chord over it, and how far the way may go back along it.
const NEAR: f64 = 0.4;
/// The same of poses that count as lying on a straight leg.
const STRAIGHT: f64 = 0.02;
/// Chords that are shorter than this do not tell a direction.
const SHORT: f64 = 4.0;
/// Cosine of the turn from one chord to the next from which on the way turns back.
const BACK: f64 = -0.7;
/// Knots on a chord, and on the bend that the tolerance allows at the corner of two chords.
const KNOTS: [f64; 2] = [1.5, 4.0];
/// Growth of the knot spacing along the way.
const GROWTH: f64 = 0.35;

/// Legs on a chord, in the mean, from which on the tolerance hides the corners between them. Legs and
/// not poses: a leg may have further poses on it.
const LEGS_PER_CHORD: usize = 3;

/// Chords over the points of a list, from corner to corner.
#[derive(Clone, Debug)]
pub(super) struct Chords {
    /// Index of the point at each corner; the ends of the list are corners too.
    pub(super) corners: Vec<usize>,
}

impl Chords {
    /// The longest chords from the first point on, one after the other.
    pub(super) fn new<const D: usize>(points: &[SVector<f64, D>]) -> Self {
        Self::within(points, NEAR)
    }

    /// The legs between the corners of a list: chords that stay nearer than the tolerance shows.
    pub(super) fn legs<const D: usize>(points: &[SVector<f64, D>]) -> Self {
        Self::within(points, STRAIGHT)
    }

    /// The longest chords from which no pose is farther away than `near`.
    fn within<const D: usize>(points: &[SVector<f64, D>], near: f64) -> Self {
        let point = |i: usize| points[i];
        let mut corners = vec![0];
        corners.extend(ends(&point, points.len() - 1, near));
        Self { corners }
    }

    /// The end of each leg of [`Self::legs`], one after the other: nothing is kept of them.
    pub(super) fn leg_ends<const D: usize>(
        point: &impl Fn(usize) -> SVector<f64, D>,
        last: usize,
    ) -> impl Iterator<Item = usize> {
        ends(point, last, STRAIGHT)
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.corners.len() - 1
    }

    /// Whether the tolerance shows the corners of a list that does not turn: its curve is not nearly
    /// known. Orientations are better fitted all the same.
    pub(super) fn shows_corners<const D: usize>(&self, points: &[SVector<f64, D>]) -> bool {
        D == 3 && Self::show_corners(Self::legs(points).count(), self.count())
    }

    /// The same of so many legs and chords.
    pub(super) fn show_corners(legs: usize, chords: usize) -> bool {
        legs < LEGS_PER_CHORD * chords
    }

    /// The point at which the way turns back, if it does: the fit of one curve ends there.
    pub(super) fn turning_points<const D: usize>(&self, points: &[SVector<f64, D>]) -> Vec<usize> {
        let chord = |k: usize| points[self.corners[k + 1]] - points[self.corners[k]];
        let count = self.count();
        let long: Vec<usize> = (0..count).filter(|k| chord(*k).norm() >= SHORT).collect();
        let mut turning = Vec::new();
        for pair in long.windows(2) {
            let (before, after) = (chord(pair[0]), chord(pair[1]));
            let cosine = before.dot(&after) / (before.norm() * after.norm());
            // A bend of several short chords is a bend, unless it is small.
            let between: f64 = (pair[0] + 1..pair[1]).map(|k| chord(k).norm()).sum();
            if cosine < BACK && between < SHORT {
                let out = before.normalize() - after.normalize();
                let range = self.corners[pair[0]] + 1..self.corners[pair[1] + 1];
                let tip =
                    range.max_by(|i, j| points[*i].dot(&out).total_cmp(&points[*j].dot(&out)));
                turning.extend(tip);
            }
        }
        turning.dedup();
        turning
    }

    /// A parameter for each point of the list that runs along the chords, and grows by one from
    /// each knot of a fit to the next; the last is the number of knot intervals.
    pub(super) fn parameters<const D: usize>(&self, points: &[SVector<f64, D>]) -> Vec<f64> {
        let spacing = self.spacing(points);
        let mut parameters = Vec::with_capacity(points.len());
        let mut start = 0.0;
        parameters.push(start);
        for (k, pair) in self.corners.windows(2).enumerate() {
            let chord = points[pair[1]] - points[pair[0]];
            let length = chord.norm();
            let unit = chord / length.max(1e-300);
            let mut along = 0.0_f64;
            let scale = Ramp::new(length, [spacing[k], spacing[k + 1]]);
            for point in &points[pair[0] + 1..=pair[1]] {
                along = along.max((point - points[pair[0]]).dot(&unit)).min(length);
                parameters.push(start + scale.knots(along));
            }
            start += scale.knots(length);
            if let Some(end) = parameters.last_mut() {
                *end = start;
            }
        }
        let whole = (start + 0.5).floor().max(4.0);
        parameters.iter_mut().for_each(|x| *x *= whole / start);
        parameters
    }

    /// Knot spacing at each corner.
    fn spacing<const D: usize>(&self, points: &[SVector<f64, D>]) -> Vec<f64> {
        let chord = |k: usize| points[self.corners[k + 1]] - points[self.corners[k]];
        let count = self.count();
        let lengths: Vec<f64> = (0..count).map(|k| chord(k).norm()).collect();
        let [along, bend] = KNOTS;
        let mut spacing = Vec::with_capacity(count + 1);
        for k in 0..=count {
            let before = if k > 0 { lengths[k - 1] } else { lengths[0] };
            let after = if k < count { lengths[k] } else { before };
            let mut least = before.min(after) / along;
            if k > 0 && k < count {
                let (a, b) = (chord(k - 1) / before, chord(k) / after);
                // Half the turn: tangent from |a - b| = 2 sin, |a + b| = 2 cos.
                let tangent = (a - b).norm() / (a + b).norm().max(1e-9);
                least = least.min(4.0 / tangent.max(1e-9) / bend);
            }
            spacing.push(least.max(1.0 / bend));
        }
        for k in 0..count {
            spacing[k + 1] = spacing[k + 1].min(spacing[k] + GROWTH * lengths[k]);
        }
        for k in (0..count).rev() {
            spacing[k] = spacing[k].min(spacing[k + 1] + GROWTH * lengths[k]);
        }
        spacing
    }
}

/// Knot spacing along a chord: it grows from both ends.
struct Ramp {
    ends: [f64; 2],
    /// How far it grows from the first end, and where it begins to fall to the second.
    grown: [f64; 2],
    top: f64,
    length: f64,
}

impl Ramp {
    fn new(length: f64, ends: [f64; 2]) -> Self {
        let middle = 0.5 * (ends[0] + ends[1] + GROWTH * length);
        let most = (length / KNOTS[0]).max(ends[0]).max(ends[1]);
        let top = middle.min(most);
        Self {
            ends,
            grown: ends.map(|end| ((top - end) / GROWTH).max(0.0)),
            top,
            length,
        }
    }

    /// Knots from the first end on: the integral of one over the spacing.
    fn knots(&self, along: f64) -> f64 {
        let grow = |from: f64, way: f64| (GROWTH * way / from).ln_1p() / GROWTH;
        let [first, last] = self.grown;
        let flat = (self.length - first - last).max(0.0);
        let mut knots = grow(self.ends[0], along.min(first));
        knots += (along - first).clamp(0.0, flat) / self.top;
        let into = (along - first - flat).clamp(0.0, last);
        knots + grow(self.ends[1], last) - grow(self.ends[1], last - into)
    }
}

/// The end of each longest chord from which no point is farther away than `near`.
fn ends<const D: usize>(
    point: &impl Fn(usize) -> SVector<f64, D>,
    last: usize,
    near: f64,
) -> impl Iterator<Item = usize> {
    let next = move |from: usize| {
        // Doubling finds a chord that is too long, halving the longest below it.
        let (mut good, mut step) = (from + 1, 2);
        let mut bad = last + 1;
        while good < last {
            let to = (from + step).min(last);
            if spans(point, from..to, near) {
                good = to;
                step *= 2;
            } else {
                bad = to;
                break;
            }
        }
        while good + 1 < bad {
            let middle = good.midpoint(bad);
            if spans(point, from..middle, near) {
                good = middle;
            } else {
                bad = middle;
            }
        }
        good
    };
    let ends = std::iter::successors(Some(0), move |from| (*from < last).then(|| next(*from)));
    ends.skip(1)
}

/// Whether all points between two are near the chord from one to the other, in order.
fn spans<const D: usize>(
    point: &impl Fn(usize) -> SVector<f64, D>,
    range: Range<usize>,
    near: f64,
) -> bool {
    let from = point(range.start);
    let chord = point(range.end) - from;
    let length = chord.norm();
    let unit = if length > 0.0 { chord / length } else { chord };
    let mut most = 0.0_f64;
    (range.start + 1..range.end).all(|i| {
        let off = point(i) - from;
        let along = off.dot(&unit);
        let away = off - unit * along.clamp(0.0, length);
        let ordered = along >= most - near;
        most = most.max(along);
        ordered && size(&away) <= near
    })
}
