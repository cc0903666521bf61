//! A controller that pulls a plan through the interface and has it executed.

use crcl::Command;

use super::{Code, CommandSink, PlanInterpreter};
use crate::PlanError;
use crate::pddl::{PlanStep, read_plan};
use crate::run::{
    Act, Batch, Counters, Delivery, Event, Execution, Motion, NextStep, Outcome, PlanRunReport,
    Policy, Request, RobotOptions, Run, RunOutcome, State, Step, Steps, Tool, place_arm,
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

/// What a plan is executed with: the world, the interface to the arm, and options.
pub struct Pull<'a> {
    /// The controller's connection.
    pub writer: Writer,
    /// What moves the arm.
    pub motion: &'a mut dyn Motion,
    /// How robot statements become commands.
    pub robot: RobotOptions,
    /// What to do on failure.
    pub policy: Policy,
}

/// Opens a plan, pulls it step by step, has each step's motion executed, commits its effects
/// together with the state of the run, and closes the plan. For a run that goes on the interpreter
/// must begin with the step that was under way; the arm is first brought back to where the world
/// has it.
///
/// # Errors
/// [`PlanError`] of the database; errors of the plan are in the report.
pub fn pull(
    interpreter: &mut dyn PlanInterpreter,
    run: PulledRun,
    place: Pull<'_>,
    observer: &mut dyn FnMut(&Event),
) -> Result<PlanRunReport, PlanError> {
    let Pull {
        mut writer,
        motion,
        robot,
        policy,
    } = place;
    let resumed = run.id.is_some();
    let mut model = writer.model()?;
    if !resumed {
        place_arm(&mut writer, motion, &mut model)?;
    }
    let mut opening = Collector::default();
    let mut code = interpreter.init();
    if code == Code::Ok {
        code = interpreter.open_plan(&run.file, "PDDL", &mut opening);
    }
    if code != Code::Ok {
        let reason = interpreter.last_error().to_owned();
        interpreter.exit();
        return Ok(unopened(code, reason, run.state.counters));
    }
    let mut execution = Execution {
        run: Run {
            id: run.begin(&mut writer)?,
            resumed,
            state: run.state,
            model,
            warnings: Vec::new(),
        },
        writer,
        motion,
        robot,
        policy,
    };
    let mut steps = PulledSteps {
        interpreter,
        actions: read_plan(&run.source).unwrap_or_default(),
        opening: opening.batch,
        closing: None,
    };
    let report = execution.run(&mut steps, observer);
    steps.interpreter.close_plan();
    steps.interpreter.exit();
    report
}

/// The report of a plan that cannot be opened; nothing has moved.
fn unopened(code: Code, reason: String, counters: Counters) -> PlanRunReport {
    PlanRunReport {
        outcome: RunOutcome::Failed,
        code: code as i64,
        reason: Some(reason),
        counters,
        wall_s: 0.0,
        warnings: Vec::new(),
    }
}

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

/// The steps that an interpreter gives.
struct PulledSteps<'a> {
    interpreter: &'a mut dyn PlanInterpreter,
    /// The plan's actions, for people.
    actions: Vec<PlanStep>,
    opening: Batch,
    /// What the interpreter gave with its last code.
    closing: Option<Batch>,
}

impl Steps for PulledSteps<'_> {
    /// The interpreter reads the database itself.
    fn refresh(&mut self, _model: &mut Model) -> Result<(), PlanError> {
        Ok(())
    }

    fn opening(&self, _model: &Model, _resumed: bool) -> Batch {
        self.opening.clone()
    }

    fn next(
        &mut self,
        state: &State,
        model: &Model,
        _motion: &mut dyn Motion,
    ) -> Result<NextStep, Outcome> {
        let mut collector = Collector::default();
        let code = self.interpreter.execute(&mut collector);
        let batch = collector.batch;
        let mut next = state.clone();
        let act = match code {
            Code::Ok => {
                count(&mut next.counters, model, &batch);
                Act::Motion(batch)
            }
            code => {
                self.closing = Some(batch).filter(|batch| !batch.commands.is_empty());
                if code != Code::EndOfPlan {
                    let reason = self.interpreter.last_error().to_owned();
                    let code = code as i64;
                    return Err(Outcome::Failed { code, reason });
                }
                Act::End
            }
        };
        let number = state.counters.statements + 1;
        let action = self.actions.get(number - 1);
        let text = action.map(ToString::to_string).unwrap_or_default();
        Ok(NextStep {
            name: action.map_or_else(String::new, |action| action.name.clone()),
            line: action.map_or(0, |action| action.line),
            mark: format!("step {number}, ({text})"),
            step: Step {
                name: "action",
                span: crate::kitting::ast::Span::default(),
                act,
                changes: Vec::new(),
                state: next,
                warning: None,
            },
        })
    }

    fn errand(&mut self, _model: &Model, _request: &Request) -> Result<Delivery, String> {
        Err("an interpreter behind the interface asks for no errands".to_owned())
    }

    fn closing(&mut self, reason: i64) -> Batch {
        self.closing.take().unwrap_or_else(|| {
            let mut batch = Batch::default();
            batch.push(Command::EndCanon { reason });
            batch
        })
    }

    fn motion_failed(&self) -> i64 {
        Outcome::PULLED_MOTION
    }
}

/// Counts a step and what it does to a world.
fn count(counters: &mut Counters, before: &Model, batch: &Batch) {
    counters.statements += 1;
    counters.commands += batch.commands.len();
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
