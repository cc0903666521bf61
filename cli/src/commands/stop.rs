use clap::Args;
use ipc::ControlAsk;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;

/// Come to rest on the path, now
///
/// Waits until the arm rests and says where the motion is. `canter resume` goes on from there,
/// `canter abort` forgets the rest. This is not an emergency
/// stop: that is the robot's own.
#[derive(Args, Debug)]
pub(crate) struct Stop {
    /// Use all that the joints can do, not only what is gentle
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
