//! The report of a run.

use serde::Serialize;

use super::state::Counters;

/// Something that happened; for progress displays.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A statement was executed and committed.
    Statement {
        /// Its name, or that of the action.
        name: String,
        /// Line of the plan, from 1.
        line: usize,
        /// Statements so far.
        number: usize,
        /// Time of its motion or request (s).
        seconds: f64,
    },
    /// The end effector of this name is now on the arm.
    EndEffector(String),
    /// This many kits are finished.
    Kit(usize),
    /// Something odd.
    Warning(String),
    /// A motion or request failed and is tried again.
    Retry(String),
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RunOutcome {
    /// The plan came to its end.
    Stopped,
    /// The plan gave up, or the motion or the factotum failed.
    Failed,
    /// The operator stopped the arm: the run can be resumed.
    Interrupted,
}

impl std::fmt::Display for RunOutcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Stopped => "stopped",
            Self::Failed => "failed",
            Self::Interrupted => "interrupted",
        })
    }
}

/// How a run went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanRunReport {
    /// How it ended.
    pub outcome: RunOutcome,
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
