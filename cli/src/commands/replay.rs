use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, anyhow};
use clap::Args;
use engine::host::{ClientChannels, GivenProgram};
use engine::repetition::{RepetitionOperator, compare};
use engine::run_loop::{RunEnd, RunLoop};
use engine::session::{RunSample, SessionConfig};
use ipc::{Clock, Domain};
use planner::dry_run::FailurePolicy;
use planner::robot::Robot;
use view::Source;

use crate::console::exit_of;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::host_options::{Company, Host};
use crate::output;
use crate::printer::Printer;
use crate::program::ProgramFile;
use crate::recorded_program::RecordedFile;
use crate::simulation::{Kind, Simulation};
use crate::viewing;

/// How long an execution in lock-step may say nothing.
const PATIENCE: Duration = Duration::from_secs(120);

/// Look at a recording in the browser, or execute its programs again and compare
///
/// Serves the page of `canter view` with the recording and time controls, and prints its address.
/// With --check every program of the recording is planned and executed again, in lock-step with a
/// simulated arm that starts where the recorded one did, and every setpoint is compared bit by bit:
/// equal with the same build, and the first difference is named otherwise. Periods under an override,
/// a pause or a stop have no counterpart and are counted.
#[derive(Args, Debug)]
pub(crate) struct Replay {
    /// The recording
    #[arg(value_name = "FILE.mcap")]
    file: PathBuf,
    /// Execute the recorded programs again and compare
    #[arg(long)]
    check: bool,
    /// Say what the recording has, and serve no page
    #[arg(long, conflicts_with = "check")]
    info: bool,
    /// Show the recording in the browser: so it is without --check and --info
    #[arg(long, conflicts_with_all = ["check", "info"])]
    view: bool,
    /// Folder of the robot, for the meshes of its picture: a recording has none
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["check", "info"])]
    robot: Option<PathBuf>,
    /// Port of the page on 127.0.0.1 [default: 8230, or a free one where that is taken]
    #[arg(long, value_name = "PORT")]
    port: Option<u16>,
}

impl Replay {
    /// Shows or checks the recording.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        let recorded = RecordedFile::read(&self.file)?;
        if self.check {
            recorded.check_whole()?;
            return check(&recorded);
        }
        summary(printer, &recorded);
        if self.info {
            return Ok(Exit::Done);
        }
        let source = Source::Recording {
            recorded: Box::new(recorded.content),
            folder: self.robot.clone(),
        };
        viewing::serve(printer, (source, None), self.port, || false)
    }
}

/// What a recording has, in a few lines.
fn summary(printer: &Printer, recorded: &RecordedFile) {
    let content = &recorded.content;
    let seconds = content.samples.len() as f64 * content.head.period_ns as f64 * 1e-9;
    printer.line(&format!(
        "{} on {}: {} periods, {seconds:.3} s, {} programs, {} notes",
        content.head.robot,
        content.head.arm,
        content.samples.len(),
        content.programs.len(),
        content.notes.len()
    ));
}

fn check(recorded: &RecordedFile) -> Result<Exit, Failure> {
    let robot = recorded.robot()?;
    let mut exit = Exit::Done;
    for given in recorded.programs(false)? {
        let name = &given.name;
        let samples = recorded.samples(&given);
        let Some(start) = given.start.clone() else {
            output::note(&format!(
                "canter: {name} was given while the arm moved: where it began is not known"
            ));
            exit = Exit::Refused;
            continue;
        };
        let again = execute(recorded, &robot, &given, start)?;
        let compared = compare(samples, &again, &given, robot.dof());
        let altered = match compared.altered {
            0 => String::new(),
            count => format!("; {count} periods under an override, a pause or a stop"),
        };
        match compared.difference {
            Some(difference) => {
                exit = Exit::Refused;
                output::note(&format!(
                    "canter: {name}: after {} equal periods: {difference}{altered}",
                    compared.equal
                ));
            }
            None if compared.equal == 0 => {
                exit = Exit::Refused;
                output::note(&format!("canter: {name}: nothing to compare{altered}"));
            }
            None => output::note(&format!(
                "canter: {name}: {} periods are equal bit by bit{altered}",
                compared.equal
            )),
        }
    }
    Ok(exit)
}

/// Plans and executes a program in lock-step, with a simulated arm that stands at `start`.
fn execute(
    recorded: &RecordedFile,
    robot: &Robot,
    given: &GivenProgram,
    start: Vec<f64>,
) -> Result<Vec<RunSample>, Failure> {
    let program = ProgramFile::given(given);
    if program.exit() != Exit::Done {
        program.report();
        return Err(Failure::new(
            program.exit(),
            anyhow!("the program has findings"),
        ));
    }
    let rate_hz = (1e9 / recorded.content.head.period_ns as f64).round();
    let policy = FailurePolicy::Abort;
    let plan = program.plan(robot, rate_hz, Some(start.clone()), policy)?;
    if let Some(refusal) = plan.refusals.first() {
        program.report_refusal(refusal);
        let cause = anyhow!("the program cannot be executed by this build");
        return Err(Failure::new(Exit::Refused, cause));
    }
    let folder = tempfile::tempdir()?;
    let place = robot_at(folder.path(), robot, &start)?;
    let arm = Domain::open(&folder.path().join("domain"))?.arm("replay/arm")?;
    let channels = ClientChannels::open(&arm)?;
    let simulation = Simulation::start(
        Kind::Servos { wall: None },
        &place.display().to_string(),
        &arm,
    )?;
    let mut config = SessionConfig::new(arm);
    config.rate_hz = rate_hz;
    config.clock = Clock::LockStep;
    config.record = true;
    config.default_length = program.default_length();
    let company = Company {
        _driver: Some(simulation),
        view: None,
    };
    let host = Host::start(channels, robot, &config, company)
        .map_err(|error| Failure::new(Exit::NoPeer, error))?;
    let mut running = RunLoop::new(host, RepetitionOperator::new(PATIENCE));
    let ids = running
        .session()
        .execute(program.program(), plan)
        .map_err(|error| Failure::new(Exit::Refused, error))?;
    match running.wait_for(&ids)? {
        RunEnd::Done => {}
        RunEnd::Stopped | RunEnd::ShutDown => {
            let cause = anyhow!("no period for {} s", PATIENCE.as_secs());
            return Err(Failure::new(Exit::NoPeer, cause));
        }
        RunEnd::Refused { reason, .. } => return Err(Failure::new(Exit::Refused, anyhow!(reason))),
        RunEnd::Faulted { blame, reason } => {
            return Err(Failure::new(exit_of(blame), anyhow!(reason)));
        }
        RunEnd::Closed => return Err(Failure::new(Exit::Internal, anyhow!("it ended"))),
    }
    Ok(running.finish()?.operator.into_samples())
}

/// A folder with the robot, whose home is where the recorded arm stood: the simulated arm begins
/// there.
fn robot_at(folder: &Path, robot: &Robot, start: &[f64]) -> Result<PathBuf, Failure> {
    let write = || -> anyhow::Result<PathBuf> {
        let mut table: toml::Table = robot.toml.parse().context("robot.toml")?;
        let joints = start.iter().map(|joint| toml::Value::Float(*joint));
        let home = toml::Table::from_iter([(
            "joints_rad_or_m".to_owned(),
            toml::Value::Array(joints.collect()),
        )]);
        table.insert("home".to_owned(), toml::Value::Table(home));
        let place = folder.join(&robot.name);
        fs::create_dir(&place)?;
        fs::write(place.join("robot.urdf"), &robot.urdf)?;
        fs::write(place.join("robot.toml"), toml::to_string(&table)?)?;
        Ok(place)
    };
    write().map_err(|cause| Failure::new(Exit::Unreadable, cause))
}
