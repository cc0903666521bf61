//! The interface between geometry, kinematics and timing: curves over a path parameter `u`.

use nalgebra::{Isometry3, SVector, Vector3};

/// Pose of the controlled point at a path parameter `u`, with three derivatives with respect to
/// `u`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolPoint {
    /// Where the controlled point is.
    pub pose: Isometry3<f64>,
    /// Derivatives 1 to 3 of the position (m/u, m/u², m/u³), axes of the frame the pose is in.
    pub linear: [Vector3<f64>; 3],
    /// Angular velocity to `u` and its first two derivatives (rad/u, rad/u², rad/u³), same axes.
    pub angular: [Vector3<f64>; 3],
}

impl ToolPoint {
    /// A tool that stands still in `pose`.
    pub fn still(pose: Isometry3<f64>) -> Self {
        Self {
            pose,
            linear: [Vector3::zeros(); 3],
            angular: [Vector3::zeros(); 3],
        }
    }
}

/// Positions of `N` joints at a path parameter `u` (rad) and their three derivatives with respect
/// to `u` (rad/u, rad/u², rad/u³).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointPoint<const N: usize> {
    /// `q[k]` is derivative `k` of the positions to `u`.
    pub q: [SVector<f64, N>; 4],
}

/// Joints and tool at one path parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint<const N: usize> {
    /// The joints.
    pub joint: JointPoint<N>,
    /// The controlled point.
    pub tool: ToolPoint,
}

/// A curve of the controlled point over `0..=end()`.
pub trait ToolCurve: Send + Sync {
    /// Last parameter value.
    fn end(&self) -> f64;
    /// Parameter values where a derivative up to the third may jump, ascending, ends included.
    fn knots(&self) -> Vec<f64>;
    /// The curve at `u`; outside of its range as at the nearer end.
    fn at(&self, u: f64) -> ToolPoint;
}

impl<T: ToolCurve + ?Sized> ToolCurve for &T {
    fn end(&self) -> f64 {
        (**self).end()
    }

    fn knots(&self) -> Vec<f64> {
        (**self).knots()
    }

    fn at(&self, u: f64) -> ToolPoint {
        (**self).at(u)
    }
}

/// A joint path over `0..=end()` together with the motion of the controlled point along it.
pub trait Path<const N: usize> {
    /// Last parameter value.
    fn end(&self) -> f64;
    /// Parameter values where a derivative up to the third may jump, ascending, ends included.
    fn knots(&self) -> &[f64];
    /// The path at `u`; outside of its range as at the nearer end.
    fn at(&self, u: f64) -> PathPoint<N>;

    /// The joints of [`Path::at`]; override it if they can be computed without the tool.
    fn joint_at(&self, u: f64) -> JointPoint<N> {
        self.at(u).joint
    }

    /// The tool of [`Path::at`]; override it if it can be computed without the joints.
    fn tool_at(&self, u: f64) -> ToolPoint {
        self.at(u).tool
    }
}
