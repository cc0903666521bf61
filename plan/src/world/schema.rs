//! Tables of the world database and their migrations.

use rusqlite::Connection;

use crate::PlanError;

/// Each entry brings a database from the version of its index to the next. Entries are never
/// changed once released; new versions are appended.
pub const MIGRATIONS: &[&str] = &[
    // 1: the world.
    "CREATE TABLE workstation (
       id INTEGER PRIMARY KEY CHECK (id = 1),
       length_unit TEXT NOT NULL, angle_unit TEXT NOT NULL, weight_unit TEXT NOT NULL,
       next_object INTEGER NOT NULL, revision INTEGER NOT NULL,
       arm TEXT) STRICT;
     CREATE TABLE sku (
       id TEXT PRIMARY KEY, description TEXT NOT NULL,
       length REAL, width REAL, height REAL, has_top INTEGER,
       weight REAL, grasp TEXT) STRICT;
     CREATE TABLE sku_effector (
       sku TEXT NOT NULL REFERENCES sku(id), position INTEGER NOT NULL, effector TEXT NOT NULL,
       PRIMARY KEY (sku, position)) STRICT;
     CREATE TABLE design (id TEXT PRIMARY KEY, tray_sku TEXT NOT NULL) STRICT;
     CREATE TABLE design_part (
       design TEXT NOT NULL REFERENCES design(id), position INTEGER NOT NULL,
       sku TEXT NOT NULL, pose TEXT NOT NULL,
       PRIMARY KEY (design, position)) STRICT;
     CREATE TABLE object (
       id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, class TEXT NOT NULL,
       reference INTEGER NOT NULL REFERENCES object(id) DEFERRABLE INITIALLY DEFERRED,
       relation TEXT NOT NULL, pose TEXT NOT NULL) STRICT;
     CREATE INDEX object_reference ON object(reference);
     CREATE TABLE property (
       object INTEGER NOT NULL REFERENCES object(id) ON DELETE CASCADE,
       name TEXT NOT NULL, value TEXT NOT NULL,
       PRIMARY KEY (object, name)) STRICT;
     CREATE TABLE volume (
       robot INTEGER NOT NULL REFERENCES object(id) ON DELETE CASCADE, position INTEGER NOT NULL,
       minimum TEXT NOT NULL, maximum TEXT NOT NULL,
       PRIMARY KEY (robot, position)) STRICT;",
    // 2: runs of plans, for inspection and resumption.
    "CREATE TABLE run (
       id INTEGER PRIMARY KEY, plan TEXT NOT NULL, source TEXT NOT NULL, parameters TEXT NOT NULL,
       stock TEXT NOT NULL, state TEXT NOT NULL, outcome TEXT, under_way TEXT) STRICT;",
];

/// Brings the schema of a writable database to the newest version.
///
/// # Errors
/// [`PlanError::Schema`] when the database is newer than this program, else
/// [`PlanError::Database`].
pub fn migrate(connection: &mut Connection) -> Result<(), PlanError> {
    let found = version(connection)?;
    check_known(found)?;
    for (index, migration) in MIGRATIONS.iter().enumerate() {
        let index = i64::try_from(index).unwrap_or(i64::MAX);
        if index < found {
            continue;
        }
        let transaction = connection.transaction()?;
        transaction.execute_batch(migration)?;
        transaction.pragma_update(None, "user_version", index + 1)?;
        transaction.commit()?;
    }
    Ok(())
}

/// Schema version of a database.
///
/// # Errors
/// [`PlanError::Database`].
pub fn version(connection: &Connection) -> Result<i64, PlanError> {
    Ok(connection.pragma_query_value(None, "user_version", |row| row.get(0))?)
}

/// Newest schema version this program knows.
#[must_use]
pub fn newest() -> i64 {
    i64::try_from(MIGRATIONS.len()).unwrap_or(i64::MAX)
}

/// Refuses a database that is newer than this program.
///
/// # Errors
/// [`PlanError::Schema`].
pub fn check_known(found: i64) -> Result<(), PlanError> {
    let known = newest();
    if found > known {
        Err(PlanError::Schema { found, known })
    } else {
        Ok(())
    }
}
