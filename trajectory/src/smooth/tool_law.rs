//! The fastest time law along a curve of the tool.

use nalgebra::SVector;

use crate::{
    JointLimits, JointPoint, Path, PathPoint, Timed, TimingError, TimingOptions, ToolCurve,
    ToolLimits, ToolPoint, time_path,
};

/// The fastest law along a curve that the limits of the tool allow: parameter of the curve over time (s).
pub(super) fn tool_law(
    curve: &dyn ToolCurve,
    limits: &ToolLimits,
    options: &TimingOptions,
) -> Result<Timed<1>, TimingError> {
    let path = ToolPath {
        knots: curve.knots(),
        curve,
    };
    let free = JointLimits::uniform(f64::INFINITY, f64::INFINITY, f64::INFINITY);
    time_path(&path, &free, limits, options)
}

/// A curve of the tool as a path whose only joint is the parameter, which nothing limits.
struct ToolPath<'a> {
    curve: &'a dyn ToolCurve,
    knots: Vec<f64>,
}

impl Path<1> for ToolPath<'_> {
    fn end(&self) -> f64 {
        self.curve.end()
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, u: f64) -> PathPoint<1> {
        PathPoint {
            joint: self.joint_at(u),
            tool: self.tool_at(u),
        }
    }

    fn joint_at(&self, u: f64) -> JointPoint<1> {
        JointPoint {
            q: [u, 1.0, 0.0, 0.0].map(SVector::<f64, 1>::new),
        }
    }

    fn tool_at(&self, u: f64) -> ToolPoint {
        self.curve.at(u)
    }
}
