//! The controller of kitting plans: interprets one step at a time and has it executed.

use std::collections::BTreeMap;

use crcl::Command;
use serde::Serialize;

use super::batch::{Batch, Request};
use super::execution::{Execution, NextStep, Policy, Run, Steps, place_arm};
use super::factotum::{Delivery, Factotum, Stock};
use super::machine::Machine;
use super::motion::Motion;
use super::order::{Foresight, Written};
use super::preparation::{parameters, prepare};
use super::program::Program;
use super::report::{Event, PlanRunReport};
use super::robot::RobotOptions;
use super::state::{Outcome, State};
use crate::PlanError;
use crate::kitting::read;
use crate::world::{Model, Reader, StoredRun, Writer};

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

/// Executes a plan: asks the interpreter for one step at a time, has it executed, and commits the
/// motion's effect together with the state of the plan.
pub struct Controller<'a> {
    steps: KittingSteps<'a>,
    // Its writer is closed after the reader of the steps, so that it leaves one file.
    execution: Execution<'a>,
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
        place_arm(&mut cell.writer, cell.motion, &mut model)?;
        let machine = Machine {
            program: &program,
            model: &model,
            options: &options.robot,
        };
        let state = machine.start(&values)?;
        let id = cell.writer.begin_run(&StoredRun {
            id: 0,
            plan: program.plan.about("PlanId").to_owned(),
            source: source.to_owned(),
            parameters: json(given)?,
            stock: json(stock)?,
            state: state.to_json()?,
            outcome: None,
            under_way: None,
        })?;
        let run = Run {
            id,
            resumed: false,
            state,
            model,
            warnings,
        };
        Ok(Self::new(cell, run, program, source.to_owned(), options))
    }

    /// Prepares to resume the last run of the database: one that was killed or interrupted, or in
    /// which the arm or the factotum failed.
    ///
    /// # Errors
    /// [`PlanError::Resume`] when there is none, or it has ended.
    pub fn resume(cell: Cell<'a>, options: RunOptions) -> Result<Self, PlanError> {
        let missing = || PlanError::Resume("the database knows no run".into());
        let stored = cell.writer.last_run()?.ok_or_else(missing)?;
        let run = Run {
            id: stored.id,
            resumed: true,
            state: State::reopened(&stored)?,
            model: cell.reader.model()?,
            warnings: Vec::new(),
        };
        let program = Program::new(read(&stored.source).plan);
        Ok(Self::new(cell, run, program, stored.source, options))
    }

    fn new(
        cell: Cell<'a>,
        run: Run,
        program: Program,
        source: String,
        options: RunOptions,
    ) -> Self {
        let RunOptions {
            robot,
            policy,
            choose_order,
        } = options;
        Self {
            steps: KittingSteps {
                reader: cell.reader,
                factotum: cell.factotum,
                program,
                source,
                robot: robot.clone(),
                choose_order,
            },
            execution: Execution {
                writer: cell.writer,
                motion: cell.motion,
                robot,
                policy,
                run,
            },
        }
    }

    /// The state of the plan.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.execution.run.state
    }

    /// The world as the controller knows it.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.execution.run.model
    }

    /// Executes the plan to its end, or until the operator stops the arm.
    ///
    /// # Errors
    /// [`PlanError`] of the database; errors of the plan are in the report.
    pub fn run(&mut self, observer: &mut dyn FnMut(&Event)) -> Result<PlanRunReport, PlanError> {
        self.execution.run(&mut self.steps, observer)
    }
}

/// The steps of a kitting plan.
struct KittingSteps<'a> {
    reader: Reader,
    factotum: &'a mut dyn Factotum,
    program: Program,
    source: String,
    robot: RobotOptions,
    choose_order: bool,
}

impl Steps for KittingSteps<'_> {
    /// Late binding: the interpreter reads the world before each step.
    fn refresh(&mut self, model: &mut Model) -> Result<(), PlanError> {
        if self.reader.revision()? != model.revision {
            *model = self.reader.model()?;
        }
        Ok(())
    }

    fn opening(&self, model: &Model, resumed: bool) -> Batch {
        let mut batch = Batch {
            commands: self.robot.opening(),
            ..Batch::default()
        };
        if !resumed && model.held().is_none() && model.effector().is_some() {
            batch.push(Command::OpenGripper);
        }
        batch
    }

    fn next(
        &mut self,
        state: &State,
        model: &Model,
        motion: &mut dyn Motion,
    ) -> Result<NextStep, Outcome> {
        let options = &self.robot;
        let machine = Machine {
            program: &self.program,
            model,
            options,
        };
        let step = if self.choose_order {
            let factotum = &*self.factotum;
            let mut foresight = Foresight {
                motion,
                factotum,
                options,
            };
            machine.step(state, &mut foresight)
        } else {
            machine.step(state, &mut Written)
        };
        let step = step.map_err(|error| Outcome::Failed {
            code: Outcome::STATEMENT,
            reason: error.to_string(),
        })?;
        let line = crate::finding::position(&self.source, step.span.start).0;
        Ok(NextStep {
            name: step.name.to_owned(),
            line,
            mark: format!("{} (line {line})", step.name),
            step,
        })
    }

    fn errand(&mut self, model: &Model, request: &Request) -> Result<Delivery, String> {
        self.factotum.perform(model, &self.program.plan, request)
    }

    fn motion_failed(&self) -> i64 {
        Outcome::MOTION
    }
}
