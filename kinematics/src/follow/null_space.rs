//! Null-space motion as linear functions of the joints.
//!
//! The null-space motion is given by linear functions of the joints, `c . q = r(u)`, where `c` is
//! the direction in which the arm can move at the start without moving its tool, and `r` is a
//! polynomial of `u`. So it has exact derivatives and does not drift. With two redundant joints,
//! the second function is constant. With one, `r` may be given by the caller instead.

use super::null_space_spline::Spline;
use nalgebra::SVector;
use std::rc::Rc;

/// The value of a linear function of the joints at a path parameter, and its first three derivatives to it.
type SpareCourse = Rc<dyn Fn(f64) -> [f64; 4]>;

/// Coefficients of a polynomial `r(u) = sum r_k x^k`, `x` from 0 to 1 over the path.
pub(super) type NullSpacePolynomial = [f64; 6];

/// Shapes of a null-space motion over the progress along the path, each zero at the start and of size 1:
/// to another place at the end, there and back, and so with one and two more turns.
pub(super) const SHAPES: [NullSpacePolynomial; 4] = [
    [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 4.0, -4.0, 0.0, 0.0, 0.0],
    [0.0, 10.4, -31.2, 20.8, 0.0, 0.0],
    [0.0, 16.0, -80.0, 128.0, -64.0, 0.0],
];
/// Null-space motion: up to two linear functions of the joints with their polynomials.
#[derive(Clone)]
pub(super) struct NullSpace<const N: usize> {
    pub(super) directions: [SVector<f64, N>; 2],
    pub(super) polynomials: [NullSpacePolynomial; 2],
    pub(super) from: f64,
    pub(super) span: f64,
    pub(super) still_ends: bool,
    /// A spline that is added to the first polynomial.
    pub(super) spline: Option<Spline>,
    /// The values of the first function, if the caller gives them.
    pub(super) course: Option<SpareCourse>,
}

impl<const N: usize> NullSpace<N> {
    /// For arms of up to six joints, which have none.
    pub(super) fn none() -> Self {
        Self {
            directions: [SVector::zeros(); 2],
            polynomials: [[0.0; 6]; 2],
            from: 0.0,
            span: 1.0,
            still_ends: false,
            spline: None,
            course: None,
        }
    }

    /// Adds a polynomial of a size to the first one.
    pub(super) fn add_shape(&mut self, shape: &NullSpacePolynomial, size: f64) {
        for (c, s) in self.polynomials[0].iter_mut().zip(shape) {
            *c += size * s;
        }
    }

    /// The direction of a linear function.
    pub(super) fn direction(&self, k: usize) -> &SVector<f64, N> {
        &self.directions[k]
    }

    /// Value of each function at `u`.
    pub(super) fn at(&self, u: f64) -> [f64; 2] {
        if let Some(course) = &self.course {
            return [course(u)[0], 0.0];
        }
        let [w, ..] = self.progress((u - self.from) / self.span);
        let mut values = self
            .polynomials
            .map(|null_space_path| null_space_path.iter().rev().fold(0.0, |sum, c| sum * w + c));
        if let Some(spline) = &self.spline {
            values[0] += spline.at((u - self.from, self.span))[0];
        }
        values
    }

    /// Progress of the polynomials and its first three derivatives at `x` from 0 to 1: `x` itself,
    /// or a function that starts from rest, accelerates over the first [`EASE`] of the path, is
    /// linear in the middle and comes to rest over the last [`EASE`].
    pub(super) fn progress(&self, x: f64) -> [f64; 4] {
        if !self.still_ends {
            return [x, 1.0, 0.0, 0.0];
        }
        let x = x.clamp(0.0, 1.0);
        if x <= 0.5 {
            return eased(x);
        }
        let [w, w1, w2, w3] = eased(1.0 - x);
        [1.0 - w, w1, -w2, w3]
    }

    /// Value of the first function at `u`, and its first three derivatives.
    pub(super) fn jet(&self, u: f64) -> [f64; 4] {
        let [first, second, third] = self.rates(u)[0];
        [self.at(u)[0], first, second, third]
    }

    /// First to third derivative of each function to `u`: of a polynomial by the chain rule through its progress.
    pub(super) fn rates(&self, u: f64) -> [[f64; 3]; 2] {
        if let Some(course) = &self.course {
            let [_, first, second, third] = course(u);
            return [[first, second, third], [0.0; 3]];
        }
        let [w, w1, w2, w3] = self.progress((u - self.from) / self.span);
        let mut rates = self.polynomials.map(|null_space_path| {
            let mut c = null_space_path;
            let [r1, r2, r3]: [f64; 3] = std::array::from_fn(|_| {
                for k in 0..5 {
                    c[k] = c[k + 1] * (k as f64 + 1.0);
                }
                c[5] = 0.0;
                c.iter().rev().fold(0.0, |sum, c| sum * w + c)
            });
            let to_x = [
                r1 * w1,
                r2 * w1 * w1 + r1 * w2,
                r3 * w1 * w1 * w1 + 3.0 * r2 * w1 * w2 + r1 * w3,
            ];
            let span = self.span;
            [
                to_x[0] / span,
                to_x[1] / (span * span),
                to_x[2] / (span * span * span),
            ]
        });
        if let Some(spline) = &self.spline {
            let [_, added @ ..] = spline.at((u - self.from, self.span));
            for (rate, added) in rates[0].iter_mut().zip(added) {
                *rate += added;
            }
        }
        rates
    }
}

/// Fraction of the path in which a polynomial that begins at rest accelerates.
const EASE: f64 = 0.2;

/// First half of an eased progress: its rate is `10 t^3 - 15 t^4 + 6 t^5` of what it
/// becomes, `t` from 0 to 1 over [`EASE`].
fn eased(x: f64) -> [f64; 4] {
    let even = 1.0 / (1.0 - EASE);
    if x >= EASE {
        return [even * (x - 0.5 * EASE), even, 0.0, 0.0];
    }
    let t = x / EASE;
    [
        even * EASE * t.powi(4) * (2.5 - 3.0 * t + t * t),
        even * t.powi(3) * (10.0 - 15.0 * t + 6.0 * t * t),
        even / EASE * 30.0 * (t * (1.0 - t)).powi(2),
        even / (EASE * EASE) * 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t),
    ]
}
