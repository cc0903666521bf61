use clap::Args;
use ipc::ControlAsk;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;

/// Go on along the path after a pause or a stop
#[derive(Args, Debug)]
pub(crate) struct Resume {
    #[command(flatten)]
    arm: ArmOption,
}

impl Resume {
    /// Asks the engine.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        self.arm.control(ControlAsk::Resume, false)
    }
}
