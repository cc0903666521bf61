use clap::Args;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;

/// Print the JSON Schema of programs in JSON
#[derive(Args, Debug)]
pub(crate) struct Schema;

impl Schema {
    /// Prints it.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        output::json(&crcl::json::schema())?;
        Ok(Exit::Done)
    }
}
