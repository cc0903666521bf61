//! Errors of this crate.

use thiserror::Error;

/// Why a plan, a world model or a step of a plan was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The database does not do what it should.
    #[error("world database: {0}")]
    Database(#[from] rusqlite::Error),
    /// The database was made by a newer program.
    #[error("world database has schema version {found}, this program knows versions up to {known}")]
    Schema {
        /// Version in the file.
        found: i64,
        /// Newest version this program knows.
        known: i64,
    },
    /// The database holds something that cannot be read.
    #[error("world database, {place}: {what}")]
    Stored {
        /// Table or object.
        place: String,
        /// What is wrong.
        what: String,
    },
    /// A file cannot be read or written.
    #[error("{path}: {source}")]
    File {
        /// Its path.
        path: String,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// Another process writes the database.
    #[error(
        "world database {database} is in use by {holder}; wait until it has ended, or work in a copy"
    )]
    InUse {
        /// Path of the database.
        database: String,
        /// Program, subcommand and process id of the holder.
        holder: String,
    },
    /// A file of the database was removed or changed while it was in use.
    #[error(
        "{path} {what} while this process used it; nothing more is written, and what the arm did \
         since the last commit is not recorded; restore the file or begin with a new database"
    )]
    Lost {
        /// Path of the file.
        path: String,
        /// What happened to it.
        what: &'static str,
    },
    /// A file of a workstation cannot be understood.
    #[error("workstation file: {0}")]
    Import(String),
    /// Two objects with one name.
    #[error("two objects are called {0}")]
    DuplicateName(String),
    /// An object that should be there is not.
    #[error("no object {0} in the world")]
    NoObject(String),
    /// The world has none of what the plan needs.
    #[error("the world has no {0}")]
    Missing(String),
    /// A location chain that cannot be computed.
    #[error("the location of {object} cannot be computed: {why}")]
    Chain {
        /// Whose chain.
        object: String,
        /// Broken link, cycle, or relative location.
        why: String,
    },
    /// An expression of a plan has no value.
    #[error("{0}")]
    Value(String),
    /// A statement cannot be executed.
    #[error("{statement}: {why}")]
    Statement {
        /// Name of the statement.
        statement: String,
        /// What is wrong.
        why: String,
    },
    /// The plan has errors; it is not executed.
    #[error("the plan has {count} error(s), the first: {first}")]
    Invalid {
        /// How many.
        count: usize,
        /// Text of the first.
        first: String,
    },
    /// A parameter of the start command.
    #[error("parameter {name}: {why}")]
    Parameter {
        /// Its name.
        name: String,
        /// What is wrong.
        why: String,
    },
    /// A run that should be resumed cannot be.
    #[error("cannot resume: {0}")]
    Resume(String),
    /// A PDDL action cannot be turned into commands.
    #[error("step {step}, ({action}): {why}")]
    Action {
        /// Number of the step, from 1.
        step: usize,
        /// The action with its objects.
        action: String,
        /// What is wrong.
        why: String,
    },
    /// The table of actions is wrong.
    #[error("action table: {0}")]
    Table(String),
}
