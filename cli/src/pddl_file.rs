//! Reads PDDL plans that users name.

use std::path::Path;

use plan::pddl::ActionTable;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::input;

/// Whether a plan is PDDL: it starts, after comments, with a parenthesis or a time.
pub(crate) fn is_pddl(source: &str) -> bool {
    let code = |line: &&str| !line.is_empty() && !line.starts_with(';');
    let first = source.lines().map(str::trim).find(code).unwrap_or_default();
    first.starts_with('(')
        || first
            .split_once(':')
            .is_some_and(|(time, _)| time.trim().parse::<f64>().is_ok())
}

/// The table of PDDL actions: those in this file first, then the built-in ones.
///
/// # Errors
/// The file cannot be read, or is no table.
pub(crate) fn action_table(more: Option<&Path>) -> Result<ActionTable, Failure> {
    let refused = |error| Failure::new(Exit::Unreadable, error);
    let table = ActionTable::own().map_err(refused)?;
    match more {
        Some(more) => table.with(&input::text(more)?).map_err(refused),
        None => Ok(table),
    }
}
