//! A straight line in joint space.

use nalgebra::SVector;

use crate::{JointPoint, Path, PathPoint, ToolPoint};

/// The straight line in joint space from a start to an end, parameter 0 to 1. The motion of the
/// tool along it comes from a closure, so that this crate needs no kinematics.
///
/// ```
/// use nalgebra::{Isometry3, vector};
/// use trajectory::{JointLine, Path, ToolPoint};
///
/// let still = |_: &trajectory::JointPoint<2>| ToolPoint::still(Isometry3::identity());
/// let line = JointLine::new(vector![0.0, 1.0], vector![1.0, 3.0], still);
/// assert_eq!(line.at(0.5).joint.q[0], vector![0.5, 2.0]);
/// assert_eq!(line.at(0.5).joint.q[1], vector![1.0, 2.0]);
/// ```
#[derive(Clone, Debug)]
pub struct JointLine<const N: usize, F> {
    start: SVector<f64, N>,
    end: SVector<f64, N>,
    tool: F,
}

impl<const N: usize, F> JointLine<N, F> {
    /// The joints at `u`, 0 to 1.
    pub(crate) fn joints(&self, u: f64) -> JointPoint<N> {
        let u = u.clamp(0.0, 1.0);
        let step = self.end - self.start;
        let zero = SVector::zeros();
        // The weighted mean meets both ends exactly.
        JointPoint {
            q: [self.start * (1.0 - u) + self.end * u, step, zero, zero],
        }
    }

    /// The same line with another tool.
    pub(crate) fn with_tool<G>(&self, tool: G) -> JointLine<N, G> {
        JointLine {
            start: self.start,
            end: self.end,
            tool,
        }
    }
}

impl<const N: usize, F: Fn(&JointPoint<N>) -> ToolPoint> JointLine<N, F> {
    /// A line from `start` to `end` (rad). `tool` gives the controlled point and its derivatives
    /// to the parameter from the joints and theirs.
    pub fn new(start: SVector<f64, N>, end: SVector<f64, N>, tool: F) -> Self {
        Self { start, end, tool }
    }
}

impl<const N: usize, F: Fn(&JointPoint<N>) -> ToolPoint> Path<N> for JointLine<N, F> {
    fn end(&self) -> f64 {
        1.0
    }

    fn knots(&self) -> &[f64] {
        &[0.0, 1.0]
    }

    fn at(&self, u: f64) -> PathPoint<N> {
        let joint = self.joint_at(u);
        PathPoint {
            joint,
            tool: (self.tool)(&joint),
        }
    }

    fn tool_at(&self, u: f64) -> ToolPoint {
        (self.tool)(&self.joint_at(u))
    }

    fn joint_at(&self, u: f64) -> JointPoint<N> {
        self.joints(u)
    }
}
