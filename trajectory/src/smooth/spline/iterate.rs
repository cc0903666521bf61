//! An iterate, and how its control points move.

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
    /// Where inner vertices are to move: by how much each. Then there are no slopes but those that pull the balls along.
    pub(super) shifts: Option<&'a [[f64; D]]>,
}

impl<'a, const D: usize> Iterate<'a, D> {
    /// An iterate in its bounds.
    pub(super) fn new(problem: &'a Problem<D>, point: &'a Point<D>, room: &'a Room) -> Self {
        Self {
            problem,
            point,
            room,
            pinned: problem.pinned(point.z),
            slides: problem.slides(point),
            shifts: None,
        }
    }

    /// How each control point moves with `z`; empty if none does.
    pub(super) fn moves(&self) -> Vec<[f64; D]> {
        let still = |pin: &[[f64; D]; 2]| pin[1].iter().all(|x| *x == 0.0);
        if !self.slides.is_empty() || self.pinned.iter().all(still) {
            return self.slides.clone();
        }
        let mut moves = vec![[0.0; D]; self.point.control.len()];
        for (to, pin) in moves.iter_mut().zip(&self.pinned) {
            *to = pin[1];
        }
        moves
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
