//! The loop that executes plans of every kind: motion first, then its effect, in one transaction.

use std::time::Instant;

use crcl::Command;

use super::batch::{Batch, Request};
use super::factotum::Delivery;
use super::motion::{Motion, MotionFailure};
use super::report::{Event, PlanRunReport, RunOutcome};
use super::robot::{Robot, RobotOptions, situation};
use super::state::{Act, Outcome, State, Step};
use super::value::Value;
use crate::PlanError;
use crate::world::{Change, Model, Writer};

/// Most warnings of one run that are kept.
const MOST_WARNINGS: usize = 100;

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

/// A step with what people call it.
pub(crate) struct NextStep {
    /// Name of the statement or action.
    pub(crate) name: String,
    /// Line of the plan, from 1.
    pub(crate) line: usize,
    /// What is stored while its motion is under way, and what a failure is reported with.
    pub(crate) mark: String,
    pub(crate) step: Step,
}

/// Gives the steps of a plan, one after the other.
pub(crate) trait Steps {
    /// Brings the model up to date with the world, where others may have changed it.
    ///
    /// # Errors
    /// [`PlanError`] of the database.
    fn refresh(&mut self, model: &mut Model) -> Result<(), PlanError>;

    /// Commands before the first step, and again after a repair.
    fn opening(&self, model: &Model, resumed: bool) -> Batch;

    /// The next step.
    ///
    /// # Errors
    /// How the plan ends when it cannot go on.
    fn next(
        &mut self,
        state: &State,
        model: &Model,
        motion: &mut dyn Motion,
    ) -> Result<NextStep, Outcome>;

    /// Has an errand done.
    ///
    /// # Errors
    /// The reason, in words.
    fn errand(&mut self, model: &Model, request: &Request) -> Result<Delivery, String>;

    /// Commands at the end of the plan, with the reason for EndCanon.
    fn closing(&mut self, reason: i64) -> Batch {
        let mut batch = Batch::default();
        batch.push(Command::EndCanon { reason });
        batch
    }

    /// Reason for EndCanon when the motion failed.
    fn motion_failed(&self) -> i64;
}

/// A run of a plan as far as it has come.
pub(crate) struct Run {
    /// Its number in the database.
    pub(crate) id: i64,
    /// Whether it goes on after an interruption.
    pub(crate) resumed: bool,
    pub(crate) state: State,
    /// The world as the run knows it.
    pub(crate) model: Model,
    pub(crate) warnings: Vec<String>,
}

/// A run with what it is executed by.
pub(crate) struct Execution<'a> {
    pub(crate) writer: Writer,
    pub(crate) motion: &'a mut dyn Motion,
    pub(crate) robot: RobotOptions,
    pub(crate) policy: Policy,
    pub(crate) run: Run,
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

/// A run that is left where it is, to be resumed.
struct Left {
    outcome: RunOutcome,
    code: i64,
    reason: String,
}

/// Whether a step was committed, or the run is left.
type Went = Result<Option<Left>, PlanError>;

/// Writes where the arm is into the world, before a plan begins.
///
/// # Errors
/// [`PlanError`] of the database, or when nobody knows where the arm is.
pub(crate) fn place_arm(
    writer: &mut Writer,
    motion: &mut dyn Motion,
    model: &mut Model,
) -> Result<(), PlanError> {
    if let Some(arm) = motion.arm() {
        let changes = model.arm_changes(&arm)?;
        model.revision = writer.commit(&changes, None)?;
        model.apply_all(&changes)?;
    }
    situation(model)?;
    Ok(())
}

impl Execution<'_> {
    /// Executes the plan to its end, or until the operator stops the arm.
    ///
    /// # Errors
    /// [`PlanError`] of the database; errors of the plan are in the report.
    pub(crate) fn run(
        &mut self,
        steps: &mut dyn Steps,
        observer: &mut dyn FnMut(&Event),
    ) -> Result<PlanRunReport, PlanError> {
        let began = Instant::now();
        let mut left = match self.open(steps) {
            Ok(()) => None,
            // If the arm cannot be moved back now, an operator may help, and the run is resumed
            // later.
            Err(failure) if self.run.resumed && !failure.stopped => Some(Left {
                outcome: RunOutcome::Failed,
                code: steps.motion_failed(),
                reason: format!("at the start: {failure}"),
            }),
            Err(failure) => self.give_up(trouble(steps, &failure), "at the start")?,
        };
        while left.is_none() && self.run.state.outcome.is_none() {
            left = self.step(steps, observer)?;
        }
        let (outcome, code, reason) = match (left, self.run.state.outcome.clone()) {
            (Some(left), _) => (left.outcome, left.code, Some(left.reason)),
            (None, Some(Outcome::Failed { code, reason })) => {
                (RunOutcome::Failed, code, Some(reason))
            }
            (None, _) => (RunOutcome::Stopped, 0, None),
        };
        if outcome != RunOutcome::Interrupted {
            let closing = steps.closing(code);
            let start = situation(&self.run.model)?;
            if let Err(failure) = self.motion.execute(&start, &closing) {
                self.run.warnings.push(format!("EndCanon: {failure}"));
            }
        }
        Ok(PlanRunReport {
            outcome,
            code,
            reason,
            counters: self.run.state.counters.clone(),
            wall_s: began.elapsed().as_secs_f64(),
            warnings: self.run.warnings.clone(),
        })
    }

    /// The opening commands, and the arm where the model has it.
    fn open(&mut self, steps: &dyn Steps) -> Result<(), MotionFailure> {
        let opening = steps.opening(&self.run.model, self.run.resumed);
        self.move_only(&opening)?;
        if self.run.resumed {
            self.bring_back()
        } else {
            Ok(())
        }
    }

    fn move_only(&mut self, batch: &Batch) -> Result<(), MotionFailure> {
        let start = situation(&self.run.model).map_err(unmoved)?;
        self.run.state.counters.motion_s += self.motion.execute(&start, batch)?;
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
            model: &self.run.model,
            options: &self.robot,
        };
        match robot.way_back(&arm).map_err(unmoved)? {
            Some(batch) => self.move_only(&batch),
            None => Ok(()),
        }
    }

    fn step(&mut self, steps: &mut dyn Steps, observer: &mut dyn FnMut(&Event)) -> Went {
        steps.refresh(&mut self.run.model)?;
        let next = steps.next(&self.run.state, &self.run.model, self.motion);
        let mut next = match next {
            Ok(next) => next,
            Err(outcome) => return self.end(outcome).map(|()| None),
        };
        let done = match std::mem::replace(&mut next.step.act, Act::Nothing) {
            Act::Nothing => Ok(Done::default()),
            Act::End | Act::Exhausted => {
                let mut state = next.step.state;
                let outcome = state.outcome.take().unwrap_or(Outcome::Stopped);
                self.run.state = state;
                return self.end(outcome).map(|()| None);
            }
            Act::Motion(batch) => self.execute(steps, &next.mark, batch, observer)?,
            Act::Errand(request) => self.errand(steps, request, observer),
        };
        match done {
            Ok(done) => self.finish(next, done, observer).map(|()| None),
            Err(trouble) => self.give_up(trouble, &next.mark),
        }
    }

    /// Commits what a step did and tells about it.
    fn finish(
        &mut self,
        next: NextStep,
        done: Done,
        observer: &mut dyn FnMut(&Event),
    ) -> Result<(), PlanError> {
        let Step {
            mut changes,
            mut state,
            warning,
            ..
        } = next.step;
        let seconds = done.seconds;
        // A request to the factotum takes time, but does not move the arm.
        if done.binding.is_none() {
            state.counters.motion_s += seconds;
        }
        state.bindings.extend(done.binding);
        changes.extend(done.changes);
        let kits = self.run.state.counters.kits;
        self.commit(&changes, state)?;
        observer(&Event::Statement {
            name: next.name,
            line: next.line,
            number: self.run.state.counters.statements,
            seconds,
        });
        if self.run.state.counters.kits > kits {
            observer(&Event::Kit(self.run.state.counters.kits));
        }
        self.warn(warning, observer);
        Ok(())
    }

    /// Ends the plan, or leaves it for a resume if the operator stopped it.
    fn give_up(&mut self, trouble: Trouble, mark: &str) -> Went {
        match trouble {
            Trouble::Failed(code, reason) => {
                let reason = format!("{mark}: {reason}");
                self.end(Outcome::Failed { code, reason })?;
                Ok(None)
            }
            Trouble::Stopped(reason) => Ok(Some(Left {
                outcome: RunOutcome::Interrupted,
                code: 0,
                reason: format!("{mark}: {reason}"),
            })),
        }
    }

    fn warn(&mut self, warning: Option<String>, observer: &mut dyn FnMut(&Event)) {
        let Some(warning) = warning else { return };
        observer(&Event::Warning(warning.clone()));
        let warnings = &mut self.run.warnings;
        if !warnings.contains(&warning) && warnings.len() < MOST_WARNINGS {
            warnings.push(warning);
        }
    }

    /// Commits changes of the world and state of the plan, together or not at all.
    fn commit(&mut self, changes: &[Change], state: State) -> Result<(), PlanError> {
        self.run.model.apply_all(changes)?;
        let outcome = state.outcome.as_ref().map(Outcome::to_json).transpose()?;
        let text = state.to_json()?;
        let run = (self.run.id, text.as_str(), outcome.as_deref());
        self.run.model.revision = self.writer.commit(changes, Some(run))?;
        self.run.state = state;
        Ok(())
    }

    fn end(&mut self, outcome: Outcome) -> Result<(), PlanError> {
        let mut state = self.run.state.clone();
        state.outcome = Some(outcome);
        self.commit(&[], state)
    }

    /// Executes a batch, again as often as the policy says.
    fn execute(
        &mut self,
        steps: &dyn Steps,
        mark: &str,
        batch: Batch,
        observer: &mut dyn FnMut(&Event),
    ) -> Result<Result<Done, Trouble>, PlanError> {
        self.writer.mark_under_way(self.run.id, mark)?;
        let mut attempt = 0;
        let seconds = loop {
            let start = situation(&self.run.model)?;
            let failure = match self.motion.execute(&start, &batch) {
                Ok(seconds) => break seconds,
                Err(failure) => failure,
            };
            attempt += 1;
            let again = !failure.stopped && self.again(attempt);
            if !again || !self.motion.recover() {
                return Ok(Err(trouble(steps, &failure)));
            }
            observer(&Event::Retry(format!("{mark}: {failure}")));
            self.run
                .warnings
                .push(format!("{mark}: {failure}; tried again"));
            self.run.resumed = true;
            if let Err(failure) = self.open(steps) {
                return Ok(Err(trouble(steps, &failure)));
            }
        };
        for tool in batch.tools.iter().filter_map(|(_, tool)| tool.as_ref()) {
            observer(&Event::EndEffector(tool.name.clone()));
        }
        Ok(Ok(Done {
            changes: batch.changes,
            seconds,
            binding: None,
        }))
    }

    /// Whether a failed step is tried again after this many attempts.
    fn again(&self, attempt: usize) -> bool {
        matches!(self.policy, Policy::Repair { attempts } if attempt <= attempts)
    }

    fn errand(
        &mut self,
        steps: &mut dyn Steps,
        request: Request,
        observer: &mut dyn FnMut(&Event),
    ) -> Result<Done, Trouble> {
        let mut attempt = 0;
        loop {
            match steps.errand(&self.run.model, &request) {
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
                        return Err(Trouble::Failed(Outcome::FACTOTUM, reason));
                    }
                    observer(&Event::Retry(reason));
                }
            }
        }
    }
}

/// What a failure of the motion means for the plan.
fn trouble(steps: &dyn Steps, failure: &MotionFailure) -> Trouble {
    let text = failure.to_string();
    if failure.stopped {
        Trouble::Stopped(text)
    } else {
        Trouble::Failed(steps.motion_failed(), text)
    }
}

/// What keeps the arm from being moved at all.
fn unmoved(error: PlanError) -> MotionFailure {
    MotionFailure::new(0, error.to_string())
}
