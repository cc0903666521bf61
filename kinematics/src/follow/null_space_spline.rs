//! A spline added to a null-space motion: it changes the motion along a part of a path, and nothing of the rest.

/// Basis functions of a spline.
pub(super) const BASIS: usize = 20;
/// Degree of the spline: its third derivative is smooth.
const DEGREE: usize = 5;

/// A spline over a path, by its coefficients, rad. It begins and ends with the path, as level as four derivatives that are zero make it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Spline(pub(super) [f64; BASIS]);

impl Spline {
    /// Its value and first three derivatives where the path parameter has gone so far of its span.
    pub(super) fn at(&self, (gone, span): (f64, f64)) -> [f64; 4] {
        let step = span / (BASIS + DEGREE) as f64;
        let x = gone / step;
        let begin = (x.max(0.0) as usize).saturating_sub(DEGREE);
        let mut sum = [0.0; 4];
        for (k, coefficient) in self.0.iter().enumerate().skip(begin).take(DEGREE + 1) {
            let mut scale = *coefficient;
            for (sum, value) in sum.iter_mut().zip(basis(x - k as f64)) {
                *sum += scale * value;
                scale /= step;
            }
        }
        sum
    }
}

/// The basis function that is not zero from 0 to 6, and its first three derivatives.
///
/// # Source
/// The B-spline of even knots as a sum of truncated powers: C. de Boor, "A Practical Guide to Splines", 1978, chapter 9.
fn basis(x: f64) -> [f64; 4] {
    const SIGNS: [f64; DEGREE + 2] = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
    let mut sum = [0.0; 4];
    if x >= SIGNS.len() as f64 - 1.0 {
        return sum;
    }
    for (k, sign) in SIGNS.into_iter().enumerate() {
        let t = (x - k as f64).max(0.0);
        let square = t * t;
        sum[0] += sign * square * square * t / 120.0;
        sum[1] += sign * square * square / 24.0;
        sum[2] += sign * square * t / 6.0;
        sum[3] += sign * square / 2.0;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::null_space::NullSpace;
    use super::*;
    use nalgebra::SVector;

    /// Far from the basis functions with a coefficient nothing changes, each derivative is that of the one before, and both ends are level.
    #[test]
    fn a_part_of_the_path_changes() {
        let mut motion = NullSpace::<7>::none();
        motion.directions[0] = SVector::<f64, 7>::repeat(1.0).normalize();
        motion.polynomials[0] = [0.4, -0.3, 0.2, 0.0, 0.1, 0.0];
        (motion.from, motion.span) = (1.0, 2.0);
        let mut coefficients = [0.0; BASIS];
        (coefficients[0], coefficients[1]) = (0.3, -0.2);
        let other = NullSpace {
            spline: Some(Spline(coefficients)),
            ..motion.clone()
        };
        let late = 1.0 + 2.0 * 0.6;
        assert_eq!(other.at(late)[0], motion.at(late)[0]);
        assert_eq!(other.rates(late)[0], motion.rates(late)[0]);
        assert!((other.at(1.4)[0] - motion.at(1.4)[0]).abs() > 0.01);
        for end in [1.0, 3.0] {
            assert!((other.at(end)[0] - motion.at(end)[0]).abs() < 1e-12);
            let rates = [&other, &motion].map(|motion| motion.rates(end)[0]);
            assert!(
                rates[0]
                    .iter()
                    .zip(rates[1])
                    .all(|(a, b)| (a - b).abs() < 1e-9)
            );
        }
        let seen = |u: f64| {
            let [first, second, third] = other.rates(u)[0];
            [other.at(u)[0], first, second, third]
        };
        let step = 1e-5;
        for k in 1..100 {
            let u = 1.0 + 0.02 * f64::from(k);
            let [before, here, after] = [-step, 0.0, step].map(|by| seen(u + by));
            for order in 0..3 {
                let slope = (after[order] - before[order]) / (2.0 * step);
                let off = (slope - here[order + 1]).abs();
                assert!(off < 1e-4 * (1.0 + here[order + 1].abs()), "{u}: {off}");
            }
        }
    }
}
