use std::io::{self, Write};
use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::Args;
use driver_sim::Options;
use ipc::{Arm, DriverLink, IpcError};
use planner::robot::Robot;

use super::failure;
use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::robot::RobotOption;
use crate::wall::WallOption;

/// How long another driver may still hold the arm, and the time between two tries.
const TAKEN: Duration = Duration::from_secs(3);
const LOOK: Duration = Duration::from_millis(20);

/// Run the simulated driver of an arm until Ctrl-C
///
/// It reads setpoints from shared memory, moves one second-order servo per joint, and publishes
/// measured states, as the driver of a real arm does.
#[derive(Args, Debug)]
pub(super) struct Sim {
    #[command(flatten)]
    robot: RobotOption,
    #[command(flatten)]
    arm: ArmOption,
    /// Natural frequency of the servos, rad/s
    #[arg(long, value_name = "RAD/S", default_value_t = 300.0)]
    frequency: f64,
    /// Damping ratio of the servos
    #[arg(long, value_name = "RATIO", default_value_t = 1.0)]
    damping: f64,
    /// Periods by which setpoints come late
    #[arg(long, value_name = "PERIODS", default_value_t = 0)]
    delay: usize,
    /// Amplitude of the noise on measured positions, rad
    #[arg(long, value_name = "RAD", default_value_t = 0.0)]
    noise: f64,
    /// Seed of the noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    wall: WallOption,
    /// End soon after standard input ends
    #[arg(long, hide = true)]
    until_end_of_input: bool,
}

impl Sim {
    /// Drives until a signal, or until its starter asks for the end.
    pub(super) fn run(&self) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        let arm = self.arm.open()?;
        let stop = super::asked_to_end(self.until_end_of_input)?;
        if self.until_end_of_input {
            wait_for_arm(&arm)?;
            // The starter waits for this line.
            writeln!(io::stdout(), "ready")?;
        }
        let report = driver_sim::run(self.options(&robot, arm)?, &stop).map_err(failure)?;
        super::tell(&report, !self.until_end_of_input);
        Ok(Exit::Done)
    }

    fn options(&self, robot: &Robot, arm: Arm) -> Result<Options, Failure> {
        let joints = &robot.joints;
        Ok(Options {
            model: ipc::model_hash(robot.urdf.as_bytes()),
            position: robot.home.clone(),
            lower: joints.lower.iter().map(|value| value.max(-1e3)).collect(),
            upper: joints.upper.iter().map(|value| value.min(1e3)).collect(),
            velocity: joints.velocity.clone(),
            acceleration: joints.acceleration.clone(),
            jerk: joints.jerk.clone(),
            frequency: self.frequency,
            damping: self.damping,
            delay: self.delay,
            noise: self.noise,
            seed: self.seed,
            wall: self.wall.wall(robot)?,
            ..Options::new(arm, robot.dof())
        })
    }
}

/// Waits until no other driver has the arm: a driver whose starter was killed needs a moment to
/// end.
fn wait_for_arm(arm: &Arm) -> Result<(), Failure> {
    let end = Instant::now() + TAKEN;
    loop {
        match DriverLink::open(arm) {
            Ok(_) => return Ok(()),
            Err(IpcError::Taken { .. }) if Instant::now() < end => sleep(LOOK),
            Err(error) => return Err(failure(error.into())),
        }
    }
}
