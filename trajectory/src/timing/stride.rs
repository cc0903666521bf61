//! How far a Newton step may go.

use super::lanes::{LANE, Wave, combine, dot};
use super::problem::Problem;
use super::state::{Norm, Row, Spots, State, jerk_places, vector};
use crate::wide::{Four, Op};

/// Reciprocals of the largest factors that a step may go: of the law and of the multipliers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stride {
    pub primal: f64,
    pub dual: f64,
}

/// The same for the cells of a block.
#[derive(Clone, Copy)]
struct Strides<S: Four> {
    simd: S,
    mu: Wave<S>,
    primal: Wave<S>,
    dual: Wave<S>,
}

impl<S: Four> Strides<S> {
    /// Takes in a row that changes by `d`, and writes the step of its multiplier.
    #[inline(always)]
    fn row(&mut self, row: &mut Row, d: Wave<S>) {
        let one = Wave::splat(self.simd, 1.0);
        let (g, m) = (
            Wave::load(self.simd, &row.g),
            Wave::load(self.simd, &row.multiplier),
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
    fn norm(&mut self, row: &mut Norm, d: [Wave<S>; 3]) {
        let one = Wave::splat(self.simd, 1.0);
        let g = vector(self.simd, &row.g);
        let m = Wave::load(self.simd, &row.multiplier);
        let slack = one - dot(g, g);
        let (half, square) = (dot(g, d), dot(d, d));
        let inverse = slack.inverse();
        // |g + t d| = 1, for 1 / t: slack r² - 2 half r - square = 0.
        let ratio = (half + (half * half + slack * square).sqrt()) * inverse;
        self.primal = ratio.max(self.primal);
        let new = (self.mu + (m + m) * half) * inverse;
        (new - m).store(&mut row.change);
        self.dual = (one - new / m).max(self.dual);
    }

    /// Takes in a cap whose row changes by `d`, and `a` that changes by `da`.
    #[inline(always)]
    fn value(&mut self, row: &mut Row, d: Wave<S>, (a, da): (Wave<S>, Wave<S>)) {
        let one = Wave::splat(self.simd, 1.0);
        let m = Wave::load(self.simd, &row.multiplier);
        let inverse = (one - Wave::load(self.simd, &row.g)).inverse();
        let fall = Wave::splat(self.simd, 0.0) - da / a;
        self.primal = (d * inverse).max(fall).max(self.primal);
        let new = (self.mu + m * d) * inverse;
        (new - m).store(&mut row.change);
        self.dual = (one - new / m).max(self.dual);
    }
}

/// How far the law `x` may go along `step`; also computes the steps of the multipliers, for the
/// centring `mu`. Jerk rows are taken by their tangents.
pub(super) struct Measure<'a> {
    pub problem: &'a Problem,
    pub x: &'a [f64],
    pub step: &'a [f64],
    pub state: &'a mut State,
    pub mu: f64,
}

impl Op for Measure<'_> {
    type Output = Stride;

    #[inline(always)]
    fn run<S: Four>(mut self, simd: S) -> Stride {
        let least = Wave::splat(simd, 1e-9);
        let mut strides = Strides {
            simd,
            mu: Wave::splat(simd, self.mu),
            primal: least,
            dual: least,
        };
        for (i, basis) in self.problem.basis.iter().enumerate() {
            let left = Spots::left(simd, basis, &self.x[LANE * i..]);
            let change = Spots::left(simd, basis, &self.step[LANE * i..]);
            let width = Wave::load(simd, &basis.width);
            let half = width * 0.5;
            self.values(&mut strides, 2 * i, left.a, change);
            let middle = left.moved(half).a;
            self.values(&mut strides, 2 * i + 1, middle, change.moved(half));
            for (slot, share) in jerk_places(self.problem, i) {
                let x = width * *share;
                self.jerks(&mut strides, slot, left.moved(x), change.moved(x));
            }
        }
        Stride {
            primal: strides.primal.largest(),
            dual: strides.dual.largest(),
        }
    }
}

impl Measure<'_> {
    /// The rows of a slot of values.
    #[inline(always)]
    fn values<S: Four>(&mut self, to: &mut Strides<S>, slot: usize, a: Wave<S>, d: Spots<S>) {
        let (problem, simd) = (self.problem, to.simd);
        let cap = Wave::load(simd, &problem.cap[slot]) * d.a;
        to.value(&mut self.state.cap[slot], cap, (a, d.a));
        let (rows, norms) = self.state.values(problem, slot);
        let lines = problem.acceleration[slot * problem.joints..].iter();
        for (row, line) in rows.iter_mut().zip(lines) {
            let [p, q] = line.map(|lane| Wave::load(simd, &lane));
            to.row(row, p * d.b + q * d.a);
        }
        let lines = problem.norm_acceleration[slot * problem.tool_accelerations..].iter();
        for (norm, line) in norms.iter_mut().zip(lines) {
            let [p, q] = line;
            let d = combine([vector(simd, p), vector(simd, q)], [d.b, d.a]);
            to.norm(norm, d);
        }
    }

    /// The rows of a jerk slot: of `sqrt(a) (x a + y b + z c)`.
    #[inline(always)]
    fn jerks<S: Four>(&mut self, to: &mut Strides<S>, slot: usize, at: Spots<S>, d: Spots<S>) {
        let (problem, simd) = (self.problem, to.simd);
        let root = at.a.sqrt();
        let half = d.a * 0.5 / at.a;
        let a = root * (d.a + half * at.a);
        let b = root * (d.b + half * at.b);
        let c = root * (d.c + half * at.c);
        let (rows, norms) = self.state.jerks(problem, slot);
        let lines = problem.jerk[slot * problem.joints..].iter();
        for (row, line) in rows.iter_mut().zip(lines) {
            let [x, y, z] = line.map(|lane| Wave::load(simd, &lane));
            to.row(row, x * a + y * b + z * c);
        }
        let lines = problem.norm_jerk[slot * problem.tool_jerks..].iter();
        for (norm, line) in norms.iter_mut().zip(lines) {
            let [x, y, z] = line;
            let line = [vector(simd, x), vector(simd, y), vector(simd, z)];
            to.norm(norm, combine(line, [a, b, c]));
        }
    }
}
