//! The SIMD build.

use crate::four::Four;

/// Fused multiply-add and SIMD registers, with the proof that the processor has them.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub struct Fused(pub(crate) pulp::x86::V3);

/// Fused multiply-add; only for processors that have it.
#[cfg(not(target_arch = "x86_64"))]
#[derive(Clone, Copy, Debug)]
pub struct Fused(pub(crate) ());

#[cfg(not(target_arch = "x86_64"))]
crate::four::lane_by_lane!(Fused, |x, y, z| x.mul_add(y, z));

#[cfg(target_arch = "x86_64")]
impl Four for Fused {
    type F = std::arch::x86_64::__m256d;
    type B = std::arch::x86_64::__m256d;

    #[inline(always)]
    fn fma(self, a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
    #[inline(always)]
    fn splat(self, x: f64) -> Self::F {
        self.0.avx._mm256_set1_pd(x)
    }
    #[inline(always)]
    fn pack(self, x: [f64; 4]) -> Self::F {
        pulp::cast(x)
    }
    #[inline(always)]
    fn unpack(self, x: Self::F) -> [f64; 4] {
        pulp::cast(x)
    }
    #[inline(always)]
    fn add(self, x: Self::F, y: Self::F) -> Self::F {
        self.0.avx._mm256_add_pd(x, y)
    }
    #[inline(always)]
    fn sub(self, x: Self::F, y: Self::F) -> Self::F {
        self.0.avx._mm256_sub_pd(x, y)
    }
    #[inline(always)]
    fn mul(self, x: Self::F, y: Self::F) -> Self::F {
        self.0.avx._mm256_mul_pd(x, y)
    }
    #[inline(always)]
    fn div(self, x: Self::F, y: Self::F) -> Self::F {
        self.0.avx._mm256_div_pd(x, y)
    }
    #[inline(always)]
    fn mul_add(self, x: Self::F, y: Self::F, z: Self::F) -> Self::F {
        self.0.fma._mm256_fmadd_pd(x, y, z)
    }
    #[inline(always)]
    fn mul_less(self, x: Self::F, y: Self::F, z: Self::F) -> Self::F {
        self.0.fma._mm256_fnmadd_pd(x, y, z)
    }
    #[inline(always)]
    fn min(self, x: Self::F, y: Self::F) -> Self::F {
        self.0.avx._mm256_min_pd(x, y)
    }
    #[inline(always)]
    fn max(self, x: Self::F, y: Self::F) -> Self::F {
        self.0.avx._mm256_max_pd(x, y)
    }
    #[inline(always)]
    fn sqrt(self, x: Self::F) -> Self::F {
        self.0.avx._mm256_sqrt_pd(x)
    }
    #[inline(always)]
    fn floor(self, x: Self::F) -> Self::F {
        self.0.avx._mm256_floor_pd(x)
    }
    #[inline(always)]
    fn abs(self, x: Self::F) -> Self::F {
        self.0.avx._mm256_andnot_pd(self.pack([-0.0; 4]), x)
    }
    #[inline(always)]
    fn neg(self, x: Self::F) -> Self::F {
        self.0.avx._mm256_xor_pd(self.pack([-0.0; 4]), x)
    }
    #[inline(always)]
    fn signed(self, x: Self::F, y: Self::F) -> Self::F {
        let (avx, sign) = (self.0.avx, self.pack([-0.0; 4]));
        avx._mm256_or_pd(avx._mm256_andnot_pd(sign, x), avx._mm256_and_pd(sign, y))
    }
    #[inline(always)]
    fn next(self, x: Self::F) -> Self::F {
        self.0.avx2._mm256_permute4x64_pd::<0b11_00_10_01>(x)
    }
    #[inline(always)]
    fn transposed(self, [x, y, z, w]: [Self::F; 4]) -> [Self::F; 3] {
        let avx = self.0.avx;
        let (xy, zw) = (avx._mm256_unpacklo_pd(x, y), avx._mm256_unpacklo_pd(z, w));
        let (odd_xy, odd_zw) = (avx._mm256_unpackhi_pd(x, y), avx._mm256_unpackhi_pd(z, w));
        [
            avx._mm256_permute2f128_pd::<0x20>(xy, zw),
            avx._mm256_permute2f128_pd::<0x20>(odd_xy, odd_zw),
            avx._mm256_permute2f128_pd::<0x31>(xy, zw),
        ]
    }
    #[inline(always)]
    fn le(self, x: Self::F, y: Self::F) -> Self::B {
        const LESS_OR_EQUAL: i32 = std::arch::x86_64::_CMP_LE_OQ;
        self.0.avx._mm256_cmp_pd::<LESS_OR_EQUAL>(x, y)
    }
    #[inline(always)]
    fn select(self, mask: Self::B, yes: Self::F, no: Self::F) -> Self::F {
        self.0.avx._mm256_blendv_pd(no, yes, mask)
    }
    #[inline(always)]
    fn and(self, x: Self::B, y: Self::B) -> Self::B {
        self.0.avx._mm256_and_pd(x, y)
    }
    #[inline(always)]
    fn xor(self, x: Self::B, y: Self::B) -> Self::B {
        self.0.avx._mm256_xor_pd(x, y)
    }
    #[inline(always)]
    fn bit<const BELOW: i32>(self, x: Self::F) -> Self::B {
        // Selections look at the sign only.
        pulp::cast(self.0.avx2._mm256_slli_epi64::<BELOW>(pulp::cast(x)))
    }
    #[inline(always)]
    fn bits(self, x: Self::B) -> u8 {
        self.0.avx._mm256_movemask_pd(x) as u8
    }
}
