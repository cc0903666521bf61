//! What a build does with four numbers at once.

/// Numbers in a [`Four::F`].
pub const LANES: usize = 4;

/// What a build does with four numbers at once.
pub trait Four: Copy {
    /// Four numbers.
    type F: Copy;
    /// Four booleans.
    type B: Copy;

    /// `a * b + c` of single numbers, fused or not.
    fn fma(self, a: f64, b: f64, c: f64) -> f64;
    /// Four numbers from memory.
    fn pack(self, x: [f64; 4]) -> Self::F;
    /// The four numbers.
    fn unpack(self, x: Self::F) -> [f64; 4];
    /// The same number four times.
    fn splat(self, x: f64) -> Self::F;
    /// `x + y`.
    fn add(self, x: Self::F, y: Self::F) -> Self::F;
    /// `x - y`.
    fn sub(self, x: Self::F, y: Self::F) -> Self::F;
    /// `x y`, number by number.
    fn mul(self, x: Self::F, y: Self::F) -> Self::F;
    /// `x / y`, number by number.
    fn div(self, x: Self::F, y: Self::F) -> Self::F;
    /// `x y + z`, fused or not.
    fn mul_add(self, x: Self::F, y: Self::F, z: Self::F) -> Self::F;
    /// `z - x y`, fused or not.
    fn mul_less(self, x: Self::F, y: Self::F, z: Self::F) -> Self::F;
    /// The smaller of each pair; `y` where one of them is not a number.
    fn min(self, x: Self::F, y: Self::F) -> Self::F;
    /// The larger of each pair; `y` where one of them is not a number.
    fn max(self, x: Self::F, y: Self::F) -> Self::F;
    /// The square root of each number.
    fn sqrt(self, x: Self::F) -> Self::F;
    /// The largest integer that is at most the number.
    fn floor(self, x: Self::F) -> Self::F;
    /// The magnitude of each number.
    fn abs(self, x: Self::F) -> Self::F;
    /// `-x`.
    fn neg(self, x: Self::F) -> Self::F;
    /// The magnitude of `x` with the sign of `y`.
    fn signed(self, x: Self::F, y: Self::F) -> Self::F;
    /// The second, third, first and fourth number.
    fn next(self, x: Self::F) -> Self::F;
    /// The first three of four vectors as rows: first numbers, second, third.
    fn transposed(self, columns: [Self::F; 4]) -> [Self::F; 3];
    /// `x <= y`; false if either is NaN.
    fn le(self, x: Self::F, y: Self::F) -> Self::B;
    /// `yes` where the mask is true, otherwise `no`.
    fn select(self, mask: Self::B, yes: Self::F, no: Self::F) -> Self::F;
    /// Where both are true.
    fn and(self, x: Self::B, y: Self::B) -> Self::B;
    /// Where exactly one is true.
    fn xor(self, x: Self::B, y: Self::B) -> Self::B;
    /// Whether the bit is set that is `BELOW` places below the sign bit.
    fn bit<const BELOW: i32>(self, x: Self::F) -> Self::B;
    /// Bit `i` is boolean `i`.
    fn bits(self, x: Self::B) -> u8;

    /// The first four numbers of a slice; zeros where it is shorter than that.
    #[inline(always)]
    fn load(self, x: &[f64]) -> Self::F {
        self.pack(x.first_chunk().copied().unwrap_or_default())
    }

    /// Writes them to the first four places of a slice that has them.
    #[inline(always)]
    fn store(self, x: Self::F, to: &mut [f64]) {
        if let Some(to) = to.first_chunk_mut() {
            *to = self.unpack(x);
        }
    }

    /// The sum of the four: the first two, the last two, and then both.
    #[inline(always)]
    fn sum(self, x: Self::F) -> f64 {
        let [a, b, c, d] = self.unpack(x);
        (a + b) + (c + d)
    }
}

/// Separate multiply and add: every processor.
#[derive(Clone, Copy, Debug)]
pub struct Plain;

/// A build without SIMD registers computes one lane after the other.
macro_rules! lane_by_lane {
    ($build:ty, $fma:expr) => {
        impl Four for $build {
            type F = [f64; 4];
            type B = [bool; 4];

            #[inline(always)]
            fn fma(self, a: f64, b: f64, c: f64) -> f64 {
                let fma: fn(f64, f64, f64) -> f64 = $fma;
                fma(a, b, c)
            }
            #[inline(always)]
            fn splat(self, x: f64) -> [f64; 4] {
                [x; 4]
            }
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
            fn and(self, x: [bool; 4], y: [bool; 4]) -> [bool; 4] {
                [x[0] & y[0], x[1] & y[1], x[2] & y[2], x[3] & y[3]]
            }
            #[inline(always)]
            fn xor(self, x: [bool; 4], y: [bool; 4]) -> [bool; 4] {
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
pub(crate) use lane_by_lane;
