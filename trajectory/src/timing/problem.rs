//! The time law as an optimisation problem over a grid of cells.

use nalgebra::Vector3;

use super::lanes::{LANE, Lane};

/// A law `a(w) = (dw/dt)^2`, C1 and quadratic in each cell, is given by its first value, the middle
/// Bézier point of each cell, and its last value. In a cell with `a`, `b = a'/2`, `c = a''/2` at
/// its left end: `d²w/dt² = b` and `d³w/dt³ = c sqrt(a)`.
///
/// Every row is divided by its limit. Locations are numbered `2 k` for node `k` and `2 k + 1` for
/// the middle of cell `k`. Jerk rows stand at places that are evenly spread over each cell, both
/// ends included: three in most cells, more where the path turns fast against the law.
#[derive(Clone, Debug, Default)]
pub(super) struct Problem {
    /// Widths of the cells.
    pub widths: Vec<f64>,
    /// Groups of joint rows at a location.
    pub lanes: usize,
    /// Acceleration rows `|p b + q a| <= 1` at each location, as `[p, q]`.
    pub acceleration: Vec<[Lane; 2]>,
    /// Jerk rows `sqrt(a) |x a + y b + z c| <= 1` at each jerk place, as `[x, y, z]`.
    pub jerk: Vec<[Lane; 3]>,
    /// Index of the first jerk place of each cell, then their number.
    pub jerk_places: Vec<usize>,
    /// Reciprocal of the cap of `a` at each location.
    pub cap: Vec<f64>,
    /// Acceleration rows of the tool, bounded in norm; the same number at each location.
    pub norm_acceleration: Vec<[Vector3<f64>; 2]>,
    /// Jerk rows of the tool, bounded in norm.
    pub norm_jerk: Vec<[Vector3<f64>; 3]>,
    /// Whether the law has to begin with `a = 1`, `b = 0`.
    pub moving: bool,
}

/// The law at one place: `a`, `b` there and `c` of the cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spot {
    /// `(dw/dt)^2`.
    pub a: f64,
    /// `d²w/dt²`.
    pub b: f64,
    /// `(d³w/dt³) / (dw/dt)`.
    pub c: f64,
}

impl Spot {
    /// The law of the same cell `x` further on.
    pub(super) fn moved(self, x: f64) -> Self {
        Self {
            a: self.a + x * (2.0 * self.b + x * self.c),
            b: self.b + x * self.c,
            c: self.c,
        }
    }
}

impl Problem {
    /// Number of cells.
    pub(super) fn cells(&self) -> usize {
        self.widths.len()
    }

    /// The problem with all limits of speed, acceleration and jerk `factor` times as wide.
    pub(super) fn relaxed(&self, factor: f64) -> Self {
        let mut wide = self.clone();
        let narrow = 1.0 / factor;
        let rows = wide.acceleration.iter_mut().flatten().flatten();
        let rows = rows.chain(wide.jerk.iter_mut().flatten().flatten());
        rows.for_each(|x| *x *= narrow);
        let vectors = wide.norm_acceleration.iter_mut().flatten();
        let vectors = vectors.chain(wide.norm_jerk.iter_mut().flatten());
        vectors.for_each(|x| *x *= narrow);
        wide.cap.iter_mut().for_each(|cap| *cap *= narrow * narrow);
        wide
    }

    /// Takes away the rows of the first node that a given start state decides by itself.
    pub(super) fn release_start(&mut self) {
        let norms = self.norm_accelerations();
        self.acceleration[..self.lanes].fill([[0.0; LANE]; 2]);
        self.norm_acceleration[..norms].fill([Vector3::zeros(); 2]);
        self.cap[0] = 1e-6;
    }

    /// Tool rows of acceleration at each location.
    pub(super) fn norm_accelerations(&self) -> usize {
        self.norm_acceleration.len() / (2 * self.cells() + 1)
    }

    /// Tool rows of jerk at each jerk place.
    pub(super) fn norm_jerks(&self) -> usize {
        self.norm_jerk.len() / self.jerk_places.last().copied().unwrap_or(0).max(1)
    }

    /// The jerk places of cell `k`, each with its distance from the left end.
    pub(super) fn jerk_spots(&self, k: usize) -> impl Iterator<Item = (usize, f64)> {
        let (first, end) = (self.jerk_places[k], self.jerk_places[k + 1]);
        let step = self.widths[k] / (end - first - 1) as f64;
        (first..end).map(move |i| (i, step * (i - first) as f64))
    }

    /// Width of the cell before `k`; 0 before the first.
    fn width_before(&self, k: usize) -> f64 {
        if k == 0 { 0.0 } else { self.widths[k - 1] }
    }

    /// The rows of `a`, `b`, `c` at the left end of cell `k` over the unknowns `k`, `k+1`, `k+2`.
    pub(super) fn basis(&self, k: usize) -> [[f64; 3]; 3] {
        let (before, h) = (self.width_before(k), self.widths[k]);
        let after = self.widths.get(k + 1).copied().unwrap_or(0.0);
        let (left, right) = (1.0 / (before + h), 1.0 / (h + after));
        let a = [h * left, before * left, 0.0];
        let b = [-left, left, 0.0];
        let c = [left / h, -(left + right) / h, right / h];
        [a, b, c]
    }

    /// The law at the left end of cell `k`.
    pub(super) fn spot(&self, k: usize, x: &[f64]) -> Spot {
        let (before, h) = (self.width_before(k), self.widths[k]);
        let after = self.widths.get(k + 1).copied().unwrap_or(0.0);
        let (left, right) = (1.0 / (before + h), 1.0 / (h + after));
        let b = (x[k + 1] - x[k]) * left;
        let next = (x[k + 2] - x[k + 1]) * right;
        Spot {
            a: (h * x[k] + before * x[k + 1]) * left,
            b,
            c: (next - b) / h,
        }
    }

    /// Share of location `i` in the time, over `1 / sqrt(a)` (Simpson's rule in each cell).
    pub(super) fn weight(&self, i: usize) -> f64 {
        let k = i / 2;
        if i % 2 == 1 {
            return self.widths[k] * (4.0 / 6.0);
        }
        (self.width_before(k) + self.widths.get(k).copied().unwrap_or(0.0)) / 6.0
    }

    /// The time that the law `x` takes.
    pub(super) fn time(&self, x: &[f64]) -> f64 {
        let mut time = 0.0;
        for (k, h) in self.widths.iter().enumerate() {
            let spot = self.spot(k, x);
            let (middle, end) = (spot.moved(0.5 * h), spot.moved(*h));
            time += h / 6.0 * (1.0 / spot.a.sqrt() + 4.0 / middle.a.sqrt() + 1.0 / end.a.sqrt());
        }
        time
    }
}
