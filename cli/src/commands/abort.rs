use clap::Args;
use ipc::ControlAsk;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;

/// Come to rest on the path and drop the rest of the program
#[derive(Args, Debug)]
pub(crate) struct Abort {
    #[command(flatten)]
    arm: ArmOption,
}

impl Abort {
    /// Asks the engine.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        self.arm.control(ControlAsk::Abort, true)
    }
}
