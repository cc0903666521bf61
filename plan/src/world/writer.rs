//! Writing the world database: for the controller only.

use std::path::Path;

use rusqlite::{Connection, Transaction, TransactionBehavior, params};

use super::lock::Lock;
use super::presence::Presence;
use super::reader::{load, pose_to_text};
use super::stored_run::{StoredRun, last_run};
use super::{Change, Location, Model, Object, ObjectId, Scalar, schema};
use crate::PlanError;

/// How safe a commit is against loss of power. A killed process never loses a commit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Durability {
    /// On the disk when the commit returns.
    #[default]
    Full,
    /// Handed to the operating system; for dry runs and tests.
    Process,
}

/// The one connection that may write the world database.
///
/// As long as it is open no other process can open a second one; readers are free. Before and after
/// each change it checks that the files of the database are still in their place and unchanged by
/// others.
#[derive(Debug)]
pub struct Writer {
    // Closed before the lock is released.
    connection: Connection,
    presence: Presence,
    /// Counts the commits of other connections.
    data_version: i64,
    lock: Lock,
}

impl Writer {
    /// Opens or creates the database in `path` and brings its schema up to date.
    ///
    /// # Errors
    /// [`PlanError::InUse`] when another process or another writer of this one has it open,
    /// [`PlanError::File`], [`PlanError::Database`] or [`PlanError::Schema`].
    pub fn open(path: &Path, durability: Durability) -> Result<Self, PlanError> {
        let lock = Lock::take(path)?;
        let mut connection = Connection::open(path)?;
        connection.pragma_update(None, "journal_mode", "WAL")?;
        let synchronous = if durability == Durability::Full {
            "FULL"
        } else {
            "NORMAL"
        };
        connection.pragma_update(None, "synchronous", synchronous)?;
        connection.pragma_update(None, "foreign_keys", true)?;
        connection.busy_timeout(std::time::Duration::from_secs(5))?;
        schema::migrate(&mut connection)?;
        let data_version = data_version(&connection)?;
        let presence = Presence::of(path)?;
        Ok(Self {
            connection,
            presence,
            data_version,
            lock,
        })
    }

    /// Makes a change as one transaction, between two checks that the database is still this one.
    fn change<T>(
        &mut self,
        change: impl FnOnce(&Transaction<'_>) -> Result<T, PlanError>,
    ) -> Result<T, PlanError> {
        self.check_in_place()?;
        self.presence.check_unwritten()?;
        let transaction = self
            .connection
            .transaction_with_behavior(TransactionBehavior::Immediate)?;
        if data_version(&transaction)? != self.data_version {
            return Err(self.presence.changed());
        }
        let done = change(&transaction)?;
        transaction.commit()?;
        self.presence.note();
        self.check_in_place()?;
        Ok(done)
    }

    fn check_in_place(&self) -> Result<(), PlanError> {
        self.presence.check()?;
        if self.lock.is_in_place() {
            Ok(())
        } else {
            Err(self.presence.unlocked())
        }
    }

    /// Reads the whole world.
    ///
    /// # Errors
    /// As [`super::Reader::model`].
    pub fn model(&self) -> Result<Model, PlanError> {
        let transaction = self.connection.unchecked_transaction()?;
        load(&transaction)
    }

    /// Replaces the whole world by `model`; runs in the old world are deleted.
    ///
    /// # Errors
    /// [`PlanError::Database`] or [`PlanError::Lost`].
    pub fn replace(&mut self, model: &Model) -> Result<(), PlanError> {
        self.change(|transaction| replace(transaction, model))
    }

    /// Commits changes of the world, and the state of the run that made them, as one transaction:
    /// all of it or nothing. Returns the new revision.
    ///
    /// # Errors
    /// [`PlanError::Database`] or [`PlanError::Lost`]; the database is then unchanged, unless it
    /// was lost during the commit.
    pub fn commit(
        &mut self,
        changes: &[Change],
        run: Option<(i64, &str, Option<&str>)>,
    ) -> Result<i64, PlanError> {
        self.change(|transaction| {
            for change in changes {
                write_change(transaction, change)?;
            }
            if let Some((id, state, outcome)) = run {
                transaction
                    .prepare_cached(
                        "UPDATE run SET state = ?, outcome = ?, under_way = NULL WHERE id = ?",
                    )?
                    .execute(params![state, outcome, id])?;
            }
            let revision = transaction
                .prepare_cached(
                    "UPDATE workstation SET revision = revision + 1 RETURNING revision",
                )?
                .query_row([], |row| row.get(0))?;
            Ok(revision)
        })
    }

    /// Records a new run and returns its number.
    ///
    /// # Errors
    /// [`PlanError::Database`] or [`PlanError::Lost`].
    pub fn begin_run(&mut self, run: &StoredRun) -> Result<i64, PlanError> {
        self.change(|transaction| {
            transaction.execute(
                "INSERT INTO run (plan, source, parameters, stock, state) VALUES (?, ?, ?, ?, ?)",
                params![run.plan, run.source, run.parameters, run.stock, run.state],
            )?;
            Ok(transaction.last_insert_rowid())
        })
    }

    /// Records that the motion of a step begins, so that an inspection after a kill can tell.
    ///
    /// # Errors
    /// [`PlanError::Database`] or [`PlanError::Lost`].
    pub fn mark_under_way(&mut self, run: i64, step: &str) -> Result<(), PlanError> {
        self.change(|transaction| {
            transaction
                .prepare_cached("UPDATE run SET under_way = ? WHERE id = ?")?
                .execute(params![step, run])?;
            Ok(())
        })
    }

    /// The latest run, or none.
    ///
    /// # Errors
    /// [`PlanError::Database`].
    pub fn last_run(&self) -> Result<Option<StoredRun>, PlanError> {
        last_run(&self.connection)
    }
}

/// A number that changes when another connection commits.
fn data_version(connection: &Connection) -> Result<i64, PlanError> {
    Ok(connection.pragma_query_value(None, "data_version", |row| row.get(0))?)
}

fn replace(transaction: &Transaction<'_>, model: &Model) -> Result<(), PlanError> {
    transaction.execute_batch(
        "DELETE FROM volume; DELETE FROM property; DELETE FROM object;
         DELETE FROM design_part; DELETE FROM design; DELETE FROM sku_effector;
         DELETE FROM sku; DELETE FROM workstation; DELETE FROM run;",
    )?;
    let units = &model.units;
    transaction.execute(
        "INSERT INTO workstation VALUES (1, ?, ?, ?, ?, ?, ?)",
        params![
            units.length,
            units.angle,
            units.weight,
            model.next,
            model.revision,
            model.arm.as_ref().map(pose_to_text)
        ],
    )?;
    write_descriptions(transaction, model)?;
    for object in model.objects() {
        create(transaction, object)?;
    }
    for (position, volume) in model.volumes().iter().enumerate() {
        transaction.execute(
            "INSERT INTO volume VALUES (?, ?, ?, ?)",
            params![
                volume.robot.0,
                i64::try_from(position).unwrap_or(i64::MAX),
                format!("{:?}", volume.minimum),
                format!("{:?}", volume.maximum)
            ],
        )?;
    }
    Ok(())
}

fn write_descriptions(transaction: &Transaction<'_>, model: &Model) -> Result<(), PlanError> {
    let position = |index: usize| i64::try_from(index).unwrap_or(i64::MAX);
    for sku in model.skus() {
        transaction.execute(
            "INSERT INTO sku VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
            params![
                sku.id,
                sku.description,
                sku.shape.map(|s| s.length),
                sku.shape.map(|s| s.width),
                sku.shape.map(|s| s.height),
                sku.shape.map(|s| s.has_top),
                sku.weight,
                sku.grasp.as_ref().map(pose_to_text)
            ],
        )?;
        for (index, effector) in sku.effectors.iter().enumerate() {
            transaction.execute(
                "INSERT INTO sku_effector VALUES (?, ?, ?)",
                params![sku.id, position(index), effector],
            )?;
        }
    }
    for design in model.designs() {
        transaction.execute(
            "INSERT INTO design VALUES (?, ?)",
            params![design.id, design.tray_sku],
        )?;
        for (index, part) in design.parts.iter().enumerate() {
            transaction.execute(
                "INSERT INTO design_part VALUES (?, ?, ?, ?)",
                params![
                    design.id,
                    position(index),
                    part.sku,
                    pose_to_text(&part.pose)
                ],
            )?;
        }
    }
    Ok(())
}

fn create(transaction: &Transaction<'_>, object: &Object) -> Result<(), PlanError> {
    transaction
        .prepare_cached("INSERT INTO object VALUES (?, ?, ?, ?, ?, ?)")?
        .execute(params![
            object.id.0,
            object.name,
            object.class.name(),
            object.location.reference.0,
            object.location.relation.name(),
            pose_to_text(&object.location.pose)
        ])?;
    for (name, value) in &object.properties {
        set(transaction, object.id, name, value)?;
    }
    Ok(())
}

fn set(
    transaction: &Transaction<'_>,
    object: ObjectId,
    name: &str,
    value: &Scalar,
) -> Result<(), PlanError> {
    let value = serde_json::to_string(value).map_err(|error| PlanError::Stored {
        place: name.to_owned(),
        what: error.to_string(),
    })?;
    transaction
        .prepare_cached("INSERT OR REPLACE INTO property VALUES (?, ?, ?)")?
        .execute(params![object.0, name, value])?;
    Ok(())
}

fn place(
    transaction: &Transaction<'_>,
    object: ObjectId,
    location: &Location,
) -> Result<(), PlanError> {
    transaction
        .prepare_cached("UPDATE object SET reference = ?, relation = ?, pose = ? WHERE id = ?")?
        .execute(params![
            location.reference.0,
            location.relation.name(),
            pose_to_text(&location.pose),
            object.0
        ])?;
    Ok(())
}

fn write_change(transaction: &Transaction<'_>, change: &Change) -> Result<(), PlanError> {
    match change {
        Change::Create(object) => {
            create(transaction, object)?;
            transaction
                .prepare_cached(
                    "UPDATE workstation SET next_object = max(next_object, ? + 1) WHERE id = 1",
                )?
                .execute([object.id.0])?;
        }
        Change::Delete(id) => {
            transaction
                .prepare_cached("DELETE FROM object WHERE id = ?")?
                .execute([id.0])?;
        }
        Change::Place { object, location } => place(transaction, *object, location)?,
        Change::Set {
            object,
            property,
            value,
        } => set(transaction, *object, property, value)?,
        Change::Arm(pose) => {
            transaction
                .prepare_cached("UPDATE workstation SET arm = ?")?
                .execute([pose_to_text(pose)])?;
        }
    }
    Ok(())
}
