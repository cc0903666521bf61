//! Durations counted in fixed buckets, written by one thread and read by any.

use core::sync::atomic::{AtomicU64, Ordering};

/// Buckets per octave: the width of a bucket is at most a sixteenth of its value.
const FINE: u64 = 16;

/// Buckets in all: up to 2^40 ns, about 18 minutes.
const BUCKETS: usize = 37 * 16;

/// A histogram of durations in ns that is always on: counting is one addition.
#[derive(Debug)]
pub struct Histogram {
    counts: [AtomicU64; BUCKETS],
    largest: AtomicU64,
}

impl Histogram {
    pub(super) fn new() -> Self {
        Self {
            counts: core::array::from_fn(|_| AtomicU64::new(0)),
            largest: AtomicU64::new(0),
        }
    }

    /// The bucket of a value: linear below [`FINE`], then [`FINE`] per octave.
    fn bucket(value: u64) -> usize {
        if value < FINE {
            return value as usize;
        }
        let octave = u64::from(value.ilog2()) - 3;
        let within = (value >> (octave - 1)) - FINE;
        ((octave * FINE + within) as usize).min(BUCKETS - 1)
    }

    /// The largest value of a bucket.
    fn ceiling(bucket: usize) -> u64 {
        let bucket = bucket as u64;
        if bucket < FINE {
            return bucket;
        }
        let (octave, within) = (bucket / FINE, bucket % FINE);
        ((FINE + within + 1) << (octave - 1)) - 1
    }

    /// Counts a duration.
    pub(super) fn count(&self, nanoseconds: u64) {
        if let Some(count) = self.counts.get(Self::bucket(nanoseconds)) {
            count.fetch_add(1, Ordering::Relaxed);
        }
        self.largest.fetch_max(nanoseconds, Ordering::Relaxed);
    }

    /// How many durations were counted.
    pub fn total(&self) -> u64 {
        self.counts
            .iter()
            .map(|count| count.load(Ordering::Relaxed))
            .sum()
    }

    /// The largest duration counted (ns).
    pub fn largest(&self) -> u64 {
        self.largest.load(Ordering::Relaxed)
    }

    /// The quantile `share` (0..=1) of the counted durations (ns), to a sixteenth; 0 if none was
    /// counted.
    pub fn quantile(&self, share: f64) -> u64 {
        let wanted = (share.clamp(0.0, 1.0) * self.total() as f64).ceil() as u64;
        let mut seen = 0;
        for (bucket, count) in self.counts.iter().enumerate() {
            seen += count.load(Ordering::Relaxed);
            if seen >= wanted && seen > 0 {
                return Self::ceiling(bucket).min(self.largest());
            }
        }
        self.largest()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buckets_hold_their_values() {
        let mut previous = 0;
        for value in (0..5000).chain((0..39).map(|power| (1_u64 << power) + 17)) {
            let bucket = Histogram::bucket(value);
            let ceiling = Histogram::ceiling(bucket);
            assert!(
                value <= ceiling && ceiling <= value + value / 16 + 1,
                "{value} {ceiling}"
            );
        }
        for bucket in (0..5000).map(Histogram::bucket) {
            assert!(bucket == previous || bucket == previous + 1);
            previous = bucket;
        }
    }

    #[test]
    fn quantiles() {
        let histogram = Histogram::new();
        (1..=1000).for_each(|value| histogram.count(value));
        assert_eq!((histogram.total(), histogram.largest()), (1000, 1000));
        assert!((500..=532).contains(&histogram.quantile(0.5)));
        assert!((990..=1000).contains(&histogram.quantile(0.99)));
        histogram.count(u64::MAX);
        assert_eq!(histogram.quantile(1.0), Histogram::ceiling(BUCKETS - 1));
    }
}
