//! The report of a run.

use serde::Serialize;

use super::state::Counters;

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

/// How a run went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanRunReport {
    /// `stopped` (by Stop), `failed`, or `interrupted` by the operator: then it can be resumed.
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
