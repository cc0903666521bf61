//! The uniform quintic B-spline.
//!
//! Control point `j` acts on the spans `j - 5 ..= j`; span `j` runs over one knot interval.
//!
//! # Source
//! C. de Boor, "A Practical Guide to Splines", 1978, chapter 10, for uniform knots.

use simd::{F4, Four, LANES};

/// Control points that act on one span.
pub(super) const ORDER: usize = 6;

/// Power coefficients, in the share of the span, of the basis functions, times 120:
/// `POWER[i][k]` belongs to control point `i` of the span, power `k`.
const POWER: [[f64; 6]; ORDER] = [
    [1.0, -5.0, 10.0, -10.0, 5.0, -1.0],
    [26.0, -50.0, 20.0, 20.0, -20.0, 5.0],
    [66.0, 0.0, -60.0, 0.0, 30.0, -10.0],
    [26.0, 50.0, 20.0, -20.0, -20.0, 10.0],
    [1.0, 5.0, 10.0, 10.0, 5.0, -5.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
];

/// Weights of the control points of a span for the value at the share `x` of it.
pub(super) fn value(x: f64) -> [f64; ORDER] {
    POWER.map(|p| (p[0] + x * (p[1] + x * (p[2] + x * (p[3] + x * (p[4] + x * p[5]))))) / 120.0)
}

/// Length of the weights of a span with zeros after them, so that four may be loaded from each.
pub(super) const PADDED: usize = ORDER + LANES - 1;

/// [`POWER`] by powers, with zeros after the last control point.
const BY_POWER: [[f64; 2 * LANES]; 6] = {
    let mut powers = [[0.0; 2 * LANES]; 6];
    let (mut i, mut k) = (0, 0);
    while k < 6 {
        powers[k][i] = POWER[i][k];
        i += 1;
        if i == ORDER {
            (i, k) = (0, k + 1);
        }
    }
    powers
};

/// [`value`], four control points at a time: the same numbers.
#[inline(always)]
pub(super) fn values<S: Four>(simd: S, x: f64, to: &mut [f64; PADDED]) {
    let (x, all) = (F4::splat(simd, x), F4::splat(simd, 120.0));
    for first in [0, LANES] {
        let power = |k: usize| F4::load(simd, &BY_POWER[k][first..first + LANES]);
        let mut sum = power(5);
        for k in (0..5).rev() {
            sum = power(k) + x * sum;
        }
        (sum / all).put(&mut to[first..first + LANES], 0);
    }
}

/// The same for the first derivative (to the share).
pub(super) fn first(x: f64) -> [f64; ORDER] {
    let slope = |p: [f64; 6]| {
        p[1] + x * (2.0 * p[2] + x * (3.0 * p[3] + x * (4.0 * p[4] + x * 5.0 * p[5])))
    };
    POWER.map(|p| slope(p) / 120.0)
}

/// The same for the second derivative.
pub(super) fn second(x: f64) -> [f64; ORDER] {
    let bend = |p: [f64; 6]| 2.0 * p[2] + x * (6.0 * p[3] + x * (12.0 * p[4] + x * 20.0 * p[5]));
    POWER.map(|p| bend(p) / 120.0)
}

/// The same for the third derivative.
pub(super) fn third(x: f64) -> [f64; ORDER] {
    POWER.map(|p| (6.0 * p[3] + x * (24.0 * p[4] + x * 60.0 * p[5])) / 120.0)
}

/// Integrals over a span of the products of third derivatives, in two variables.
///
/// # Source
/// Gauss-Legendre quadrature with three points, exact for products of parabolas (Abramowitz and
/// Stegun, table 25.4).
pub(super) fn gram() -> [[f64; ORDER]; ORDER] {
    let far = 0.5 * 0.6_f64.sqrt();
    let places = [
        (0.5 - far, 5.0 / 18.0),
        (0.5, 8.0 / 18.0),
        (0.5 + far, 5.0 / 18.0),
    ];
    let mut gram = [[0.0; ORDER]; ORDER];
    for (x, weight) in places {
        let w = third(x);
        for (row, a) in gram.iter_mut().zip(w) {
            for (cell, b) in row.iter_mut().zip(w) {
                *cell += weight * a * b;
            }
        }
    }
    gram
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Four control points at a time have the weights of one at a time, to the last bit.
    #[test]
    fn lanes_change_nothing() {
        struct Values(f64);
        impl simd::Op for Values {
            type Output = [f64; PADDED];

            #[inline(always)]
            fn run<S: Four>(self, simd: S) -> [f64; PADDED] {
                let mut to = [0.0; PADDED];
                values(simd, self.0, &mut to);
                to
            }
        }
        for k in 0..100 {
            let x = f64::from(k) / 99.0;
            let lanes = simd::Build::detect().run(Values(x));
            assert_eq!(lanes[..ORDER], value(x));
            assert_eq!(lanes[ORDER..], [0.0; PADDED - ORDER]);
        }
    }

    /// Cubics are reproduced with all derivatives: their control values are known.
    #[test]
    fn reproduces_cubics() {
        // Value of t^3 at the control point k of the uniform quintic: its blossom at the knots
        // k - 2 .. k + 2, t^3 + (3 t / 10) (sum of squares of -2 .. 2).
        let control = |t: f64| t * t * t - 1.5 * t;
        let c: Vec<f64> = (0..6).map(|i| control(f64::from(i) - 2.0)).collect();
        for x in [0.0, 0.3, 1.0] {
            let sum = |w: [f64; 6]| w.iter().zip(&c).map(|(w, c)| w * c).sum::<f64>();
            let shift = sum(value(x)) - x * x * x;
            assert_relative_eq!(sum(second(x)), 6.0 * x, epsilon = 1e-12);
            assert_relative_eq!(sum(third(x)), 6.0, epsilon = 1e-12);
            assert_relative_eq!(shift, 0.0, epsilon = 1e-12);
            assert_relative_eq!(sum(first(x)), 3.0 * x * x, epsilon = 1e-12);
        }
    }

    /// A constant third derivative c has the integral c squared in each span.
    #[test]
    fn gram_measures_the_third_derivative() {
        let c: Vec<f64> = (0..6_i32).map(|i| f64::from(i * i * i) / 6.0).collect();
        let gram = gram();
        let mut sum = 0.0;
        for (row, a) in gram.iter().zip(&c) {
            for (g, b) in row.iter().zip(&c) {
                sum += g * a * b;
            }
        }
        assert_relative_eq!(sum, 1.0, epsilon = 1e-9);
    }
}
