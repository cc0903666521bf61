use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use crcl::LengthUnit;
use engine::arm_motion::ArmMotion;
use engine::equipment::equip;
use engine::run_loop::RunLoop;
use plan::PlanError;
use plan::interp::{PddlInterpreter, Pull, PulledRun, pull};
use plan::run::{
    Cell, Controller, Event, Motion, PlanRunReport, Policy, Program, RobotOptions, RunOptions,
    RunOutcome, SimulatedFactotum, Stock, parameters, prepare,
};
use plan::world::{Model, Reader, StoredRun, Writer};
use planner::dry_run::FailurePolicy;
use planner::robot::Robot;

use crate::console::{Console, SampleOptions, Voice, exit_of};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::host_options::{Company, HostOptions};
use crate::input;
use crate::pddl_file::{action_table, is_pddl};
use crate::plan_report::PlanReport;
use crate::printer::Printer;
use crate::recorder_options;
use crate::robot::{RobotOption, with_joints};
use crate::signals::SignalThread;
use crate::world_file::{Database, refused};

/// An engine with its operator.
type MovingArm = RunLoop<Company, Console>;

/// Execute a kitting process plan or a PDDL plan in a world
///
/// Starts the engine and, unless told otherwise, the simulated driver. With --dry-run the motion is
/// planned exactly as in a real run, but nothing moves, and the world does not change. The factotum
/// is simulated: it brings supplies like those at the start. Ctrl-C stops on the path and ends; the
/// run can then be resumed. A second Ctrl-C aborts.
#[derive(Args, Debug)]
pub(crate) struct PlanRun {
    /// The plan; not needed with --resume
    #[arg(required_unless_present = "resume", conflicts_with = "resume")]
    plan: Option<PathBuf>,
    /// Database (changed by the run), or workstation file (.toml, .json, .xml; used as a copy)
    #[arg(long, value_name = "WORLD")]
    world: PathBuf,
    #[command(flatten)]
    robot: RobotOption,
    #[command(flatten)]
    host: HostOptions,
    /// Refuse a kitting plan with another PlanId
    #[arg(long, value_name = "ID", conflicts_with = "resume")]
    plan_id: Option<String>,
    /// Value of a parameter of the plan
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// How often the factotum brings what meets a requirement; without this, always
    #[arg(long, value_name = "REQUIREMENT=TIMES")]
    stock: Vec<String>,
    /// Plan all motion, move nothing, do not change the world
    #[arg(long)]
    dry_run: bool,
    /// Run in a copy of the world, which is kept in this new database
    #[arg(long, value_name = "FILE.db")]
    keep: Option<PathBuf>,
    /// Continue the last run of the database, which was killed or stopped
    #[arg(long)]
    resume: bool,
    /// Percentage of the arm's speed and acceleration
    #[arg(long, value_name = "PERCENT", default_value_t = 50.0)]
    speed: f64,
    /// Attempts to repair a failed step before the plan is given up
    #[arg(long, value_name = "N", default_value_t = 0)]
    repair: usize,
    /// Keep the written order of lists that leave the order open
    #[arg(long)]
    written_order: bool,
    /// Table (TOML) of further PDDL actions
    #[arg(long, value_name = "TABLE.toml")]
    actions: Option<PathBuf>,
    /// Write what was published and measured as CSV
    #[arg(long, value_name = "FILE.csv", conflicts_with = "dry_run")]
    samples: Option<PathBuf>,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
    /// Show each statement
    #[arg(short, long)]
    verbose: bool,
}

impl PlanRun {
    /// Executes the plan.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        let mut robot = self.robot.load()?;
        let source = self.plan.as_deref().map(input::text).transpose()?;
        let (parameters, limits) = (self.parameters()?, self.limits()?);
        let (database, writer) = Database::open(&self.world, self.dry_run, self.keep.as_deref())?;
        let model = writer.model().map_err(refused)?;
        let stored = if self.resume {
            writer.last_run().map_err(refused)?
        } else {
            None
        };
        self.check(source.as_deref(), &parameters, &model)?;
        equip(&mut robot, &model).map_err(refused)?;
        let arm = if self.dry_run {
            None
        } else {
            Some(self.moving_arm(&robot, &database.path, printer)?)
        };
        let task = Task {
            command: self,
            printer,
            source,
            stored,
            parameters,
            limits,
            database,
            writer,
        };
        with_joints!(robot.dof(), execute(task, &robot, arm))
    }

    /// Checks what is possible before an engine is started.
    fn check(
        &self,
        source: Option<&str>,
        given: &BTreeMap<String, String>,
        model: &Model,
    ) -> Result<(), Failure> {
        match source {
            Some(source) if !is_pddl(source) => {
                let (program, _) = prepare(source, model).map_err(refused)?;
                parameters(&program, given).map_err(refused)?;
                self.check_id(program.plan.about("PlanId"))
            }
            _ => self.check_id(""),
        }
    }

    /// The plan is the one that was asked for.
    fn check_id(&self, found: &str) -> Result<(), Failure> {
        match &self.plan_id {
            Some(wanted) if wanted != found => {
                let message = anyhow::anyhow!("the id of the plan is {found:?}, not {wanted:?}");
                Err(Failure::new(Exit::Refused, message))
            }
            _ => Ok(()),
        }
    }

    /// An engine for the plan; a live view shows the database that the plan changes.
    fn moving_arm(
        &self,
        robot: &Robot,
        world: &Path,
        printer: &Printer,
    ) -> Result<MovingArm, Failure> {
        let place = self.robot.place();
        let (metres, policy) = (LengthUnit::Meter, FailurePolicy::Abort);
        let mut host = self.host.start(robot, place, metres, policy)?;
        host.own("canter plan-run");
        self.host.show(&mut host, Some(world))?;
        let samples = SampleOptions {
            joints: robot.dof(),
            rate_hz: self.host.rate,
            file: self.samples.as_deref(),
        };
        let signals = SignalThread::start(printer, "once more to brake hard")?;
        let console = Console::new(printer, signals, &host.session, &samples, Voice::Messages)?;
        Ok(RunLoop::new(host, console))
    }

    fn parameters(&self) -> Result<BTreeMap<String, String>, Failure> {
        pairs("--set", &self.set)
    }

    /// How often the factotum still brings something.
    fn limits(&self) -> Result<BTreeMap<String, usize>, Failure> {
        let number = |(name, times): (String, String)| match times.parse() {
            Ok(times) => Ok((name, times)),
            Err(_) => {
                let message = anyhow::anyhow!("--stock {name}={times}: expected a number of times");
                Err(Failure::new(Exit::Usage, message))
            }
        };
        let pairs = pairs("--stock", &self.stock)?;
        pairs.into_iter().map(number).collect()
    }

    fn options(&self, robot: &Robot) -> RunOptions {
        RunOptions {
            robot: self.robot_options(robot),
            policy: self.policy(),
            choose_order: !self.written_order,
        }
    }

    fn policy(&self) -> Policy {
        match self.repair {
            0 => Policy::Stop,
            attempts => Policy::Repair { attempts },
        }
    }

    fn robot_options(&self, robot: &Robot) -> RobotOptions {
        RobotOptions {
            percent: Some(self.speed),
            ..RobotOptions::for_arm(robot.dof())
        }
    }

    fn observe(&self, printer: &Printer, event: &Event) {
        match event {
            Event::Statement {
                name,
                line,
                seconds,
                ..
            } if self.verbose => {
                printer.note(&format!(
                    "done     line {line:4}  {name:30} {seconds:9.3} s"
                ));
            }
            Event::Kit(number) => printer.note(&format!("kit {number} is finished")),
            Event::EndEffector(name) if self.verbose => printer.note(&format!("with {name}")),
            Event::Warning(text) => printer.note(&format!("warning: {text}")),
            Event::Retry(text) => printer.note(&format!("tried again: {text}")),
            _ => {}
        }
    }
}

/// Values by name, from NAME=VALUE.
fn pairs(option: &str, texts: &[String]) -> Result<BTreeMap<String, String>, Failure> {
    let pair = |text: &String| {
        let (name, value) = text.split_once('=').ok_or_else(|| {
            let message = anyhow::anyhow!("{option} {text}: expected NAME=VALUE");
            Failure::new(Exit::Usage, message)
        })?;
        Ok((name.trim().to_owned(), value.trim().to_owned()))
    };
    texts.iter().map(pair).collect()
}

/// A plan with all it needs but an arm.
struct Task<'a> {
    command: &'a PlanRun,
    printer: &'a Printer,
    /// Text of the plan; none when a run is resumed.
    source: Option<String>,
    /// The run that is resumed; `None` when a plan is started.
    stored: Option<StoredRun>,
    parameters: BTreeMap<String, String>,
    limits: BTreeMap<String, usize>,
    database: Database,
    writer: Writer,
}

impl Task<'_> {
    /// Whether the plan, or that of the resumed run, is PDDL.
    fn is_pddl(&self) -> bool {
        let stored = self.stored.as_ref().map(|run| run.source.as_str());
        self.source.as_deref().or(stored).is_some_and(is_pddl)
    }

    fn kitting(self, robot: &Robot, motion: &mut dyn Motion) -> Result<PlanRunReport, PlanError> {
        let Self {
            command,
            printer,
            source,
            stored,
            parameters,
            limits,
            database,
            writer,
        } = self;
        let stock = match &source {
            Some(source) => {
                let program = Program::new(plan::kitting::read(source).plan);
                Stock::of(&writer.model()?, &program.plan)
            }
            None => {
                let stock = stored.map(|run| serde_json::from_str(&run.stock));
                stock.and_then(Result::ok).unwrap_or_default()
            }
        };
        let mut factotum = SimulatedFactotum::new(stock.clone());
        factotum.limits = limits;
        let cell = Cell {
            reader: Reader::open(&database.path)?,
            writer,
            motion,
            factotum: &mut factotum,
        };
        let options = command.options(robot);
        let mut controller = match &source {
            Some(source) => Controller::start(cell, source, &parameters, &stock, options),
            None => Controller::resume(cell, options),
        }?;
        controller.run(&mut |event| command.observe(printer, event))
    }

    fn pddl(self, robot: &Robot, motion: &mut dyn Motion) -> Result<PlanRunReport, Failure> {
        let (command, printer) = (self.command, self.printer);
        let table = action_table(command.actions.as_deref())?;
        let options = command.robot_options(robot);
        let mut interpreter = PddlInterpreter::new(&self.database.path, table, options.clone());
        let run = match self.stored {
            Some(stored) => PulledRun::resume(stored).map_err(refused)?,
            None => {
                let name = command.plan.as_ref().map(|path| path.display().to_string());
                let source = self.source.as_deref().unwrap_or_default();
                PulledRun::new(&name.unwrap_or_default(), source)
            }
        };
        interpreter.go_on(run.source(), run.done());
        let place = Pull {
            writer: self.writer,
            motion,
            robot: options,
            policy: command.policy(),
        };
        let mut observer = |event: &Event| command.observe(printer, event);
        pull(&mut interpreter, run, place, &mut observer).map_err(refused)
    }
}

fn execute<const N: usize>(
    task: Task<'_>,
    robot: &Robot,
    arm: Option<MovingArm>,
) -> Result<Exit, Failure> {
    let (command, printer) = (task.command, task.printer);
    let mut motion = ArmMotion::<N, _>::new(robot, command.host.rate, arm)
        .map_err(|error| Failure::new(Exit::Unreadable, error))?;
    let report: PlanReport = if task.is_pddl() {
        task.pddl(robot, &mut motion)?
    } else {
        task.kitting(robot, &mut motion).map_err(refused)?
    }
    .into();
    let arm = motion.into_mover();
    let blame = arm.as_ref().and_then(MovingArm::blame);
    let off_path = match arm {
        Some(arm) => {
            let finished = arm.finish()?;
            let worst = finished.operator.recording().worst();
            finished.operator.finish()?;
            if let Some(summary) = finished.recorded? {
                recorder_options::report(printer, &summary);
            }
            Some(worst)
        }
        None => None,
    };
    let mut text = Vec::new();
    report.write(&mut text, command.json, off_path)?;
    printer.lines(text);
    Ok(match report.outcome() {
        RunOutcome::Stopped => Exit::Done,
        RunOutcome::Interrupted => Exit::Stopped,
        RunOutcome::Failed => blame.map_or(Exit::Refused, exit_of),
    })
}
