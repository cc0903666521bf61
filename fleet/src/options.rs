//! The arguments of the program.

use std::io::Write;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use crate::authority::Keys;
use crate::commands::{All, Completions, Man, Notes, One, Override, Router, Send, Top};
use crate::failure::Failure;
use crate::member::Cell;
use crate::one_thread;

/// Many cells: their reports, programs and stops over an encrypted network
///
/// Every process of a fleet has a certificate, and the router lets it do what its certificate allows:
/// `keys` makes both. `router` is what all connect to, `cell` runs beside the engines of a cell; the
/// other commands show and command the arms. A stop over a network is no safety function.
#[derive(Debug, Parser)]
#[command(name = "canter-fleet", version)]
struct Options {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Keys(Keys),
    Router(Router),
    Cell(Cell),
    Top(Top),
    /// Print one line of JSON for each arm: its name, whether it lives, its last report
    List(All),
    Notes(Notes),
    Send(Send),
    /// Come to rest on the path, as fast as the joints can; `resume` goes on from there
    ///
    /// This is not an emergency stop: a network may be late or gone. One line of JSON for each arm;
    /// exit code 4 if one that lives did not answer.
    Stop(All),
    /// Come to rest on the path and stay there until `resume`
    Pause(All),
    /// Go on after a stop or pause
    Resume(One),
    Override(Override),
    Man(Man),
    Completions(Completions),
}

/// Reads the arguments of the process and does what they say.
#[must_use]
pub fn main() -> ExitCode {
    let options = Options::parse();
    if let Err(failure) = one_thread::ensure() {
        return say(&failure);
    }
    let done = match options.command {
        Command::Keys(keys) => keys.run(),
        Command::Router(router) => router.run(),
        Command::Cell(cell) => cell.run(),
        Command::Top(top) => top.run(),
        Command::List(all) => all.list(),
        Command::Notes(notes) => notes.run(),
        Command::Send(send) => send.run(),
        Command::Stop(all) => all.ask("stop"),
        Command::Pause(all) => all.ask("pause"),
        Command::Resume(one) => one.resume(),
        Command::Override(share) => share.run(),
        Command::Man(man) => man.run(Options::command()),
        Command::Completions(completions) => completions.run(Options::command()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => say(&failure),
    }
}

fn say(failure: &Failure) -> ExitCode {
    // Nobody may listen.
    let _ = writeln!(std::io::stderr().lock(), "canter-fleet: {failure}");
    failure.code()
}
