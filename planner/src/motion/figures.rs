//! Numbers as messages show them.

/// A number with this many decimals, or more if these would all be zero: a small amount is not
/// shown as 0.
pub(super) fn figures(value: f64, decimals: usize) -> String {
    let size = value.abs();
    if size >= 1e12 {
        return format!("{value:.1e}");
    }
    let needed = if size > 0.0 && size < 1.0 {
        (1.0 - size.log10().floor()).clamp(0.0, 12.0) as usize
    } else {
        0
    };
    format!("{value:.digits$}", digits = decimals.max(needed))
}

#[cfg(test)]
mod tests {
    use super::figures;

    #[test]
    fn small_amounts_are_not_zero() {
        let said = |value: f64| figures(value, 1);
        assert_eq!(said(1388.11), "1388.1");
        assert_eq!(said(0.5), "0.50");
        assert_eq!(said(0.0123), "0.012");
        assert_eq!(said(3.4e-7), "0.00000034");
        assert_eq!(said(0.0), "0.0");
        assert_eq!(said(1e300), "1.0e300");
    }
}
