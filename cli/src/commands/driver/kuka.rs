use clap::Args;
use driver_kuka::KukaOptions;

use super::{about, until_signal};
use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::robot::RobotOption;

/// Drive a KUKA arm over the Robot Sensor Interface until Ctrl-C
///
/// The controller sends its telegrams to this process while its program CanterRsi.src runs. Nothing
/// moves before an engine starts. Read docs/drivers/kuka.md before the first start.
#[derive(Args, Debug)]
pub(super) struct Kuka {
    #[command(flatten)]
    robot: RobotOption,
    #[command(flatten)]
    arm: ArmOption,
    /// Address and port that the controller sends to
    #[arg(long, value_name = "ADDRESS", default_value = "0.0.0.0:49152")]
    listen: String,
    /// Cycle of RSI, ms: 4 (IPO_FAST) or 12
    #[arg(long, value_name = "MS", default_value_t = 4.0)]
    cycle: f64,
    /// How far the arm is behind the setpoints, ms; two cycles where not given
    #[arg(long, value_name = "MS")]
    delay: Option<f64>,
    /// Share of the maker's limits that the commands keep
    #[arg(long, value_name = "SHARE", default_value_t = 0.97)]
    share: f64,
}

impl Kuka {
    /// Drives until a signal.
    pub(super) fn run(&self) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        let arm = self.arm.open()?;
        let options = KukaOptions {
            cycle: self.cycle * 1e-3,
            delay: self.delay.unwrap_or(2.0 * self.cycle) * 1e-3,
            share: self.share,
            ..KukaOptions::new(&self.listen, about(&robot))
        };
        until_signal(|how, stop| driver_kuka::run(&arm, options, how, stop))
    }
}
