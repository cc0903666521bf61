//! A joint path through waypoints.

use nalgebra::{Isometry3, SVector};

use crate::{JointPoint, Path, PathPoint, ToolPoint};

/// The natural cubic spline of `N` joints through waypoints, twice continuously differentiable. It
/// has no tool: for joint moves and benchmarks.
///
/// ```
/// use nalgebra::vector;
/// use trajectory::{Path, SplinePath};
///
/// let path = SplinePath::new(&[vector![0.0], vector![1.0], vector![0.0]]).unwrap();
/// assert_eq!(path.end(), 2.0);
/// assert_eq!(path.at(1.0).joint.q[0], vector![1.0]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SplinePath<const N: usize> {
    points: Vec<SVector<f64, N>>,
    /// Second derivatives at the waypoints.
    bends: Vec<SVector<f64, N>>,
    knots: Vec<f64>,
}

impl<const N: usize> SplinePath<N> {
    /// The spline through `points` (rad), one unit of the parameter from each to the next; `None`
    /// for fewer than two.
    pub fn new(points: &[SVector<f64, N>]) -> Option<Self> {
        let knots = (0..points.len()).map(|i| i as f64).collect();
        Self::through(knots, points)
    }

    /// The spline that is at `points[i]` (rad) where the parameter is `knots[i]`. `None` for fewer
    /// than two points, another number of knots, or knots that do not begin at 0 and grow.
    ///
    /// # Source
    /// de Boor, A Practical Guide to Splines, 1978, chapter IV: with `h[i] = k[i+1] - k[i]` and
    /// slopes `s[i] = (p[i+1] - p[i]) / h[i]`, the tridiagonal system
    /// `h[i-1] m[i-1] + 2 (h[i-1] + h[i]) m[i] + h[i] m[i+1] = 6 (s[i] - s[i-1])`, solved by
    /// elimination.
    pub fn through(knots: Vec<f64>, points: &[SVector<f64, N>]) -> Option<Self> {
        let count = points.len();
        let grows = knots.windows(2).all(|pair| pair[0] < pair[1]);
        if count < 2 || knots.len() != count || knots[0] != 0.0 || !grows {
            return None;
        }
        let length = |i: usize| knots[i + 1] - knots[i];
        let slope = |i: usize| (points[i + 1] - points[i]) / length(i);
        let mut bends = vec![SVector::zeros(); count];
        let mut factors = vec![0.0; count];
        for i in 1..count - 1 {
            let (before, after) = (length(i - 1), length(i));
            let pivot = 2.0 * (before + after) - before * factors[i - 1];
            factors[i] = after / pivot;
            let right = (slope(i) - slope(i - 1)) * 6.0;
            bends[i] = (right - bends[i - 1] * before) / pivot;
        }
        for i in (1..count - 1).rev() {
            let after = bends[i + 1];
            bends[i] -= after * factors[i];
        }
        Some(Self {
            points: points.to_vec(),
            bends,
            knots,
        })
    }
}

impl<const N: usize> Path<N> for SplinePath<N> {
    fn end(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, u: f64) -> PathPoint<N> {
        let u = u.clamp(0.0, self.end());
        let after = self.knots.partition_point(|knot| *knot <= u);
        let i = (after.max(1) - 1).min(self.points.len() - 2);
        let h = self.knots[i + 1] - self.knots[i];
        let x = (u - self.knots[i]) / h;
        let y = 1.0 - x;
        let (p, q) = (self.points[i], self.points[i + 1]);
        let (m, n) = (self.bends[i], self.bends[i + 1]);
        let bend = m * ((y * y * y - y) / 6.0) + n * ((x * x * x - x) / 6.0);
        let value = p * y + q * x + bend * (h * h);
        let turn = m * ((1.0 - 3.0 * y * y) / 6.0) + n * ((3.0 * x * x - 1.0) / 6.0);
        let first = (q - p) / h + turn * h;
        let joint = JointPoint {
            q: [value, first, m * y + n * x, (n - m) / h],
        };
        PathPoint {
            joint,
            tool: ToolPoint::still(Isometry3::identity()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    /// Twice continuously differentiable at every inner knot, straight at the ends, and through the
    /// points, whatever the distances of the knots are.
    #[test]
    fn uneven_knots_make_a_natural_spline() {
        let points = [0.0, 1.0, -0.5, 0.25, 2.0].map(|q| vector![q]);
        let knots = vec![0.0, 0.3, 2.0, 2.1, 5.0];
        let path = SplinePath::through(knots.clone(), &points).unwrap();
        assert_eq!(path.end(), 5.0);
        for (knot, point) in knots.iter().zip(&points) {
            let at = path.at(*knot).joint.q;
            assert!((at[0] - point).norm() < 1e-12);
            let step = 1e-9;
            let (before, after) = (path.at(knot - step).joint.q, path.at(knot + step).joint.q);
            for order in 0..3 {
                let jump = (after[order] - before[order]).norm();
                assert!(jump < 1e-5, "derivative {order} at {knot} jumps by {jump}");
            }
        }
        assert!(path.at(0.0).joint.q[2].norm() < 1e-12);
        assert!(path.at(5.0).joint.q[2].norm() < 1e-12);
        // The derivatives are those of the value.
        for u in [0.1, 1.0, 2.05, 4.0] {
            let h = 1e-5;
            let [left, right] = [path.at(u - h), path.at(u + h)].map(|point| point.joint.q);
            for order in 0..3 {
                let slope = (right[order] - left[order]) / (2.0 * h);
                assert!((slope - path.at(u).joint.q[order + 1]).norm() < 1e-5);
            }
        }
    }

    #[test]
    fn wrong_knots_make_no_spline() {
        let points = [vector![0.0], vector![1.0]];
        for knots in [
            vec![0.0],
            vec![0.0, 0.0],
            vec![1.0, 2.0],
            vec![0.0, f64::NAN],
        ] {
            assert_eq!(SplinePath::through(knots, &points), None);
        }
        assert_eq!(SplinePath::new(&points[..1]), None);
    }
}
