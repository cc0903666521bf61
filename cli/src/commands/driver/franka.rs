use clap::Args;
use driver_franka::{Collision, FrankaOptions, GripperOptions};
use planner::robot::Robot;

use super::{about, until_signal};
use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::robot::RobotOption;

/// Drive a Franka arm (FR3, Panda) over its control interface until Ctrl-C
///
/// Nothing moves before an engine starts. Read docs/drivers/franka.md before the first start.
#[derive(Args, Debug)]
pub(super) struct Franka {
    #[command(flatten)]
    robot: RobotOption,
    #[command(flatten)]
    arm: ArmOption,
    /// Address of the arm's control box: host or host:port
    #[arg(long, value_name = "ADDRESS")]
    address: String,
    /// How far the arm is behind the setpoints, ms
    #[arg(long, value_name = "MS", default_value_t = 4.0)]
    delay: f64,
    /// Share of the maker's limits that the commands keep
    #[arg(long, value_name = "SHARE", default_value_t = 0.9)]
    share: f64,
    /// Torques at the joints from which the arm stops, N m, with commas
    #[arg(long, value_name = "TORQUES", value_delimiter = ',')]
    collision_torque: Vec<f64>,
    /// Forces (N) and torques (N m) at the flange from which the arm stops, with commas
    #[arg(long, value_name = "FORCES", value_delimiter = ',')]
    collision_force: Vec<f64>,
    /// Stiffness of the joints, N m/rad, with commas; the controller's own where not given
    #[arg(long, value_name = "STIFFNESS", value_delimiter = ',')]
    impedance: Vec<f64>,
    /// The arm has no Franka Hand
    #[arg(long)]
    no_gripper: bool,
    /// Force of a close where the command has none, N
    #[arg(long, value_name = "N", default_value_t = 20.0)]
    gripper_force: f64,
    /// Speed of the fingers where the command has none, m/s
    #[arg(long, value_name = "M/S", default_value_t = 0.1)]
    gripper_speed: f64,
}

impl Franka {
    /// Drives until a signal.
    pub(super) fn run(&self) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        let arm = self.arm.open()?;
        let options = self.options(&robot)?;
        until_signal(|how, stop| driver_franka::run(&arm, options, how, stop))
    }

    fn options(&self, robot: &Robot) -> Result<FrankaOptions, Failure> {
        let usual = Collision::default();
        let collision = Collision {
            torque: list("collision-torque", &self.collision_torque)?.unwrap_or(usual.torque),
            force: list("collision-force", &self.collision_force)?.unwrap_or(usual.force),
        };
        Ok(FrankaOptions {
            delay: self.delay * 1e-3,
            share: self.share,
            collision: Some(collision),
            impedance: list("impedance", &self.impedance)?,
            gripper: (!self.no_gripper).then_some(GripperOptions {
                speed: self.gripper_speed,
                force: self.gripper_force,
            }),
            ..FrankaOptions::new(&self.address, about(robot))
        })
    }
}

/// An option that is a list of `N` numbers, or is not given.
fn list<const N: usize>(name: &str, values: &[f64]) -> Result<Option<[f64; N]>, Failure> {
    if values.is_empty() {
        return Ok(None);
    }
    <[f64; N]>::try_from(values).map(Some).map_err(|_| {
        let found = values.len();
        Failure::new(
            Exit::Usage,
            anyhow::anyhow!("--{name} needs {N} numbers, got {found}"),
        )
    })
}
