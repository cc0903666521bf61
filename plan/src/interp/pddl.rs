//! The interpreter of PDDL plans.

use std::path::{Path, PathBuf};

use crcl::{AngleUnit, Command, LengthUnit};

use super::{Code, CommandSink, PlanInterpreter};
use crate::PlanError;
use crate::pddl::{ActionTable, PlanStep, read_plan};
use crate::run::RobotOptions;
use crate::world::{Model, Reader};

/// Largest file of a plan, bytes.
const LARGEST: u64 = 64 << 20;

/// The text of a plan, from a regular file: a pipe would wait for a writer, a device may never end.
fn plan_text(path: &Path) -> std::io::Result<String> {
    use std::io::{Error, ErrorKind, Read};
    let found = std::fs::metadata(path)?;
    if !found.is_file() || found.len() > LARGEST {
        let expected = format!("expected a regular file of at most {LARGEST} bytes");
        return Err(Error::new(ErrorKind::InvalidInput, expected));
    }
    let mut text = String::new();
    let file = std::fs::File::open(path)?;
    file.take(LARGEST).read_to_string(&mut text)?;
    Ok(text)
}

/// Interprets PDDL plans against a world database that it can only read.
#[derive(Debug)]
pub struct PddlInterpreter {
    world: PathBuf,
    table: ActionTable,
    options: RobotOptions,
    reader: Option<Reader>,
    plan: Option<(Vec<PlanStep>, usize)>,
    /// Text and first step of the plan that is opened next, for a resumed run.
    resumed: Option<(String, usize)>,
    error: String,
}

impl PddlInterpreter {
    /// An interpreter for the world database in `world`.
    #[must_use]
    pub fn new(world: &Path, table: ActionTable, options: RobotOptions) -> Self {
        let (world, error) = (world.to_owned(), String::new());
        Self {
            world,
            table,
            options,
            reader: None,
            plan: None,
            resumed: None,
            error,
        }
    }

    /// The plan that is opened next has this text, and its first steps have been executed already.
    pub fn go_on(&mut self, source: &str, done: usize) {
        self.resumed = Some((source.to_owned(), done));
    }

    /// Steps of the open plan and the position of the next.
    #[must_use]
    pub fn progress(&self) -> (usize, usize) {
        self.plan
            .as_ref()
            .map_or((0, 0), |(steps, next)| (steps.len(), *next))
    }

    fn fail(&mut self, code: Code, message: impl Into<String>) -> Code {
        self.error = message.into();
        code
    }

    fn step(&self, reader: &Reader, step: &PlanStep) -> Result<crate::run::Batch, PlanError> {
        let model: Model = reader.model()?;
        self.table.interpret(step, &model, &self.options)
    }

    fn opening(&self) -> Vec<Command> {
        let mut commands = vec![
            Command::InitCanon,
            Command::SetLengthUnits {
                unit: LengthUnit::Meter,
            },
            Command::SetAngleUnits {
                unit: AngleUnit::Radian,
            },
        ];
        if let Some(percent) = self.options.percent {
            commands.push(Command::SetRelativeSpeed { percent });
            commands.push(Command::SetRelativeAcceleration { percent });
        }
        commands
    }

    fn end(&mut self, sink: &mut dyn CommandSink, code: Code, message: String) -> Code {
        if let Some((steps, next)) = &mut self.plan {
            *next = steps.len() + 1;
        }
        let reason = if code == Code::EndOfPlan {
            0
        } else {
            code as i64
        };
        sink.command(Command::EndCanon { reason });
        self.fail(code, message)
    }
}

impl PlanInterpreter for PddlInterpreter {
    fn init(&mut self) -> Code {
        match Reader::open(&self.world) {
            Ok(reader) => {
                self.reader = Some(reader);
                self.plan = None;
                self.error.clear();
                Code::Ok
            }
            Err(error) => self.fail(Code::Internal, error.to_string()),
        }
    }

    fn open_plan(&mut self, file_name: &str, plan_type: &str, sink: &mut dyn CommandSink) -> Code {
        if self.reader.is_none() {
            return self.fail(Code::NotInitialised, "InterpInit was not called");
        }
        if self.plan.is_some() {
            return self.fail(Code::PlanAlreadyOpen, "a plan is open already");
        }
        if plan_type != "PDDL" {
            return self.fail(
                Code::UnsupportedPlanType,
                format!("no plan type {plan_type}"),
            );
        }
        let (text, done) = match self.resumed.take() {
            Some(resumed) => resumed,
            None => match plan_text(Path::new(file_name)) {
                Ok(text) => (text, 0),
                Err(error) => {
                    return self.fail(Code::CannotReadFile, format!("{file_name}: {error}"));
                }
            },
        };
        let steps = match read_plan(&text) {
            Ok(steps) => steps,
            Err(error) => return self.fail(Code::ParseError, format!("{file_name}: {error}")),
        };
        for step in &steps {
            if let Err(message) = self.table.knows(step) {
                let message = format!("{file_name}: line {}: {message}", step.line);
                return self.fail(Code::UnknownAction, message);
            }
        }
        if !self
            .opening()
            .into_iter()
            .all(|command| sink.command(command))
        {
            return self.fail(Code::SinkFull, "the controller does not take InitCanon");
        }
        let done = done.min(steps.len());
        self.plan = Some((steps, done));
        self.error.clear();
        Code::Ok
    }

    fn execute(&mut self, sink: &mut dyn CommandSink) -> Code {
        let Some((steps, next)) = &self.plan else {
            let (code, message) = match self.reader {
                None => (Code::NotInitialised, "InterpInit was not called"),
                Some(_) => (Code::NoPlanOpen, "no plan is open"),
            };
            return self.fail(code, message);
        };
        let (number, count) = (*next, steps.len());
        let Some(step) = steps.get(number).cloned() else {
            if number == count {
                return self.end(sink, Code::EndOfPlan, String::new());
            }
            return self.fail(Code::EndOfPlan, "the plan has ended");
        };
        let Some(reader) = &self.reader else {
            return Code::NotInitialised;
        };
        match self.step(reader, &step) {
            Ok(batch) => {
                for (index, command) in batch.commands.into_iter().enumerate() {
                    if !sink.command(command) {
                        let message = format!("step {}: no room for its commands", number + 1);
                        return self.end(sink, Code::SinkFull, message);
                    }
                    if let Some((_, tool)) = batch.tools.iter().find(|(after, _)| *after == index) {
                        sink.tool(tool.clone());
                    }
                }
                sink.effects(batch.changes);
                if let Some((_, next)) = &mut self.plan {
                    *next = number + 1;
                }
                Code::Ok
            }
            Err(error) => {
                let code = match &error {
                    PlanError::NoObject(_) | PlanError::Chain { .. } | PlanError::Missing(_) => {
                        Code::NoSuchPose
                    }
                    PlanError::Statement { .. } => Code::PreconditionFalse,
                    PlanError::Value(_) => Code::UnknownAction,
                    _ => Code::Internal,
                };
                let message = format!("step {}, ({step}): {error}", number + 1);
                self.end(sink, code, message)
            }
        }
    }

    fn close_plan(&mut self) -> Code {
        if self.reader.is_none() {
            return self.fail(Code::NotInitialised, "InterpInit was not called");
        }
        match self.plan.take() {
            Some(_) => Code::Ok,
            None => self.fail(Code::NoPlanOpen, "no plan is open"),
        }
    }

    fn exit(&mut self) -> Code {
        match self.reader.take() {
            Some(_) => {
                self.plan = None;
                Code::Ok
            }
            None => self.fail(Code::NotInitialised, "InterpInit was not called"),
        }
    }

    fn last_error(&self) -> &str {
        &self.error
    }
}
