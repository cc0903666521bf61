//! The kinematics of an arm with a joint count that is known at run time only.

use kinematics::{IkFailure, Solver};
use nalgebra::{Isometry3, SVector};
use planner::kernels::Kernels;
use planner::robot::{Robot, RobotError};
use planner::with_dof;

use crate::arrays::matrix;

/// Which point of the arm a pose is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Point {
    /// The end of the arm.
    Flange,
    /// The tool centre point of the end effector that is mounted at the start.
    Tool,
}

/// Why a pose is not reached, and how near the arm comes.
#[derive(Clone, Debug)]
pub(crate) struct Missed {
    pub(crate) failure: IkFailure,
    /// Distance (m) and angle (rad) of the nearest pose found.
    pub(crate) off: [f64; 2],
    /// Its joints.
    pub(crate) nearest: Vec<f64>,
}

/// The kinematics of an arm; slices have one number per joint, poses are in the workstation.
pub(crate) trait Kinematics: Send + Sync {
    /// Poses (16 numbers each) at rows of joints.
    fn forward(&self, point: Point, q: &[f64], poses: &mut [f64]);

    /// Jacobians (6 rows of one number per joint each) at rows of joints.
    fn jacobian(&self, point: Point, q: &[f64], jacobians: &mut [f64]);

    /// The joints for a pose, nearest to the seed or to the middle of the ranges.
    fn nearest(
        &self,
        point: Point,
        pose: &Isometry3<f64>,
        seed: Option<&[f64]>,
        q: &mut [f64],
    ) -> Result<(), Missed>;

    /// All branches of a pose, one after the other; at a value of the free parameter if given.
    fn branches(&self, point: Point, pose: &Isometry3<f64>, parameter: Option<f64>) -> Vec<f64>;

    /// Which closed form is used, or `numeric`.
    fn family(&self) -> &'static str;

    /// Values of the free parameter of an arm with seven joints, evenly spaced.
    fn parameters(&self, count: usize) -> Vec<f64>;
}

/// The kinematics of a robot.
///
/// # Errors
/// As [`Robot::chain`].
pub(crate) fn of(robot: &Robot) -> Result<Box<dyn Kinematics>, RobotError> {
    with_dof!(robot.dof(), N => Ok(Box::new(Arm::<N>::new(robot)?)))
}

struct Arm<const N: usize> {
    kernels: Kernels<N>,
    flange: Solver<N>,
    tool: Solver<N>,
    middle: SVector<f64, N>,
}

impl<const N: usize> Arm<N> {
    fn new(robot: &Robot) -> Result<Self, RobotError> {
        let kernels = Kernels::get();
        let flange = (kernels.solver)(robot.chain()?);
        let tool = (kernels.solver)(robot.chain_with(robot.mounted)?);
        let chain = flange.chain();
        let middle = SVector::from_fn(|i, _| {
            let (low, high) = (chain.lower()[i], chain.upper()[i]);
            if low.is_finite() && high.is_finite() {
                0.5 * (low + high)
            } else {
                0.0
            }
        });
        Ok(Self {
            kernels,
            flange,
            tool,
            middle,
        })
    }

    fn solver(&self, point: Point) -> &Solver<N> {
        match point {
            Point::Flange => &self.flange,
            Point::Tool => &self.tool,
        }
    }
}

impl<const N: usize> Kinematics for Arm<N> {
    fn forward(&self, point: Point, q: &[f64], poses: &mut [f64]) {
        let chain = self.solver(point).chain();
        for (q, out) in q.chunks_exact(N).zip(poses.chunks_exact_mut(16)) {
            matrix(&chain.forward(&SVector::from_column_slice(q)), out);
        }
    }

    fn jacobian(&self, point: Point, q: &[f64], jacobians: &mut [f64]) {
        let chain = self.solver(point).chain();
        for (q, out) in q.chunks_exact(N).zip(jacobians.chunks_exact_mut(6 * N)) {
            let (_, jacobian) = chain.jacobian(&SVector::from_column_slice(q));
            for (row, out) in out.chunks_exact_mut(N).enumerate() {
                for (column, out) in out.iter_mut().enumerate() {
                    *out = jacobian[(row, column)];
                }
            }
        }
    }

    fn nearest(
        &self,
        point: Point,
        pose: &Isometry3<f64>,
        seed: Option<&[f64]>,
        q: &mut [f64],
    ) -> Result<(), Missed> {
        let seed = seed.map_or(self.middle, SVector::from_column_slice);
        match (self.kernels.nearest)(self.solver(point), pose, &seed) {
            Ok(solution) => {
                q.copy_from_slice(solution.q.as_slice());
                Ok(())
            }
            Err(report) => Err(Missed {
                failure: report.failure,
                off: [report.position_error, report.rotation_error],
                nearest: report.nearest.as_slice().to_vec(),
            }),
        }
    }

    fn branches(&self, point: Point, pose: &Isometry3<f64>, parameter: Option<f64>) -> Vec<f64> {
        let solver = self.solver(point);
        let found = match parameter {
            Some(parameter) => (self.kernels.branches_at)(solver, pose, parameter, &self.middle),
            None => (self.kernels.branches)(solver, pose),
        };
        let flat = found.iter().flat_map(|solution| solution.q.as_slice());
        flat.copied().collect()
    }

    fn family(&self) -> &'static str {
        self.flange.family()
    }

    fn parameters(&self, count: usize) -> Vec<f64> {
        self.flange.parameters(count)
    }
}
