//! A joint path through points that were computed beforehand.

use nalgebra::SVector;

use crate::{JointPoint, Path, PathPoint, ToolCurve, ToolPoint};

/// A joint path through given points with three derivatives, for example from inverse kinematics
/// along a [`ToolCurve`]. Between two points it is the polynomial of degree seven with the value
/// and three derivatives of both, so the path is C3. The tool values come from the curve.
#[derive(Clone, Debug)]
pub struct HermitePath<const N: usize, C> {
    at: Vec<f64>,
    points: Vec<JointPoint<N>>,
    knots: Vec<f64>,
    tool: C,
}

impl<const N: usize, C: ToolCurve> HermitePath<N, C> {
    /// A path through `points` (parameter, joints), ascending in the parameter, from 0 to the end
    /// of `tool`. Returns `None` when there are fewer than two points or they do not ascend.
    pub fn new(points: Vec<(f64, JointPoint<N>)>, tool: C) -> Option<Self> {
        let (at, points): (Vec<f64>, Vec<JointPoint<N>>) = points.into_iter().unzip();
        let ascends = at.windows(2).all(|pair| pair[0] < pair[1]);
        if at.len() < 2 || !ascends {
            return None;
        }
        let knots = tool.knots();
        Some(Self {
            at,
            points,
            knots,
            tool,
        })
    }

    /// The curve of the controlled point.
    pub fn tool(&self) -> &C {
        &self.tool
    }

    /// Last parameter value.
    pub fn last(&self) -> f64 {
        self.at[self.at.len() - 1]
    }

    /// The joints and their three derivatives at `u`.
    fn joints(&self, u: f64) -> JointPoint<N> {
        let last = self.at.len() - 1;
        let u = u.clamp(self.at[0], self.at[last]);
        let i = (self.at.partition_point(|x| *x <= u).max(1) - 1).min(last - 1);
        let span = self.at[i + 1] - self.at[i];
        septic(
            &self.points[i],
            &self.points[i + 1],
            span,
            (u - self.at[i]) / span,
        )
    }
}

impl<const N: usize, C: ToolCurve> Path<N> for HermitePath<N, C> {
    fn end(&self) -> f64 {
        self.at[self.at.len() - 1]
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, u: f64) -> PathPoint<N> {
        PathPoint {
            joint: self.joints(u),
            tool: self.tool.at(u),
        }
    }

    fn joint_at(&self, u: f64) -> JointPoint<N> {
        self.joints(u)
    }

    fn tool_at(&self, u: f64) -> ToolPoint {
        self.tool.at(u)
    }
}

/// Value and three derivatives at `x` (0 to 1) of the polynomial of degree seven between two
/// points `span` apart.
///
/// # Source
/// Two-point Hermite interpolation in Bernstein form: the first four control points follow from
/// the derivatives at one end (Farin, Curves and Surfaces for CAGD, 2002, section 5.2).
fn septic<const N: usize>(
    left: &JointPoint<N>,
    right: &JointPoint<N>,
    span: f64,
    x: f64,
) -> JointPoint<N> {
    let [l0, l1, l2, l3] = scaled(left, span);
    let [r0, r1, r2, r3] = scaled(right, -span);
    let end = |p0: SVector<f64, N>, d1: SVector<f64, N>, d2: SVector<f64, N>, d3| {
        let p1 = p0 + d1 / 7.0;
        let p2 = p0 + d1 * (2.0 / 7.0) + d2 / 42.0;
        let p3 = p0 + d1 * (3.0 / 7.0) + d2 * (3.0 / 42.0) + d3 / 210.0;
        [p0, p1, p2, p3]
    };
    let [a0, a1, a2, a3] = end(l0, l1, l2, l3);
    let [b0, b1, b2, b3] = end(r0, r1, r2, r3);
    let mut c = [a0, a1, a2, a3, b3, b2, b1, b0];
    // de Casteljau down to the cubic, whose ends give the derivatives.
    for level in (4..8).rev() {
        for i in 0..level {
            c[i] = c[i] * (1.0 - x) + c[i + 1] * x;
        }
    }
    let third = (c[3] - c[2] * 3.0 + c[1] * 3.0 - c[0]) * (210.0 / (span * span * span));
    let mut step = |level: usize| {
        for i in 0..level {
            c[i] = c[i] * (1.0 - x) + c[i + 1] * x;
        }
        c
    };
    let c2 = step(3);
    let second = (c2[2] - c2[1] * 2.0 + c2[0]) * (42.0 / (span * span));
    let c1 = step(2);
    let first = (c1[1] - c1[0]) * (7.0 / span);
    let value = step(1)[0];
    JointPoint {
        q: [value, first, second, third],
    }
}

/// The derivatives of `point` to the parameter measured in units of `span`.
fn scaled<const N: usize>(point: &JointPoint<N>, span: f64) -> [SVector<f64, N>; 4] {
    let [q0, q1, q2, q3] = point.q;
    [q0, q1 * span, q2 * (span * span), q3 * (span * span * span)]
}
