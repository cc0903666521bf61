//! Moves a number to a target with bounded first and second derivative.

/// How fast a number may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Largest rate (1/s of the number's unit).
    pub rate: f64,
    /// Largest rate of the rate (1/s² of the number's unit).
    pub change: f64,
}

/// How many periods of `period` (s) it takes to bring `rate` to zero with `change` (1/s²).
pub fn ramp_periods(rate: f64, change: f64, period: f64) -> f64 {
    libm::ceil(libm::fabs(rate) / (change * period) - 1e-9)
}

/// The rate at the end of the next period for a number that has `value` and `rate` now and shall
/// come to rest at `target`, without passing it, as soon as `bounds` allow. Within a period the
/// rate is linear in time. `period` in s.
///
/// The number after the period is `value + (rate + next) / 2 * period`.
///
/// # Source
/// Own derivation. With `next` reached, a ramp of `m` periods to rate zero adds
/// `next * m * period / 2`; the two together must make up what is missing after the present rate,
/// so `next = 2 e / (period (1 + m))` with the least `m` that keeps the ramp within the bounds:
/// `m (m + 1) >= 2 |e| / (change period²)`.
///
/// ```
/// use realtime::{Bounds, next_rate};
///
/// let bounds = Bounds { rate: 4.0, change: 60.0 };
/// let (mut value, mut rate) = (1.0, 0.0);
/// for _ in 0..400 {
///     let next = next_rate([value, rate], 0.0, bounds, 0.001);
///     value += (rate + next) / 2.0 * 0.001;
///     rate = next;
/// }
/// assert!(value.abs() < 1e-9 && rate == 0.0);
/// ```
pub fn next_rate([value, rate]: [f64; 2], target: f64, bounds: Bounds, period: f64) -> f64 {
    let missing = target - value - rate * period / 2.0;
    let step = bounds.change * period;
    if libm::fabs(missing) < 1e-12 && libm::fabs(rate) <= step {
        return 0.0;
    }
    let unit = step * period;
    let ramp = libm::ceil((libm::sqrt(1.0 + 8.0 * libm::fabs(missing) / unit) - 1.0) / 2.0);
    let wanted = 2.0 * missing / (period * (1.0 + ramp.max(1.0)));
    let bounded = wanted.clamp(-bounds.rate, bounds.rate);
    bounded.clamp(rate - step, rate + step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        /// From rest it arrives, never passes the target, never breaks a bound, and is not slower
        /// than the continuous optimum by more than a few periods.
        #[test]
        fn arrives_without_overshoot(
            start in -2.0..2.0_f64, target in -2.0..2.0_f64,
            rate in 0.1..50.0_f64, change in 1.0..5000.0_f64, period in 0.00025..0.01_f64,
        ) {
            let bounds = Bounds { rate, change };
            let (mut value, mut speed, mut periods) = (start, 0.0, 0);
            while (value != target || speed != 0.0) && periods < 1_000_000 {
                let next = next_rate([value, speed], target, bounds, period);
                prop_assert!((next - speed).abs() <= change * period * (1.0 + 1e-9));
                prop_assert!(next.abs() <= rate * (1.0 + 1e-12));
                value += (speed + next) / 2.0 * period;
                speed = next;
                prop_assert!((value - target) * (start - target) >= -1e-9);
                periods += 1;
                if speed == 0.0 && (value - target).abs() < 1e-9 { break; }
            }
            let distance = (target - start).abs();
            let reach = rate * rate / change;
            let optimum = if distance < reach {
                2.0 * (distance / change).sqrt()
            } else {
                distance / rate + rate / change
            };
            prop_assert!(f64::from(periods) * period <= optimum + 8.0 * period + 0.1 * optimum);
        }
    }
}
