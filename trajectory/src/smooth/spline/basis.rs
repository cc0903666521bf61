//! The uniform quartic B-spline.
//!
//! Control point `k` affects the spans `k - 4 ..= k`; span `k` is one knot interval and depends on
//! the control points `k ..= k + 4`.
//!
//! # Source
//! C. de Boor, "A Practical Guide to Splines", 1978, chapter 10, for uniform
//! knots; blossoms: L. Ramshaw, 1987.

/// Power coefficients of the five basis functions in the local parameter of the span, times 24:
/// `POWER[i][k]` belongs to control point `i`, power `k`.
const POWER: [[f64; 5]; 5] = [
    [1.0, -4.0, 6.0, -4.0, 1.0],
    [11.0, -12.0, -6.0, 12.0, -4.0],
    [11.0, 12.0, -6.0, -12.0, 6.0],
    [1.0, 4.0, 6.0, 4.0, -4.0],
    [0.0, 0.0, 0.0, 0.0, 1.0],
];

/// The power coefficients.
const SHARE: [[f64; 5]; 5] = {
    let mut share = POWER;
    let mut k = 0;
    while k < 25 {
        share[k / 5][k % 5] /= 24.0;
        k += 1;
    }
    share
};

/// Weights of the position at a knot and in the middle of a span.
pub(crate) const AT_KNOT: [f64; 5] = [1.0 / 24.0, 11.0 / 24.0, 11.0 / 24.0, 1.0 / 24.0, 0.0];
pub(crate) const AT_MIDDLE: [f64; 5] = [
    1.0 / 384.0,
    76.0 / 384.0,
    230.0 / 384.0,
    76.0 / 384.0,
    1.0 / 384.0,
];

/// Differences of order 1 to 3, as weights of consecutive control points.
pub(crate) const FIRST: [f64; 2] = [-1.0, 1.0];
pub(crate) const SECOND: [f64; 3] = [1.0, -2.0, 1.0];
pub(crate) const THIRD: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];

/// The first four control points that make the spline start with position p,
/// velocity v, acceleration a and jerk j at knot spacing h are
/// `p + START[k][0] h v + START[k][1] h^2 a + START[k][2] h^3 j`.
pub(crate) const START: [[f64; 3]; 4] = [
    [-1.5, 11.0 / 12.0, -0.25],
    [-0.5, -1.0 / 12.0, 1.0 / 12.0],
    [0.5, -1.0 / 12.0, -1.0 / 12.0],
    [1.5, 11.0 / 12.0, 0.25],
];

/// Weights of the five control points for value, first and second derivative at the local parameter
/// `s` of a span.
pub(crate) fn weights(s: f64) -> [[f64; 5]; 3] {
    let mut result = [place(s), [0.0; 5], [0.0; 5]];
    for (i, p) in SHARE.iter().enumerate() {
        result[1][i] = p[1] + (2.0 * p[2] + (3.0 * p[3] + 4.0 * p[4] * s) * s) * s;
        result[2][i] = 2.0 * p[2] + (6.0 * p[3] + 12.0 * p[4] * s) * s;
    }
    result
}

/// Weights of the five control points for the value at the local parameter `s` of a span.
pub(crate) fn place(s: f64) -> [f64; 5] {
    SHARE.map(|p| p[0] + (p[1] + (p[2] + (p[3] + p[4] * s) * s) * s) * s)
}

/// Power coefficients in time of the span of five control values, at knot spacing `h` (s).
pub(crate) fn power(control: &[f64; 5], h: f64) -> [f64; 5] {
    let (mut result, mut scale) = ([0.0; 5], 1.0 / 24.0);
    for (k, value) in result.iter_mut().enumerate() {
        *value = (0..5).map(|i| POWER[i][k] * control[i]).sum::<f64>() * scale;
        scale /= h;
    }
    result
}

/// Moves each place but the first and the last by a share of the way to the control point that reproduces cubics: away from the place by
/// 5/24 of its second difference. `number` is one coordinate of a place.
pub(crate) fn reproduce<T>(
    places: &mut [T],
    number: impl Fn(&mut T) -> &mut f64,
    share: impl Fn(usize) -> f64,
) {
    let before: Vec<f64> = places.iter_mut().map(|place| *number(place)).collect();
    for k in 1..before.len().saturating_sub(1) {
        let bend = before[k - 1] - before[k] * 2.0 + before[k + 1];
        *number(&mut places[k]) -= bend * (5.0 / 24.0 * share(k));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Spans join with three equal derivatives, and the start is as asked.
    #[test]
    fn spans_join_and_start_as_asked() {
        let (h, p, v, a, j) = (0.3, 0.7, -0.4, 1.2, 5.0);
        let start = START.map(|w| p + w[0] * h * v + w[1] * h * h * a + w[2] * h * h * h * j);
        let control = [start[0], start[1], start[2], start[3], 0.9, -2.0];
        let first = power(
            &[control[0], control[1], control[2], control[3], control[4]],
            h,
        );
        let next = power(
            &[control[1], control[2], control[3], control[4], control[5]],
            h,
        );
        for (got, wanted) in first.iter().zip([p, v, a / 2.0, j / 6.0]) {
            assert_relative_eq!(*got, wanted, epsilon = 1e-12);
        }
        let end = crate::poly::quartic(&first, h);
        for (k, factor) in [1.0, 1.0, 2.0, 6.0].iter().enumerate() {
            assert_relative_eq!(end[k], next[k] * factor, epsilon = 1e-10);
        }
        assert_eq!(weights(0.0)[0], AT_KNOT);
        for (got, wanted) in weights(0.5)[0].iter().zip(AT_MIDDLE) {
            assert_relative_eq!(*got, wanted, epsilon = 1e-15);
        }
    }
}
