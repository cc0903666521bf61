//! Vectors of four neighbouring cells at once.

use simd::{F4, Four, LANES};

/// Cells in a block.
pub(super) const LANE: usize = LANES;

/// One number of each cell of a block.
pub(super) type Lane = [f64; LANE];

/// The scalar product of two vectors in each cell.
#[inline(always)]
pub(super) fn dot<S: Four>(a: [F4<S>; 3], b: [F4<S>; 3]) -> F4<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Rows of four cells in registers.
#[inline(always)]
pub(super) fn lanes<S: Four, const M: usize>(simd: S, lanes: &[Lane; M]) -> [F4<S>; M] {
    lanes.each_ref().map(|lane| F4::load(simd, lane))
}

/// Product of a symmetric matrix, given by its rows from the diagonal on, and a vector of two numbers.
#[inline(always)]
pub(super) fn times_two<S: Four>([xx, xy, yy]: [F4<S>; 3], [x, y]: [F4<S>; 2]) -> [F4<S>; 2] {
    [xx * x + xy * y, xy * x + yy * y]
}

/// The same of three.
#[inline(always)]
pub(super) fn times<S: Four>(
    [xx, xy, xz, yy, yz, zz]: [F4<S>; 6],
    vector: [F4<S>; 3],
) -> [F4<S>; 3] {
    [
        dot([xx, xy, xz], vector),
        dot([xy, yy, yz], vector),
        dot([xz, yz, zz], vector),
    ]
}
