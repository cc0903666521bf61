//! The search for the largest value of polynomials over time.

use std::ops::{Add, Mul};

use crate::poly::halve;

/// Largest relative distance of a bound from a value that is reached.
pub(super) const TOLERANCE: f64 = 1e-3;
/// A stretch is halved at most this often.
const DEPTH: u32 = 12;

/// The largest value found so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
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
    pub(super) fn enough(&self, bound: f64) -> bool {
        bound <= (self.reached * (1.0 + TOLERANCE)).max(self.floor)
    }

    /// Adds a bound; NaN counts as the highest.
    pub(super) fn raise(&mut self, bound: f64, time: f64) {
        if bound > self.bound || bound.is_nan() {
            (self.bound, self.time) = (bound, time);
        }
    }

    /// Adds a quantity that is within `error` of a polynomial in Bernstein form over `[from, to]`
    /// (s); its size is `norm` of the vector, which must be convex.
    pub(super) fn take<T, const M: usize>(
        &mut self,
        control: &[T; M],
        (from, to): (f64, f64),
        (error, norm): (f64, &impl Fn(&T) -> f64),
    ) where
        T: Copy + Add<Output = T> + Mul<f64, Output = T>,
    {
        self.halved(control, (from, to), (error, norm), DEPTH);
    }

    fn halved<T, const M: usize>(
        &mut self,
        control: &[T; M],
        (from, to): (f64, f64),
        (error, norm): (f64, &impl Fn(&T) -> f64),
        depth: u32,
    ) where
        T: Copy + Add<Output = T> + Mul<f64, Output = T>,
    {
        let (mut hull, mut at) = (0.0_f64, 0);
        for (i, c) in control.iter().enumerate() {
            let size = norm(c);
            if size > hull || size.is_nan() {
                (hull, at) = (size, i);
            }
        }
        let bound = hull + error;
        let ends = norm(&control[0]).max(norm(&control[M - 1])) - error;
        self.reached = self.reached.max(ends);
        if bound <= self.bound {
            return;
        }
        if depth == 0 || self.enough(bound) || !bound.is_finite() {
            self.raise(bound, from + (to - from) * at as f64 / (M - 1) as f64);
            return;
        }
        let middle = 0.5 * (from + to);
        let (left, right) = halve(control);
        self.halved(&left, (from, middle), (error, norm), depth - 1);
        self.halved(&right, (middle, to), (error, norm), depth - 1);
    }
}
