//! Polynomials on an interval: power form, Bernstein form, products.
//!
//! The curve of a polynomial lies in the convex hull of its Bernstein coefficients, so a bound on
//! the coefficients holds for all times.
//!
//! # Source
//! G. Farin, "Curves and Surfaces for CAGD", 5th edition 2002, chapters 5, 6.

use std::ops::{Add, Mul};

use nalgebra::Vector3;

/// Binomial coefficients up to row 7.
pub(crate) const CHOOSE: [[f64; 8]; 8] = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 3.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 4.0, 6.0, 4.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 5.0, 10.0, 10.0, 5.0, 1.0, 0.0, 0.0],
    [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0, 0.0],
    [1.0, 7.0, 21.0, 35.0, 35.0, 21.0, 7.0, 1.0],
];

/// Bernstein coefficients on `[from, to]` of the polynomial
/// `sum_k power[k] t^k` of degree `M - 1 <= 7`.
pub(crate) fn bernstein<T, const M: usize>(power: &[T; M], from: f64, to: f64) -> [T; M]
where
    T: Copy + Add<Output = T> + Mul<f64, Output = T>,
{
    let mut shifted = shifted(power, from);
    let (mut scale, degree) = (1.0, M - 1);
    for (k, value) in shifted.iter_mut().enumerate() {
        *value = *value * (scale / CHOOSE[degree][k]);
        scale *= to - from;
    }
    let mut result = shifted;
    for (i, value) in result.iter_mut().enumerate().skip(1) {
        *value = shifted[0];
        for k in 1..=i {
            *value = *value + shifted[k] * CHOOSE[i][k];
        }
    }
    result
}

/// Power form of the polynomial at `from + t`: Taylor shift by repeated synthetic division.
pub(crate) fn shifted<T, const M: usize>(power: &[T; M], from: f64) -> [T; M]
where
    T: Copy + Add<Output = T> + Mul<f64, Output = T>,
{
    let mut shifted = *power;
    if from != 0.0 {
        for low in 0..M.saturating_sub(1) {
            for k in (low..M - 1).rev() {
                shifted[k] = shifted[k] + shifted[k + 1] * from;
            }
        }
    }
    shifted
}

/// Power form of the polynomial at `end - t`.
pub(crate) fn reversed<T, const M: usize>(power: &[T; M], end: f64) -> [T; M]
where
    T: Copy + Add<Output = T> + Mul<f64, Output = T>,
{
    let mut shifted = *power;
    for low in 0..M.saturating_sub(1) {
        for k in (low..M - 1).rev() {
            shifted[k] = shifted[k] + shifted[k + 1] * end;
        }
    }
    for value in shifted.iter_mut().skip(1).step_by(2) {
        *value = *value * -1.0;
    }
    shifted
}

/// Both halves of a polynomial in Bernstein form (de Casteljau).
pub(crate) fn halve<T, const M: usize>(control: &[T; M]) -> ([T; M], [T; M])
where
    T: Copy + Add<Output = T> + Mul<f64, Output = T>,
{
    let (mut left, mut right) = (*control, *control);
    for level in 1..M {
        for k in 0..M - level {
            right[k] = (right[k] + right[k + 1]) * 0.5;
        }
        left[level] = right[0];
    }
    (left, right)
}

/// Value of a polynomial in Bernstein form at a share of its interval, and its derivative by that share (de Casteljau).
pub(crate) fn at_share<T, const M: usize>(control: &[T; M], share: f64) -> [T; 2]
where
    T: Copy + Add<Output = T> + Mul<f64, Output = T>,
{
    let mut points = *control;
    for level in (2..M).rev() {
        for k in 0..level {
            points[k] = points[k] * (1.0 - share) + points[k + 1] * share;
        }
    }
    let rise = (points[1] + points[0] * -1.0) * (M - 1) as f64;
    [points[0] * (1.0 - share) + points[1] * share, rise]
}

/// Most steps to a root: halving alone ends with the last digit of a share after so many.
const STEPS: usize = 60;

/// The share of the interval at which a polynomial in Bernstein form is zero; `None` unless its coefficients change sign
/// just once: then it has one root, which is found to the last digits.
///
/// # Source
/// Variation diminishing property: Farin 2002, section 5.6. Newton's method inside a bracket.
pub(crate) fn only_root<const M: usize>(control: &[f64; M]) -> Option<f64> {
    let signs = || (0..M).filter(|k| control[*k] != 0.0);
    let changes = || {
        let pairs = signs().zip(signs().skip(1));
        pairs.filter(|(i, k)| (control[*i] > 0.0) != (control[*k] > 0.0))
    };
    let (before, after) = changes().next()?;
    if changes().nth(1).is_some() {
        return None;
    }
    let rises = control[after] > 0.0;
    let far = control[before] / (control[before] - control[after]);
    let (mut low, mut high) = (0.0, 1.0);
    let mut share = (before as f64 + far * (after - before) as f64) / (M - 1) as f64;
    for _ in 0..STEPS {
        let [value, slope] = at_share(control, share);
        if (value > 0.0) == rises {
            high = share;
        } else {
            low = share;
        }
        let next = share - value / slope;
        let next = if next > low && next < high {
            next
        } else {
            0.5 * (low + high)
        };
        let step = (next - share).abs();
        share = next;
        if step <= 4.0 * f64::EPSILON {
            break;
        }
    }
    Some(share)
}

/// Bernstein coefficients of the dot product of a quartic and a cubic.
pub(crate) fn dot(quartic: &[Vector3<f64>; 5], cubic: &[Vector3<f64>; 4]) -> [f64; 8] {
    let mut product = [0.0; 8];
    for (i, a) in quartic.iter().enumerate() {
        for (j, b) in cubic.iter().enumerate() {
            product[i + j] += a.dot(b) * CHOOSE[4][i] * CHOOSE[3][j] / CHOOSE[7][i + j];
        }
    }
    product
}

/// Value and three derivatives at `t` of the quartic `sum_k power[k] t^k`.
pub(crate) fn quartic<T>(power: &[T; 5], t: f64) -> [T; 4]
where
    T: Copy + Add<Output = T> + Mul<f64, Output = T>,
{
    let [c0, c1, c2, c3, c4] = *power;
    [
        c0 + (c1 + (c2 + (c3 + c4 * t) * t) * t) * t,
        c1 + (c2 * 2.0 + (c3 * 3.0 + c4 * (4.0 * t)) * t) * t,
        c2 * 2.0 + (c3 * 6.0 + c4 * (12.0 * t)) * t,
        c3 * 6.0 + c4 * (24.0 * t),
    ]
}

/// Upper bound of the norm of a Bernstein form over `limit`, refined by halving while it is above
/// the limit and above the values at the ends.
pub(crate) fn hull<const M: usize>(control: &[Vector3<f64>; M], limit: f64, depth: u32) -> f64 {
    let norms = control.map(|c| c.norm() / limit);
    let bound = norms
        .iter()
        .fold(0.0, |worst: f64, n| if *n <= worst { worst } else { *n });
    let ends = norms[0].max(norms[M - 1]);
    if depth == 0 || bound <= 0.9 || bound <= ends * (1.0 + 1e-4) {
        return bound;
    }
    let (left, right) = halve(control);
    hull(&left, limit, depth - 1).max(hull(&right, limit, depth - 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn value(power: &[f64; 5], t: f64) -> f64 {
        quartic(power, t)[0]
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(2), ..ProptestConfig::default() })]

        /// Ends are interpolated, the hull holds, and halves agree with the whole.
        #[test]
        fn hull_holds(power in prop::array::uniform5(-2.0..2.0_f64), from in -1.0..1.0_f64, width in 0.01..2.0_f64) {
            let to = from + width;
            let control = bernstein(&power, from, to);
            assert_relative_eq!(control[0], value(&power, from), epsilon = 1e-10);
            assert_relative_eq!(control[4], value(&power, to), epsilon = 1e-10);
            let (low, high) = control.iter().fold((f64::MAX, f64::MIN), |(l, h), c| (l.min(*c), h.max(*c)));
            for i in 0..=20 {
                let x = value(&power, from + width * f64::from(i) / 20.0);
                prop_assert!(low - 1e-10 <= x && x <= high + 1e-10);
            }
            let (left, right) = halve(&control);
            assert_relative_eq!(left[4], value(&power, from + width / 2.0), epsilon = 1e-10);
            assert_relative_eq!(right[0], left[4], epsilon = 1e-12);
            assert_relative_eq!(right[4], control[4], epsilon = 1e-12);
        }

        /// Values at a share are those of the power form, and so is the derivative.
        #[test]
        fn values_at_a_share(power in prop::array::uniform5(-2.0..2.0_f64), share in 0.0..1.0_f64) {
            let [value, rise] = at_share(&bernstein(&power, 0.0, 1.0), share);
            let [right, slope, ..] = quartic(&power, share);
            assert_relative_eq!(value, right, epsilon = 1e-12);
            assert_relative_eq!(rise, slope, epsilon = 1e-11);
        }

        /// Where the coefficients change sign once the root is one, to the last digits; else none is given.
        #[test]
        fn the_only_root_is_a_root(control in prop::array::uniform8(-1.0..1.0_f64), low in 0..7_usize) {
            let [mut once, mut twice] = [control.map(f64::abs); 2];
            once[..=low].iter_mut().for_each(|c| *c = -*c);
            twice[low] = -0.1;
            let root = only_root(&once).unwrap();
            let [value, slope] = at_share(&once, root);
            prop_assert!(value.abs() <= 1e-15 * (1.0 + slope.abs()) * 8.0, "{once:?} {root} {value} {slope}");
            prop_assert_eq!(only_root(&twice).is_some(), low == 0);
            prop_assert_eq!(only_root(&control.map(f64::abs)), None);
        }

        /// The product's Bernstein form is the product.
        #[test]
        fn product_is_a_product(a in prop::array::uniform5(-2.0..2.0_f64), b in prop::array::uniform4(-2.0..2.0_f64)) {
            let q = a.map(|x| Vector3::new(x, 1.0 - x, 0.5));
            let c = b.map(|x| Vector3::new(x, x * x, 2.0));
            let product = dot(&q, &c);
            assert_relative_eq!(product[0], q[0].dot(&c[0]), epsilon = 1e-12);
            assert_relative_eq!(product[7], q[4].dot(&c[3]), epsilon = 1e-12);
            let middle = halve(&product).0[7];
            assert_relative_eq!(middle, halve(&q).0[4].dot(&halve(&c).0[3]), epsilon = 1e-12);
        }
    }
}
