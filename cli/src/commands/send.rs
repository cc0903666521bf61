use std::io::{self, Write};
use std::thread::sleep;
use std::time::Duration;

use clap::Args;
use ipc::Verb;
use serde_json::Value;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;
use crate::program::ProgramArgument;

/// How often the engine is asked how far it is.
const POLL: Duration = Duration::from_millis(50);

/// Send a program to a running engine and wait for its end
///
/// Prints one JSON object per event of the program, one per line.
#[derive(Args, Debug)]
pub(crate) struct Send {
    #[command(flatten)]
    program: ProgramArgument,
    #[command(flatten)]
    arm: ArmOption,
    /// Only hand it over
    #[arg(long)]
    no_wait: bool,
}

impl Send {
    /// Sends, then follows.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let program = self.program.read()?;
        program.report();
        if program.exit() != Exit::Done {
            return Ok(program.exit());
        }
        let before = self.arm.ask(Verb::Status)?.body;
        let seen = before["last_note"].as_u64().unwrap_or(0);
        let answer = self.arm.ask(Verb::Submit {
            format: program.form_name().to_owned(),
            name: program.name().to_owned(),
            program: program.text().to_owned(),
        })?;
        let commands = answer.body["commands"].as_u64().unwrap_or(0);
        output::note(&format!("canter: {commands} commands accepted"));
        let last = answer.body["last"].as_u64();
        match last {
            Some(last) if !self.no_wait => wait(&self.arm, seen, last),
            _ => Ok(Exit::Done),
        }
    }
}

/// Prints what happens after note `seen` until the command `last` is over.
pub(super) fn wait(arm: &ArmOption, mut seen: u64, last: u64) -> Result<Exit, Failure> {
    loop {
        let body = arm.ask(Verb::Notes { since: seen })?.body;
        for entry in body["notes"].as_array().into_iter().flatten() {
            seen = entry["number"].as_u64().unwrap_or(seen);
            let note = &entry["note"];
            writeln!(io::stdout().lock(), "{note}")?;
            if let Some(exit) = over(note, last) {
                return Ok(exit);
            }
        }
        sleep(POLL);
    }
}

/// The exit code for a note, if nothing of the program can follow.
fn over(note: &Value, last: u64) -> Option<Exit> {
    let is_last = note["id"].as_u64() == Some(last);
    match note["event"].as_str()? {
        "done" if is_last => Some(Exit::Done),
        "refused" if is_last || note["dropped"].as_u64() > Some(0) => Some(Exit::Refused),
        "aborted" => Some(Exit::Stopped),
        "faulted" if note["blame"] == "guard" => Some(Exit::Aborted),
        "faulted" => Some(Exit::DriverFault),
        "closed" => Some(Exit::NoPeer),
        _ => None,
    }
}
