use clap::Args;
use ipc::ControlAsk;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;

/// Clear a latched fault and open a new session with the driver
///
/// Look at the reason first: `canter status`.
#[derive(Args, Debug)]
pub(crate) struct Recover {
    #[command(flatten)]
    arm: ArmOption,
}

impl Recover {
    /// Asks the engine.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        self.arm.control(ControlAsk::Recover, false)
    }
}
