//! One file per command: its arguments, and `run`, which returns the exit code.
//!
//! A new command is a file here and one line in [`Command`] and in [`Command::run`].

mod abort;
mod bench;
mod check;
mod completions;
mod convert;
mod crcl;
mod doctor;
mod doctor_driver;
mod driver;
mod engine;
mod fk;
mod follow;
mod ik;
mod jog;
mod man;
mod override_speed;
mod pause;
mod plan;
mod plan_check;
mod plan_run;
mod record;
mod recover;
mod replay;
mod resume;
mod robots;
mod run;
mod schema;
mod send;
mod serve;
mod serve_ros2;
mod shutdown;
mod status;
mod stop;
mod verify;
mod view;
mod world;

use clap::Subcommand;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::printer::Printer;

/// What `canter` can do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Abort(abort::Abort),
    Bench(bench::Bench),
    Check(check::Check),
    Completions(completions::Completions),
    Convert(convert::Convert),
    Crcl(crcl::Crcl),
    Doctor(doctor::Doctor),
    Driver(driver::Driver),
    Engine(engine::Engine),
    Fk(fk::Fk),
    Follow(follow::Follow),
    Ik(ik::Ik),
    Jog(jog::Jog),
    Man(man::Man),
    Override(override_speed::Override),
    Pause(pause::Pause),
    Plan(plan::Plan),
    Record(record::Record),
    Recover(recover::Recover),
    Replay(replay::Replay),
    Resume(resume::Resume),
    Robots(robots::Robots),
    World(world::World),
    PlanCheck(plan_check::PlanCheck),
    PlanRun(plan_run::PlanRun),
    Run(run::Run),
    Schema(schema::Schema),
    Send(send::Send),
    Serve(serve::Serve),
    Shutdown(shutdown::Shutdown),
    Status(status::Status),
    Stop(stop::Stop),
    Verify(verify::Verify),
    View(view::View),
}

impl Command {
    /// Runs the command that was given.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        match self {
            Self::Abort(command) => command.run(),
            Self::Bench(command) => command.run(printer),
            Self::Check(command) => command.run(),
            Self::Completions(command) => command.run(),
            Self::Convert(command) => command.run(),
            Self::Crcl(command) => command.run(),
            Self::Doctor(command) => command.run(),
            Self::Driver(command) => command.run(),
            Self::Engine(command) => command.run(printer),
            Self::Fk(command) => command.run(),
            Self::Follow(command) => command.run(),
            Self::Ik(command) => command.run(),
            Self::Jog(command) => command.run(printer),
            Self::Man(command) => command.run(),
            Self::Override(command) => command.run(),
            Self::Pause(command) => command.run(),
            Self::Plan(command) => command.run(printer),
            Self::Record(command) => command.run(printer),
            Self::Recover(command) => command.run(),
            Self::Replay(command) => command.run(printer),
            Self::Resume(command) => command.run(),
            Self::Robots(command) => command.run(),
            Self::World(command) => command.run(),
            Self::PlanCheck(command) => command.run(),
            Self::PlanRun(command) => command.run(printer),
            Self::Run(command) => command.run(printer),
            Self::Schema(command) => command.run(),
            Self::Send(command) => command.run(),
            Self::Serve(command) => command.run(),
            Self::Shutdown(command) => command.run(),
            Self::Status(command) => command.run(),
            Self::Stop(command) => command.run(),
            Self::Verify(command) => command.run(),
            Self::View(command) => command.run(printer),
        }
    }
}
