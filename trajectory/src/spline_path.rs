//! A joint path through waypoints.

use nalgebra::{Isometry3, SVector};

use crate::{JointPoint, Path, PathPoint, ToolPoint};

/// The natural cubic spline of `N` joints through waypoints, one unit of the parameter from each to
/// the next; twice continuously differentiable. It has no tool: for joint moves and benchmarks.
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
    /// The spline through `points` (rad); `None` for fewer than two.
    ///
    /// # Source
    /// de Boor, A Practical Guide to Splines, 1978, chapter IV: the tridiagonal system
    /// `m[i-1] + 4 m[i] + m[i+1] = 6 (p[i-1] - 2 p[i] + p[i+1])`, solved by elimination.
    pub fn new(points: &[SVector<f64, N>]) -> Option<Self> {
        let count = points.len();
        if count < 2 {
            return None;
        }
        let mut bends = vec![SVector::zeros(); count];
        let mut factors = vec![0.0; count];
        for i in 1..count - 1 {
            let pivot = 4.0 - factors[i - 1];
            factors[i] = 1.0 / pivot;
            let right = (points[i - 1] - points[i] * 2.0 + points[i + 1]) * 6.0;
            bends[i] = (right - bends[i - 1]) / pivot;
        }
        for i in (1..count - 1).rev() {
            let after = bends[i + 1];
            bends[i] -= after * factors[i];
        }
        let knots = (0..count).map(|i| i as f64).collect();
        Some(Self {
            points: points.to_vec(),
            bends,
            knots,
        })
    }
}

impl<const N: usize> Path<N> for SplinePath<N> {
    fn end(&self) -> f64 {
        (self.points.len() - 1) as f64
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, u: f64) -> PathPoint<N> {
        let u = u.clamp(0.0, self.end());
        let i = (u as usize).min(self.points.len() - 2);
        let x = u - i as f64;
        let y = 1.0 - x;
        let (p, q) = (self.points[i], self.points[i + 1]);
        let (m, n) = (self.bends[i], self.bends[i + 1]);
        let value = p * y + q * x + m * ((y * y * y - y) / 6.0) + n * ((x * x * x - x) / 6.0);
        let first = q - p + m * ((1.0 - 3.0 * y * y) / 6.0) + n * ((3.0 * x * x - 1.0) / 6.0);
        let joint = JointPoint {
            q: [value, first, m * y + n * x, n - m],
        };
        PathPoint {
            joint,
            tool: ToolPoint::still(Isometry3::identity()),
        }
    }
}
