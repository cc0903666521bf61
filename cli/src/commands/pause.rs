use clap::Args;
use ipc::ControlAsk;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;

/// Come to rest on the path and wait there
///
/// The program is kept; `canter resume` continues from exactly there.
#[derive(Args, Debug)]
pub(crate) struct Pause {
    #[command(flatten)]
    arm: ArmOption,
}

impl Pause {
    /// Asks the engine.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        self.arm.control(ControlAsk::Pause, true)
    }
}
