//! An iterate, and how sums of its control points move.

use super::problem::{Point, Problem, Room};

/// An iterate with what the terms of its barrier need.
pub(super) struct Iterate<'a, const D: usize> {
    pub(super) problem: &'a Problem<D>,
    pub(super) point: &'a Point<D>,
    pub(super) room: &'a Room,
    /// The control points that the start fixes, and their derivatives to `z`.
    pub(super) pinned: [[[f64; D]; 2]; 4],
    /// How each control point moves with `z` if the end is in motion; empty if it rests.
    pub(super) slides: Vec<[f64; D]>,
}

impl<const D: usize> Iterate<'_, D> {
    /// How a sum of control points moves with `z`, if some of them are pinned.
    #[inline(always)]
    pub(super) fn slide<const M: usize>(&self, sum: &Sum<'_, M>) -> Option<[f64; 3]> {
        let Sum { first, w, g } = *sum;
        let mut slide = [0.0; 3];
        let mut add = |weight: f64, change: &[f64; D]| {
            for d in 0..3 {
                slide[d] += weight * change[3 * g + d];
            }
        };
        if !self.slides.is_empty() {
            for (weight, change) in w.iter().zip(&self.slides[first..]) {
                add(*weight, change);
            }
        } else if first < 4 {
            for (weight, pin) in w.iter().zip(&self.pinned[first..]) {
                add(*weight, &pin[1]);
            }
        } else {
            return None;
        }
        Some(slide)
    }
}

/// A weighted sum of consecutive control points, of the coordinates of one group.
#[derive(Clone, Copy)]
pub(super) struct Sum<'a, const M: usize> {
    pub(super) first: usize,
    pub(super) w: &'a [f64; M],
    pub(super) g: usize,
}

impl<'a, const M: usize> Sum<'a, M> {
    #[inline(always)]
    pub(super) fn new(first: usize, w: &'a [f64; M], g: usize) -> Self {
        Self { first, w, g }
    }
}

/// `diagonal I + scale y y^T`.
#[inline(always)]
pub(super) fn outer(y: &[f64; 3], diagonal: f64, scale: f64) -> [[f64; 3]; 3] {
    let mut result = [[0.0; 3]; 3];
    for a in 0..3 {
        for b in 0..3 {
            result[a][b] = scale * y[a] * y[b];
        }
        result[a][a] += diagonal;
    }
    result
}
