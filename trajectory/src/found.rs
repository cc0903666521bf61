//! The search for the largest value of polynomials over time.

use std::ops::{Add, Mul, Range};

use crate::poly::halve;

/// Largest relative distance of a bound from a value that is reached.
pub(crate) const TOLERANCE: f64 = 1e-3;
/// A stretch is halved at most this often.
const DEPTH: u32 = 12;

/// The largest value found so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Found {
    /// No value is higher.
    pub bound: f64,
    /// When (s) it is about attained.
    pub time: f64,
    /// Some value is at least this high.
    pub reached: f64,
    /// Bounds below this need not be tight.
    pub floor: f64,
}

impl Found {
    /// Whether a bound is near enough to a value that is reached.
    pub(crate) fn enough(&self, bound: f64) -> bool {
        bound <= (self.reached * (1.0 + TOLERANCE)).max(self.floor)
    }

    /// Adds a bound; NaN counts as the highest.
    pub(crate) fn raise(&mut self, bound: f64, time: f64) {
        if bound > self.bound || bound.is_nan() {
            (self.bound, self.time) = (bound, time);
        }
    }

    /// Adds a quantity over a range of time (s) in which it is within `error` of a polynomial in
    /// Bernstein form; its size is `norm` of the vector, which must be convex.
    pub(crate) fn take<T, const M: usize>(
        &mut self,
        control: &[T; M],
        when: Range<f64>,
        error: f64,
        norm: impl Fn(&T) -> f64,
    ) where
        T: Copy + Add<Output = T> + Mul<f64, Output = T>,
    {
        let mut search = Search {
            found: self,
            error,
            norm,
        };
        search.take(control, when, DEPTH);
    }
}

/// The search for the largest value of one quantity.
struct Search<'a, F> {
    found: &'a mut Found,
    error: f64,
    norm: F,
}

impl<F> Search<'_, F> {
    /// Adds a polynomial, and halves it at most `depth` times.
    fn take<T, const M: usize>(&mut self, control: &[T; M], when: Range<f64>, depth: u32)
    where
        T: Copy + Add<Output = T> + Mul<f64, Output = T>,
        F: Fn(&T) -> f64,
    {
        let (mut hull, mut at) = (0.0_f64, 0);
        for (i, c) in control.iter().enumerate() {
            let size = (self.norm)(c);
            if size > hull || size.is_nan() {
                (hull, at) = (size, i);
            }
        }
        let bound = hull + self.error;
        let ends = (self.norm)(&control[0]).max((self.norm)(&control[M - 1])) - self.error;
        let found = &mut *self.found;
        found.reached = found.reached.max(ends);
        if bound <= found.bound {
            return;
        }
        if depth == 0 || found.enough(bound) || !bound.is_finite() {
            let share = at as f64 / (M - 1) as f64;
            found.raise(bound, when.start + (when.end - when.start) * share);
            return;
        }
        let middle = 0.5 * (when.start + when.end);
        let (left, right) = halve(control);
        self.take(&left, when.start..middle, depth - 1);
        self.take(&right, middle..when.end, depth - 1);
    }
}
