use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use planner::dry_run::{FailurePolicy, Plan as Planned, PlannedCommand};
use planner::motion::MoveCertificate;
use view::Source;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::host_options::rate;
use crate::output;
use crate::output_file::OutputFile;
use crate::picture;
use crate::plot;
use crate::printer::Printer;
use crate::program::ProgramArgument;
use crate::robot::RobotOption;
use crate::samples::{SampleRow, SampleWriter};
use crate::viewing;

/// Plan a program without moving anything: the dry run
///
/// Uses the same planner as `canter run`, from the robot's home position, and prints when each
/// command starts, how long it takes and what was proved of each move.
#[derive(Args, Debug)]
pub(crate) struct Plan {
    #[command(flatten)]
    program: ProgramArgument,
    #[command(flatten)]
    robot: RobotOption,
    /// Write the motion as CSV
    #[arg(long, value_name = "FILE.csv")]
    samples: Option<PathBuf>,
    /// Time between samples, seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.001, value_parser = period)]
    period: f64,
    /// Draw the motion as SVG
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Servo rate: every command starts on a tick of it
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, value_parser = rate)]
    rate: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Show the plan in the browser until Ctrl-C: prints the address of a page
    #[arg(long)]
    view: bool,
}

impl Plan {
    /// Plans; prints the plan; writes what was asked for.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        let program = self.program.read()?;
        program.report();
        if program.exit() != Exit::Done {
            return Ok(program.exit());
        }
        let plan = program.plan(&robot, self.rate, None, FailurePolicy::Abort)?;
        for refusal in &plan.refusals {
            program.report_refusal(refusal);
        }
        if self.json {
            output::json(&plan)?;
        } else {
            table(&plan)?;
        }
        if !plan.refusals.is_empty() {
            return Ok(Exit::Refused);
        }
        if let Some(path) = &self.samples {
            self.write_samples(&plan, path)?;
        }
        if let Some(path) = &self.plot {
            let picture = plot::svg(&picture::drawing(&robot, &plan, program.name()));
            fs::write(path, picture)
                .with_context(|| unwritable(path))
                .map_err(refused)?;
        }
        if self.view {
            let texts = [program.name(), program.form_name(), program.text()];
            let source = Source::Program {
                robot: Box::new(robot),
                program: texts.map(str::to_owned),
            };
            return viewing::serve(printer, (source, None), None, || false);
        }
        Ok(Exit::Done)
    }
}

impl Plan {
    fn write_samples(&self, plan: &Planned, path: &Path) -> Result<(), Failure> {
        let mut writer = SampleWriter::new(OutputFile::create(path)?, plan.dof, &[])?;
        for sample in plan.samples(self.period) {
            let row = SampleRow {
                t_s: sample.t_s,
                command: sample.command,
                joints: [&sample.q, &sample.dq, &sample.ddq],
                pose: &sample.workstation_from_tool,
            };
            writer.write(&row, &[])?;
        }
        Ok(writer.finish()?)
    }
}

/// One line a command, and the sum.
fn table(plan: &Planned) -> io::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(
        out,
        "{:>5} {:>5}  {:30} {:>9} {:>9}  proved",
        "index", "line", "command", "start", "time"
    )?;
    for command in &plan.commands {
        writeln!(
            out,
            "{:5} {:5}  {:30} {:9.3} {:9.3}  {}",
            command.index,
            command.line,
            command.name,
            command.start_s,
            command.duration_s,
            proved(command)
        )?;
    }
    writeln!(
        out,
        "{} on {} joints: {:.3} s, planned in {:.1} ms",
        plan.robot,
        plan.dof,
        plan.duration_s,
        plan.planning_s * 1e3
    )
}

/// What was proved of a move, in short.
fn proved(command: &PlannedCommand) -> String {
    let Some(certificate) = &command.certificate else {
        return String::new();
    };
    let mut text = format!("limits {:.1} %", certificate.peaks.largest() * 100.0);
    if let Some(straightness) = certificate.straightness_m {
        text += &format!(", straight within {:.2} um", straightness * 1e6);
    }
    let worst = certificate
        .poses
        .iter()
        .map(|pass| pass.deviation_m)
        .fold(0.0, f64::max);
    if let Some(pass) = certificate.poses.first() {
        text += &format!(
            ", {} poses passed within {:.3} mm of {:.3} mm",
            certificate.poses.len(),
            worst * 1e3,
            pass.tolerance_m * 1e3
        );
    }
    text + &rests(certificate)
}

/// At which poses a move rests, and why: the first few.
fn rests(certificate: &MoveCertificate) -> String {
    let poses = certificate.poses.iter();
    let mut rests = poses.filter_map(|pass| Some(format!("{} ({})", pass.index, pass.rests?)));
    let first: Vec<_> = rests.by_ref().take(3).collect();
    let text = match first.as_slice() {
        [] => return String::new(),
        [one] => format!(", rests at pose {one}"),
        some => format!(", rests at poses {}", some.join(", ")),
    };
    match rests.count() {
        0 => text,
        more => format!("{text} and {more} more"),
    }
}

fn unwritable(path: &std::path::Path) -> String {
    format!("cannot write {}", path.display())
}

fn refused(cause: anyhow::Error) -> Failure {
    Failure::new(Exit::Unreadable, cause)
}

fn period(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (1e-6..=1e3).contains(&value) => Ok(value),
        _ => Err("expected seconds from 0.000001 to 1000".to_owned()),
    }
}
