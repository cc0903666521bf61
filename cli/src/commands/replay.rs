use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use clap::Args;
use engine::host::{ClientChannels, GivenProgram};
use engine::session::{Note, RunSample, SessionConfig};
use ipc::{Clock, Domain};
use planner::dry_run::FailurePolicy;
use planner::robot::Robot;
use recorder::Sample;
use view::Source;

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
    /// Port of the page on 127.0.0.1 [default: 8230, or a free one where that is taken]
    #[arg(long, value_name = "PORT")]
    port: Option<u16>,
}

impl Replay {
    /// Shows or checks the recording.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        let recorded = RecordedFile::read(&self.file)?;
        if self.check {
            return check(&recorded);
        }
        summary(printer, &recorded);
        if self.info {
            return Ok(Exit::Done);
        }
        let source = Source::Recording(Box::new(recorded.content));
        viewing::serve(printer, source, self.port, || false)
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

/// What a comparison came to.
#[derive(Default)]
struct Comparison {
    equal: usize,
    /// Periods without a counterpart: under an override, a pause or a stop.
    altered: usize,
    difference: Option<String>,
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
            Some(text) => {
                exit = Exit::Refused;
                output::note(&format!(
                    "canter: {name}: after {} equal periods: {text}{altered}",
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
    let simulation = Simulation::start(Kind::Servos, &place.display().to_string(), &arm)?;
    let mut config = SessionConfig::new(arm);
    config.rate_hz = rate_hz;
    config.clock = Clock::LockStep;
    config.record = true;
    config.default_length = program.default_length();
    let company = Company {
        _driver: Some(simulation),
        view: None,
    };
    let mut host = Host::start(channels, robot, &config, company)
        .map_err(|error| Failure::new(Exit::NoPeer, error))?;
    let ids = host
        .session
        .execute(program.program(), plan)
        .map_err(|error| Failure::new(Exit::Refused, error))?;
    finish(&mut host, ids.last().copied().unwrap_or(0))
}

/// Waits for the last command and gives all periods.
fn finish(host: &mut Host, last: u32) -> Result<Vec<RunSample>, Failure> {
    let mut samples = Vec::new();
    let mut heard = Instant::now();
    loop {
        let note = host.turn()?;
        let fresh = host.samples();
        if !fresh.is_empty() {
            heard = Instant::now();
        }
        samples.extend(fresh);
        match note {
            Some(Note::Done { id, .. }) if id == last => break,
            Some(Note::Faulted { reason, .. }) => {
                return Err(Failure::new(Exit::DriverFault, anyhow!(reason)));
            }
            Some(Note::Refused { error, .. }) => {
                return Err(Failure::new(Exit::Refused, anyhow!(error.message)));
            }
            Some(Note::Closed) => return Err(Failure::new(Exit::Internal, anyhow!("it ended"))),
            _ if heard.elapsed() > PATIENCE => {
                let cause = anyhow!("no period for {} s", PATIENCE.as_secs());
                return Err(Failure::new(Exit::NoPeer, cause));
            }
            _ => {}
        }
    }
    host.close()?;
    samples.extend(host.samples());
    Ok(samples)
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

/// A place in a program: number of the command from 0, and the planned time in it as bits.
type Place = (u32, u64);

/// Holds the recorded periods against those that were made again.
fn compare(
    recorded: &[Sample],
    again: &[RunSample],
    given: &GivenProgram,
    joints: usize,
) -> Comparison {
    let made: HashMap<Place, &RunSample> = again
        .iter()
        .filter(|sample| sample.path_time > 0.0 && sample.command > 0)
        .map(|sample| ((sample.command - 1, sample.path_time.to_bits()), sample))
        .collect();
    let mut found = Comparison::default();
    let mut altered = None;
    for sample in recorded {
        if sample.path_time <= 0.0 || sample.command < given.first {
            continue;
        }
        let command = sample.command - given.first;
        // A command that was slowed down once is at other places of its path from then on.
        if sample.time_scaling.to_bits() != 1.0_f64.to_bits() && sample.time_scaling > 0.0 {
            altered = Some(command);
        }
        let counterpart = made.get(&(command, sample.path_time.to_bits()));
        let Some(made) = counterpart else {
            if altered == Some(command) {
                found.altered += 1;
                continue;
            }
            found.difference = Some(format!(
                "command {} at {} s (period {}): it does not come to this time",
                command + 1,
                sample.path_time,
                sample.tick
            ));
            return found;
        };
        if altered == Some(command) {
            found.altered += 1;
            continue;
        }
        if let Some(text) = difference(sample, made, joints) {
            found.difference = Some(format!(
                "command {} at {} s (period {}): {text}",
                command + 1,
                sample.path_time,
                sample.tick
            ));
            return found;
        }
        found.equal += 1;
    }
    found
}

/// The first number of a period that is another one now.
fn difference(recorded: &Sample, made: &RunSample, joints: usize) -> Option<String> {
    let lists = [
        ("position", &recorded.position, &made.q),
        ("velocity", &recorded.velocity, &made.dq),
        ("acceleration", &recorded.acceleration, &made.ddq),
    ];
    for (name, was, is) in lists {
        for joint in 0..joints {
            let (was, is) = (was.get(joint)?, is.get(joint)?);
            if was.to_bits() != is.to_bits() {
                return Some(format!(
                    "{name} of joint {}: recorded {was}, now {is}",
                    joint + 1
                ));
            }
        }
    }
    None
}
