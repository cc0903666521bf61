use std::io::{self, Write};

use clap::{Args, ValueEnum};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::program::{Form, ProgramArgument};

/// Print a program in another form: text, JSON or XML
///
/// Nothing is lost but comments and layout. What the other form cannot say is an error.
#[derive(Args, Debug)]
pub(crate) struct Convert {
    #[command(flatten)]
    program: ProgramArgument,
    /// Form to print; by default JSON for a text, and text for the others
    #[arg(long, value_enum)]
    to: Option<Target>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Target {
    /// The call syntax of the specification.
    Text,
    /// JSON.
    Json,
    /// CRCL's XML.
    Xml,
}

impl Convert {
    /// Reads the program and prints it; one that cannot be read whole is not printed.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let program = self.program.read()?;
        program.report();
        if program.exit() == Exit::Unreadable {
            return Ok(Exit::Unreadable);
        }
        let target = self.to.unwrap_or(match program.form() {
            Form::Json | Form::Xml => Target::Text,
            Form::Auto | Form::Text => Target::Json,
        });
        let text = match target {
            Target::Text => crcl::text::write(program.program()),
            Target::Json => crcl::json::write(program.program()),
            Target::Xml => match crcl::xml::write(program.program()) {
                Ok(text) => text,
                Err(findings) => {
                    program.report_findings(&findings);
                    return Ok(Exit::Refused);
                }
            },
        };
        let mut out = io::stdout().lock();
        writeln!(out, "{}", text.trim_end())?;
        Ok(Exit::Done)
    }
}
