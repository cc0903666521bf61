//! Four numbers with operators, and masks of them.
//!
//! [`F4`] has the usual operators and is one register in the SIMD build. It contains the proof of
//! the build, so that its operations cannot be used on another processor.

use crate::four::{Four, LANES};
use std::ops::{Add, AddAssign, BitAnd, BitXor, Div, Mul, Neg, Sub};

/// Four numbers.
#[derive(Clone, Copy)]
pub struct F4<S: Four> {
    a: S,
    v: S::F,
}

/// Four booleans, one per number.
#[derive(Clone, Copy)]
pub struct Mask<S: Four> {
    a: S,
    v: S::B,
}

/// The first three of four vectors as rows: first numbers, second, third.
#[inline(always)]
pub fn transposed<S: Four>(columns: [F4<S>; 4]) -> [F4<S>; 3] {
    let [x, y, z, w] = columns;
    let [first, second, third] = x.a.transposed([x.v, y.v, z.v, w.v]);
    [x.with(first), x.with(second), x.with(third)]
}

impl<S: Four> F4<S> {
    /// Four numbers.
    #[inline(always)]
    pub fn new(a: S, x: [f64; 4]) -> Self {
        Self { a, v: a.pack(x) }
    }

    /// The same number four times.
    #[inline(always)]
    pub fn splat(a: S, x: f64) -> Self {
        Self { a, v: a.splat(x) }
    }

    /// The first four numbers of a slice; zeros where it is shorter than that.
    #[inline(always)]
    pub fn load(a: S, from: &[f64]) -> Self {
        Self { a, v: a.load(from) }
    }

    /// Four numbers from `at` on, or all and zeros where there are fewer than four; see [`groups`].
    #[inline(always)]
    pub fn some(a: S, all: &[f64], at: usize) -> Self {
        if all.len() >= LANES {
            return Self::load(a, &all[at..at + LANES]);
        }
        let mut lanes = [0.0; LANES];
        for (to, from) in lanes.iter_mut().zip(all) {
            *to = *from;
        }
        Self::load(a, &lanes)
    }

    /// Writes what [`F4::some`] reads.
    #[inline(always)]
    pub fn put(self, all: &mut [f64], at: usize) {
        if all.len() >= LANES {
            self.a.store(self.v, &mut all[at..at + LANES]);
            return;
        }
        for (to, from) in all.iter_mut().zip(self.array()) {
            *to = from;
        }
    }

    /// Writes the numbers to memory.
    #[inline(always)]
    pub fn store(self, to: &mut [f64; LANES]) {
        self.a.store(self.v, to);
    }

    /// The proof of the build of these numbers.
    #[inline(always)]
    pub fn build(self) -> S {
        self.a
    }

    /// The four numbers.
    #[inline(always)]
    pub fn array(self) -> [f64; 4] {
        self.a.unpack(self.v)
    }

    #[inline(always)]
    fn with(self, v: S::F) -> Self {
        Self { a: self.a, v }
    }

    /// `self * y + z`.
    #[inline(always)]
    #[must_use]
    pub fn fma(self, y: Self, z: Self) -> Self {
        self.with(self.a.mul_add(self.v, y.v, z.v))
    }

    /// `z - self * y`.
    #[inline(always)]
    #[must_use]
    pub fn taken_from(self, y: Self, z: Self) -> Self {
        self.with(self.a.mul_less(self.v, y.v, z.v))
    }

    /// The smaller of each pair; `y` where one of them is not a number.
    #[inline(always)]
    #[must_use]
    pub fn min(self, y: Self) -> Self {
        self.with(self.a.min(self.v, y.v))
    }

    /// The larger of each pair; `y` where one of them is not a number.
    #[inline(always)]
    #[must_use]
    pub fn max(self, y: Self) -> Self {
        self.with(self.a.max(self.v, y.v))
    }

    /// The square root of each number.
    #[inline(always)]
    #[must_use]
    pub fn sqrt(self) -> Self {
        self.with(self.a.sqrt(self.v))
    }

    /// The largest integer that is at most the number.
    #[inline(always)]
    #[must_use]
    pub fn floor(self) -> Self {
        self.with(self.a.floor(self.v))
    }

    /// The magnitude of each number.
    #[inline(always)]
    #[must_use]
    pub fn abs(self) -> Self {
        self.with(self.a.abs(self.v))
    }

    /// The magnitude of these numbers with the signs of `y`.
    #[inline(always)]
    #[must_use]
    pub fn signed(self, y: Self) -> Self {
        self.with(self.a.signed(self.v, y.v))
    }

    /// The second, third, first and fourth number.
    #[inline(always)]
    #[must_use]
    pub fn next(self) -> Self {
        self.with(self.a.next(self.v))
    }

    /// Whether the bit is set that is `BELOW` places below the sign bit.
    #[inline(always)]
    pub fn bit<const BELOW: i32>(self) -> Mask<S> {
        let a = self.a;
        Mask {
            a,
            v: a.bit::<BELOW>(self.v),
        }
    }

    /// `self <= y`; false if either is not a number.
    #[inline(always)]
    pub fn le(self, y: Self) -> Mask<S> {
        let a = self.a;
        Mask {
            a,
            v: a.le(self.v, y.v),
        }
    }
}

impl<S: Four> F4<S> {
    /// One over each number.
    #[inline(always)]
    #[must_use]
    pub fn inverse(self) -> Self {
        Self::splat(self.a, 1.0) / self
    }

    /// The sum of the four.
    #[inline(always)]
    pub fn sum(self) -> f64 {
        self.a.sum(self.v)
    }

    /// The largest of the four.
    #[inline(always)]
    pub fn largest(self) -> f64 {
        let [a, b, c, d] = self.array();
        a.max(b).max(c.max(d))
    }

    /// The least of the four.
    #[inline(always)]
    pub fn least(self) -> f64 {
        let [a, b, c, d] = self.array();
        a.min(b).min(c.min(d))
    }
}

/// Where groups of four of `count` numbers begin; the last group takes some once more where the
/// numbers do not fill it.
#[inline(always)]
pub fn groups(count: usize) -> impl Iterator<Item = usize> {
    let last = count.saturating_sub(LANES);
    (0..count.div_ceil(LANES)).map(move |group| (LANES * group).min(last))
}

impl<S: Four> Mask<S> {
    /// `yes` where true, otherwise `no`.
    #[inline(always)]
    pub fn select(self, yes: F4<S>, no: F4<S>) -> F4<S> {
        yes.with(self.a.select(self.v, yes.v, no.v))
    }

    /// Bit `i` is boolean `i`.
    #[inline(always)]
    pub fn bits(self) -> u8 {
        self.a.bits(self.v)
    }
}

impl<S: Four> BitAnd for Mask<S> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        let a = self.a;
        Self {
            a,
            v: a.and(self.v, o.v),
        }
    }
}

impl<S: Four> BitXor for Mask<S> {
    type Output = Self;

    #[inline(always)]
    fn bitxor(self, o: Self) -> Self {
        let a = self.a;
        Self {
            a,
            v: a.xor(self.v, o.v),
        }
    }
}

impl<S: Four> Add for F4<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.with(self.a.add(self.v, o.v))
    }
}

impl<S: Four> AddAssign for F4<S> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<S: Four> Sub for F4<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.with(self.a.sub(self.v, o.v))
    }
}

impl<S: Four> Mul for F4<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        self.with(self.a.mul(self.v, o.v))
    }
}

impl<S: Four> Div for F4<S> {
    type Output = Self;

    #[inline(always)]
    fn div(self, o: Self) -> Self {
        self.with(self.a.div(self.v, o.v))
    }
}

impl<S: Four> Neg for F4<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.with(self.a.neg(self.v))
    }
}

impl<S: Four> Mul<f64> for F4<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        self * Self::splat(self.a, o)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Build, Op};

    /// Every operation on four numbers, in the order of the trait.
    struct All([f64; 4], [f64; 4]);

    impl Op for All {
        type Output = (Vec<[f64; 4]>, [u8; 4]);

        fn run<S: Four>(self, a: S) -> Self::Output {
            let (x, y) = (F4::new(a, self.0), F4::new(a, self.1));
            let (less, not) = (x.le(y), y.le(x));
            let numbers = [
                x + y,
                x - y,
                x * y,
                x / y,
                x.fma(y, x),
                x.taken_from(y, y),
                x.min(y),
                x.max(y),
                x.abs().sqrt(),
                x.floor(),
                x.abs(),
                -x,
                x.signed(y),
                x.next(),
                less.select(x, y),
            ];
            let mut numbers = numbers.map(F4::array).to_vec();
            numbers.extend(transposed([x, y, -x, -y]).map(F4::array));
            let odd = x.bit::<11>();
            let bits = [less, less & not, less ^ not, odd].map(Mask::bits);
            (numbers, bits)
        }
    }

    /// Both builds do the same with numbers whose products are exact.
    #[test]
    fn builds_agree() {
        let (x, y) = ([1.5, -2.25, -0.0, 8.0], [0.5, 4.0, 2.0, -8.0]);
        let plain = Build::Plain.run(All(x, y));
        assert_eq!(plain, Build::detect().run(All(x, y)));
        assert_eq!(plain.0[3], [3.0, -0.5625, 0.0, -1.0]);
        assert_eq!(plain.0[9], [1.0, -3.0, 0.0, 8.0]);
        assert_eq!(plain.0[13], [-2.25, -0.0, 1.5, 8.0]);
        assert_eq!(plain.0[17], [-0.0, 2.0, 0.0, -2.0]);
        assert_eq!(plain.1, [0b0110, 0, 0b1111, 0b0001]);
    }
}
