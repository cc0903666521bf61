//! One file a command: its arguments, and `run`, which gives the exit code.
//!
//! A new command is a file here and one line in [`Command`] and in [`Command::run`].

mod completions;
mod fk;
mod man;
mod plan_check;
mod plan_run;
mod robots;
mod world;

use clap::Subcommand;

use crate::exit::Exit;
use crate::failure::Failure;

/// What `canter` can do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Fk(fk::Fk),
    Robots(robots::Robots),
    World(world::World),
    PlanCheck(plan_check::PlanCheck),
    PlanRun(plan_run::PlanRun),
    Completions(completions::Completions),
    Man(man::Man),
}

impl Command {
    /// Runs the command that was given.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        match self {
            Self::Fk(command) => command.run(),
            Self::Robots(command) => command.run(),
            Self::World(command) => command.run(),
            Self::PlanCheck(command) => command.run(),
            Self::PlanRun(command) => command.run(),
            Self::Completions(command) => command.run(),
            Self::Man(command) => command.run(),
        }
    }
}
