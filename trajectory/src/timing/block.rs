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

/// `sum_i rows[i] * factors[i]` for rows that are vectors in each cell.
#[inline(always)]
pub(super) fn combine<S: Four, const M: usize>(
    rows: [[F4<S>; 3]; M],
    factors: [F4<S>; M],
) -> [F4<S>; 3] {
    let first = factors[0];
    let mut out = rows[0];
    for x in &mut out {
        *x = *x * first;
    }
    for k in 1..M {
        for (out, row) in out.iter_mut().zip(rows[k]) {
            *out += row * factors[k];
        }
    }
    out
}
