//! How far a Newton step may go.

use super::block::{LANE, Lane, dot, lanes, times, times_two};
use super::evaluate::Spots;
use super::lines::{Jerks, Lines, Values};
use super::problem::Problem;
use super::state::{ConstraintRow, Norm, State};
use simd::{F4, Four, Op};

/// Reciprocals of the largest factors of a step: of the law and of the multipliers.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepLength {
    pub primal: f64,
    pub dual: f64,
}

/// The same for the cells of a block.
#[derive(Clone, Copy)]
struct Strides<S: Four> {
    simd: S,
    mu: F4<S>,
    primal: F4<S>,
    dual: F4<S>,
}

impl<S: Four> Strides<S> {
    /// Adds a row that changes by `d`, and writes the step of its multiplier.
    #[inline(always)]
    fn row(&mut self, row: &mut ConstraintRow, d: F4<S>) {
        let one = F4::splat(self.simd, 1.0);
        let (g, m) = (
            F4::load(self.simd, &row.g),
            F4::load(self.simd, &row.multiplier),
        );
        let gd = g * d;
        let slack = one - g * g;
        // One division for both reciprocals.
        let both = (slack * m).inverse();
        let inverse = both * m;
        self.primal = ((gd + d).max(gd - d) * inverse).max(self.primal);
        let change = (self.mu + (m + m) * gd) * inverse - m;
        change.store(&mut row.change);
        self.dual = (one - (change + m) * (both * slack)).max(self.dual);
    }

    /// Takes in a row bounded in norm that changes by `d`.
    #[inline(always)]
    fn norm(&mut self, row: &mut Norm, [half, square]: [F4<S>; 2]) {
        let (zero, one) = (F4::splat(self.simd, 0.0), F4::splat(self.simd, 1.0));
        let m = F4::load(self.simd, &row.multiplier);
        let slack = one - F4::load(self.simd, &row.square);
        // One division for both reciprocals.
        let both = (slack * m).inverse();
        let inverse = both * m;
        // |g + t d| = 1, for 1 / t: slack r² - 2 half r - square = 0.
        let ratio = (half + (half * half + slack * square).max(zero).sqrt()) * inverse;
        self.primal = ratio.max(self.primal);
        let new = (self.mu + (m + m) * half) * inverse;
        (new - m).store(&mut row.change);
        self.dual = (one - new * (both * slack)).max(self.dual);
    }

    /// Takes in a cap of `a`, which changes by `da`.
    #[inline(always)]
    fn value(&mut self, cap: &Lane, row: &mut ConstraintRow, a: F4<S>, da: F4<S>) {
        let one = F4::splat(self.simd, 1.0);
        let d = F4::load(self.simd, cap) * da;
        let m = F4::load(self.simd, &row.multiplier);
        let inverse = (one - F4::load(self.simd, &row.g)).inverse();
        let fall = F4::splat(self.simd, 0.0) - da / a;
        self.primal = (d * inverse).max(fall).max(self.primal);
        let new = (self.mu + m * d) * inverse;
        (new - m).store(&mut row.change);
        self.dual = (one - new / m).max(self.dual);
    }

    /// Takes in the rows of a slot of values.
    #[inline(always)]
    fn values(&mut self, slot: Values<'_>, at: Spots<S>, d: Spots<S>) {
        let simd = self.simd;
        for ([p, q], row) in slot.joints.0.iter().zip(slot.joints.1) {
            self.row(row, F4::load(simd, p) * d.b + F4::load(simd, q) * d.a);
        }
        for (line, norm) in slot.tools.0.iter().zip(slot.tools.1) {
            let [ta, tb] = times_two(lanes(simd, line), [d.a, d.b]);
            let half = ta * at.a + tb * at.b;
            let square = ta * d.a + tb * d.b;
            self.norm(norm, [half, square]);
        }
    }

    /// Adds the rows of a jerk slot: of `sqrt(a) (x a + y b + z c)`.
    #[inline(always)]
    fn jerks(&mut self, slot: Jerks<'_>, at: Spots<S>, d: Spots<S>) {
        let simd = self.simd;
        let root = at.a.sqrt();
        let half = d.a * 0.5 / at.a;
        let a = root * (d.a + half * at.a);
        let b = root * (d.b + half * at.b);
        let c = root * (d.c + half * at.c);
        for ([x, y, z], row) in slot.joints.0.iter().zip(slot.joints.1) {
            let (x, y, z) = (F4::load(simd, x), F4::load(simd, y), F4::load(simd, z));
            self.row(row, dot([x, y, z], [a, b, c]));
        }
        let law = [root * at.a, root * at.b, root * at.c];
        for (line, norm) in slot.tools.0.iter().zip(slot.tools.1) {
            let t = times(lanes(simd, line), [a, b, c]);
            self.norm(norm, [dot(t, law), dot(t, [a, b, c])]);
        }
    }
}

/// How far the law `x` may move along `step`; also computes the steps of the multipliers, for the
/// centring `mu`. Jerk rows are replaced by their tangents.
pub(super) struct Measure<'a> {
    pub problem: &'a Problem,
    pub x: &'a [f64],
    pub step: &'a [f64],
    pub state: &'a mut State,
    pub mu: f64,
}

impl Op for Measure<'_> {
    type Output = StepLength;

    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> StepLength {
        let least = F4::splat(simd, 1e-9);
        let mut step_lengths = Strides {
            simd,
            mu: F4::splat(simd, self.mu),
            primal: least,
            dual: least,
        };
        let (mut lines, blocks) = Lines::all(self.problem, self.state);
        for (i, (basis, value, cap)) in blocks.enumerate() {
            let left = Spots::left(simd, basis, &self.x[LANE * i..]);
            let change = Spots::left(simd, basis, &self.step[LANE * i..]);
            let width = F4::load(simd, &basis.width);
            let half = width * 0.5;
            let (middle, further) = (left.moved(half), change.moved(half));
            step_lengths.value(&value[0][1], &mut cap[0], left.a, change.a);
            step_lengths.value(&value[1][1], &mut cap[1], middle.a, further.a);
            step_lengths.values(lines.values(), left, change);
            step_lengths.values(lines.values(), middle, further);
            for share in self.problem.jerk_shares(i) {
                let x = width * *share;
                step_lengths.jerks(lines.jerks(), left.moved(x), change.moved(x));
            }
        }
        StepLength {
            primal: step_lengths.primal.largest(),
            dual: step_lengths.dual.largest(),
        }
    }
}
