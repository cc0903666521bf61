//! Computes values and multipliers of the rows of a problem under a law.

use super::block::{LANE, Lane, dot, lanes, times, times_two};
use super::lines::{Jerks, Lines, Values};
use super::problem::{Basis, Problem};
use super::state::{ConstraintRow, State};
use simd::{F4, Four, Op};

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
    pub a: F4<S>,
    pub b: F4<S>,
    pub c: F4<S>,
}

impl<S: Four> Spots<S> {
    /// At the left ends, from the unknowns beginning with those of the block.
    #[inline(always)]
    pub(super) fn left(simd: S, basis: &Basis, x: &[f64]) -> Self {
        let x: &[f64; LANE + 2] = x.first_chunk().unwrap_or(&[1.0; LANE + 2]);
        let x0 = F4::load(simd, &x[..LANE]);
        let x1 = F4::load(simd, &x[1..LANE + 1]);
        let x2 = F4::load(simd, &x[2..]);
        let b = (x1 - x0) * F4::load(simd, &basis.left);
        let next = (x2 - x1) * F4::load(simd, &basis.right);
        let (first, second) = (F4::load(simd, &basis.first), F4::load(simd, &basis.second));
        Self {
            a: x0 * first + x1 * second,
            b,
            c: (next - b) * F4::load(simd, &basis.inverse),
        }
    }

    /// `x` further on.
    #[inline(always)]
    pub(super) fn moved(self, x: F4<S>) -> Self {
        let gain = x * self.c;
        Self {
            a: self.a + x * (self.b + self.b + gain),
            b: self.b + gain,
            c: self.c,
        }
    }
}

/// Computes the value of every row for the law `x`. The time is NaN if the law is not positive
/// everywhere.
pub(super) struct Evaluate<'a> {
    pub problem: &'a Problem,
    pub x: &'a [f64],
    pub state: &'a mut State,
}

impl Op for Evaluate<'_> {
    type Output = Worth;

    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> Worth {
        let zero = F4::splat(simd, 0.0);
        let (mut flat, mut steep, mut time) = (zero, zero, zero);
        let (mut lines, blocks) = Lines::all(self.problem, self.state);
        for (i, (basis, value, cap)) in blocks.enumerate() {
            let left = Spots::left(simd, basis, &self.x[LANE * i..]);
            let width = F4::load(simd, &basis.width);
            let middle = left.moved(width * 0.5);
            time += F4::load(simd, &value[0][0]) / left.a.sqrt();
            time += F4::load(simd, &value[1][0]) / middle.a.sqrt();
            let [first, second] = cap;
            flat = self::cap(&value[0][1], first, left).max(flat);
            flat = self::cap(&value[1][1], second, middle).max(flat);
            flat = values(lines.values(), left).max(flat);
            flat = values(lines.values(), middle).max(flat);
            for share in self.problem.jerk_shares(i) {
                let spot = left.moved(width * *share);
                steep = jerks(lines.jerks(), spot).max(steep);
            }
        }
        Worth {
            flat: flat.largest(),
            steep: steep.largest(),
            time: time.sum(),
        }
    }
}

/// Sets the ratios to caps; returns their squares.
#[inline(always)]
fn cap<S: Four>(cap: &Lane, row: &mut ConstraintRow, spot: Spots<S>) -> F4<S> {
    let g = F4::load(spot.a.build(), cap) * spot.a;
    g.store(&mut row.g);
    g * g
}

/// Sets the values at a slot; returns the largest square.
#[inline(always)]
fn values<S: Four>(slot: Values<'_>, spot: Spots<S>) -> F4<S> {
    let simd = spot.a.build();
    let mut most = F4::splat(simd, 0.0);
    for ([p, q], row) in slot.joints.0.iter().zip(slot.joints.1) {
        let g = F4::load(simd, p) * spot.b + F4::load(simd, q) * spot.a;
        g.store(&mut row.g);
        most = (g * g).max(most);
    }
    for (line, norm) in slot.tools.0.iter().zip(slot.tools.1) {
        let [a, b] = times_two(lanes(simd, line), [spot.a, spot.b]);
        let square = a * spot.a + b * spot.b;
        square.store(&mut norm.square);
        most = square.max(most);
    }
    most
}

/// Sets the values at a jerk slot; returns the largest square.
#[inline(always)]
fn jerks<S: Four>(slot: Jerks<'_>, spot: Spots<S>) -> F4<S> {
    let simd = spot.a.build();
    let root = spot.a.sqrt();
    let (a, b, c) = (root * spot.a, root * spot.b, root * spot.c);
    let mut most = F4::splat(simd, 0.0);
    for ([x, y, z], row) in slot.joints.0.iter().zip(slot.joints.1) {
        let (x, y, z) = (F4::load(simd, x), F4::load(simd, y), F4::load(simd, z));
        let g = dot([x, y, z], [a, b, c]);
        g.store(&mut row.g);
        most = (g * g).max(most);
    }
    for (line, norm) in slot.tools.0.iter().zip(slot.tools.1) {
        let square = dot(times(lanes(simd, line), [a, b, c]), [a, b, c]);
        square.store(&mut norm.square);
        most = square.max(most);
    }
    most
}

/// What happens to the multipliers.
#[derive(Clone, Copy)]
pub(super) enum Turn {
    /// Sets the multipliers so that their product with the slacks has this value.
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
        let one = F4::splat(simd, 1.0);
        let mut total = F4::splat(simd, 0.0);
        let (state, turn) = (self.state, self.turn);
        for row in state.acceleration.iter_mut().chain(&mut state.jerk) {
            let g = F4::load(simd, &row.g);
            total += turn.take(one - g * g, &mut row.multiplier, &row.change);
        }
        for row in state.cap.iter_mut().flatten() {
            let g = F4::load(simd, &row.g);
            total += turn.take(one - g, &mut row.multiplier, &row.change);
        }
        for row in state
            .norm_acceleration
            .iter_mut()
            .chain(&mut state.norm_jerk)
        {
            let square = F4::load(simd, &row.square);
            total += turn.take(one - square, &mut row.multiplier, &row.change);
        }
        total.sum()
    }
}

impl Turn {
    /// Turns one multiplier; returns its product with the slack.
    #[inline(always)]
    fn take<S: Four>(self, slack: F4<S>, multiplier: &mut Lane, change: &Lane) -> F4<S> {
        let simd = slack.build();
        let new = match self {
            Self::Balance(mu) => F4::splat(simd, mu) / slack,
            Self::Advance(factor) => F4::load(simd, multiplier) + F4::load(simd, change) * factor,
        };
        new.store(multiplier);
        new * slack
    }
}
