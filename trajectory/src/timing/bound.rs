//! Bounds of polynomials over an interval, for all times.

/// An upper bound of `|sum_k coefficients[k] t^k|` over `0 <= t <= duration`, exact to `tolerance`
/// where it is above `floor`; at most five coefficients.
///
/// # Source
/// Convex hull property of the Bernstein form, tightened by subdivision (Farin, Curves and
/// Surfaces for CAGD, 2002, chapter 5).
pub(super) fn bound(coefficients: &[f64], duration: f64, floor: f64, tolerance: f64) -> f64 {
    let (points, count) = bernstein(coefficients, duration);
    refine(points, count, (floor, tolerance), 12)
}

/// Bernstein points of the polynomial over the interval, and their number.
fn bernstein(coefficients: &[f64], duration: f64) -> ([f64; 5], usize) {
    const SHARE: [[[f64; 5]; 5]; 5] = shares();
    let count = coefficients.len().min(5);
    let mut points = [0.0; 5];
    let mut power = 1.0;
    for (k, c) in coefficients.iter().take(5).enumerate() {
        let c = c * power;
        power *= duration;
        for (i, point) in points.iter_mut().enumerate().take(count).skip(k) {
            *point += c * SHARE[count - 1][i][k];
        }
    }
    (points, count)
}

/// `C(i, k) / C(n, k)` for degree `n`.
const fn shares() -> [[[f64; 5]; 5]; 5] {
    const CHOOSE: [[f64; 5]; 5] = [
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 1.0, 0.0, 0.0, 0.0],
        [1.0, 2.0, 1.0, 0.0, 0.0],
        [1.0, 3.0, 3.0, 1.0, 0.0],
        [1.0, 4.0, 6.0, 4.0, 1.0],
    ];
    let mut table = [[[0.0; 5]; 5]; 5];
    let mut n = 0;
    while n < 5 {
        let mut i = 0;
        while i <= n {
            let mut k = 0;
            while k <= i {
                table[n][i][k] = CHOOSE[i][k] / CHOOSE[n][k];
                k += 1;
            }
            i += 1;
        }
        n += 1;
    }
    table
}

/// Splits until the hull is tight.
fn refine(points: [f64; 5], count: usize, (floor, tolerance): (f64, f64), depth: usize) -> f64 {
    let hull = points
        .iter()
        .take(count)
        .fold(0.0_f64, |most, x| most.max(x.abs()));
    let ends = points[0].abs().max(points[count - 1].abs());
    if hull <= floor || hull - ends <= tolerance || depth == 0 {
        return hull;
    }
    let (mut left, mut right, mut row) = (points, points, points);
    for level in (0..count).rev() {
        left[count - 1 - level] = row[0];
        right[level] = row[level];
        for i in 0..level {
            row[i] = 0.5 * (row[i] + row[i + 1]);
        }
    }
    let first = refine(left, count, (floor, tolerance), depth - 1);
    first.max(refine(
        right,
        count,
        (floor.max(first), tolerance),
        depth - 1,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_tight() {
        let polynomial = [0.3, -2.0, 1.0, 4.0, -3.0];
        let value = |t: f64| polynomial.iter().rev().fold(0.0, |sum, c| sum * t + c);
        let dense = (0..=100_000).map(|i| value(1.4 * f64::from(i) / 1e5).abs());
        let dense = dense.fold(0.0, f64::max);
        let bound = bound(&polynomial, 1.4, 0.0, 1e-9);
        assert!(
            bound >= dense - 1e-12 && bound < dense + 1e-7,
            "{bound} {dense}"
        );
    }
}
