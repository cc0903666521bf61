//! The workstation controller: the only writer of the world.

use std::collections::BTreeMap;
use std::time::Instant;

use crcl::Command;
use serde::Serialize;

use super::batch::{Batch, Request};
use super::factotum::{Factotum, Stock};
use super::machine::Machine;
use super::motion::{Motion, MotionFailure};
use super::order::Foresight;
use super::preparation::{parameters, prepare};
use super::program::Program;
use super::report::{Event, PlanRunReport};
use super::robot::{Robot, RobotOptions, situation};
use super::state::{Act, Outcome, State, Step};
use super::value::Value;
use crate::PlanError;
use crate::kitting::read;
use crate::world::{Change, Model, Reader, StoredRun, Writer};

/// What to do when a motion or a request to the factotum fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// End the plan with EndCanon and a positive reason.
    Stop,
    /// Clear the failure, move the arm back to where the step began, and try the step again, at
    /// most this often per step.
    Repair {
        /// Attempts for one step.
        attempts: usize,
    },
}

/// How a run is made.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// How robot statements become commands.
    pub robot: RobotOptions,
    /// What to do on failure.
    pub policy: Policy,
    /// Whether the executor chooses orders by predicted time; otherwise the written order.
    pub choose_order: bool,
}

impl Default for RunOptions {
    fn default() -> Self {
        Self {
            robot: RobotOptions::default(),
            policy: Policy::Stop,
            choose_order: true,
        }
    }
}

/// Executes a plan: asks the interpreter for one step at a time, has it executed, and commits the
/// motion's effect together with the state of the plan.
pub struct Controller<'a> {
    // The writer is closed last, so that one file remains.
    reader: Reader,
    writer: Writer,
    motion: &'a mut dyn Motion,
    factotum: &'a mut dyn Factotum,
    options: RunOptions,
    program: Program,
    source: String,
    model: Model,
    state: State,
    run: i64,
    resumed: bool,
    warnings: Vec<String>,
    /// Why the run stops here and can be resumed: outcome, code, reason.
    left: Option<(&'static str, i64, String)>,
}

/// Result of a motion or a request to the factotum.
#[derive(Default)]
struct Done {
    changes: Vec<Change>,
    seconds: f64,
    /// A variable with its new value.
    binding: Option<(String, Value)>,
}

/// Why a step did not come to its end.
enum Trouble {
    /// The plan fails, with this code.
    Failed(i64, String),
    /// The operator stopped the arm.
    Stopped(String),
}

impl From<MotionFailure> for Trouble {
    fn from(failure: MotionFailure) -> Self {
        let text = failure.to_string();
        if failure.stopped {
            Self::Stopped(text)
        } else {
            Self::Failed(3, text)
        }
    }
}

/// The world's two connections and the two agents that act in it.
pub struct Cell<'a> {
    /// The controller's connection.
    pub writer: Writer,
    /// The interpreter's connection.
    pub reader: Reader,
    /// What moves the arm.
    pub motion: &'a mut dyn Motion,
    /// What brings and takes things.
    pub factotum: &'a mut dyn Factotum,
}

fn json<T: Serialize>(value: &T) -> Result<String, PlanError> {
    serde_json::to_string(value).map_err(|error| PlanError::Resume(error.to_string()))
}

impl<'a> Controller<'a> {
    /// Prepares a new run of a plan.
    ///
    /// # Errors
    /// [`PlanError`] when plan, parameters or world do not match; nothing has moved then.
    pub fn start(
        mut cell: Cell<'a>,
        source: &str,
        given: &BTreeMap<String, String>,
        stock: &Stock,
        options: RunOptions,
    ) -> Result<Self, PlanError> {
        let mut model = cell.reader.model()?;
        let (program, warnings) = prepare(source, &model)?;
        let values = parameters(&program, given)?;
        if let Some(arm) = cell.motion.arm() {
            let changes = model.arm_changes(&arm)?;
            model.revision = cell.writer.commit(&changes, None)?;
            model.apply_all(&changes)?;
        }
        situation(&model)?;
        let machine = Machine {
            program: &program,
            model: &model,
            options: &options.robot,
        };
        let state = machine.start(&values)?;
        let run = cell.writer.begin_run(&StoredRun {
            id: 0,
            plan: program.plan.about("PlanId").to_owned(),
            source: source.to_owned(),
            parameters: json(given)?,
            stock: json(stock)?,
            state: state.to_json()?,
            outcome: None,
            under_way: None,
        })?;
        let Cell {
            writer,
            reader,
            motion,
            factotum,
        } = cell;
        let source = source.to_owned();
        let resumed = false;
        Ok(Self {
            writer,
            reader,
            motion,
            factotum,
            options,
            program,
            source,
            model,
            state,
            run,
            resumed,
            warnings,
            left: None,
        })
    }

    /// Prepares to resume the last run of the database: one that was killed or interrupted, or in
    /// which the arm or the factotum failed.
    ///
    /// # Errors
    /// [`PlanError::Resume`] when there is none, or it has ended.
    pub fn resume(cell: Cell<'a>, options: RunOptions) -> Result<Self, PlanError> {
        let missing = || PlanError::Resume("the database knows no run".into());
        let stored = cell.writer.last_run()?.ok_or_else(missing)?;
        let state = State::reopened(&stored)?;
        let model = cell.reader.model()?;
        let program = Program::new(read(&stored.source).plan);
        let Cell {
            writer,
            reader,
            motion,
            factotum,
        } = cell;
        let (run, source, warnings) = (stored.id, stored.source, Vec::new());
        let resumed = true;
        Ok(Self {
            writer,
            reader,
            motion,
            factotum,
            options,
            program,
            source,
            model,
            state,
            run,
            resumed,
            warnings,
            left: None,
        })
    }

    /// The state of the plan.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The world as the controller knows it.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Executes the plan to its end, or until the operator stops the arm.
    ///
    /// # Errors
    /// [`PlanError`] of the database; what goes wrong in the plan is in the report.
    pub fn run(&mut self, observer: &mut dyn FnMut(&Event)) -> Result<PlanRunReport, PlanError> {
        let began = Instant::now();
        match self.open() {
            // If the arm cannot be moved back now, an operator may help, and the run is resumed
            // later.
            Err(failure) if self.resumed && !failure.stopped => {
                self.left = Some(("failed", 3, format!("at the start: {failure}")));
            }
            Err(failure) => self.give_up(failure.into(), "at the start")?,
            Ok(()) => {}
        }
        while self.state.outcome.is_none() && self.left.is_none() {
            self.step(observer)?;
        }
        let (outcome, code, reason) = match (&self.left, &self.state.outcome) {
            (Some((outcome, code, reason)), _) => (*outcome, *code, Some(reason.clone())),
            (None, Some(Outcome::Failed { code, reason })) => {
                ("failed", *code, Some(reason.clone()))
            }
            (None, _) => ("stopped", 0, None),
        };
        if outcome != "interrupted" {
            let mut closing = Batch::default();
            closing.push(Command::EndCanon { reason: code });
            if let Err(failure) = self.motion.execute(&situation(&self.model)?, &closing) {
                self.warnings.push(format!("EndCanon: {failure}"));
            }
        }
        Ok(PlanRunReport {
            outcome,
            code,
            reason,
            counters: self.state.counters.clone(),
            wall_s: began.elapsed().as_secs_f64(),
            warnings: self.warnings.clone(),
        })
    }

    /// InitCanon and the units; moves the arm to its place in the model.
    fn open(&mut self) -> Result<(), MotionFailure> {
        let mut batch = Batch::default();
        batch.push(Command::InitCanon);
        batch.push(Command::SetLengthUnits {
            unit: crcl::LengthUnit::Meter,
        });
        batch.push(Command::SetAngleUnits {
            unit: crcl::AngleUnit::Radian,
        });
        if let Some(percent) = self.options.robot.percent {
            batch.push(Command::SetRelativeSpeed { percent });
            batch.push(Command::SetRelativeAcceleration { percent });
        }
        if !self.resumed && self.model.held().is_none() && self.model.effector().is_some() {
            batch.push(Command::OpenGripper);
        }
        self.move_only(&batch)?;
        if self.resumed {
            self.bring_back()
        } else {
            Ok(())
        }
    }

    fn move_only(&mut self, batch: &Batch) -> Result<(), MotionFailure> {
        let start = situation(&self.model).map_err(unmoved)?;
        self.state.counters.motion_s += self.motion.execute(&start, batch)?;
        Ok(())
    }

    /// Moves the arm from anywhere to its place in the model. The gripper does not move: an
    /// unfinished step is executed again from its beginning, and all steps have the same result if
    /// part of their motion was made before.
    fn bring_back(&mut self) -> Result<(), MotionFailure> {
        let Some(arm) = self.motion.arm() else {
            return Ok(());
        };
        let robot = Robot {
            model: &self.model,
            options: &self.options.robot,
        };
        match robot.way_back(&arm).map_err(unmoved)? {
            Some(batch) => self.move_only(&batch),
            None => Ok(()),
        }
    }

    fn step(&mut self, observer: &mut dyn FnMut(&Event)) -> Result<(), PlanError> {
        // Late binding: the interpreter reads the world before each step.
        if self.reader.revision()? != self.model.revision {
            self.model = self.reader.model()?;
        }
        let mut step = match self.interpret() {
            Ok(step) => step,
            Err(error) => {
                let reason = error.to_string();
                return self.end(Outcome::Failed { code: 2, reason });
            }
        };
        let line = crate::finding::position(&self.source, step.span.start).0;
        let mark = format!("{} (line {line})", step.name);
        let done = match std::mem::replace(&mut step.act, Act::Nothing) {
            Act::Nothing => Ok(Done::default()),
            Act::End | Act::Exhausted => {
                let outcome = step.state.outcome.take().unwrap_or(Outcome::Stopped);
                self.state = step.state;
                return self.end(outcome);
            }
            Act::Motion(batch) => self.execute(&mark, batch, observer)?,
            Act::Errand(request) => self.errand(request, observer),
        };
        match done {
            Ok(done) => self.finish(step, done, line, observer),
            Err(trouble) => self.give_up(trouble, &mark),
        }
    }

    /// Commits what a step did and tells about it.
    fn finish(
        &mut self,
        step: Step,
        done: Done,
        line: usize,
        observer: &mut dyn FnMut(&Event),
    ) -> Result<(), PlanError> {
        let Step {
            name,
            mut changes,
            mut state,
            warning,
            ..
        } = step;
        let seconds = done.seconds;
        // A request to the factotum takes time, but does not move the arm.
        if done.binding.is_none() {
            state.counters.motion_s += seconds;
        }
        state.bindings.extend(done.binding);
        changes.extend(done.changes);
        let kits = self.state.counters.kits;
        self.commit(&changes, state)?;
        let number = self.state.counters.statements;
        observer(&Event::Statement {
            name,
            line,
            number,
            seconds,
        });
        if self.state.counters.kits > kits {
            observer(&Event::Kit(self.state.counters.kits));
        }
        self.warn(warning, observer);
        Ok(())
    }

    /// Ends the plan, or leaves it for a resume if the operator stopped it.
    fn give_up(&mut self, trouble: Trouble, mark: &str) -> Result<(), PlanError> {
        match trouble {
            Trouble::Failed(code, reason) => {
                let reason = format!("{mark}: {reason}");
                self.end(Outcome::Failed { code, reason })
            }
            Trouble::Stopped(reason) => {
                self.left = Some(("interrupted", 0, format!("{mark}: {reason}")));
                Ok(())
            }
        }
    }

    fn warn(&mut self, warning: Option<String>, observer: &mut dyn FnMut(&Event)) {
        let Some(warning) = warning else { return };
        observer(&Event::Warning(warning.clone()));
        if !self.warnings.contains(&warning) && self.warnings.len() < 100 {
            self.warnings.push(warning);
        }
    }

    fn interpret(&mut self) -> Result<Step, PlanError> {
        let options = &self.options.robot;
        let machine = Machine {
            program: &self.program,
            model: &self.model,
            options,
        };
        if self.options.choose_order {
            let factotum = &*self.factotum;
            machine.step(
                &self.state,
                &mut Foresight {
                    motion: self.motion,
                    factotum,
                    options,
                },
            )
        } else {
            machine.step(&self.state, &mut super::order::Written)
        }
    }

    /// Commits changes of the world and state of the plan, together or not at all.
    fn commit(&mut self, changes: &[Change], state: State) -> Result<(), PlanError> {
        self.model.apply_all(changes)?;
        let outcome = state.outcome.as_ref().map(Outcome::to_json).transpose()?;
        let run = (self.run, state.to_json()?, outcome);
        self.model.revision = self
            .writer
            .commit(changes, Some((run.0, run.1.as_str(), run.2.as_deref())))?;
        self.state = state;
        Ok(())
    }

    fn end(&mut self, outcome: Outcome) -> Result<(), PlanError> {
        let mut state = self.state.clone();
        state.outcome = Some(outcome);
        self.commit(&[], state)
    }

    /// Executes a batch, again as often as the policy says.
    fn execute(
        &mut self,
        mark: &str,
        batch: Batch,
        observer: &mut dyn FnMut(&Event),
    ) -> Result<Result<Done, Trouble>, PlanError> {
        self.writer.mark_under_way(self.run, mark)?;
        let mut attempt = 0;
        let seconds = loop {
            let failure = match self.motion.execute(&situation(&self.model)?, &batch) {
                Ok(seconds) => break seconds,
                Err(failure) => failure,
            };
            attempt += 1;
            let again = !failure.stopped && self.again(attempt);
            if !again || !self.motion.recover() {
                return Ok(Err(failure.into()));
            }
            observer(&Event::Retry(format!("{mark}: {failure}")));
            self.warnings
                .push(format!("{mark}: {failure}; tried again"));
            self.resumed = true;
            if let Err(failure) = self.open() {
                return Ok(Err(failure.into()));
            }
        };
        for (_, tool) in &batch.tools {
            tool.iter()
                .for_each(|tool| observer(&Event::EndEffector(tool.name.clone())));
        }
        Ok(Ok(Done {
            changes: batch.changes,
            seconds,
            binding: None,
        }))
    }

    /// Whether a failed step is tried again after this many attempts.
    fn again(&self, attempt: usize) -> bool {
        matches!(self.options.policy, Policy::Repair { attempts } if attempt <= attempts)
    }

    fn errand(
        &mut self,
        request: Request,
        observer: &mut dyn FnMut(&Event),
    ) -> Result<Done, Trouble> {
        let mut attempt = 0;
        loop {
            let plan = &self.program.plan;
            match self.factotum.perform(&self.model, plan, &request) {
                Ok(delivery) => {
                    let value = delivery.object.map_or(Value::Null, Value::Object);
                    return Ok(Done {
                        changes: delivery.changes,
                        seconds: delivery.seconds,
                        binding: Some((request.variable, value)),
                    });
                }
                Err(reason) => {
                    attempt += 1;
                    if !self.again(attempt) {
                        return Err(Trouble::Failed(4, reason));
                    }
                    observer(&Event::Retry(reason));
                }
            }
        }
    }
}

/// What keeps the arm from being moved at all.
fn unmoved(error: PlanError) -> MotionFailure {
    MotionFailure::new(0, error.to_string())
}
