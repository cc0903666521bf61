//! Arithmetic in two builds: wide (AVX2 and FMA) where the processor has it,
//! plain elsewhere. The choice is made once, when a chain is built.
//!
//! The same generic code is compiled twice. Both builds differ only in the
//! rounding of fused multiply-adds; see [`crate::Chain::plain`] for the bound.
//! Everything that a dispatched function calls must be inlined into it, or it
//! falls back to the plain instruction set.

/// Multiply and add, fused or not.
pub(crate) trait Arith: Copy {
    /// `a * b + c`.
    fn fma(self, a: f64, b: f64, c: f64) -> f64;
}

/// Separate multiply and add: every processor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain;

/// Fused multiply-add; only for code compiled for processors that have it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fused;

impl Arith for Plain {
    #[inline(always)]
    fn fma(self, a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }
}

impl Arith for Fused {
    #[inline(always)]
    fn fma(self, a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
}

/// A computation that is compiled for both builds. `run` must be `#[inline(always)]`.
pub(crate) trait Op {
    /// What it computes.
    type Output;
    /// Computes it.
    fn run<A: Arith>(self, arith: A) -> Self::Output;
}

/// Which build to use: proof that the processor can, or the plain one.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Build {
    Plain,
    #[cfg(target_arch = "x86_64")]
    Wide(pulp::x86::V3),
    #[cfg(target_arch = "aarch64")]
    Wide,
}

impl Build {
    /// The best that this processor has.
    pub(crate) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            pulp::x86::V3::try_new().map_or(Self::Plain, Self::Wide)
        }
        #[cfg(target_arch = "aarch64")]
        {
            Self::Wide
        }
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        {
            Self::Plain
        }
    }

    /// Runs a computation in this build.
    #[inline(always)]
    pub(crate) fn run<O: Op>(self, op: O) -> O::Output {
        match self {
            Self::Plain => op.run(Plain),
            #[cfg(target_arch = "x86_64")]
            Self::Wide(simd) => simd.vectorize(Wide(op)),
            #[cfg(target_arch = "aarch64")]
            Self::Wide => op.run(Fused),
        }
    }
}

/// Adapter for `pulp`, which compiles `call` for the wide instruction set.
#[cfg(target_arch = "x86_64")]
struct Wide<O>(O);

#[cfg(target_arch = "x86_64")]
impl<O: Op> pulp::NullaryFnOnce for Wide<O> {
    type Output = O::Output;

    #[inline(always)]
    fn call(self) -> O::Output {
        self.0.run(Fused)
    }
}

/// Four numbers that one wide register holds; the fourth of a direction is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(crate) struct V4(pub(crate) [f64; 4]);

impl V4 {
    pub(crate) const ZERO: Self = Self([0.0; 4]);

    #[inline(always)]
    pub(crate) fn new(x: f64, y: f64, z: f64) -> Self {
        Self([x, y, z, 0.0])
    }

    /// `self * s`.
    #[inline(always)]
    pub(crate) fn scale(self, s: f64) -> Self {
        let v = self.0;
        Self([v[0] * s, v[1] * s, v[2] * s, v[3] * s])
    }

    /// `self * s + c`.
    #[inline(always)]
    pub(crate) fn scale_add<A: Arith>(self, a: A, s: f64, c: Self) -> Self {
        let (v, c) = (self.0, c.0);
        Self([
            a.fma(v[0], s, c[0]),
            a.fma(v[1], s, c[1]),
            a.fma(v[2], s, c[2]),
            a.fma(v[3], s, c[3]),
        ])
    }

    #[inline(always)]
    pub(crate) fn sub(self, o: Self) -> Self {
        let (v, o) = (self.0, o.0);
        Self([v[0] - o[0], v[1] - o[1], v[2] - o[2], v[3] - o[3]])
    }

    /// Vector product of the first three.
    #[inline(always)]
    pub(crate) fn cross<A: Arith>(self, a: A, o: Self) -> Self {
        let (v, o) = (self.0, o.0);
        Self([
            a.fma(v[1], o[2], -(v[2] * o[1])),
            a.fma(v[2], o[0], -(v[0] * o[2])),
            a.fma(v[0], o[1], -(v[1] * o[0])),
            0.0,
        ])
    }
}

/// Sine and cosine of several angles at once, within 2e-16 of the exact ones.
///
/// # Source
/// S. L. Moshier, Cephes Mathematical Library, 1989: reduction by pi/2 in three
/// parts, minimax polynomials on [-pi/4, pi/4].
#[inline(always)]
pub(crate) fn sin_cos<A: Arith, const N: usize>(a: A, angles: [f64; N]) -> ([f64; N], [f64; N]) {
    const MAGIC: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52: adding it rounds to an integer
    const FAR: f64 = 1e6;
    let (mut sin, mut cos) = ([0.0; N], [0.0; N]);
    let mut far = false;
    for i in 0..N {
        let shifted = a.fma(angles[i], std::f64::consts::FRAC_2_PI, MAGIC);
        let turns = shifted - MAGIC;
        let quadrant = shifted.to_bits();
        let mut x = a.fma(-turns, 1.570_796_251_296_997, angles[i]);
        x = a.fma(-turns, 7.549_789_415_861_596e-8, x);
        x = a.fma(-turns, 5.390_302_858_158_119e-15, x);
        let z = x * x;
        let (s, c) = sin_cos_core(a, x, z);
        let swap = quadrant & 1 != 0;
        let (s, c) = if swap { (c, s) } else { (s, c) };
        sin[i] = f64::from_bits(s.to_bits() ^ ((quadrant & 2) << 62));
        cos[i] = f64::from_bits(c.to_bits() ^ ((quadrant.wrapping_add(1) & 2) << 62));
        far |= angles[i].abs() > FAR || angles[i].is_nan();
    }
    if far {
        for i in 0..N {
            (sin[i], cos[i]) = angles[i].sin_cos();
        }
    }
    (sin, cos)
}

/// Both polynomials for `|x| <= pi/4`, `z = x^2`.
#[inline(always)]
fn sin_cos_core<A: Arith>(a: A, x: f64, z: f64) -> (f64, f64) {
    let mut s = a.fma(1.589_623_015_765_465_7e-10, z, -2.505_074_776_285_780_7e-8);
    s = a.fma(s, z, 2.755_731_362_138_572_4e-6);
    s = a.fma(s, z, -1.984_126_982_958_954e-4);
    s = a.fma(s, z, 8.333_333_333_322_118e-3);
    s = a.fma(s, z, -1.666_666_666_666_663e-1);
    let mut c = a.fma(-1.135_853_652_138_768_2e-11, z, 2.087_570_084_197_473e-9);
    c = a.fma(c, z, -2.755_731_417_929_674e-7);
    c = a.fma(c, z, 2.480_158_728_885_170_5e-5);
    c = a.fma(c, z, -1.388_888_888_887_305_6e-3);
    c = a.fma(c, z, 4.166_666_666_666_659e-2);
    (a.fma(s * z, x, x), a.fma(c * z, z, a.fma(-0.5, z, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sine and cosine agree with the standard library to two units in the last place of one.
    #[test]
    fn sin_cos_agrees_with_std() {
        for i in -200_000..200_000 {
            let x = f64::from(i) * 1.234_567_89e-3;
            let ([s], [c]) = sin_cos(Plain, [x]);
            assert!(
                (s - x.sin()).abs() < 4e-16 && (c - x.cos()).abs() < 4e-16,
                "{x}"
            );
            let ([s], [c]) = sin_cos(Fused, [x]);
            assert!(
                (s - x.sin()).abs() < 4e-16 && (c - x.cos()).abs() < 4e-16,
                "{x}"
            );
        }
        for x in [1e7, -3e9, f64::MAX] {
            assert_eq!(sin_cos(Plain, [x]), ([x.sin()], [x.cos()]));
        }
        assert!(sin_cos(Plain, [f64::NAN]).0[0].is_nan());
    }
}
