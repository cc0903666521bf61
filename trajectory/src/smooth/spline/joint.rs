//! A joint of an arm that follows a spline.
//!
//! Near a motion that is known, the position of a joint is to first order an affine function of where the tool is. So the
//! joints at the control points are control points of a spline, too, and the hulls of their differences bound speed,
//! acceleration and jerk of each joint for all times.

use simd::{F4, Four, LANES};

use super::basis::{FIRST, SECOND, THIRD};

/// How often the last position stands there once more, so that groups of four may begin at each.
const MORE: usize = 8;

/// Differences of order 1 to 3, as weights of consecutive control points.
pub(super) const DIFFERENCES: [&[f64]; 3] = [&FIRST, &SECOND, &THIRD];

/// Bounds of a joint at each control point: of its position, speed, acceleration and jerk.
pub(super) const BOUNDS: usize = 4;

/// A joint whose position at each control point is an affine function of it.
#[derive(Clone, Debug)]
pub(crate) struct Joint<const D: usize> {
    /// Greatest speed, acceleration and jerk.
    pub(super) caps: [f64; 3],
    /// Middle of its positions at each control point, and how far it may be from there.
    pub(super) range: Vec<[f64; 2]>,
    /// Its position where the coordinates of a control point are 0, and how it changes with each, by control point.
    pub(super) base: Vec<f64>,
    pub(super) changes: Vec<[f64; D]>,
}

impl<const D: usize> Joint<D> {
    /// Its positions at control points, the last of which stands there a few times more.
    pub(super) fn positions(&self, control: &[[f64; D]]) -> Vec<f64> {
        let mut positions = Vec::with_capacity(control.len() + MORE);
        let all = self.base.iter().zip(&self.changes).zip(control);
        positions.extend(all.map(|((base, change), c)| base + dot(change, c)));
        let last = positions.last().copied().unwrap_or_default();
        positions.resize(control.len() + MORE, last);
        positions
    }

    /// Whether it is within its range at all control points.
    pub(super) fn is_within(&self, control: &[[f64; D]]) -> bool {
        let positions = self.positions(control);
        let mut all = positions.iter().zip(&self.range);
        all.all(|(q, [middle, half])| (q - middle).abs() < *half)
    }

    /// Greatest ratio of speed, acceleration and jerk to their bounds.
    pub(super) fn ratios(&self, control: &[[f64; D]], h: f64) -> [f64; 3] {
        let positions = self.positions(control);
        let worst = |order: usize| {
            let all = positions.windows(order + 2);
            let all = all.map(|q| dot(DIFFERENCES[order], q).abs());
            all.fold(0.0, f64::max) / (self.caps[order] * h.powi(order as i32 + 1))
        };
        [worst(0), worst(1), worst(2)]
    }

    /// Passes the squares of four neighbours at a time to `take`, with the square of their bound, until it says false: then
    /// `None`, else the sum of the logarithms of the bounds that depend on `z`.
    #[inline(always)]
    pub(super) fn look<S: Four>(
        &self,
        simd: S,
        (control, h): (&[[f64; D]], f64),
        mut take: impl FnMut(F4<S>, F4<S>) -> bool,
    ) -> Option<f64> {
        let positions = self.positions(control);
        let count = control.len();
        let bounds = [1, 2, 3].map(|k| (self.caps[k - 1] * h.powi(k as i32)).powi(2));
        let squares = bounds.map(|b| F4::splat(simd, b));
        for k in (0..count).step_by(LANES) {
            let near = &positions[k..];
            let (q0, q1) = (F4::load(simd, near), F4::load(simd, &near[1..]));
            let (q2, q3) = (F4::load(simd, &near[2..]), F4::load(simd, &near[3..]));
            let (first, second, third) = (q1 - q0, q2 - q1, q3 - q2);
            let (bend, next) = (second - first, third - second);
            // The last position counts once.
            let range = |i: usize| match self.range.get(k + i) {
                Some([middle, half]) => [*middle, half * half],
                None => [0.0, f64::INFINITY],
            };
            let [middle, half] =
                [0, 1].map(|m| F4::new(simd, std::array::from_fn(|i| range(i)[m])));
            let [speed, acceleration, jerk] = squares;
            let all = [
                (q0 - middle, half),
                (first, speed),
                (bend, acceleration),
                (next - bend, jerk),
            ];
            for (value, bound) in all {
                if !take(value * value, bound) {
                    return None;
                }
            }
        }
        let logarithm = |k: usize| (count - 1 - k) as f64 * bounds[k].ln();
        Some(logarithm(0) + logarithm(1) + logarithm(2))
    }
}

/// The sum of products.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
