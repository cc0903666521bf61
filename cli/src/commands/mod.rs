//! One file a command: its arguments, and `run`, which gives the exit code.
//!
//! A new command is a file here and one line in [`Command`] and in [`Command::run`].

mod check;
mod completions;
mod driver;
mod fk;
mod ik;
mod man;
mod plan;
mod robots;

use clap::Subcommand;

use crate::exit::Exit;
use crate::failure::Failure;

/// What `canter` can do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Check(check::Check),
    Completions(completions::Completions),
    Driver(driver::Driver),
    Fk(fk::Fk),
    Ik(ik::Ik),
    Man(man::Man),
    Plan(plan::Plan),
    Robots(robots::Robots),
}

impl Command {
    /// Runs the command that was given.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        match self {
            Self::Check(command) => command.run(),
            Self::Completions(command) => command.run(),
            Self::Driver(command) => command.run(),
            Self::Fk(command) => command.run(),
            Self::Ik(command) => command.run(),
            Self::Man(command) => command.run(),
            Self::Plan(command) => command.run(),
            Self::Robots(command) => command.run(),
        }
    }
}
