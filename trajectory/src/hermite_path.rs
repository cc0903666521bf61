//! A joint path through points that were computed beforehand.

use nalgebra::SVector;

use crate::{JointPoint, Path, PathPoint, ToolCurve, ToolPoint};

/// A point of a [`HermitePath`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HermitePoint<const N: usize> {
    /// Path parameter.
    pub u: f64,
    /// The joints, with the third derivative that they have after the point.
    pub joint: JointPoint<N>,
    /// How much their third derivative jumps there (rad/u³), as that of the tool may.
    pub jump: SVector<f64, N>,
}

/// A joint path through given points with three derivatives, for example from inverse kinematics
/// along a [`ToolCurve`]. Between two points it is the polynomial of degree seven with the value
/// and three derivatives of both, so the path is C3 but where the third derivative jumps. The tool values come
/// from the curve.
#[derive(Clone, Debug)]
pub struct HermitePath<const N: usize, C> {
    points: Vec<HermitePoint<N>>,
    knots: Vec<f64>,
    tool: C,
}

impl<const N: usize, C: ToolCurve> HermitePath<N, C> {
    /// A path through `points`, ascending in the parameter, from 0 to the end of `tool`. Returns `None`
    /// when there are fewer than two points or they do not ascend.
    pub fn new(points: Vec<HermitePoint<N>>, tool: C) -> Option<Self> {
        let ascends = points.windows(2).all(|pair| pair[0].u < pair[1].u);
        if points.len() < 2 || !ascends {
            return None;
        }
        let knots = tool.knots();
        Some(Self {
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
        self.points[self.points.len() - 1].u
    }

    /// The joints and their three derivatives at `u`.
    fn joints(&self, u: f64) -> JointPoint<N> {
        let points = &self.points;
        let last = points.len() - 1;
        let u = u.clamp(points[0].u, points[last].u);
        let i = (points.partition_point(|point| point.u <= u).max(1) - 1).min(last - 1);
        let (left, right) = (&points[i], &points[i + 1]);
        let span = right.u - left.u;
        let mut before = right.joint;
        before.q[3] -= right.jump;
        septic(&left.joint, &before, span, (u - left.u) / span)
    }
}

impl<const N: usize, C: ToolCurve> Path<N> for HermitePath<N, C> {
    fn end(&self) -> f64 {
        self.last()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Line;
    use nalgebra::Isometry3;

    /// A third derivative that jumps at a point is one before it and another one after it; nothing else jumps.
    #[test]
    fn the_third_derivative_jumps_where_it_is_told() {
        let end = Isometry3::translation(1.0, 0.0, 0.0);
        let line = Line::new(Isometry3::identity(), end);
        // From rest, with the jerk 6 up to half of the way and -6 from there on.
        let half = 0.5 * line.end();
        let point = |u: f64, q: [f64; 4], jump: f64| HermitePoint {
            u,
            joint: JointPoint {
                q: q.map(|value| SVector::from([value])),
            },
            jump: SVector::from([jump]),
        };
        let at_half = [half.powi(3), 3.0 * half * half, 6.0 * half, -6.0];
        let at_end = [6.0 * half.powi(3), 6.0 * half * half, 0.0, -6.0];
        let points = vec![
            point(0.0, [0.0, 0.0, 0.0, 6.0], 0.0),
            point(half, at_half, -12.0),
            point(line.end(), at_end, 0.0),
        ];
        let path = HermitePath::new(points, line).unwrap();
        for share in [0.1, 0.5, 0.9] {
            let u = share * half;
            let [q, q1, q2, q3] = path.joint_at(u).q.map(|value| value[0]);
            let exact = [u.powi(3), 3.0 * u * u, 6.0 * u, 6.0];
            let off = [q - exact[0], q1 - exact[1], q2 - exact[2], q3 - exact[3]];
            assert!(off.iter().all(|off| off.abs() < 1e-9), "{u}: {off:?}");
            let q3 = path.joint_at(half + u).q[3][0];
            assert!((q3 + 6.0).abs() < 1e-9, "{u}: {q3}");
        }
    }
}
