//! A followed tool curve as a smooth path of the joints.

use nalgebra::SVector;
use realtime::{Piece, Sample};
use trajectory::{JointPoint, Path, PathPoint, ToolCurve};

use kinematics::follow::FollowPoint;

/// Quintic pieces between the points at which inverse kinematics was solved;
/// value, first and second derivative are continuous.
pub struct JointPath<'a, const N: usize> {
    curve: &'a dyn ToolCurve,
    knots: Vec<f64>,
    pieces: Vec<Piece<N>>,
}

impl<'a, const N: usize> JointPath<'a, N> {
    /// Joins followed points; at least two, in increasing order of the parameter.
    #[must_use]
    pub fn new(curve: &'a dyn ToolCurve, points: &[FollowPoint<N>]) -> Self {
        let knots = points.iter().map(|point| point.u).collect();
        let pieces = points
            .windows(2)
            .map(|pair| {
                Piece::hermite(pair[1].u - pair[0].u, &sample(&pair[0]), &sample(&pair[1]))
            })
            .collect();
        Self { curve, knots, pieces }
    }

    /// Joint values and derivatives at parameter `u`.
    #[must_use]
    pub fn joints(&self, u: f64) -> Sample<N> {
        let index = self.knots.partition_point(|&knot| knot <= u).clamp(1, self.pieces.len()) - 1;
        self.pieces[index].sample(u - self.knots[index])
    }

    /// Pieces in the parameter.
    #[must_use]
    pub fn pieces(&self) -> &[Piece<N>] {
        &self.pieces
    }
}

impl<const N: usize> Path<N> for JointPath<'_, N> {
    fn end(&self) -> f64 {
        self.knots.last().copied().unwrap_or(0.0)
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, u: f64) -> PathPoint<N> {
        let joints = self.joints(u);
        let q: [SVector<f64, N>; 4] =
            [joints.position, joints.velocity, joints.acceleration, joints.jerk];
        PathPoint { joint: JointPoint { q }, tool: self.curve.at(u) }
    }
}

fn sample<const N: usize>(point: &FollowPoint<N>) -> Sample<N> {
    let [position, velocity, acceleration, jerk] = point.q;
    Sample { position, velocity, acceleration, jerk }
}
