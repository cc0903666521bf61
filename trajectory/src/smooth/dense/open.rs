//! The part of a long fitted curve that is at hand.
//!
//! Its blocks are fitted one after the other as they are needed, and what was passed is dropped. A block
//! is a function of its poses alone, so the curve is the same to the last bit each time.

use nalgebra::{Isometry3, Quaternion, SVector, Vector3};

use super::basis::ORDER;
use super::blocks::Block;
use super::curve::{Curve, SEEN};
use super::fit::{Fit, Orientation};
use super::list::List;
use super::marks::Marks;
use super::places::{Units, size};

/// Radius of the balls of the fit, as a share of the tolerance, and the largest share that the check
/// of the curve accepts: the rest is for what follows the curve.
pub(super) const AIM: f64 = 0.96;
const KEPT: f64 = 0.98;
/// Parts of a knot interval in which the distance from the legs is bounded.
const PARTS: f64 = 8.0;

/// What a curve is made from, beside its poses.
#[derive(Clone, Debug)]
pub(super) struct Recipe {
    pub(super) marks: Marks,
    pub(super) units: Units,
    pub(super) orientation: Orientation,
    /// The turn from start to end of a curve that is fitted as one that does not turn (rotation vector, rad).
    pub(super) slight: Vector3<f64>,
}

/// A part of a curve, with control points and passes that are final up to some place.
#[derive(Clone, Debug)]
pub(super) struct Open<const D: usize> {
    pub(super) curve: Curve<D>,
    /// Number of the first pose that is kept, and the points of all that are.
    first: usize,
    points: Vec<SVector<f64, D>>,
    /// The curve is final up to this parameter, and the passes of all poses before this one.
    ready: f64,
    pub(super) passed: usize,
    /// Poses that were checked, and the greatest distance from the legs (balls).
    checked: usize,
    far: f64,
    /// The next block, and the orientation with which its points begin.
    next: usize,
    turn: Quaternion<f64>,
}

impl<const D: usize> Open<D> {
    /// Nothing of a curve.
    pub(super) fn new(recipe: &Recipe, start: &Isometry3<f64>) -> Self {
        let fit = Fit {
            control: Vec::new(),
            parameters: Vec::new(),
        };
        let end = recipe.marks.spans() as f64;
        let curve = Curve::part((fit, end), recipe.units, start);
        Self {
            curve: curve.turned(recipe.slight),
            first: 0,
            points: Vec::new(),
            ready: 0.0,
            passed: 0,
            checked: 0,
            far: 0.0,
            next: 0,
            turn: start.rotation.into_inner(),
        }
    }

    /// Fits the next blocks until the curve is known up to a parameter, with all poses passed there; false
    /// where one cannot be fitted.
    pub(super) fn cover(&mut self, recipe: &Recipe, list: &List<'_>, to: f64) -> bool {
        let count = Block::count(recipe.marks.spans());
        while self.next < count {
            let last = self.curve.fit.parameters[..self.passed - self.first].last();
            if self.ready > to && last.is_some_and(|u| *u > to) {
                return true;
            }
            if self.extend(recipe, list, count).is_none() {
                return false;
            }
        }
        true
    }

    /// Fits one more block.
    fn extend(&mut self, recipe: &Recipe, list: &List<'_>, count: usize) -> Option<()> {
        let Recipe { marks, units, .. } = recipe;
        let block = Block::new(self.next, count, marks.spans());
        let shift = block.from as f64;
        let first = marks.count(|u| u < shift);
        let last = marks.count(|u| u <= block.to as f64);
        if last < first + 2 {
            return None;
        }
        let since = (list.at(0).translation.vector, self.turn);
        let points = units.points_since::<D>(&list.part(first..last), since);
        let given: Vec<f64> = (first..last).map(|i| marks.at(i)).collect();
        let own: Vec<f64> = given.iter().map(|u| u - shift).collect();
        let radii = vec![AIM; own.len()];
        let fit = Fit::of(block.part(), (&points, &own, &radii), recipe.orientation).ok()?;
        self.add(&block, &fit, first, &given);
        self.next += 1;
        let known = self.first + self.points.len();
        self.points
            .extend(&points[known.saturating_sub(first).min(points.len())..]);
        match block.alone_to() {
            Some(end) => {
                self.passed = marks.count(|u| u <= end);
                // The last control point of a span is in the middle of its own two knots after the span.
                self.ready = end - 2.0;
                while self.passed > self.first && self.pass(self.passed - 1) > self.ready {
                    self.passed -= 1;
                }
                let from = Block::new(self.next, count, marks.spans()).from as f64;
                let begin = marks.count(|u| u < from);
                if let (true, Some(point)) = (D > 3, points.get(begin.checked_sub(first)?)) {
                    self.turn = units.quaternion(point);
                }
            }
            None => {
                self.passed = marks.len();
                self.ready = marks.spans() as f64;
            }
        }
        Some(())
    }

    /// Adds what a block has of the control points and of the passes.
    fn add(&mut self, block: &Block, fit: &Fit<D>, first: usize, given: &[f64]) {
        let begin = self.curve.from as usize;
        let whole = &mut self.curve.fit;
        whole
            .control
            .resize(block.to + ORDER - 1 - begin, SVector::zeros());
        for (j, c) in fit.control.iter().enumerate() {
            // Control point j is in the middle of its spans at j - 2.
            let j = block.from + j;
            if j >= begin {
                whole.control[j - begin] += c * block.share(j as f64 - 2.0);
            }
        }
        whole
            .parameters
            .resize(first + given.len() - self.first, 0.0);
        let shift = block.from as f64;
        for (i, (at, given)) in fit.parameters.iter().zip(given).enumerate() {
            if first + i >= self.first {
                whole.parameters[first + i - self.first] += (at + shift) * block.share(*given);
            }
        }
    }

    /// The pass of a pose that is final.
    pub(super) fn pass(&self, pose: usize) -> f64 {
        self.curve.fit.parameters[pose - self.first]
    }

    /// Frees what is before a parameter and before a pose.
    pub(super) fn forget(&mut self, from: f64, pose: usize) {
        let from = from.min(self.ready).max(self.curve.from).floor();
        self.curve
            .fit
            .control
            .drain(..(from - self.curve.from) as usize);
        self.curve.from = from;
        let pose = pose.clamp(self.first, self.passed.max(self.first));
        self.curve.fit.parameters.drain(..pose - self.first);
        self.points.drain(..pose - self.first);
        self.first = pose;
    }

    /// Frees what was checked, up to a parameter.
    pub(super) fn forget_checked(&mut self, from: f64) {
        self.forget(from, self.checked.saturating_sub(1));
    }

    /// The knots of the time law in the part.
    pub(super) fn knots(&self, spans: usize) -> Vec<f64> {
        let first = (self.curve.from as usize).next_multiple_of(SEEN);
        let mut knots: Vec<f64> = (first..spans).step_by(SEEN).map(|k| k as f64).collect();
        knots.retain(|u| *u <= self.ready);
        if self.ready >= spans as f64 {
            knots.push(self.ready);
        }
        knots
    }

    /// Greatest distance from the legs so far, in balls.
    pub(super) fn far(&self) -> f64 {
        self.far
    }

    /// Whether the curve passes all poses that are not checked yet in order within their balls, and
    /// stays near the legs to them.
    pub(super) fn check(&mut self) -> bool {
        let Some(from) = self.checked.checked_sub(1) else {
            self.checked = self.passed.min(1);
            return self.passed == 0 || (self.is_passed(0) && self.check());
        };
        let poses = from - self.first..self.passed - self.first;
        let ordered = self.curve.fit.parameters[poses.clone()].is_sorted();
        let passed = (self.checked..self.passed).all(|pose| self.is_passed(pose));
        if !ordered || !passed {
            return false;
        }
        let far = off_legs(
            &self.curve,
            &self.points[poses.clone()],
            &self.curve.fit.parameters[poses],
        );
        self.far = self.far.max(far);
        self.checked = self.passed;
        far <= KEPT
    }

    fn is_passed(&self, pose: usize) -> bool {
        let at = self.pass(pose) - self.curve.from;
        size(&(self.curve.fit.point(at) - self.points[pose - self.first])) <= KEPT
    }
}

/// A bound of the distance in place of a curve from the leg that it is on, over all legs between points that it
/// passes at these parameters.
///
/// Between two places the curve is no farther from the chord over them than an eighth of the square
/// of their distance in the parameter times the largest second derivative, and a chord is no farther
/// from a leg than its ends are. The second derivative is a cubic spline whose control points are the
/// second differences of those of the curve, so none is larger than these.
fn off_legs<const D: usize>(curve: &Curve<D>, points: &[SVector<f64, D>], passes: &[f64]) -> f64 {
    let (fit, begin) = (&curve.fit, curve.from);
    let place = |point: &SVector<f64, D>| Vector3::new(point[0], point[1], point[2]);
    let bends: Vec<f64> = fit
        .control
        .windows(3)
        .map(|c| place(&(c[0] - c[1] * 2.0 + c[2])).norm())
        .collect();
    let bend = |span: usize| bends[span..span + 4].iter().copied().fold(0.0, f64::max);
    let mut most = 0.0_f64;
    for (leg, at) in points.windows(2).zip(passes.windows(2)) {
        let (from, way) = (place(&leg[0]), place(&(leg[1] - leg[0])));
        let square = way.norm_squared().max(1e-300);
        let off = |u: f64| {
            let gap = place(&fit.point(u)) - from;
            (gap - way * (gap.dot(&way) / square).clamp(0.0, 1.0)).norm()
        };
        let [mut start, last] = [at[0] - begin, at[1] - begin];
        let mut before = off(start);
        while start < last {
            // No part reaches over a knot.
            let end = (((start * PARTS).floor() + 1.0) / PARTS).min(last);
            let span = (start as usize).min(fit.spans() - 1);
            let step = end - start;
            let after = off(end);
            most = most.max(before.max(after) + step * step / 8.0 * bend(span));
            (start, before) = (end, after);
        }
    }
    if most.is_nan() { f64::INFINITY } else { most }
}
