//! A controller that pulls a plan through the interface and has it executed.

use std::time::Instant;

use crcl::Command;

use super::{Code, CommandSink, PlanInterpreter};
use crate::PlanError;
use crate::pddl::read_plan;
use crate::run::{
    Batch, Counters, Motion, MotionFailure, Outcome, PlanRunReport, Robot, RobotOptions, State,
    Tool, situation,
};
use crate::world::{Change, Class, Model, StoredRun, Writer};

/// A run of a plan: a new one, or one that is resumed.
#[derive(Clone, Debug)]
pub struct PulledRun {
    file: String,
    source: String,
    /// Its number in the database, if it is resumed.
    id: Option<i64>,
    state: State,
}

impl PulledRun {
    /// A new run of the plan in `file`, whose text is kept in the database.
    #[must_use]
    pub fn new(file: &str, source: &str) -> Self {
        Self {
            file: file.to_owned(),
            source: source.to_owned(),
            id: None,
            state: State::default(),
        }
    }

    /// Resumes the run of the database: it was killed or interrupted, or its motion failed.
    ///
    /// # Errors
    /// [`PlanError::Resume`] when it has ended.
    pub fn resume(stored: StoredRun) -> Result<Self, PlanError> {
        let state = State::reopened(&stored)?;
        Ok(Self {
            file: stored.plan,
            source: stored.source,
            id: Some(stored.id),
            state,
        })
    }

    /// Text of the plan.
    #[must_use]
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Steps executed so far.
    #[must_use]
    pub fn done(&self) -> usize {
        self.state.counters.statements
    }

    fn begin(&self, writer: &mut Writer) -> Result<i64, PlanError> {
        if let Some(id) = self.id {
            return Ok(id);
        }
        writer.begin_run(&StoredRun {
            id: 0,
            plan: self.file.clone(),
            source: self.source.clone(),
            parameters: "{}".into(),
            stock: "{}".into(),
            state: self.state.to_json()?,
            outcome: None,
            under_way: None,
        })
    }
}

/// Reason given to EndCanon when the motion failed.
const MOTION_FAILED: i64 = 100;

/// Collects the commands of one step.
#[derive(Default)]
struct Collector {
    batch: Batch,
}

impl CommandSink for Collector {
    fn command(&mut self, command: Command) -> bool {
        self.batch.push(command);
        true
    }

    fn tool(&mut self, tool: Option<Tool>) {
        self.batch.tool(tool);
    }

    fn effects(&mut self, changes: Vec<Change>) {
        self.batch.changes = changes;
    }
}

/// Why a plan was not pulled to its end.
enum Trouble {
    Motion(MotionFailure),
    World(PlanError),
}

impl From<MotionFailure> for Trouble {
    fn from(failure: MotionFailure) -> Self {
        Self::Motion(failure)
    }
}

impl From<PlanError> for Trouble {
    fn from(error: PlanError) -> Self {
        Self::World(error)
    }
}

/// What a plan is executed with: the world, the interface to the arm, and options.
pub struct Pull<'a> {
    /// The controller's connection.
    pub writer: &'a mut Writer,
    /// What moves the arm.
    pub motion: &'a mut dyn Motion,
    /// How robot statements become commands.
    pub options: &'a RobotOptions,
}

/// Opens a plan, pulls it step by step, has each step's motion executed, commits its effects
/// together with the state of the run, and closes the plan. `observer` gets the number of each
/// finished step. For a resumed run the interpreter must begin with the unfinished step; the arm is
/// first moved back to its place in the world.
///
/// # Errors
/// [`PlanError`] of the database; errors of the plan are in the report.
pub fn pull(
    interpreter: &mut dyn PlanInterpreter,
    run: PulledRun,
    place: Pull<'_>,
    observer: &mut dyn FnMut(usize),
) -> Result<PlanRunReport, PlanError> {
    let began = Instant::now();
    let resumed = run.id.is_some();
    if let Some(arm) = place.motion.arm().filter(|_| !resumed) {
        let changes = place.writer.model()?.arm_changes(&arm)?;
        place.writer.commit(&changes, None)?;
    }
    let mut opening = Collector::default();
    let mut code = interpreter.init();
    if code == Code::Ok {
        code = interpreter.open_plan(&run.file, "PDDL", &mut opening);
    }
    if code != Code::Ok {
        let reason = interpreter.last_error().to_owned();
        interpreter.exit();
        let end = End::Over(failed(code as i64, reason));
        return Ok(end.report(run.state.counters, began));
    }
    let steps = read_plan(&run.source).unwrap_or_default();
    let mut puller = Puller {
        id: run.begin(place.writer)?,
        actions: steps.iter().map(ToString::to_string).collect(),
        place,
        state: run.state,
    };
    let end = match puller.run(interpreter, (opening.batch, resumed), observer) {
        Ok(Code::EndOfPlan) => Ok(End::Over(Outcome::Stopped)),
        Ok(code) => {
            let reason = interpreter.last_error().to_owned();
            Ok(End::Over(failed(code as i64, reason)))
        }
        Err(Trouble::Motion(failure)) => Ok(puller.after(&failure)),
        Err(Trouble::World(error)) => Err(error),
    };
    interpreter.close_plan();
    interpreter.exit();
    let end = end?;
    if let End::Over(outcome) = &end {
        puller.save(&[], Some(outcome))?;
    }
    Ok(end.report(puller.state.counters, began))
}

fn failed(code: i64, reason: String) -> Outcome {
    Outcome::Failed { code, reason }
}

/// How a run ended.
enum End {
    Over(Outcome),
    /// The operator stopped it; it can be resumed.
    Interrupted(String),
}

impl End {
    fn report(self, counters: Counters, began: Instant) -> PlanRunReport {
        let (outcome, code, reason) = match self {
            Self::Over(Outcome::Stopped) => ("stopped", 0, None),
            Self::Over(Outcome::Failed { code, reason }) => ("failed", code, Some(reason)),
            Self::Interrupted(reason) => ("interrupted", 0, Some(reason)),
        };
        PlanRunReport {
            outcome,
            code,
            reason,
            counters,
            wall_s: began.elapsed().as_secs_f64(),
            warnings: Vec::new(),
        }
    }
}

/// A plan that is being pulled.
struct Puller<'a> {
    id: i64,
    /// The plan's actions as texts, for people.
    actions: Vec<String>,
    place: Pull<'a>,
    state: State,
}

impl Puller<'_> {
    /// Pulls steps until the interpreter has no more; returns its last code.
    fn run(
        &mut self,
        interpreter: &mut dyn PlanInterpreter,
        (opening, resumed): (Batch, bool),
        observer: &mut dyn FnMut(usize),
    ) -> Result<Code, Trouble> {
        self.perform(&opening)?;
        if resumed {
            self.bring_back()?;
        }
        loop {
            let mut collector = Collector::default();
            let code = interpreter.execute(&mut collector);
            if code != Code::Ok {
                let ended = self.perform(&collector.batch);
                return if code == Code::EndOfPlan {
                    ended.map(|()| code)
                } else {
                    Ok(code)
                };
            }
            self.step(&collector.batch)?;
            observer(self.state.counters.statements);
        }
    }

    fn bring_back(&mut self) -> Result<(), Trouble> {
        let Some(arm) = self.place.motion.arm() else {
            return Ok(());
        };
        let model = &self.place.writer.model()?;
        let options = self.place.options;
        match (Robot { model, options }).way_back(&arm)? {
            Some(batch) => self.perform(&batch),
            None => Ok(()),
        }
    }

    /// Executes the commands of a step, then commits its effects with the state of the run.
    fn step(&mut self, batch: &Batch) -> Result<(), Trouble> {
        let number = self.state.counters.statements + 1;
        let before = self.place.writer.model()?;
        let action = self.actions.get(number - 1).map_or("", String::as_str);
        let mark = format!("step {number}, ({action}),");
        self.place.writer.mark_under_way(self.id, &mark)?;
        self.perform(batch)?;
        count(&mut self.state.counters, &before, batch);
        self.state.counters.statements = number;
        Ok(self.save(&batch.changes, None)?)
    }

    fn perform(&mut self, batch: &Batch) -> Result<(), Trouble> {
        if batch.commands.is_empty() {
            return Ok(());
        }
        let start = situation(&self.place.writer.model()?)?;
        let seconds = self.place.motion.execute(&start, batch)?;
        self.state.counters.motion_s += seconds;
        self.state.counters.commands += batch.commands.len();
        Ok(())
    }

    /// The result of the run after a failure of the motion. Unless the operator stopped it, the arm
    /// gets EndCanon.
    fn after(&mut self, failure: &MotionFailure) -> End {
        let number = self.state.counters.statements + 1;
        let reason = format!("step {number}: {failure}");
        if failure.stopped {
            return End::Interrupted(reason);
        }
        let (mut end, code) = (Batch::default(), MOTION_FAILED);
        end.push(Command::EndCanon { reason: code });
        // The motion has failed already; this failure is not reported.
        let _ = self.perform(&end);
        End::Over(failed(code, reason))
    }

    fn save(&mut self, changes: &[Change], outcome: Option<&Outcome>) -> Result<(), PlanError> {
        let (state, outcome) = (
            self.state.to_json()?,
            outcome.map(Outcome::to_json).transpose()?,
        );
        let run = (self.id, state.as_str(), outcome.as_deref());
        self.place.writer.commit(changes, Some(run))?;
        Ok(())
    }
}

/// Counts what a step did to a world.
fn count(counters: &mut Counters, before: &Model, batch: &Batch) {
    let attached = batch.tools.iter().filter(|(_, tool)| tool.is_some());
    counters.end_effector_changes += attached.count();
    let effector = before.effector().map(|effector| effector.id);
    let held = before.held().map(|held| held.id);
    for change in &batch.changes {
        let Change::Place { object, location } = change else {
            continue;
        };
        if Some(location.reference) == effector {
            counters.pick_ups += 1;
        } else if Some(*object) == held {
            counters.put_downs += 1;
            let class = |id| before.object(id).map(|object| object.class).ok();
            let boxed = class(location.reference).is_some_and(Class::is_container);
            counters.kits += usize::from(boxed && class(*object) == Some(Class::KitInstance));
        }
    }
}
