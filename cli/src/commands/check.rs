use std::io::{self, IsTerminal, Write};

use clap::Args;
use planner::dry_run::FailurePolicy;
use serde_json::json;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;
use crate::program::{ProgramArgument, ProgramFile, look};
use crate::robot::load;

/// Find everything that is wrong with a program; nothing moves
///
/// With a robot the program is planned too: reach, joint limits, singularities, tools. Exit code 0
/// when there is no error (warnings are allowed), 1 when a command would be refused, 3 when the
/// program cannot be read.
#[derive(Args, Debug)]
pub(crate) struct Check {
    #[command(flatten)]
    program: ProgramArgument,
    /// Shipped robot or a folder with robot.urdf and robot.toml
    #[arg(short, long, value_name = "R")]
    robot: Option<String>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Check {
    /// Reads, checks, prints all findings.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let robot = self.robot.as_deref().map(load).transpose()?;
        let mut file = self.program.read()?;
        if let Some(robot) = &robot
            && file.exit() != Exit::Unreadable
        {
            let plan = file.plan(robot, 1000.0, None, FailurePolicy::Skip)?;
            file.add_refusals(&plan.refusals);
        }
        if self.json {
            output::json(&description(&file))?;
        } else {
            print(&file)?;
        }
        Ok(file.exit())
    }
}

fn print(file: &ProgramFile) -> io::Result<()> {
    let mut out = io::stdout().lock();
    if file.reading().findings.is_empty() {
        return writeln!(
            out,
            "{}: {} commands, no findings",
            file.name(),
            count(file)
        );
    }
    write!(out, "{}", file.shown(look(io::stdout().is_terminal())))
}

fn count(file: &ProgramFile) -> usize {
    file.program().commands.len()
}

fn description(file: &ProgramFile) -> serde_json::Value {
    json!({
        "schema": 1,
        "file": file.name(),
        "commands": count(file),
        "findings": crcl::records(&file.reading().findings, file.source()),
        "omitted": file.reading().omitted,
    })
}
