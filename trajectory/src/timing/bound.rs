//! Bounds of polynomials over an interval, for all times.

use crate::poly::bernstein;

/// How exact a bound must be: to `tolerance` where it is above `floor`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Precision {
    pub(super) floor: f64,
    pub(super) tolerance: f64,
}

/// An upper bound of `|sum_k coefficients[k] t^k|` over `0 <= t <= duration`; at most five
/// coefficients.
///
/// # Source
/// Convex hull property of the Bernstein form, tightened by subdivision (Farin, Curves and
/// Surfaces for CAGD, 2002, chapter 5).
pub(super) fn bound<const M: usize>(
    coefficients: &[f64; M],
    duration: f64,
    precision: Precision,
) -> f64 {
    let mut points = [0.0; 5];
    let control = bernstein(coefficients, 0.0, duration);
    for (point, c) in points.iter_mut().zip(control) {
        *point = c;
    }
    refine(points, M.min(5), precision, 12)
}

/// Splits at the extremum until the hull is tight: the parts on both sides of it are monotonic, so
/// that their ends bound them.
fn refine(points: [f64; 5], count: usize, precision: Precision, depth: usize) -> f64 {
    let Precision { floor, tolerance } = precision;
    let (mut hull, mut peak) = (0.0_f64, 0);
    for (i, x) in points.iter().take(count).enumerate() {
        if x.abs() > hull {
            (hull, peak) = (x.abs(), i);
        }
    }
    let ends = points[0].abs().max(points[count - 1].abs());
    if hull <= floor || hull - ends <= tolerance || depth == 0 {
        return hull;
    }
    let x = turn(&points, count, peak);
    let (mut left, mut right, mut row) = (points, points, points);
    for level in (0..count).rev() {
        left[count - 1 - level] = row[0];
        right[level] = row[level];
        for i in 0..level {
            row[i] = (1.0 - x) * row[i] + x * row[i + 1];
        }
    }
    let first = refine(left, count, precision, depth - 1);
    let floor = floor.max(first);
    first.max(refine(
        right,
        count,
        Precision { floor, tolerance },
        depth - 1,
    ))
}

/// The approximate extremum of the polynomial near point `peak`, by Newton steps; the middle if
/// they do not converge. The hulls of the parts bound the polynomial wherever it is split.
fn turn(points: &[f64; 5], count: usize, peak: usize) -> f64 {
    let degree = count - 1;
    let mut x = peak as f64 / degree as f64;
    for _ in 0..3 {
        let mut slopes = [0.0; 4];
        for (slope, pair) in slopes.iter_mut().zip(points[..count].windows(2)) {
            *slope = pair[1] - pair[0];
        }
        for level in (2..degree).rev() {
            for i in 0..level {
                slopes[i] = (1.0 - x) * slopes[i] + x * slopes[i + 1];
            }
        }
        let bend = slopes[1] - slopes[0];
        x -= (slopes[0] + x * bend) / ((degree - 1) as f64 * bend);
    }
    if x > 0.01 && x < 0.99 { x } else { 0.5 }
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
        let precision = Precision {
            floor: 0.0,
            tolerance: 1e-9,
        };
        let bound = bound(&polynomial, 1.4, precision);
        assert!(
            bound >= dense - 1e-12 && bound < dense + 1e-7,
            "{bound} {dense}"
        );
    }
}
