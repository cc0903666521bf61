//! A controller that pulls a plan through the interface and has it executed.

use std::time::Instant;

use crcl::Command;
use serde::Serialize;

use super::{Code, CommandSink, PlanInterpreter};
use crate::PlanError;
use crate::run::{Batch, Motion, MotionFailure, Tool, situation};
use crate::world::{Change, Class, Model, Writer};

/// How a pulled plan went.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PulledReport {
    /// `stopped` (at its end), `failed`, or `interrupted` by the operator.
    pub outcome: &'static str,
    /// Last return value of the interpreter; 100 when the motion failed.
    pub code: i64,
    /// In words; none when all went well.
    pub reason: Option<String>,
    /// Steps of the plan executed.
    pub steps: usize,
    /// Canonical commands executed.
    pub commands: usize,
    /// Objects picked up.
    pub pick_ups: usize,
    /// Objects put down.
    pub put_downs: usize,
    /// End effectors attached.
    pub end_effector_changes: usize,
    /// Kits put into a container.
    pub kits: usize,
    /// Time of motion (s).
    pub motion_s: f64,
    /// Time that the run took (s).
    pub wall_s: f64,
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

/// Opens a plan, pulls it step by step, has each step's motion executed, commits its effects, and
/// closes the plan. `observer` gets the number of each finished step.
///
/// # Errors
/// [`PlanError`] of the database; what goes wrong in the plan is in the report.
pub fn pull(
    interpreter: &mut dyn PlanInterpreter,
    plan: (&str, &str),
    writer: &mut Writer,
    motion: &mut dyn Motion,
    observer: &mut dyn FnMut(usize),
) -> Result<PulledReport, PlanError> {
    let began = Instant::now();
    let mut report = PulledReport {
        outcome: "failed",
        ..PulledReport::default()
    };
    let model = writer.model()?;
    if let Some(arm) = motion.arm() {
        writer.commit(&model.arm_changes(&arm)?, None)?;
    }
    let mut opening = Collector::default();
    let mut code = interpreter.init();
    if code == Code::Ok {
        code = interpreter.open_plan(plan.0, plan.1, &mut opening);
    }
    let opened = code == Code::Ok;
    let mut failure = None;
    if opened {
        failure = execute(opening, writer, motion, &mut report)?;
    }
    while code == Code::Ok && failure.is_none() {
        let mut collector = Collector::default();
        code = interpreter.execute(&mut collector);
        failure = execute(collector, writer, motion, &mut report)?;
        if code == Code::Ok && failure.is_none() {
            report.steps += 1;
            observer(report.steps);
        }
    }
    report.code = code as i64;
    match (failure, code) {
        (Some(failure), _) => {
            report.code = 100;
            report.reason = Some(format!("step {}: {failure}", report.steps + 1));
            if failure.stopped {
                report.outcome = "interrupted";
            }
            let mut end = Batch::default();
            end.push(Command::EndCanon {
                reason: report.code,
            });
            // The motion has failed already; there is nobody left to tell.
            let _ = motion.execute(&situation(&writer.model()?)?, &end);
        }
        (None, Code::EndOfPlan) => (report.outcome, report.code) = ("stopped", 0),
        (None, _) => report.reason = Some(interpreter.last_error().to_owned()),
    }
    if opened {
        interpreter.close_plan();
    }
    interpreter.exit();
    report.wall_s = began.elapsed().as_secs_f64();
    Ok(report)
}

/// Executes the commands of a step and commits its effects; the failure of its motion, if any.
fn execute(
    collector: Collector,
    writer: &mut Writer,
    motion: &mut dyn Motion,
    report: &mut PulledReport,
) -> Result<Option<MotionFailure>, PlanError> {
    let batch = collector.batch;
    if batch.commands.is_empty() && batch.changes.is_empty() {
        return Ok(None);
    }
    let model = writer.model()?;
    if !batch.commands.is_empty() {
        match motion.execute(&situation(&model)?, &batch) {
            Ok(seconds) => report.motion_s += seconds,
            Err(failure) => return Ok(Some(failure)),
        }
        report.commands += batch.commands.len();
    }
    if !batch.changes.is_empty() {
        writer.commit(&batch.changes, None)?;
        report.count(&model, &batch);
    }
    Ok(None)
}

impl PulledReport {
    /// Counts what a step did to a world.
    fn count(&mut self, before: &Model, batch: &Batch) {
        let attached = batch.tools.iter().filter(|(_, tool)| tool.is_some());
        self.end_effector_changes += attached.count();
        let effector = before.effector().map(|effector| effector.id);
        let held = before.held().map(|held| held.id);
        for change in &batch.changes {
            let Change::Place { object, location } = change else {
                continue;
            };
            if Some(location.reference) == effector {
                self.pick_ups += 1;
            } else if Some(*object) == held {
                self.put_downs += 1;
                let class = |id| before.object(id).map(|object| object.class).ok();
                let boxed = class(location.reference).is_some_and(Class::is_container);
                self.kits += usize::from(boxed && class(*object) == Some(Class::KitInstance));
            }
        }
    }
}
