//! Numbers of four neighbouring cells at once.

use std::ops::{Add, AddAssign, Div, Mul, Sub};

use crate::wide::{Four, LANES};

/// Cells in a block.
pub(super) const LANE: usize = LANES;

/// One number of each cell of a block.
pub(super) type Lane = [f64; LANE];

/// A [`Lane`] in a register, with the build that computes on it.
#[derive(Clone, Copy)]
pub(super) struct Packed<S: Four> {
    simd: S,
    x: S::F,
}

impl<S: Four> Packed<S> {
    /// The same number for each cell.
    #[inline(always)]
    pub(super) fn splat(simd: S, x: f64) -> Self {
        let x = simd.splat(x);
        Self { simd, x }
    }

    /// The first four numbers of a slice.
    #[inline(always)]
    pub(super) fn load(simd: S, from: &[f64]) -> Self {
        let x = simd.load(from);
        Self { simd, x }
    }

    /// Four numbers from `at` on, or all and zeros where there are fewer than four.
    #[inline(always)]
    pub(super) fn some(simd: S, all: &[f64], at: usize) -> Self {
        if all.len() >= LANE {
            return Self::load(simd, &all[at..at + LANE]);
        }
        let mut lane = [0.0; LANE];
        lane[..all.len()].copy_from_slice(all);
        Self::load(simd, &lane)
    }

    /// Writes what [`Packed::some`] reads.
    #[inline(always)]
    pub(super) fn put(self, all: &mut [f64], at: usize) {
        if all.len() >= LANE {
            self.simd.store(self.x, &mut all[at..at + LANE]);
            return;
        }
        let (lane, count) = (self.lane(), all.len());
        all.copy_from_slice(&lane[..count]);
    }

    /// The build that computes on it.
    #[inline(always)]
    pub(super) fn simd(self) -> S {
        self.simd
    }

    /// Writes the numbers to memory.
    #[inline(always)]
    pub(super) fn store(self, to: &mut Lane) {
        self.simd.store(self.x, to);
    }

    /// The numbers as an array.
    #[inline(always)]
    pub(super) fn lane(self) -> Lane {
        let mut lane = [0.0; LANE];
        self.store(&mut lane);
        lane
    }

    /// The larger of each pair; `other` if one of them is NaN.
    #[inline(always)]
    pub(super) fn max(self, other: Self) -> Self {
        let x = self.simd.max(self.x, other.x);
        Self { x, ..self }
    }

    /// The magnitude of each number.
    #[inline(always)]
    pub(super) fn abs(self) -> Self {
        self.max(Self::splat(self.simd, 0.0) - self)
    }

    /// The square root of each number.
    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        let x = self.simd.sqrt(self.x);
        Self { x, ..self }
    }

    /// One over each number.
    #[inline(always)]
    pub(super) fn inverse(self) -> Self {
        Self::splat(self.simd, 1.0) / self
    }

    /// The sum of the four.
    #[inline(always)]
    pub(super) fn sum(self) -> f64 {
        self.simd.sum(self.x)
    }

    /// The largest of the four.
    #[inline(always)]
    pub(super) fn largest(self) -> f64 {
        let [a, b, c, d] = self.lane();
        a.max(b).max(c.max(d))
    }

    /// The least of the four.
    #[inline(always)]
    pub(super) fn least(self) -> f64 {
        let [a, b, c, d] = self.lane();
        a.min(b).min(c.min(d))
    }
}

impl<S: Four> Add for Packed<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let x = self.simd.add(self.x, other.x);
        Self { x, ..self }
    }
}

impl<S: Four> Sub for Packed<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let x = self.simd.sub(self.x, other.x);
        Self { x, ..self }
    }
}

impl<S: Four> Mul for Packed<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let x = self.simd.mul(self.x, other.x);
        Self { x, ..self }
    }
}

impl<S: Four> Mul<f64> for Packed<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self * Self::splat(self.simd, factor)
    }
}

impl<S: Four> Div for Packed<S> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let x = self.simd.div(self.x, other.x);
        Self { x, ..self }
    }
}

impl<S: Four> AddAssign for Packed<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// The starts of groups of four of `count` numbers; the last group overlaps the one before if the
/// numbers do not fill it.
#[inline(always)]
pub(super) fn groups(count: usize) -> impl Iterator<Item = usize> {
    let last = count.saturating_sub(LANE);
    (0..count.div_ceil(LANE)).map(move |group| (LANE * group).min(last))
}

/// The scalar product of two vectors in each cell.
#[inline(always)]
pub(super) fn dot<S: Four>(a: [Packed<S>; 3], b: [Packed<S>; 3]) -> Packed<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `sum_i rows[i] * factors[i]` for rows that are vectors in each cell.
#[inline(always)]
pub(super) fn combine<S: Four, const M: usize>(
    rows: [[Packed<S>; 3]; M],
    factors: [Packed<S>; M],
) -> [Packed<S>; 3] {
    let first = factors[0];
    let mut out = rows[0];
    for x in &mut out {
        *x = *x * first;
    }
    for k in 1..M {
        for (out, row) in out.iter_mut().zip(rows[k]) {
            *out += row * factors[k];
        }
    }
    out
}
