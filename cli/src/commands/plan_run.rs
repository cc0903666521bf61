use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use engine::robot::Robot;
use engine::session::{Session, SessionConfig};
use ipc::{Arm, Clock};
use plan::PlanError;
use plan::interp::{PddlInterpreter, pull};
use plan::pddl::ActionTable;
use plan::run::{
    Cell, Controller, Event, Motion, Policy, Program, Report, RobotOptions, RunOptions,
    SimulatedFactotum, Stock,
};
use plan::world::{Reader, Writer};

use crate::arm_motion::{ArmMotion, OwnDriver, equip};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::robot::{load, with_joints};
use crate::world_file::Database;
use crate::{output, world_file};

/// Execute a kitting process plan or a PDDL plan in a world
///
/// With --dry-run the motion is planned exactly as in a real run but nothing moves, and the world is
/// left as it is. Otherwise a driver of the arm must be running, or give --sim. The factotum is
/// simulated: it brings supplies like those at the start.
#[derive(Args, Debug)]
pub(crate) struct PlanRun {
    /// The plan; not needed with --resume
    #[arg(required_unless_present = "resume")]
    plan: Option<PathBuf>,
    /// Database (changed by the run), or workstation file (.toml, .json, .xml; used as a copy)
    #[arg(long, value_name = "WORLD")]
    world: PathBuf,
    /// Shipped robot (see `canter robots list`) or a folder with robot.urdf and robot.toml
    #[arg(short, long, value_name = "R")]
    robot: String,
    /// Value of a parameter of the plan
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Plan all motion, move nothing, change nothing
    #[arg(long, conflicts_with_all = ["sim", "resume"])]
    dry_run: bool,
    /// Go on with the last run of the database, which was killed
    #[arg(long)]
    resume: bool,
    /// Start a simulated driver and run in step with it
    #[arg(long)]
    sim: bool,
    /// Name of the arm, as cell/arm
    #[arg(long, value_name = "CELL/ARM", default_value = "canter/arm")]
    arm: Arm,
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
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
    /// Show each statement
    #[arg(short, long)]
    verbose: bool,
}

fn refused(error: PlanError) -> Failure {
    let exit = match error {
        PlanError::Database(_) | PlanError::Stored { .. } | PlanError::Schema { .. } => {
            Exit::Unreadable
        }
        _ => Exit::Refused,
    };
    Failure::new(exit, error)
}

impl PlanRun {
    /// Executes the plan.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let mut robot = load(&self.robot)?;
        let (database, writer) = Database::open(&self.world, self.dry_run)?;
        equip(&mut robot, &writer.model().map_err(refused)?).map_err(refused)?;
        let _driver = if self.sim {
            Some(OwnDriver::start(&robot, &self.arm)?)
        } else {
            None
        };
        let session = if self.dry_run {
            None
        } else {
            Some(self.session(&robot)?)
        };
        with_joints!(
            robot.dof(),
            execute(self, &robot, session, &database, writer)
        )
    }

    fn session(&self, robot: &Robot) -> Result<Session, Failure> {
        let mut config = SessionConfig::new(self.arm.clone());
        if self.sim {
            config.clock = Clock::LockStep;
        }
        let session = Session::start(robot, &config);
        session.map_err(|error| Failure::new(Exit::NoPeer, error))
    }

    fn parameters(&self) -> Result<BTreeMap<String, String>, Failure> {
        let pair = |text: &String| {
            let (name, value) = text.split_once('=').ok_or_else(|| {
                let message = anyhow::anyhow!("--set {text}: expected NAME=VALUE");
                Failure::new(Exit::Usage, message)
            })?;
            Ok((name.trim().to_owned(), value.trim().to_owned()))
        };
        self.set.iter().map(pair).collect()
    }

    fn robot_options(&self) -> RobotOptions {
        RobotOptions {
            percent: Some(self.speed),
            ..RobotOptions::default()
        }
    }

    fn observe(&self, event: &Event) {
        match event {
            Event::Statement {
                name,
                line,
                number,
                seconds,
            } if self.verbose => {
                output::note(&format!("{number}: line {line}, {name}, {seconds:.3} s"));
            }
            Event::Kit(number) => output::note(&format!("kit {number} is finished")),
            Event::EndEffector(name) if self.verbose => output::note(&format!("with {name}")),
            Event::Warning(text) => output::note(&format!("warning: {text}")),
            Event::Retry(text) => output::note(&format!("tried again: {text}")),
            _ => {}
        }
    }

    fn kitting(
        &self,
        source: Option<&str>,
        database: &Database,
        writer: Writer,
        motion: &mut dyn Motion,
    ) -> Result<Exit, Failure> {
        let model = writer.model().map_err(refused)?;
        let stock = match source {
            Some(source) => Stock::of(&model, &Program::new(plan::kitting::read(source).plan).plan),
            None => {
                let run = writer.last_run().map_err(refused)?;
                let stock = run.and_then(|run| serde_json::from_str(&run.stock).ok());
                stock.unwrap_or_default()
            }
        };
        let mut factotum = SimulatedFactotum::new(stock.clone());
        let reader = Reader::open(&database.path).map_err(refused)?;
        let options = RunOptions {
            robot: self.robot_options(),
            policy: match self.repair {
                0 => Policy::Stop,
                attempts => Policy::Repair { attempts },
            },
            choose_order: !self.written_order,
        };
        let cell = Cell {
            writer,
            reader,
            motion,
            factotum: &mut factotum,
        };
        let mut controller = match source {
            Some(source) => Controller::start(cell, source, &self.parameters()?, &stock, options),
            None => Controller::resume(cell, options),
        }
        .map_err(refused)?;
        let report = controller
            .run(&mut |event| self.observe(event))
            .map_err(refused)?;
        self.print(&report)?;
        Ok(match report.code {
            0 => Exit::Done,
            3 => Exit::Aborted,
            _ => Exit::Refused,
        })
    }

    fn print(&self, report: &Report) -> io::Result<()> {
        if self.json {
            return output::json(report);
        }
        let mut out = io::stdout().lock();
        let c = &report.counters;
        if let Some(reason) = &report.reason {
            writeln!(
                out,
                "{}: {reason} (EndCanon({}))",
                report.outcome, report.code
            )?;
        }
        writeln!(
            out,
            "{} kits: {} statements, {} commands, {} pick-ups, {} put-downs, {} moves above, {} end effector changes, {} factotum calls",
            c.kits,
            c.statements,
            c.commands,
            c.pick_ups,
            c.put_downs,
            c.moves_above,
            c.end_effector_changes,
            c.factotum_calls
        )?;
        writeln!(
            out,
            "{:.3} s of motion, {:.3} s gained by chosen orders, {:.3} s by the clock on the wall, {} warnings",
            c.motion_s,
            c.gained_s,
            report.wall_s,
            report.warnings.len()
        )
    }

    fn pddl(
        &self,
        path: &std::path::Path,
        database: &Database,
        mut writer: Writer,
        motion: &mut dyn Motion,
    ) -> Result<Exit, Failure> {
        let mut table = ActionTable::own().map_err(refused)?;
        if let Some(more) = &self.actions {
            table = table.with(&world_file::read(more)?).map_err(refused)?;
        }
        let mut interpreter = PddlInterpreter::new(&database.path, table, self.robot_options());
        let name = path.display().to_string();
        let mut step = |number| {
            if self.verbose {
                output::note(&format!("step {number} is done"));
            }
        };
        let plan = (name.as_str(), "PDDL");
        let report =
            pull(&mut interpreter, plan, &mut writer, motion, &mut step).map_err(refused)?;
        if self.json {
            output::json(&report)?;
        } else {
            let mut out = io::stdout().lock();
            if let Some(reason) = &report.reason {
                writeln!(out, "{}: {reason}", report.outcome)?;
            }
            let (steps, commands) = (report.steps, report.commands);
            writeln!(
                out,
                "{steps} steps, {commands} commands, {:.3} s of motion",
                report.motion_s
            )?;
        }
        Ok(match report.code {
            0 => Exit::Done,
            100 => Exit::Aborted,
            _ => Exit::Refused,
        })
    }
}

fn execute<const N: usize>(
    command: &PlanRun,
    robot: &Robot,
    session: Option<Session>,
    database: &Database,
    writer: Writer,
) -> Result<Exit, Failure> {
    let mut motion = ArmMotion::<N>::new(robot, session)?;
    let Some(path) = command.plan.as_ref().filter(|_| !command.resume) else {
        return command.kitting(None, database, writer, &mut motion);
    };
    let source = world_file::read(path)?;
    if is_pddl(&source) {
        return command.pddl(path, database, writer, &mut motion);
    }
    command.kitting(Some(&source), database, writer, &mut motion)
}

/// A PDDL plan starts, after comments, with a parenthesis or a time.
fn is_pddl(source: &str) -> bool {
    let code = |line: &&str| !line.is_empty() && !line.starts_with(';');
    let first = source.lines().map(str::trim).find(code).unwrap_or_default();
    first.starts_with('(')
        || first
            .split_once(':')
            .is_some_and(|(time, _)| time.trim().parse::<f64>().is_ok())
}
