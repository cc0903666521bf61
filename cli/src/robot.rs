use clap::Args;
use planner::robot::Robot;

use crate::exit::Exit;
use crate::failure::Failure;

/// Which robot a command is about.
#[derive(Args, Debug)]
pub(crate) struct RobotOption {
    /// Shipped robot (see `canter robots list`) or a folder with robot.urdf and robot.toml
    #[arg(short, long, value_name = "R")]
    robot: String,
}

impl RobotOption {
    /// Loads the robot.
    ///
    /// # Errors
    /// As [`load`].
    pub(crate) fn load(&self) -> Result<Robot, Failure> {
        load(&self.robot)
    }

    /// The name or folder as it was given.
    pub(crate) fn place(&self) -> &str {
        &self.robot
    }
}

/// Loads a robot by shipped name or folder.
///
/// # Errors
/// [`Exit::Unreadable`] with the error in its files.
pub(crate) fn load(name: &str) -> Result<Robot, Failure> {
    planner::robot::load(name).map_err(|error| Failure::new(Exit::Unreadable, error))
}

/// Calls a function generic over the joint count, `name::<N>(arguments)`, with `N` chosen at run
/// time; returns an internal failure for a count that no robot may have.
macro_rules! with_joints {
    ($dof:expr, $name:ident($($argument:expr),*)) => {
        match $dof {
            1 => $name::<1>($($argument),*),
            2 => $name::<2>($($argument),*),
            3 => $name::<3>($($argument),*),
            4 => $name::<4>($($argument),*),
            5 => $name::<5>($($argument),*),
            6 => $name::<6>($($argument),*),
            7 => $name::<7>($($argument),*),
            8 => $name::<8>($($argument),*),
            other => Err($crate::failure::Failure::new(
                $crate::exit::Exit::Internal,
                anyhow::anyhow!("a robot of {other} joints was loaded, 1 to 8 are supported"),
            )),
        }
    };
}
pub(crate) use with_joints;
