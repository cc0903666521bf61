use std::io::{self, Write};
use std::time::Duration;

use clap::{Args, Subcommand};
use crcl::xml;
use crcl_tcp::{Client, ClientError, Progress};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::program::{Form, ProgramArgument};
use crate::tls_option::TlsOption;

/// Talk to CRCL servers of others
#[derive(Args, Debug)]
pub(crate) struct Crcl {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Send(CrclSend),
}

/// Send a program to a CRCL server and wait for its end
///
/// Sends command by command, each when the one before it is done, as NIST's clients do, and prints
/// a line for each. A program in text or JSON is sent as the XML that `canter convert` gives.
#[derive(Args, Debug)]
pub(crate) struct CrclSend {
    /// The server
    #[arg(value_name = "HOST:PORT")]
    server: String,
    #[command(flatten)]
    program: ProgramArgument,
    /// Longest time that one command may take (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 120)]
    limit: u64,
    #[command(flatten)]
    tls: TlsOption,
}

impl Crcl {
    /// Does what was asked.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        match &self.what {
            What::Send(send) => send.run(),
        }
    }
}

impl CrclSend {
    fn run(&self) -> Result<Exit, Failure> {
        let file = self.program.read()?;
        // The other side may be able to do what Canter cannot: its own words count.
        let text = match file.form() {
            Form::Xml => file.text().to_owned(),
            _ if file.exit() != Exit::Done => {
                file.report();
                return Ok(file.exit());
            }
            _ => match xml::write(file.program()) {
                Ok(text) => text,
                Err(findings) => {
                    file.report_findings(&findings);
                    return Ok(Exit::Refused);
                }
            },
        };
        let program = match xml::read_instructions(&text) {
            Ok(program) => program,
            Err(findings) => {
                file.report_findings(&findings);
                return Ok(Exit::Unreadable);
            }
        };
        let client = match self.tls.client()? {
            Some(tls) => Client::connect_tls(&self.server, &tls),
            None => Client::connect(&self.server),
        };
        let mut client = client.map_err(failure)?;
        let limit = Duration::from_secs(self.limit);
        client
            .run(&program, file.name(), limit, |progress| print(&progress))
            .map_err(failure)?;
        Ok(Exit::Done)
    }
}

fn print(progress: &Progress) {
    let name = progress.instruction.command.name();
    // Who closes standard output still has the exit code.
    let _ = writeln!(io::stdout().lock(), "done  {:4}  {name}", progress.index);
}

fn failure(error: ClientError) -> Failure {
    let exit = match error {
        ClientError::Failed { .. } | ClientError::Late { .. } => Exit::Refused,
        _ => Exit::NoPeer,
    };
    Failure::new(exit, error)
}
