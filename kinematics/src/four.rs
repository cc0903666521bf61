//! Operations on four numbers, in each build of the arithmetic.

use crate::arith::{Fused, Plain};

/// Operations of a build on four numbers at once.
pub(crate) trait Four: Copy {
    /// Four numbers.
    type F: Copy;
    /// Four booleans.
    type B: Copy;

    fn pack(self, x: [f64; 4]) -> Self::F;
    fn unpack(self, x: Self::F) -> [f64; 4];
    fn add(self, x: Self::F, y: Self::F) -> Self::F;
    fn sub(self, x: Self::F, y: Self::F) -> Self::F;
    fn mul(self, x: Self::F, y: Self::F) -> Self::F;
    fn div(self, x: Self::F, y: Self::F) -> Self::F;
    /// `x y + z`.
    fn mul_add(self, x: Self::F, y: Self::F, z: Self::F) -> Self::F;
    /// `z - x y`.
    fn mul_less(self, x: Self::F, y: Self::F, z: Self::F) -> Self::F;
    fn min(self, x: Self::F, y: Self::F) -> Self::F;
    fn max(self, x: Self::F, y: Self::F) -> Self::F;
    fn sqrt(self, x: Self::F) -> Self::F;
    fn floor(self, x: Self::F) -> Self::F;
    fn abs(self, x: Self::F) -> Self::F;
    fn neg(self, x: Self::F) -> Self::F;
    /// The size of `x` with the sign of `y`.
    fn signed(self, x: Self::F, y: Self::F) -> Self::F;
    /// The second, third, first and fourth number.
    fn next(self, x: Self::F) -> Self::F;
    /// The first three of four vectors as rows: first numbers, second, third.
    fn transposed(self, columns: [Self::F; 4]) -> [Self::F; 3];
    /// `x <= y`; false if either is NaN.
    fn le(self, x: Self::F, y: Self::F) -> Self::B;
    fn select(self, mask: Self::B, yes: Self::F, no: Self::F) -> Self::F;
    fn both(self, x: Self::B, y: Self::B) -> Self::B;
    fn either(self, x: Self::B, y: Self::B) -> Self::B;
    /// Whether the bit is set that is `BELOW` places below the sign bit.
    fn bit<const BELOW: i32>(self, x: Self::F) -> Self::B;
    /// Bit `i` is boolean `i`.
    fn bits(self, x: Self::B) -> u8;
}

/// A build without SIMD registers computes one lane after the other.
macro_rules! lane_by_lane {
    ($build:ty, $fma:expr) => {
        impl Four for $build {
            type F = [f64; 4];
            type B = [bool; 4];

            #[inline(always)]
            fn pack(self, x: [f64; 4]) -> [f64; 4] {
                x
            }
            #[inline(always)]
            fn unpack(self, x: [f64; 4]) -> [f64; 4] {
                x
            }
            #[inline(always)]
            fn add(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
                [x[0] + y[0], x[1] + y[1], x[2] + y[2], x[3] + y[3]]
            }
            #[inline(always)]
            fn sub(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
                [x[0] - y[0], x[1] - y[1], x[2] - y[2], x[3] - y[3]]
            }
            #[inline(always)]
            fn mul(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
                [x[0] * y[0], x[1] * y[1], x[2] * y[2], x[3] * y[3]]
            }
            #[inline(always)]
            fn div(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
                [x[0] / y[0], x[1] / y[1], x[2] / y[2], x[3] / y[3]]
            }
            #[inline(always)]
            fn mul_add(self, x: [f64; 4], y: [f64; 4], z: [f64; 4]) -> [f64; 4] {
                let fma: fn(f64, f64, f64) -> f64 = $fma;
                std::array::from_fn(|i| fma(x[i], y[i], z[i]))
            }
            #[inline(always)]
            fn mul_less(self, x: [f64; 4], y: [f64; 4], z: [f64; 4]) -> [f64; 4] {
                let fma: fn(f64, f64, f64) -> f64 = $fma;
                std::array::from_fn(|i| fma(-x[i], y[i], z[i]))
            }
            #[inline(always)]
            fn min(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
                std::array::from_fn(|i| if x[i] < y[i] { x[i] } else { y[i] })
            }
            #[inline(always)]
            fn max(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
                std::array::from_fn(|i| if x[i] > y[i] { x[i] } else { y[i] })
            }
            #[inline(always)]
            fn sqrt(self, x: [f64; 4]) -> [f64; 4] {
                x.map(f64::sqrt)
            }
            #[inline(always)]
            fn floor(self, x: [f64; 4]) -> [f64; 4] {
                x.map(f64::floor)
            }
            #[inline(always)]
            fn abs(self, x: [f64; 4]) -> [f64; 4] {
                x.map(f64::abs)
            }
            #[inline(always)]
            fn neg(self, x: [f64; 4]) -> [f64; 4] {
                [-x[0], -x[1], -x[2], -x[3]]
            }
            #[inline(always)]
            fn signed(self, x: [f64; 4], y: [f64; 4]) -> [f64; 4] {
                std::array::from_fn(|i| x[i].copysign(y[i]))
            }
            #[inline(always)]
            fn next(self, x: [f64; 4]) -> [f64; 4] {
                [x[1], x[2], x[0], x[3]]
            }
            #[inline(always)]
            fn transposed(self, [x, y, z, w]: [[f64; 4]; 4]) -> [[f64; 4]; 3] {
                [
                    [x[0], y[0], z[0], w[0]],
                    [x[1], y[1], z[1], w[1]],
                    [x[2], y[2], z[2], w[2]],
                ]
            }
            #[inline(always)]
            fn le(self, x: [f64; 4], y: [f64; 4]) -> [bool; 4] {
                [x[0] <= y[0], x[1] <= y[1], x[2] <= y[2], x[3] <= y[3]]
            }
            #[inline(always)]
            fn select(self, mask: [bool; 4], yes: [f64; 4], no: [f64; 4]) -> [f64; 4] {
                std::array::from_fn(|i| if mask[i] { yes[i] } else { no[i] })
            }
            #[inline(always)]
            fn both(self, x: [bool; 4], y: [bool; 4]) -> [bool; 4] {
                [x[0] & y[0], x[1] & y[1], x[2] & y[2], x[3] & y[3]]
            }
            #[inline(always)]
            fn either(self, x: [bool; 4], y: [bool; 4]) -> [bool; 4] {
                [x[0] ^ y[0], x[1] ^ y[1], x[2] ^ y[2], x[3] ^ y[3]]
            }
            #[inline(always)]
            fn bit<const BELOW: i32>(self, x: [f64; 4]) -> [bool; 4] {
                x.map(|x| x.to_bits() << BELOW >> 63 == 1)
            }
            #[inline(always)]
            fn bits(self, x: [bool; 4]) -> u8 {
                u8::from(x[0]) | u8::from(x[1]) << 1 | u8::from(x[2]) << 2 | u8::from(x[3]) << 3
            }
        }
    };
}

lane_by_lane!(Plain, |x, y, z| x * y + z);
#[cfg(not(target_arch = "x86_64"))]
lane_by_lane!(Fused, |x, y, z| x.mul_add(y, z));

#[cfg(target_arch = "x86_64")]
impl Four for Fused {
    type F = std::arch::x86_64::__m256d;
    type B = std::arch::x86_64::__m256d;

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
    fn both(self, x: Self::B, y: Self::B) -> Self::B {
        self.0.avx._mm256_and_pd(x, y)
    }
    #[inline(always)]
    fn either(self, x: Self::B, y: Self::B) -> Self::B {
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
