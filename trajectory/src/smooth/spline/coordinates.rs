//! The coordinates of control points, four at a time.

use simd::{F4, Four, LANES};

use super::basis::{AT_KNOT, AT_MIDDLE};

/// How often the last control point stands there once more, so that groups of four may begin at each.
const MORE: usize = 8;

/// Coordinates of control points, those of one coordinate after those of the other.
pub(super) struct Coordinates {
    values: Vec<f64>,
    length: usize,
}

impl Coordinates {
    /// Those of control points, the last of which stands there a few times more.
    pub(super) fn of<const D: usize>(control: &[[f64; D]]) -> Self {
        let length = control.len() + MORE;
        let last = control.last().copied().unwrap_or([0.0; D]);
        let mut values = vec![0.0; D * length];
        for (d, values) in values.chunks_exact_mut(length).enumerate() {
            let (own, more) = values.split_at_mut(control.len());
            for (value, control) in own.iter_mut().zip(control) {
                *value = control[d];
            }
            more.fill(last[d]);
        }
        Self { values, length }
    }

    /// Coordinate `d` of the control points from `k` on.
    #[inline(always)]
    fn from(&self, d: usize, k: usize) -> &[f64; LANES + 4] {
        let values = &self.values[d * self.length + k..];
        values.first_chunk().unwrap_or(&[0.0; LANES + 4])
    }

    /// Differences of order 1 to 3 in group `g`, those of the control points from `k` on.
    #[inline(always)]
    pub(super) fn differences<S: Four>(&self, simd: S, g: usize, k: usize) -> [[F4<S>; 3]; 3] {
        let zero = F4::splat(simd, 0.0);
        let mut result = [[zero; 3]; 3];
        for d in 0..3 {
            let c = self.from(3 * g + d, k);
            let (c0, c1) = (F4::load(simd, c), F4::load(simd, &c[1..]));
            let (c2, c3) = (F4::load(simd, &c[2..]), F4::load(simd, &c[3..]));
            let (first, second, third) = (c1 - c0, c2 - c1, c3 - c2);
            let (bend, next) = (second - first, third - second);
            (result[0][d], result[1][d], result[2][d]) = (first, bend, next - bend);
        }
        result
    }

    /// Positions in group `g` at the knots from `k` on, and in the middles of the spans after them.
    #[inline(always)]
    pub(super) fn samples<S: Four>(&self, simd: S, g: usize, k: usize) -> [[F4<S>; 3]; 2] {
        let zero = F4::splat(simd, 0.0);
        let mut result = [[zero; 3]; 2];
        for d in 0..3 {
            let c = self.from(3 * g + d, k);
            let (c0, c1) = (F4::load(simd, c), F4::load(simd, &c[1..]));
            let (c2, c3) = (F4::load(simd, &c[2..]), F4::load(simd, &c[3..]));
            result[0][d] = (c0 + c3) * AT_KNOT[0] + (c1 + c2) * AT_KNOT[1];
            let outer = c0 + F4::load(simd, &c[4..]);
            result[1][d] = outer * AT_MIDDLE[0] + (c1 + c3) * AT_MIDDLE[1] + c2 * AT_MIDDLE[2];
        }
        result
    }
}
