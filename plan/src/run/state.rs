//! The state of a running plan, and its next step.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::batch::{Batch, Request};
use super::value::Value;
use crate::PlanError;
use crate::kitting::ast::Span;
use crate::world::{Change, StoredRun};

/// How a plan ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outcome {
    /// Stop was executed.
    Stopped,
    /// The plan gave up, or could not continue.
    Failed {
        /// Reason for EndCanon, positive: 1 Quit, 2 a statement, 3 the motion, 4 the factotum; for
        /// PDDL plans a [`crate::interp::Code`], or 100 for the motion.
        code: i64,
        /// In words.
        reason: String,
    },
}

impl Outcome {
    /// Whether the arm or the factotum failed, not the plan: then the step can be tried again.
    #[must_use]
    pub fn can_be_resumed(&self) -> bool {
        matches!(
            self,
            Self::Failed {
                code: 3 | 4 | 100,
                ..
            }
        )
    }

    pub(crate) fn to_json(&self) -> Result<String, PlanError> {
        serde_json::to_string(self).map_err(|error| PlanError::Resume(error.to_string()))
    }
}

/// A list that is being executed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Frame {
    pub(crate) node: usize,
    /// Chosen order of the members, once it is chosen.
    pub(crate) order: Option<Vec<usize>>,
    /// Position of the next member; for a loop, statements done at the last test.
    pub(crate) next: usize,
}

impl Frame {
    pub(crate) fn new(node: usize) -> Self {
        Self {
            node,
            order: None,
            next: usize::MAX,
        }
    }
}

/// What has been done so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Counters {
    /// Statements executed (lists and tests not counted).
    pub statements: usize,
    /// Canonical commands executed.
    pub commands: usize,
    /// Objects picked up.
    pub pick_ups: usize,
    /// Objects put down.
    pub put_downs: usize,
    /// Moves above a pose.
    pub moves_above: usize,
    /// Changes of the end effector.
    pub end_effector_changes: usize,
    /// Errands of the factotum.
    pub factotum_calls: usize,
    /// Kits finished.
    pub kits: usize,
    /// Time of motion (s).
    pub motion_s: f64,
    /// Time gained by orders that the executor chose, as predicted (s).
    pub gained_s: f64,
}

/// The state of a plan: program counter, variables, counters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    pub(crate) stack: Vec<Frame>,
    /// Values of parameters and variables.
    pub bindings: BTreeMap<String, Value>,
    /// What has been done.
    pub counters: Counters,
    /// How it ended, when it has.
    pub outcome: Option<Outcome>,
}

impl State {
    pub(crate) fn to_json(&self) -> Result<String, PlanError> {
        serde_json::to_string(self).map_err(|error| PlanError::Resume(error.to_string()))
    }

    /// The state of a stored run, for resuming it.
    ///
    /// # Errors
    /// [`PlanError::Resume`] when the run has ended, or its state cannot be read.
    pub(crate) fn reopened(stored: &StoredRun) -> Result<Self, PlanError> {
        let broken = |error: serde_json::Error| PlanError::Resume(error.to_string());
        let mut state: Self = serde_json::from_str(&stored.state).map_err(broken)?;
        let outcome = stored.outcome.as_deref().map(serde_json::from_str);
        let outcome = outcome.transpose().map_err(broken)?;
        match state.outcome.take().or(outcome) {
            Some(Outcome::Stopped) => Err(PlanError::Resume("the last run came to its end".into())),
            Some(outcome) if outcome.can_be_resumed() => Ok(state),
            Some(Outcome::Failed { reason, .. }) => {
                let why = format!("the last run gave up: {reason}");
                Err(PlanError::Resume(why))
            }
            None => Ok(state),
        }
    }
}

/// What a step asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Act {
    /// Nothing but its changes.
    Nothing,
    /// Motion; its changes come true with it.
    Motion(Batch),
    /// A request to the factotum.
    Errand(Request),
    /// The plan is over, by a statement.
    End,
    /// There are no more statements.
    Exhausted,
}

/// One step of a plan: what to do, and the state when it is done.
#[derive(Clone, Debug)]
pub struct Step {
    /// Name of the statement.
    pub name: &'static str,
    /// Where it is written.
    pub span: Span,
    /// What to do.
    pub act: Act,
    /// Changes of the world that need no motion.
    pub changes: Vec<Change>,
    /// The state afterwards.
    pub state: State,
    /// Something odd that the user should know.
    pub warning: Option<String>,
}

/// A step that asks for nothing.
pub(super) fn nothing(name: &'static str, span: Span, state: State) -> Step {
    Step {
        name,
        span,
        act: Act::Nothing,
        changes: Vec::new(),
        state,
        warning: None,
    }
}

/// The last step.
pub(super) fn done(name: &'static str, span: Span, state: State) -> Step {
    Step {
        act: Act::End,
        ..nothing(name, span, state)
    }
}

/// The last step of a plan that gives up.
pub(super) fn quit(name: &'static str, span: Span, mut state: State, reason: String) -> Step {
    state.stack.clear();
    state.outcome = Some(Outcome::Failed { code: 1, reason });
    done(name, span, state)
}
