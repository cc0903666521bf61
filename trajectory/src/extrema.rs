//! Exact largest values of a motion: extrema of its polynomials, not samples.

use nalgebra::SVector;
use realtime::Piece;

use crate::Trajectory;

/// Largest magnitude of each derivative, one per joint, over a whole motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointPeaks<const N: usize> {
    /// Largest |velocity|, rad/s or m/s.
    pub velocity: SVector<f64, N>,
    /// Largest |acceleration|, rad/s2 or m/s2.
    pub acceleration: SVector<f64, N>,
    /// Largest |jerk|, rad/s3 or m/s3; jumps between pieces do not count.
    pub jerk: SVector<f64, N>,
}

impl<const N: usize> Trajectory<N> {
    /// Largest velocity, acceleration and jerk of each joint for all t.
    ///
    /// ```
    /// use nalgebra::vector;
    /// use realtime::{Piece, Sample};
    /// let piece = Piece::hermite(1.0, &Sample::rest(vector![0.0]), &Sample::rest(vector![1.0]));
    /// let peaks = trajectory::Trajectory::new(vec![piece]).peaks();
    /// assert!((peaks.velocity[0] - 15.0 / 8.0).abs() < 1e-12);
    /// assert!((peaks.jerk[0] - 60.0).abs() < 1e-9);
    /// ```
    #[must_use]
    pub fn peaks(&self) -> JointPeaks<N> {
        let zero = SVector::zeros();
        let mut peaks = JointPeaks {
            velocity: zero,
            acceleration: zero,
            jerk: zero,
        };
        for piece in self.pieces() {
            for joint in 0..N {
                let position = Polynomial::of(piece, joint);
                let velocity = position.derivative();
                let acceleration = velocity.derivative();
                let jerk = acceleration.derivative();
                let unit = 1.0 / piece.duration;
                let peak = |polynomial: &Polynomial, scale: f64| {
                    let (low, high) = polynomial.range();
                    high.abs().max(low.abs()) * scale
                };
                let cube = unit * unit * unit;
                peaks.velocity[joint] = peaks.velocity[joint].max(peak(&velocity, unit));
                peaks.acceleration[joint] =
                    peaks.acceleration[joint].max(peak(&acceleration, unit * unit));
                peaks.jerk[joint] = peaks.jerk[joint].max(peak(&jerk, cube));
            }
        }
        peaks
    }

    /// Lowest and highest position of each joint for all t, rad or m; plus and minus infinity if
    /// there is no piece.
    #[must_use]
    pub fn position_range(&self) -> (SVector<f64, N>, SVector<f64, N>) {
        let mut lowest = SVector::repeat(f64::INFINITY);
        let mut highest = SVector::repeat(f64::NEG_INFINITY);
        for piece in self.pieces() {
            for joint in 0..N {
                let (low, high) = Polynomial::of(piece, joint).range();
                lowest[joint] = low.min(lowest[joint]);
                highest[joint] = high.max(highest[joint]);
            }
        }
        (lowest, highest)
    }
}

/// Lowest and highest position of one joint over a piece, rad or m.
pub(crate) fn range<const N: usize>(piece: &Piece<N>, joint: usize) -> (f64, f64) {
    Polynomial::of(piece, joint).range()
}

/// Coefficients of a polynomial on 0..=1, lowest power first.
#[derive(Clone, Copy, Debug)]
struct Polynomial {
    coefficients: [f64; 6],
    degree: usize,
}

impl Polynomial {
    /// One joint of a piece, with time in units of the piece's duration.
    fn of<const N: usize>(piece: &Piece<N>, joint: usize) -> Self {
        let mut scale = 1.0;
        let coefficients = piece.coefficients.map(|coefficient| {
            let scaled = coefficient[joint] * scale;
            scale *= piece.duration;
            scaled
        });
        Self {
            coefficients,
            degree: 5,
        }
    }

    fn derivative(&self) -> Self {
        let mut coefficients = [0.0; 6];
        for power in 1..=self.degree {
            coefficients[power - 1] = self.coefficients[power] * power as f64;
        }
        Self {
            coefficients,
            degree: self.degree.saturating_sub(1),
        }
    }

    fn at(&self, x: f64) -> f64 {
        let terms = self.coefficients[..=self.degree].iter().rev();
        terms.fold(0.0, |sum, coefficient| sum * x + coefficient)
    }

    /// Lowest and highest value on 0..=1.
    fn range(&self) -> (f64, f64) {
        let ends = (self.at(0.0), self.at(1.0));
        let mut range = (ends.0.min(ends.1), ends.0.max(ends.1));
        if self.degree > 1 {
            for &root in self.derivative().roots().as_slice() {
                let value = self.at(root);
                range = (range.0.min(value), range.1.max(value));
            }
        }
        range
    }

    /// Places in 0..=1 where the sign changes: between two neighbouring
    /// extrema there is at most one.
    fn roots(&self) -> Roots {
        let mut roots = Roots::default();
        if self.degree == 0 {
            return roots;
        }
        let turns = self.derivative().roots();
        let mut from = 0.0;
        for &to in turns.as_slice().iter().chain(&[1.0]) {
            if let Some(root) = self.bisect(from, to) {
                roots.push(root);
            }
            from = to;
        }
        roots
    }

    fn bisect(&self, mut low: f64, mut high: f64) -> Option<f64> {
        let rises = self.at(high) > 0.0;
        if (self.at(low) > 0.0) == rises {
            return None;
        }
        for _ in 0..54 {
            let middle = 0.5 * (low + high);
            if (self.at(middle) > 0.0) == rises {
                high = middle
            } else {
                low = middle
            }
        }
        Some(0.5 * (low + high))
    }
}

/// At most five roots, in increasing order.
#[derive(Clone, Copy, Debug, Default)]
struct Roots {
    values: [f64; 5],
    count: usize,
}

impl Roots {
    fn push(&mut self, root: f64) {
        if let Some(place) = self.values.get_mut(self.count) {
            *place = root;
            self.count += 1;
        }
    }

    fn as_slice(&self) -> &[f64] {
        &self.values[..self.count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(3), ..Default::default() })]

        /// No sample lies beyond the peaks, and some sample comes near each.
        #[test]
        fn peaks_bound_samples_from_both_sides(
            coefficients in prop::array::uniform6(-2.0..2.0_f64),
            duration in 0.01..3.0_f64,
        ) {
            let coefficients = coefficients.map(SVector::<f64, 1>::new);
            let motion = Trajectory::new(vec![Piece { duration, coefficients }]);
            let (peaks, (low, high)) = (motion.peaks(), motion.position_range());
            let (mut velocity, mut acceleration, mut jerk) = (0.0_f64, 0.0_f64, 0.0_f64);
            let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
            for i in 0..=4000 {
                let sample = motion.pieces()[0].sample(duration * f64::from(i) / 4000.0);
                velocity = velocity.max(sample.velocity[0].abs());
                acceleration = acceleration.max(sample.acceleration[0].abs());
                jerk = jerk.max(sample.jerk[0].abs());
                lowest = lowest.min(sample.position[0]);
                highest = highest.max(sample.position[0]);
            }
            for (bound, seen) in [
                (peaks.velocity[0], velocity),
                (peaks.acceleration[0], acceleration),
                (peaks.jerk[0], jerk),
                (-low[0], -lowest),
                (high[0], highest),
            ] {
                let scale = 1e-9 * (1.0 + bound.abs());
                prop_assert!(seen <= bound + scale, "{seen} above {bound}");
                prop_assert!(seen >= bound - 1e-3 * (1.0 + bound.abs()), "{bound} far above {seen}");
            }
        }
    }
}
