use clap::Args;
use ipc::Verb;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;

/// Come to rest on the path and end the engine
#[derive(Args, Debug)]
pub(crate) struct Shutdown {
    #[command(flatten)]
    arm: ArmOption,
}

impl Shutdown {
    /// Asks the engine.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        self.arm.tell(Verb::Shutdown)
    }
}
