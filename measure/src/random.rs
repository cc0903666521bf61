//! A sequence of random numbers.

use nalgebra::SVector;

/// Random numbers, the same for the same seed on every machine.
///
/// ```
/// use measure::Random;
///
/// let (mut one, mut same) = (Random::new(7), Random::new(7));
/// let number = one.between(-2.0, 3.0);
/// assert!((-2.0..3.0).contains(&number));
/// assert_eq!(number, same.between(-2.0, 3.0));
/// ```
///
/// # Source
/// SplitMix64: G. Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number generators",
/// OOPSLA 2014.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The sequence of `seed`.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The sequence of `seed`, far from those of the seeds beside it.
    pub fn scattered(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x2545_f491_4f6c_dd1d)
    }

    /// An even number from `low` to `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        let bits = self.bits() >> 11;
        low + (high - low) * (bits as f64 / (1_u64 << 53) as f64)
    }

    /// Even numbers, each from its `low` to its `high`.
    pub fn within<const N: usize>(
        &mut self,
        low: &SVector<f64, N>,
        high: &SVector<f64, N>,
    ) -> SVector<f64, N> {
        low.zip_map(high, |low, high| self.between(low, high))
    }

    /// A normal number of deviation 1.
    ///
    /// # Source
    /// G. Box, M. Muller, "A note on the generation of random normal deviates", 1958.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.between(0.0, 1.0)).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.between(0.0, 1.0)).cos()
    }

    /// 64 random bits.
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}
