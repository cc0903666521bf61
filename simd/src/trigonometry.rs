//! Sines and cosines of four angles at once.

use crate::f4::F4;
use crate::four::Four;

/// Sine and cosine of several angles at once, see [`sin_cos_of`].
#[inline(always)]
pub fn sin_cos<S: Four, const N: usize>(a: S, angles: [f64; N]) -> ([f64; N], [f64; N]) {
    let (mut sin, mut cos) = ([0.0; N], [0.0; N]);
    for first in (0..N).step_by(4) {
        // Not by copies of slices, which would be calls.
        let mut four = [0.0; 4];
        for (to, from) in four.iter_mut().zip(&angles[first..]) {
            *to = *from;
        }
        let (s, c) = sin_cos_of(F4::new(a, four));
        let (s, c) = (s.array(), c.array());
        for (i, (sin, cos)) in sin[first..]
            .iter_mut()
            .zip(&mut cos[first..])
            .enumerate()
            .take(4)
        {
            (*sin, *cos) = (s[i], c[i]);
        }
    }
    (sin, cos)
}

/// Sine and cosine of four angles (rad), within 2e-16 of the exact ones.
///
/// # Source
/// S. L. Moshier, Cephes Mathematical Library, 1989: reduction by pi/2 in three
/// parts, minimax polynomials on [-pi/4, pi/4].
#[inline(always)]
pub fn sin_cos_of<S: Four>(angles: F4<S>) -> (F4<S>, F4<S>) {
    const FAR: f64 = 1e6;
    let a = angles.build();
    if angles.abs().le(F4::splat(a, FAR)).bits() == 15 {
        return near_sin_cos_of(angles);
    }
    let far = far_sin_cos_of(angles.array());
    (F4::new(a, far.0), F4::new(a, far.1))
}

/// Sine and cosine of angles that are too large for the reduction.
#[cold]
fn far_sin_cos_of(angles: [f64; 4]) -> ([f64; 4], [f64; 4]) {
    (angles.map(f64::sin), angles.map(f64::cos))
}

/// Sine and cosine of four angles below 1e6 rad.
#[inline(always)]
fn near_sin_cos_of<S: Four>(angles: F4<S>) -> (F4<S>, F4<S>) {
    const MAGIC: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52: adding it rounds to an integer
    let a = angles.build();
    let quarter = F4::splat(a, std::f64::consts::FRAC_2_PI);
    let count = angles.fma(quarter, F4::splat(a, MAGIC));
    let turns = count - F4::splat(a, MAGIC);
    let mut x = turns.taken_from(F4::splat(a, 1.570_796_251_296_997), angles);
    x = turns.taken_from(F4::splat(a, 7.549_789_415_861_596e-8), x);
    x = turns.taken_from(F4::splat(a, 5.390_302_858_158_119e-15), x);
    let (s, c) = sin_cos_core(x);
    // Odd quarter turns swap sine and cosine; the second bit is half a turn.
    let (odd, half) = (count.bit::<63>(), count.bit::<62>());
    let (sin, cos) = (odd.select(c, s), odd.select(s, c));
    (half.select(-sin, sin), (odd ^ half).select(-cos, cos))
}

/// Both polynomials for `|x| <= pi/4`.
#[inline(always)]
fn sin_cos_core<S: Four>(x: F4<S>) -> (F4<S>, F4<S>) {
    let a = x.build();
    let z = x * x;
    let mut s = F4::splat(a, 1.589_623_015_765_465_7e-10);
    s = s.fma(z, F4::splat(a, -2.505_074_776_285_780_7e-8));
    s = s.fma(z, F4::splat(a, 2.755_731_362_138_572_4e-6));
    s = s.fma(z, F4::splat(a, -1.984_126_982_958_954e-4));
    s = s.fma(z, F4::splat(a, 8.333_333_333_322_118e-3));
    s = s.fma(z, F4::splat(a, -1.666_666_666_666_663e-1));
    let mut c = F4::splat(a, -1.135_853_652_138_768_2e-11);
    c = c.fma(z, F4::splat(a, 2.087_570_084_197_473e-9));
    c = c.fma(z, F4::splat(a, -2.755_731_417_929_674e-7));
    c = c.fma(z, F4::splat(a, 2.480_158_728_885_170_5e-5));
    c = c.fma(z, F4::splat(a, -1.388_888_888_887_305_6e-3));
    c = c.fma(z, F4::splat(a, 4.166_666_666_666_659e-2));
    let one = F4::splat(a, 1.0);
    let cos = (c * z).fma(z, z.taken_from(F4::splat(a, 0.5), one));
    ((s * z).fma(x, x), cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Build, Op, Plain};

    struct Both(f64);

    impl Op for Both {
        type Output = ([f64; 1], [f64; 1]);

        fn run<S: Four>(self, a: S) -> Self::Output {
            sin_cos(a, [self.0])
        }
    }

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
            let ([s], [c]) = Build::detect().run(Both(x));
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
