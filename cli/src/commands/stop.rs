use clap::Args;
use ipc::ControlAsk;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;

/// Come to rest on the path, now
///
/// Waits until the arm rests and prints the state of the motion. `canter resume` continues from
/// there, `canter abort` drops the rest. This is not an emergency stop: use that of the robot.
#[derive(Args, Debug)]
pub(crate) struct Stop {
    /// Brake as fast as the joints can, instead of gently
    #[arg(long)]
    fast: bool,
    #[command(flatten)]
    arm: ArmOption,
}

impl Stop {
    /// Asks the engine.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        self.arm.control(ControlAsk::Stop { fast: self.fast }, true)
    }
}
