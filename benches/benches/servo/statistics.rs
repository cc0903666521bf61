//! Quantiles of measured times.

/// The value that a share of the sorted values is not above.
pub(crate) fn quantile(sorted: &[u64], share: f64) -> u64 {
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}

/// Median and 99th percentile of sorted times, in words.
pub(crate) fn summary(sorted: &[u64]) -> String {
    format!(
        "p50 {} ns, p99 {} ns",
        quantile(sorted, 0.5),
        quantile(sorted, 0.99)
    )
}

/// The middle of some numbers.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
