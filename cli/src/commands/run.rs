use std::io::{self, IsTerminal};
use std::path::PathBuf;

use clap::Args;
use engine::session::{Blame, Note};
use planner::dry_run::{FailurePolicy, Plan};
use planner::robot::Robot;
use serde_json::json;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::host_options::{DriverChoice, Host, HostOptions, RefusalOption};
use crate::output_file::OutputFile;
use crate::printer::Printer;
use crate::program::{ProgramArgument, ProgramFile};
use crate::progress::Progress;
use crate::recording::Recording;
use crate::robot::RobotOption;
use crate::signals::SignalThread;

/// Run a program on an arm
///
/// Starts the engine and, unless told otherwise, the simulated driver, runs the program, prints a
/// line for each command that is done, and ends both. The whole program is planned first: one that
/// cannot be executed moves nothing. Ctrl-C stops on the path and ends; a second Ctrl-C brakes as
/// fast as the joints can. The arm does not wait for a reader: if standard output is closed or not
/// read, the program runs to its end, lines are dropped and counted, and the exit code is 8.
#[derive(Args, Debug)]
pub(crate) struct Run {
    #[command(flatten)]
    program: ProgramArgument,
    #[command(flatten)]
    robot: RobotOption,
    #[command(flatten)]
    host: HostOptions,
    #[command(flatten)]
    refusal: RefusalOption,
    /// Write what was published and measured as CSV
    #[arg(long, value_name = "FILE.csv")]
    samples: Option<PathBuf>,
    /// Print one JSON object per event, one per line
    #[arg(long)]
    json: bool,
}

impl Run {
    /// Runs the program to its end.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        let program = self.program.read()?;
        program.report();
        if program.exit() != Exit::Done {
            return Ok(program.exit());
        }
        // The simulated arm starts where the dry run does, so that a program that cannot be
        // executed starts nothing. The position of another arm is known to its driver only.
        let mut plans = 0;
        let mut plan = None;
        if self.host.driver != DriverChoice::External {
            let Some(ours) = self.plan(&program, &robot, None)? else {
                return Ok(Exit::Refused);
            };
            plans += ours.plans;
            plan = Some(ours);
        }
        if self.json {
            printer.expect_json();
        }
        let signals = SignalThread::start(printer, "once more to brake hard")?;
        let mut host = self.host.start(
            &robot,
            self.robot.place(),
            program.default_length(),
            self.refusal.policy(),
        )?;
        host.own("canter run");
        let start = host.session.start.clone();
        let plan = match plan.filter(|plan| plan.start == start) {
            Some(plan) => plan,
            None => {
                let Some(plan) = self.plan(&program, &robot, Some(start))? else {
                    return Ok(Exit::Refused);
                };
                plans += plan.plans;
                plan
            }
        };
        let sink = self
            .samples
            .as_deref()
            .map(OutputFile::create)
            .transpose()?;
        let recording = Recording::new(robot.dof(), self.host.rate, sink)?;
        let progress = Progress::new(printer, io::stderr().is_terminal() && !self.json);
        signals.steer(&host.session);
        Running {
            json: self.json,
            host,
            signals,
            printer: printer.clone(),
            recording,
            progress,
            plans,
        }
        .finish_program(&program, plan)
    }
}

impl Run {
    /// Plans the whole program from `start`, or from home, and reports refused commands; no plan if
    /// it may not be run. With a policy that allows refusals it always may.
    fn plan(
        &self,
        program: &ProgramFile,
        robot: &Robot,
        start: Option<Vec<f64>>,
    ) -> Result<Option<Plan>, Failure> {
        let policy = self.refusal.policy();
        let plan = program.plan(robot, (self.host.rate, start), policy)?;
        for refusal in &plan.refusals {
            program.report_refusal(refusal);
        }
        let may_run = plan.refusals.is_empty() || policy != FailurePolicy::Abort;
        Ok(may_run.then_some(plan))
    }
}

/// A program that is running.
struct Running {
    json: bool,
    host: Host,
    signals: SignalThread,
    printer: Printer,
    recording: Recording<OutputFile>,
    progress: Progress,
    /// How many moves were planned before the session began.
    plans: u64,
}

impl Running {
    fn finish_program(mut self, program: &ProgramFile, plan: Plan) -> Result<Exit, Failure> {
        let count = program.program().commands.len();
        let ids = self
            .host
            .session
            .execute(program.program(), plan)
            .map_err(|full| Failure::new(Exit::Refused, full))?;
        let last = ids.last().copied().unwrap_or(0);
        let mut done = 0;
        let exit = loop {
            if self.signals.has_stopped(&self.host.session) {
                break Exit::Stopped;
            }
            let note = self.host.turn()?;
            self.recording.take(&self.host.session.samples())?;
            self.progress.show(&self.host.session.status());
            if self.host.is_shut_down() {
                break Exit::Stopped;
            }
            let Some(note) = note else { continue };
            self.tell(&note);
            done += usize::from(matches!(note, Note::Done { .. }));
            if let Some(exit) = self.over(&note, last) {
                break exit;
            }
        };
        self.finish(exit, done, count)
    }

    /// The exit code for a note, if it is the last one.
    fn over(&self, note: &Note, last: u32) -> Option<Exit> {
        match note {
            Note::Done { id, .. } if *id == last => Some(Exit::Done),
            Note::Refused { id, dropped, .. } if *dropped > 0 || *id == last => Some(Exit::Refused),
            Note::Aborted { .. } => Some(Exit::Stopped),
            Note::Faulted {
                blame: Blame::Guard,
                ..
            } => Some(Exit::Aborted),
            Note::Faulted { .. } => Some(Exit::DriverFault),
            Note::Closed => Some(Exit::Internal),
            _ => None,
        }
    }

    /// One line for what happened.
    fn tell(&mut self, note: &Note) {
        let printer = &self.printer;
        if self.json {
            // All keys of a note are texts, so it can be written.
            if let Ok(text) = serde_json::to_string(note) {
                printer.line(&text);
            }
            return;
        }
        match note {
            Note::Done {
                line, name, ticks, ..
            } => {
                let seconds = *ticks as f64 * self.recording.period();
                printer.line(&format!(
                    "done     line {line:4}  {name:30} {seconds:9.3} s"
                ));
            }
            Note::Message { text } => printer.line(&format!("message  {text}")),
            Note::Refused {
                line, name, error, ..
            } => printer.note(&format!(
                "canter: error: line {line}: {name}: {}",
                error.message
            )),
            Note::Faulted { reason, .. } => printer.note(&format!("canter: error: {reason}")),
            Note::Ended { reason } if *reason > 0 => {
                printer.note(&format!("canter: the program ended with reason {reason}"));
            }
            _ => {}
        }
    }

    /// Ends session and driver, writes the rest of the samples, sums up.
    fn finish(mut self, exit: Exit, done: usize, count: usize) -> Result<Exit, Failure> {
        let duration = self.recording.duration();
        let status = self.host.session.status();
        // The sample of a period is complete when the next state arrives: the last ones are still
        // missing.
        self.host.session.close();
        self.recording.take(&self.host.session.samples())?;
        let driver = self.host.session.driver.clone();
        let tracking = self.recording.worst();
        let exit = match exit {
            // The end was reached, but not every command was executed.
            Exit::Done if done < count => Exit::Refused,
            exit => exit,
        };
        drop(self.host);
        self.signals.release();
        self.recording.finish()?;
        if self.json {
            let summary = json!({
                "event": "summary",
                "schema": 1,
                "exit": exit as u8,
                "commands": count,
                "done": done,
                "robot": status.robot,
                "driver": driver,
                "duration_s": duration,
                "plans": self.plans + status.plans,
                "cycles": status.cycles,
                "off_path_m": tracking,
            });
            self.printer.line(&summary.to_string());
            return Ok(exit);
        }
        let cycles = status.cycles;
        self.printer.line(&format!(
            "{done} of {count} commands done in {duration:.3} s; {} periods, {} of them late; \
             driver {driver} at most {:.3} mm off the path",
            cycles.ticks,
            cycles.skipped,
            tracking * 1e3
        ));
        Ok(exit)
    }
}
