//! Where the controlled point is, for any number of joints.

use nalgebra::Isometry3;
use planner::robot::{Robot, RobotError, vector};
use planner::with_dof;

/// The pose of the controlled point in the workstation at given joints (rad, m).
pub(crate) type Forward = Box<dyn Fn(&[f64]) -> Isometry3<f64> + Send>;

/// Forward kinematics of a robot with the end effector that it carries at the start.
///
/// # Errors
/// A robot that cannot be used.
pub(crate) fn forward(robot: &Robot) -> Result<Forward, RobotError> {
    with_dof!(robot.dof(), N => of::<N>(robot))
}

fn of<const N: usize>(robot: &Robot) -> Result<Forward, RobotError> {
    let chain = robot.chain_with::<N>(robot.mounted)?;
    Ok(Box::new(move |joints| chain.forward(&vector(joints))))
}
