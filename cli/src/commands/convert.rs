use std::io::{self, Write};

use clap::{Args, ValueEnum};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::program::ProgramArgument;

/// Print a program in the other form: text as JSON, JSON as text
///
/// Nothing is lost but comments and layout.
#[derive(Args, Debug)]
pub(crate) struct Convert {
    #[command(flatten)]
    program: ProgramArgument,
    /// Form to print; by default the other one
    #[arg(long, value_enum)]
    to: Option<Form>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Form {
    /// The call syntax of the specification.
    Text,
    /// JSON.
    Json,
}

impl Convert {
    /// Reads the program and prints it; one that cannot be read whole is not printed.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let program = self.program.read()?;
        program.report();
        if program.exit() == Exit::Unreadable {
            return Ok(Exit::Unreadable);
        }
        let form = self.to.unwrap_or(match program.form() {
            "json" => Form::Text,
            _ => Form::Json,
        });
        let text = match form {
            Form::Text => crcl::text::write(program.program()),
            Form::Json => crcl::json::write(program.program()),
        };
        let mut out = io::stdout().lock();
        writeln!(out, "{}", text.trim_end())?;
        Ok(Exit::Done)
    }
}
