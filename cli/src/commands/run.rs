use std::path::PathBuf;

use clap::Args;
use engine::run_loop::{Finished, RunEnd, RunLoop};
use engine::session::Status;
use planner::dry_run::Plan;
use serde_json::json;

use crate::console::{Console, SampleOptions, Voice, exit_of};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::host_options::{Company, DriverChoice, HostOptions, RefusalOption, ShownWorld};
use crate::printer::Printer;
use crate::program::{ProgramArgument, ProgramFile};
use crate::recorder_options;
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
    shown: ShownWorld,
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
        // The simulated arm starts at home, where the dry run does, so that a program that cannot be
        // executed starts nothing. Only the driver of another arm knows where it stands.
        let mut options = program.options(self.host.rate, None, self.refusal.policy());
        let mut earlier = None;
        if self.host.driver != DriverChoice::External {
            let plan = program.plan_from(&robot, &options, None)?;
            if !plan.may_run(options.on_refusal) {
                report_refusals(&program, &plan);
                return Ok(Exit::Refused);
            }
            earlier = Some(plan);
        }
        if self.json {
            printer.expect_json();
        }
        let signals = SignalThread::start(printer, "once more to brake hard")?;
        let (place, length) = (self.robot.place(), program.default_length());
        let mut host = self
            .host
            .start(&robot, place, length, self.refusal.policy())?;
        host.own("canter run");
        self.host.show(&mut host, self.shown.world.as_deref())?;
        options.start = Some(host.session.start.clone());
        let plan = program.plan_from(&robot, &options, earlier)?;
        report_refusals(&program, &plan);
        if !plan.may_run(options.on_refusal) {
            return Ok(Exit::Refused);
        }
        let samples = SampleOptions {
            joints: robot.dof(),
            rate_hz: self.host.rate,
            file: self.samples.as_deref(),
        };
        let voice = if self.json { Voice::Json } else { Voice::Lines };
        let console = Console::new(printer, signals, &host.session, &samples, voice)?;
        let (exit, summary) = execute(RunLoop::new(host, console), &program, plan)?;
        if let Some(recorded) = &summary.recorded {
            recorder_options::report(printer, recorded);
        }
        printer.line(&if self.json {
            summary.json(exit)
        } else {
            summary.text()
        });
        Ok(exit)
    }
}

/// Reports the refused commands of a plan.
fn report_refusals(program: &ProgramFile, plan: &Plan) {
    for refusal in &plan.refusals {
        program.report_refusal(refusal);
    }
}

/// Has the program executed as it was planned.
fn execute(
    mut running: RunLoop<Company, Console>,
    program: &ProgramFile,
    plan: Plan,
) -> Result<(Exit, Summary), Failure> {
    let (start, plans) = (Some(plan.start.clone()), plan.plans);
    // All keys of a plan are texts, so it can be written.
    let certificate = serde_json::to_string(&plan).ok();
    let ids = running
        .session()
        .execute(program.program(), plan)
        .map_err(|full| Failure::new(Exit::Refused, full))?;
    running.tell_program(program.given_as(&ids, start), certificate);
    let end = running.wait_for(&ids)?;
    let driver = running.session().driver.clone();
    let Finished {
        operator: console,
        status,
        recorded,
    } = running.finish()?;
    let mut summary = Summary {
        commands: program.program().commands.len(),
        done: console.done(),
        driver,
        duration_s: console.recording().duration(),
        off_path_m: console.recording().worst(),
        plans: plans + status.plans,
        status,
        recorded: None,
    };
    console.finish()?;
    summary.recorded = recorded?;
    let exit = match end {
        // The end was reached, but not every command was executed.
        RunEnd::Done if summary.done < summary.commands => Exit::Refused,
        RunEnd::Done => Exit::Done,
        RunEnd::Refused { .. } => Exit::Refused,
        RunEnd::Stopped | RunEnd::ShutDown => Exit::Stopped,
        RunEnd::Faulted { blame, .. } => exit_of(blame),
        RunEnd::Closed => Exit::Internal,
    };
    Ok((exit, summary))
}

/// What a run came to.
struct Summary {
    commands: usize,
    done: usize,
    driver: String,
    duration_s: f64,
    off_path_m: f64,
    /// How many moves were planned, before the session and in it.
    plans: u64,
    /// Where the session was at the end.
    status: Status,
    /// What was recorded, if it was.
    recorded: Option<recorder::Summary>,
}

impl Summary {
    fn json(&self, exit: Exit) -> String {
        json!({
            "event": "summary",
            "schema": 1,
            "exit": exit as u8,
            "commands": self.commands,
            "done": self.done,
            "robot": self.status.robot,
            "driver": self.driver,
            "duration_s": self.duration_s,
            "plans": self.plans,
            "cycles": self.status.cycles,
            "off_path_m": self.off_path_m,
        })
        .to_string()
    }

    fn text(&self) -> String {
        let cycles = &self.status.cycles;
        format!(
            "{} of {} commands done in {:.3} s; {} periods, {} of them late; driver {} at most \
             {:.3} mm off the path",
            self.done,
            self.commands,
            self.duration_s,
            cycles.ticks,
            cycles.skipped,
            self.driver,
            self.off_path_m * 1e3
        )
    }
}
