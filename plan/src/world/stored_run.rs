//! A run of a plan as stored in the database.

use rusqlite::{Connection, OptionalExtension};

use crate::PlanError;

/// State of a run of a plan, stored with each commit.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredRun {
    /// Its number.
    pub id: i64,
    /// Id of the plan.
    pub plan: String,
    /// Text of the plan, as it was when the run started.
    pub source: String,
    /// Values of the parameters (JSON).
    pub parameters: String,
    /// What the simulated factotum has in store (JSON).
    pub stock: String,
    /// Program counter, variables and counters (JSON).
    pub state: String,
    /// How it ended; none while it runs or after it was killed.
    pub outcome: Option<String>,
    /// The step whose motion was begun and not yet committed.
    pub under_way: Option<String>,
}

/// The latest run in a database.
pub(super) fn last_run(connection: &Connection) -> Result<Option<StoredRun>, PlanError> {
    let run = connection
        .query_row("SELECT * FROM run ORDER BY id DESC LIMIT 1", [], |row| {
            Ok(StoredRun {
                id: row.get(0)?,
                plan: row.get(1)?,
                source: row.get(2)?,
                parameters: row.get(3)?,
                stock: row.get(4)?,
                state: row.get(5)?,
                outcome: row.get(6)?,
                under_way: row.get(7)?,
            })
        })
        .optional()?;
    Ok(run)
}
