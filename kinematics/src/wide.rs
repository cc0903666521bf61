//! Four numbers at once, in each build of the arithmetic.
//!
//! [`F4`] has the usual operators and is one register in the SIMD build. It contains the proof of
//! the build, so that its operations cannot be used on another processor.

use crate::four::Four;
use std::ops::{Add, BitAnd, BitXor, Div, Mul, Neg, Sub};

/// Four numbers.
#[derive(Clone, Copy)]
pub(crate) struct F4<A: Four> {
    a: A,
    v: A::F,
}

/// Four booleans.
#[derive(Clone, Copy)]
pub(crate) struct B4<A: Four> {
    a: A,
    v: A::B,
}

/// The first three of four vectors as rows: first numbers, second, third.
#[inline(always)]
pub(crate) fn transposed<A: Four>(columns: [F4<A>; 4]) -> [F4<A>; 3] {
    let [x, y, z, w] = columns;
    let [first, second, third] = x.a.transposed([x.v, y.v, z.v, w.v]);
    [x.with(first), x.with(second), x.with(third)]
}

impl<A: Four> F4<A> {
    #[inline(always)]
    pub(crate) fn new(a: A, x: [f64; 4]) -> Self {
        Self { a, v: a.pack(x) }
    }

    #[inline(always)]
    pub(crate) fn splat(a: A, x: f64) -> Self {
        Self::new(a, [x; 4])
    }

    /// The proof of the build of these numbers.
    #[inline(always)]
    pub(crate) fn build(self) -> A {
        self.a
    }

    #[inline(always)]
    pub(crate) fn array(self) -> [f64; 4] {
        self.a.unpack(self.v)
    }

    #[inline(always)]
    fn with(self, v: A::F) -> Self {
        Self { a: self.a, v }
    }

    /// `self * y + z`.
    #[inline(always)]
    pub(crate) fn fma(self, y: Self, z: Self) -> Self {
        self.with(self.a.mul_add(self.v, y.v, z.v))
    }

    /// `z - self * y`.
    #[inline(always)]
    pub(crate) fn taken_from(self, y: Self, z: Self) -> Self {
        self.with(self.a.mul_less(self.v, y.v, z.v))
    }

    #[inline(always)]
    pub(crate) fn min(self, y: Self) -> Self {
        self.with(self.a.min(self.v, y.v))
    }

    #[inline(always)]
    pub(crate) fn max(self, y: Self) -> Self {
        self.with(self.a.max(self.v, y.v))
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        self.with(self.a.sqrt(self.v))
    }

    #[inline(always)]
    pub(crate) fn floor(self) -> Self {
        self.with(self.a.floor(self.v))
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        self.with(self.a.abs(self.v))
    }

    /// The size of these numbers with the signs of `y`.
    #[inline(always)]
    pub(crate) fn signed(self, y: Self) -> Self {
        self.with(self.a.signed(self.v, y.v))
    }

    /// The second, third, first and fourth number.
    #[inline(always)]
    pub(crate) fn next(self) -> Self {
        self.with(self.a.next(self.v))
    }

    /// Whether the bit is set that is `BELOW` places below the sign bit.
    #[inline(always)]
    pub(crate) fn bit<const BELOW: i32>(self) -> B4<A> {
        let a = self.a;
        B4 {
            a,
            v: a.bit::<BELOW>(self.v),
        }
    }

    #[inline(always)]
    pub(crate) fn le(self, y: Self) -> B4<A> {
        let a = self.a;
        B4 {
            a,
            v: a.le(self.v, y.v),
        }
    }
}

impl<A: Four> B4<A> {
    /// `yes` where true, otherwise `no`.
    #[inline(always)]
    pub(crate) fn select(self, yes: F4<A>, no: F4<A>) -> F4<A> {
        yes.with(self.a.select(self.v, yes.v, no.v))
    }

    /// Bit `i` is boolean `i`.
    #[inline(always)]
    pub(crate) fn bits(self) -> u8 {
        self.a.bits(self.v)
    }
}

impl<A: Four> BitAnd for B4<A> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        let a = self.a;
        Self {
            a,
            v: a.both(self.v, o.v),
        }
    }
}

impl<A: Four> BitXor for B4<A> {
    type Output = Self;

    #[inline(always)]
    fn bitxor(self, o: Self) -> Self {
        let a = self.a;
        Self {
            a,
            v: a.either(self.v, o.v),
        }
    }
}

impl<A: Four> Add for F4<A> {
    type Output = Self;

    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.with(self.a.add(self.v, o.v))
    }
}

impl<A: Four> Sub for F4<A> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.with(self.a.sub(self.v, o.v))
    }
}

impl<A: Four> Mul for F4<A> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        self.with(self.a.mul(self.v, o.v))
    }
}

impl<A: Four> Div for F4<A> {
    type Output = Self;

    #[inline(always)]
    fn div(self, o: Self) -> Self {
        self.with(self.a.div(self.v, o.v))
    }
}

impl<A: Four> Neg for F4<A> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.with(self.a.neg(self.v))
    }
}

impl<A: Four> Mul<f64> for F4<A> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        self * Self::splat(self.a, o)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arith::{Arith, Build, Op};

    /// Every operation on four numbers, in the order of the trait.
    struct All([f64; 4], [f64; 4]);

    impl Op for All {
        type Output = (Vec<[f64; 4]>, [u8; 4]);

        fn run<A: Arith>(self, a: A) -> Self::Output {
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
            let bits = [less, less & not, less ^ not, odd].map(B4::bits);
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
