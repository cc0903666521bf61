//! Narrower tolerances within which a list may be planned, too.

use super::options::SmoothOptions;

/// Share of a tolerance that the first narrower one has at most.
const SHARE: f64 = 0.85;

/// The tolerances below one: powers of the square root of two, so that they are the same for all tolerances above.
pub(super) fn narrower(tolerance: f64) -> impl Iterator<Item = f64> {
    let first = (2.0 * (SHARE * tolerance).log2()).floor() as i32;
    (0..).map(move |k| 2.0_f64.powf(0.5 * f64::from(first - k)))
}

/// The options with a share of all tolerances.
pub(super) fn within(options: &SmoothOptions, share: f64) -> SmoothOptions {
    SmoothOptions {
        tolerance: share * options.tolerance,
        corridor: Some(share * options.corridor()),
        angular_tolerance: Some(share * options.angular_tolerance()),
        ..options.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tolerances that differ little have the same ones below.
    #[test]
    fn narrower_tolerances_are_the_same_for_many() {
        let below: Vec<f64> = narrower(1e-3).take(3).collect();
        assert!(below[0] <= 0.85e-3 && below[0] > 0.6e-3, "{below:?}");
        assert!((below[0] / below[2] - 2.0).abs() < 1e-12);
        assert_eq!(below, narrower(0.99e-3).take(3).collect::<Vec<_>>());
    }
}
