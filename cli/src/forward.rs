//! Where the controlled point is, for any number of joints.

use nalgebra::Isometry3;
use planner::robot::{Robot, vector};

use crate::failure::Failure;
use crate::robot::with_joints;

/// The pose of the controlled point in the workstation at given joints (rad, m).
pub(crate) type Forward = Box<dyn Fn(&[f64]) -> Isometry3<f64> + Send>;

/// Forward kinematics of a robot with the end effector that it carries at the start.
///
/// # Errors
/// A robot that cannot be used.
pub(crate) fn forward(robot: &Robot) -> Result<Forward, Failure> {
    with_joints!(robot.dof(), of(robot))
}

fn of<const N: usize>(robot: &Robot) -> Result<Forward, Failure> {
    let chain = robot
        .chain_with::<N>(robot.mounted)
        .map_err(|error| Failure::new(crate::exit::Exit::Unreadable, error))?;
    Ok(Box::new(move |joints| chain.forward(&vector(joints))))
}
