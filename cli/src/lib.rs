//! The `canter` command line: the outermost layer, with files, terminals, signals and exit codes.
//!
//! It parses arguments, calls the libraries and prints their results. The result of a command goes
//! to standard output, everything else (progress, findings of a program that is about to move,
//! logs) to standard error, so that `canter ... | other` reads only the result.
//!
//! It never plans, converts units or decides about motion: what another program may need too is in
//! a library crate.
//!
//! It is a library with one function, so that the system tests can run the same code in their own
//! binary; the binary `canter` only calls it.

mod client;
mod commands;
mod console;
mod damage;
mod engine_client;
mod exit;
mod failure;
mod forward;
mod host_options;
mod input;
mod logging;
mod mobility;
mod output;
mod output_file;
mod pddl_file;
mod picture;
mod plan_report;
mod plot;
mod printer;
mod program;
mod progress;
mod recorded_program;
mod recorder_options;
mod recording;
mod robot;
mod samples;
mod signals;
mod simulation;
mod table;
mod tls_option;
mod view_process;
mod viewing;
mod wall;
mod world_boxes;
mod world_file;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use clap::Parser;

use crate::exit::Exit;
use crate::printer::Printer;

/// Executes canonical robot commands: check, plan, run.
///
/// Exit codes: 0 done; 1 the program has findings or was refused; 2 usage; 3 cannot read, parse or
/// write a file; 4 no engine or driver; 5 stopped by the operator; 6 aborted by a limit or guard; 7
/// driver fault or driver lost; 8 done, but some output was lost; 70 internal error.
#[derive(Debug, Parser)]
#[command(name = "canter", version = env!("CANTER_VERSION"), max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: commands::Command,
}

/// Runs the process: parses the arguments, runs the command, reports a failure on standard error.
///
/// The exit codes are part of the command line's contract, see `exit.rs`.
pub fn main() -> ExitCode {
    scheduling::keep_freed_memory();
    let printer = Printer::new();
    logging::start(&printer);
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(message) => {
            // A closed terminal must not change the exit code.
            let _ = message.print();
            let exit = if message.use_stderr() {
                Exit::Usage
            } else {
                Exit::Done
            };
            return exit.into();
        }
    };
    let ran = catch_unwind(AssertUnwindSafe(|| arguments.command.run(&printer)));
    let exit = match ran {
        Ok(Ok(exit)) => exit,
        Ok(Err(failure)) => failure.report(&printer),
        // The panic hook has printed where; a panic is an internal error, whatever the input was.
        Err(_) => {
            damage::tell();
            Exit::Internal
        }
    };
    let exit = match (printer.finish(), exit) {
        (1.., Exit::Done) => Exit::OutputLost,
        (_, exit) => exit,
    };
    exit.into()
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_argument_definitions_are_consistent() {
        super::Arguments::command().debug_assert();
    }
}
