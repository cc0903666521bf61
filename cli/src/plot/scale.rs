//! Converts quantities to pixels, and finds round numbers for the marks of an axis.

/// A linear map from a range of a quantity to a range of pixels; either may be reversed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    from: [f64; 2],
    to: [f64; 2],
}

impl Scale {
    /// The map that takes `from[0]` to `to[0]` and `from[1]` to `to[1]`.
    pub(super) fn new(from: [f64; 2], to: [f64; 2]) -> Self {
        Self { from, to }
    }

    /// Pixels of a quantity.
    pub(super) fn at(&self, value: f64) -> f64 {
        let [low, high] = self.from;
        let part = if high == low {
            0.5
        } else {
            (value - low) / (high - low)
        };
        self.to[0] + part * (self.to[1] - self.to[0])
    }

    /// The range of the quantity.
    pub(super) fn range(&self) -> [f64; 2] {
        self.from
    }
}

/// Marks at 1, 2 or 5 times a power of ten, at most `count` of them, and their step.
pub(super) fn marks([low, high]: [f64; 2], count: usize) -> (Vec<f64>, f64) {
    let least = (high - low).abs() / count.max(1) as f64;
    if !(least.is_finite() && least > 0.0) {
        return (Vec::new(), 1.0);
    }
    let power = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|step| *step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * power);
    let (low, high) = (low.min(high), low.max(high));
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (
        (first..=last).map(|mark| mark as f64 * step).collect(),
        step,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_inside() {
        assert_eq!(
            marks([0.0, 7.3], 8),
            (vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], 1.0)
        );
        assert_eq!(marks([-0.1, 0.25], 4).0, [-0.1, 0.0, 0.1, 0.2]);
        assert!(marks([1.0, 1.0], 4).0.is_empty());
        assert!(marks([f64::NAN, 1.0], 4).0.is_empty());
    }

    #[test]
    fn ends_map_to_ends() {
        let scale = Scale::new([1.0, 3.0], [100.0, 0.0]);
        assert_eq!(
            (scale.at(1.0), scale.at(3.0), scale.at(2.0)),
            (100.0, 0.0, 50.0)
        );
    }
}
