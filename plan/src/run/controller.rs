//! The workstation controller: the only writer of the world.

use std::collections::BTreeMap;
use std::time::Instant;

use crcl::Command;
use serde::Serialize;

use super::batch::{Batch, Request};
use super::factotum::{Factotum, Stock};
use super::machine::{Act, Counters, Machine, Outcome, State, Step};
use super::motion::Motion;
use super::order::Foresight;
use super::program::Program;
use super::robot::{Robot, RobotOptions, situation};
use super::value::Value;
use crate::PlanError;
use crate::finding::{Severity, has_errors};
use crate::kitting::types::Type;
use crate::kitting::{Reading, check, read};
use crate::world::{Change, Model, Reader, StoredRun, Writer};

/// What to do when a motion or an errand fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// End the plan with EndCanon and a positive reason.
    Stop,
    /// Clear the failure, bring the arm back to where the step began, and try the step again, at
    /// most this often for one step.
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

/// Something that happened; for progress displays.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A statement was executed and committed.
    Statement {
        /// Its name.
        name: &'static str,
        /// Line of the plan, from 1.
        line: usize,
        /// Statements so far.
        number: usize,
        /// Time of its motion or errand (s).
        seconds: f64,
    },
    /// The end effector of this name is now on the arm.
    EndEffector(String),
    /// This many kits are finished.
    Kit(usize),
    /// Something odd.
    Warning(String),
    /// A motion or errand failed and is tried again.
    Retry(String),
}

/// How a run went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// `stopped` (by Stop) or `failed`.
    pub outcome: &'static str,
    /// Reason given to EndCanon: 0, or positive.
    pub code: i64,
    /// In words; none when all went well.
    pub reason: Option<String>,
    /// What was done.
    #[serde(flatten)]
    pub counters: Counters,
    /// Time that the run took (s).
    pub wall_s: f64,
    /// Oddities of the plan and of the run.
    pub warnings: Vec<String>,
}

/// Executes a plan: asks the interpreter for one step at a time, has it executed, and commits the
/// motion's effect together with the state of the plan.
pub struct Controller<'a> {
    writer: Writer,
    reader: Reader,
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

/// Reads and checks a plan against a world.
///
/// # Errors
/// [`PlanError::Invalid`] when the plan has errors.
pub fn prepare(source: &str, model: &Model) -> Result<(Program, Vec<String>), PlanError> {
    let Reading { plan, mut findings } = read(source);
    if !has_errors(&findings) {
        findings.extend(check(&plan, Some(model)));
    }
    let errors: Vec<_> = findings
        .iter()
        .filter(|f| f.severity == Severity::Error)
        .collect();
    if let Some(first) = errors.first() {
        let (line, column) = first.position(source);
        let first = format!("{} (line {line}, column {column})", first.message);
        return Err(PlanError::Invalid {
            count: errors.len(),
            first,
        });
    }
    let warnings = findings.iter().filter(|f| f.severity == Severity::Warning);
    let warnings = warnings.map(|f| f.message.clone()).collect();
    Ok((Program::new(plan), warnings))
}

/// Values of a plan's parameters from texts.
///
/// # Errors
/// [`PlanError::Parameter`] for one that is missing, unknown or of the wrong type.
pub fn parameters(
    program: &Program,
    given: &BTreeMap<String, String>,
) -> Result<BTreeMap<String, Value>, PlanError> {
    let fail = |name: &str, why: String| PlanError::Parameter {
        name: name.to_owned(),
        why,
    };
    let mut values = BTreeMap::new();
    for parameter in &program.plan.parameters {
        let name = &parameter.name;
        let text = given
            .get(name)
            .ok_or_else(|| fail(name, "it has no value".into()))?;
        let kind = Type::from_name(&parameter.class).unwrap_or(Type::Text);
        let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
        let value = match (kind, number) {
            (Type::Number { whole, least }, Some(number))
                if (!whole || number.fract() == 0.0)
                    && least.is_none_or(|least| number >= least as f64) =>
            {
                Value::Number(number)
            }
            (Type::Truth, _) if text == "true" || text == "false" => Value::Truth(text == "true"),
            (Type::Text, _) => Value::Text(text.clone()),
            _ => {
                return Err(fail(
                    name,
                    format!("expected {}, got {text}", kind.describe()),
                ));
            }
        };
        values.insert(name.clone(), value);
    }
    match given.keys().find(|name| !values.contains_key(*name)) {
        Some(unknown) => Err(fail(unknown, "the plan has no such parameter".into())),
        None => Ok(values),
    }
}

fn json<T: Serialize>(value: &T) -> Result<String, PlanError> {
    serde_json::to_string(value).map_err(|error| PlanError::Resume(error.to_string()))
}

impl<'a> Controller<'a> {
    /// Prepares a new run of a plan with the given id (or any, if none is given).
    ///
    /// # Errors
    /// [`PlanError`] when plan, parameters or world do not fit; nothing has moved then.
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
            state: json(&state)?,
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
        })
    }

    /// Prepares to go on with the last run of the database, after it was killed.
    ///
    /// # Errors
    /// [`PlanError::Resume`] when there is none, or it has ended.
    pub fn resume(cell: Cell<'a>, options: RunOptions) -> Result<Self, PlanError> {
        let missing = || PlanError::Resume("the database knows no run".into());
        let stored = cell.writer.last_run()?.ok_or_else(missing)?;
        if let Some(outcome) = &stored.outcome {
            return Err(PlanError::Resume(format!(
                "the last run has ended: {outcome}"
            )));
        }
        let model = cell.reader.model()?;
        let program = Program::new(read(&stored.source).plan);
        let state: State = serde_json::from_str(&stored.state)
            .map_err(|error| PlanError::Resume(error.to_string()))?;
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

    /// Executes the plan to its end.
    ///
    /// # Errors
    /// [`PlanError`] of the database; what goes wrong in the plan is in the report.
    pub fn run(&mut self, observer: &mut dyn FnMut(&Event)) -> Result<Report, PlanError> {
        let began = Instant::now();
        if let Err(reason) = self.open() {
            self.end(Outcome::Failed { code: 3, reason })?;
        }
        while self.state.outcome.is_none() {
            self.step(observer)?;
        }
        let outcome = self.state.outcome.clone().unwrap_or(Outcome::Stopped);
        let (code, reason) = match outcome {
            Outcome::Stopped => (0, None),
            Outcome::Failed { code, reason } => (code, Some(reason)),
        };
        let mut closing = Batch::default();
        closing.push(Command::EndCanon { reason: code });
        if let Err(failure) = self.motion.execute(&situation(&self.model)?, &closing) {
            self.warnings.push(format!("EndCanon: {failure}"));
        }
        Ok(Report {
            outcome: if code == 0 { "stopped" } else { "failed" },
            code,
            reason,
            counters: self.state.counters.clone(),
            wall_s: began.elapsed().as_secs_f64(),
            warnings: self.warnings.clone(),
        })
    }

    /// InitCanon and the units, and the arm where the model has it.
    fn open(&mut self) -> Result<(), String> {
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

    fn move_only(&mut self, batch: &Batch) -> Result<(), String> {
        let start = situation(&self.model).map_err(|error| error.to_string())?;
        let seconds = self
            .motion
            .execute(&start, batch)
            .map_err(|failure| failure.to_string())?;
        self.state.counters.motion_s += seconds;
        Ok(())
    }

    /// Brings the arm from wherever it is to where the model has it: up, across, down. The gripper
    /// is left alone: a step that was under way is executed again from its beginning, and all steps
    /// come to the same end when some of their motion has been made before.
    fn bring_back(&mut self) -> Result<(), String> {
        let Some(arm) = self.motion.arm() else {
            return Ok(());
        };
        let text = |error: PlanError| error.to_string();
        let wanted = situation(&self.model).map_err(text)?;
        let from_tip = wanted
            .tool
            .as_ref()
            .map(|tool| tool.arm_from_tip())
            .unwrap_or_default();
        let (here, there) = (arm * from_tip, wanted.arm * from_tip);
        let difference = here.inv_mul(&there);
        if difference.translation.vector.norm() < 1e-3 && difference.rotation.angle() < 1e-2 {
            return Ok(());
        }
        let robot = Robot {
            model: &self.model,
            options: &self.options.robot,
        };
        let height = robot.travel_height().map_err(text)?;
        let raised = |pose: &nalgebra::Isometry3<f64>| {
            let mut raised = *pose;
            raised.translation.z = raised.translation.z.max(height);
            raised
        };
        let mut batch = Batch::default();
        batch.straight(&raised(&here));
        batch.straight(&raised(&there));
        batch.straight(&there);
        self.move_only(&batch)
    }

    #[allow(
        clippy::too_many_lines,
        reason = "the order of one step is its meaning"
    )]
    fn step(&mut self, observer: &mut dyn FnMut(&Event)) -> Result<(), PlanError> {
        // Late binding: the interpreter reads the world before each step.
        if self.reader.revision()? != self.model.revision {
            self.model = self.reader.model()?;
        }
        let step = match self.interpret() {
            Ok(step) => step,
            Err(error) => {
                let reason = error.to_string();
                return self.end(Outcome::Failed { code: 2, reason });
            }
        };
        let Step {
            name,
            span,
            act,
            mut changes,
            mut state,
            warning,
        } = step;
        let line = crate::finding::position(&self.source, span.start).0;
        let seconds = match act {
            Act::Nothing => 0.0,
            Act::End | Act::Exhausted => {
                let outcome = state.outcome.take().unwrap_or(Outcome::Stopped);
                self.state = state;
                return self.end(outcome);
            }
            Act::Motion(batch) => {
                let mark = format!("{name} (line {line})");
                let seconds = match self.execute(&mark, &batch, observer)? {
                    Ok(seconds) => seconds,
                    Err(reason) => {
                        let reason = format!("{mark}: {reason}");
                        return self.end(Outcome::Failed { code: 3, reason });
                    }
                };
                state.counters.motion_s += seconds;
                for (_, tool) in &batch.tools {
                    tool.iter()
                        .for_each(|tool| observer(&Event::EndEffector(tool.name.clone())));
                }
                changes.extend(batch.changes);
                seconds
            }
            Act::Errand(request) => match self.errand(&request, observer) {
                Ok(delivery) => {
                    let value = delivery.object.map_or(Value::Null, Value::Object);
                    state.bindings.insert(request.variable, value);
                    changes.extend(delivery.changes);
                    delivery.seconds
                }
                Err(reason) => {
                    let reason = format!("{name} (line {line}): {reason}");
                    return self.end(Outcome::Failed { code: 4, reason });
                }
            },
        };
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

    /// Changes of the world and state of the plan, together or not at all.
    fn commit(&mut self, changes: &[Change], state: State) -> Result<(), PlanError> {
        self.model.apply_all(changes)?;
        let outcome = state.outcome.as_ref().map(json).transpose()?;
        let run = (self.run, json(&state)?, outcome);
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
        batch: &Batch,
        observer: &mut dyn FnMut(&Event),
    ) -> Result<Result<f64, String>, PlanError> {
        self.writer.mark_under_way(self.run, mark)?;
        let mut attempt = 0;
        loop {
            let failure = match self.motion.execute(&situation(&self.model)?, batch) {
                Ok(seconds) => return Ok(Ok(seconds)),
                Err(failure) => failure.to_string(),
            };
            attempt += 1;
            let again =
                matches!(self.options.policy, Policy::Repair { attempts } if attempt <= attempts);
            if !again || !self.motion.recover() {
                return Ok(Err(failure));
            }
            observer(&Event::Retry(format!("{mark}: {failure}")));
            self.warnings
                .push(format!("{mark}: {failure}; tried again"));
            self.resumed = true;
            if let Err(failure) = self.open() {
                return Ok(Err(failure));
            }
        }
    }

    fn errand(
        &mut self,
        request: &Request,
        observer: &mut dyn FnMut(&Event),
    ) -> Result<super::factotum::Delivery, String> {
        let mut attempt = 0;
        loop {
            let plan = &self.program.plan;
            match self.factotum.perform(&self.model, plan, request) {
                Ok(delivery) => return Ok(delivery),
                Err(reason) => {
                    attempt += 1;
                    let again = matches!(self.options.policy, Policy::Repair { attempts } if attempt <= attempts);
                    if !again {
                        return Err(reason);
                    }
                    observer(&Event::Retry(reason));
                }
            }
        }
    }
}
