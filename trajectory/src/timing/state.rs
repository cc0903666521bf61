//! Values and multipliers of the rows of a problem under a law.

use super::lanes::{LANE, Lane, Wave, combine, dot};
use super::problem::{Basis, Problem};
use crate::wide::{Four, Op};

/// Values `g`, multipliers and their steps of a row in each cell of a block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Row {
    pub g: Lane,
    pub multiplier: Lane,
    pub change: Lane,
}

/// The same of a row bounded in norm.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Norm {
    pub g: [Lane; 3],
    pub multiplier: Lane,
    pub change: Lane,
}

/// All rows, in the order of the problem's.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub acceleration: Vec<Row>,
    pub jerk: Vec<Row>,
    pub cap: Vec<Row>,
    pub norm_acceleration: Vec<Norm>,
    pub norm_jerk: Vec<Norm>,
}

/// What a law is worth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Worth {
    /// Largest squared ratio of rows that shrink like `a`.
    pub flat: f64,
    /// Largest squared ratio of jerk rows.
    pub steep: f64,
    /// How long it takes (s).
    pub time: f64,
}

/// The law in each cell of a block, at one place.
#[derive(Clone, Copy)]
pub(super) struct Spots<S: Four> {
    pub a: Wave<S>,
    pub b: Wave<S>,
    pub c: Wave<S>,
}

impl<S: Four> Spots<S> {
    /// At the left ends, from the unknowns beginning with those of the block.
    #[inline(always)]
    pub(super) fn left(simd: S, basis: &Basis, x: &[f64]) -> Self {
        let lane = |x: &Lane| Wave::load(simd, x);
        let [x0, x1, x2] = [0, 1, 2].map(|i| Wave::load(simd, &x[i..i + LANE]));
        let b = (x1 - x0) * lane(&basis.left);
        let next = (x2 - x1) * lane(&basis.right);
        Self {
            a: x0 * lane(&basis.first) + x1 * lane(&basis.second),
            b,
            c: (next - b) * lane(&basis.inverse),
        }
    }

    /// `x` further on.
    #[inline(always)]
    pub(super) fn moved(self, x: Wave<S>) -> Self {
        let gain = x * self.c;
        Self {
            a: self.a + x * (self.b + self.b + gain),
            b: self.b + gain,
            c: self.c,
        }
    }
}

/// The jerk slots of block `i`, each with its share of the way from left to right.
#[inline(always)]
pub(super) fn jerk_places(
    problem: &Problem,
    i: usize,
) -> impl Iterator<Item = (usize, &'static f64)> {
    const SHARES: [f64; 3] = [0.0, 0.5, 1.0];
    const DENSE: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
    let slots = problem.jerk_slots[i]..problem.jerk_slots[i + 1];
    let shares: &[f64] = if slots.len() == SHARES.len() {
        &SHARES
    } else {
        &DENSE
    };
    slots.zip(shares)
}

/// A vector in registers.
#[inline(always)]
pub(super) fn vector<S: Four>(simd: S, lanes: &[Lane; 3]) -> [Wave<S>; 3] {
    [
        Wave::load(simd, &lanes[0]),
        Wave::load(simd, &lanes[1]),
        Wave::load(simd, &lanes[2]),
    ]
}

impl State {
    /// For the rows of `problem`.
    pub(super) fn new(problem: &Problem) -> Self {
        Self {
            acceleration: vec![Row::default(); problem.acceleration.len()],
            jerk: vec![Row::default(); problem.jerk.len()],
            cap: vec![Row::default(); problem.cap.len()],
            norm_acceleration: vec![Norm::default(); problem.norm_acceleration.len()],
            norm_jerk: vec![Norm::default(); problem.norm_jerk.len()],
        }
    }

    /// Rows in all.
    pub(super) fn rows(&self) -> usize {
        let joints = self.acceleration.len() + self.jerk.len() + self.cap.len();
        LANE * (joints + self.norm_acceleration.len() + self.norm_jerk.len())
    }

    /// The rows of values at a slot.
    #[inline(always)]
    pub(super) fn values(&mut self, problem: &Problem, slot: usize) -> (&mut [Row], &mut [Norm]) {
        let (joints, tools) = (problem.joints, problem.tool_accelerations);
        (
            &mut self.acceleration[slot * joints..][..joints],
            &mut self.norm_acceleration[slot * tools..][..tools],
        )
    }

    /// The rows at a jerk slot.
    #[inline(always)]
    pub(super) fn jerks(&mut self, problem: &Problem, slot: usize) -> (&mut [Row], &mut [Norm]) {
        let (joints, tools) = (problem.joints, problem.tool_jerks);
        (
            &mut self.jerk[slot * joints..][..joints],
            &mut self.norm_jerk[slot * tools..][..tools],
        )
    }
}

/// Computes the value of every row for the law `x`. The time is no number when the law is not
/// positive somewhere.
pub(super) struct Evaluate<'a> {
    pub problem: &'a Problem,
    pub x: &'a [f64],
    pub state: &'a mut State,
}

impl Op for Evaluate<'_> {
    type Output = Worth;

    #[inline(always)]
    fn run<S: Four>(mut self, simd: S) -> Worth {
        let zero = Wave::splat(simd, 0.0);
        let (mut flat, mut steep, mut time) = (zero, zero, zero);
        for (i, basis) in self.problem.basis.iter().enumerate() {
            let left = Spots::left(simd, basis, &self.x[LANE * i..]);
            let width = Wave::load(simd, &basis.width);
            for (slot, spot) in [(2 * i, left), (2 * i + 1, left.moved(width * 0.5))] {
                time += Wave::load(simd, &self.problem.weight[slot]) / spot.a.sqrt();
                flat = self.values(simd, slot, spot).max(flat);
            }
            for (slot, share) in jerk_places(self.problem, i) {
                let spot = left.moved(width * *share);
                steep = self.jerks(simd, slot, spot).max(steep);
            }
        }
        Worth {
            flat: flat.largest(),
            steep: steep.largest(),
            time: time.sum(),
        }
    }
}

impl Evaluate<'_> {
    /// The largest squared value at a slot of values.
    #[inline(always)]
    fn values<S: Four>(&mut self, simd: S, slot: usize, spot: Spots<S>) -> Wave<S> {
        let problem = self.problem;
        let cap = Wave::load(simd, &problem.cap[slot]) * spot.a;
        cap.store(&mut self.state.cap[slot].g);
        let mut most = cap * cap;
        let (rows, norms) = self.state.values(problem, slot);
        let lines = problem.acceleration[slot * problem.joints..].iter();
        for (row, line) in rows.iter_mut().zip(lines) {
            let [p, q] = line.map(|lane| Wave::load(simd, &lane));
            let g = p * spot.b + q * spot.a;
            g.store(&mut row.g);
            most = (g * g).max(most);
        }
        let lines = problem.norm_acceleration[slot * problem.tool_accelerations..].iter();
        for (norm, line) in norms.iter_mut().zip(lines) {
            let [p, q] = line;
            let g = combine([vector(simd, p), vector(simd, q)], [spot.b, spot.a]);
            norm.g = g.map(Wave::lane);
            most = dot(g, g).max(most);
        }
        most
    }

    /// The largest squared value at a jerk slot.
    #[inline(always)]
    fn jerks<S: Four>(&mut self, simd: S, slot: usize, spot: Spots<S>) -> Wave<S> {
        let problem = self.problem;
        let root = spot.a.sqrt();
        let (a, b, c) = (root * spot.a, root * spot.b, root * spot.c);
        let mut most = Wave::splat(simd, 0.0);
        let (rows, norms) = self.state.jerks(problem, slot);
        let lines = problem.jerk[slot * problem.joints..].iter();
        for (row, line) in rows.iter_mut().zip(lines) {
            let [x, y, z] = line.map(|lane| Wave::load(simd, &lane));
            let g = x * a + y * b + z * c;
            g.store(&mut row.g);
            most = (g * g).max(most);
        }
        let lines = problem.norm_jerk[slot * problem.tool_jerks..].iter();
        for (norm, line) in norms.iter_mut().zip(lines) {
            let [x, y, z] = line;
            let line = [vector(simd, x), vector(simd, y), vector(simd, z)];
            let g = combine(line, [a, b, c]);
            norm.g = g.map(Wave::lane);
            most = dot(g, g).max(most);
        }
        most
    }
}

/// What happens to the multipliers.
#[derive(Clone, Copy)]
pub(super) enum Turn {
    /// Put them in balance with the slacks, for this product of both.
    Balance(f64),
    /// Go this factor of their steps.
    Advance(f64),
}

/// Turns the multipliers; returns the sum of multiplier times slack.
pub(super) struct Multipliers<'a> {
    pub state: &'a mut State,
    pub turn: Turn,
}

impl Op for Multipliers<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> f64 {
        let one = Wave::splat(simd, 1.0);
        let mut total = Wave::splat(simd, 0.0);
        let (state, turn) = (self.state, self.turn);
        for row in state.acceleration.iter_mut().chain(&mut state.jerk) {
            let g = Wave::load(simd, &row.g);
            total += turn.take(one - g * g, &mut row.multiplier, &row.change);
        }
        for row in &mut state.cap {
            let g = Wave::load(simd, &row.g);
            total += turn.take(one - g, &mut row.multiplier, &row.change);
        }
        for row in state.norm_acceleration.iter_mut().chain(&mut state.norm_jerk) {
            let g = vector(simd, &row.g);
            total += turn.take(one - dot(g, g), &mut row.multiplier, &row.change);
        }
        total.sum()
    }
}

impl Turn {
    /// Turns one multiplier; returns its product with the slack.
    #[inline(always)]
    fn take<S: Four>(self, slack: Wave<S>, multiplier: &mut Lane, change: &Lane) -> Wave<S> {
        let simd = slack.simd();
        let new = match self {
            Self::Balance(mu) => Wave::splat(simd, mu) / slack,
            Self::Advance(factor) => {
                Wave::load(simd, multiplier) + Wave::load(simd, change) * factor
            }
        };
        new.store(multiplier);
        new * slack
    }
}
