//! Whether the files of an open database are still those that were opened.

use std::ffi::OsString;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::PlanError;

/// A file as the operating system knows it: device and inode.
type Identity = (u64, u64);

/// The files of an open database: the database and its write-ahead log.
///
/// SQLite continues with a file that was deleted or replaced, and its commits are lost. This value
/// compares what is in the folder with what was there when the database was opened.
#[derive(Debug)]
pub(super) struct Presence {
    files: Vec<(PathBuf, Identity)>,
    /// Length and time of the last change of the database, after our own last commit.
    written: Option<(u64, i64, i64)>,
}

impl Presence {
    /// Notes which files belong to the open database in `path`.
    ///
    /// # Errors
    /// [`PlanError::File`] when the database is not there.
    pub(super) fn of(path: &Path) -> Result<Self, PlanError> {
        let failed = |source| PlanError::File {
            path: path.display().to_string(),
            source,
        };
        let path = path.canonicalize().map_err(failed)?;
        let mut log: OsString = path.clone().into();
        log.push("-wal");
        let database =
            identity(&path).ok_or_else(|| failed(std::io::ErrorKind::NotFound.into()))?;
        let mut files = vec![(path, database)];
        let log = PathBuf::from(log);
        if let Some(found) = identity(&log) {
            files.push((log, found));
        }
        let mut presence = Self {
            files,
            written: None,
        };
        presence.note();
        Ok(presence)
    }

    /// Notes what our own commit made of the database file.
    pub(super) fn note(&mut self) {
        self.written = self.files.first().and_then(|(path, _)| written(path));
    }

    /// Checks that every file is still the one that was opened.
    ///
    /// # Errors
    /// [`PlanError::Lost`], with the file that is gone or another one.
    pub(super) fn check(&self) -> Result<(), PlanError> {
        for (path, opened) in &self.files {
            let what = match identity(path) {
                Some(found) if found == *opened => continue,
                Some(_) => "was replaced by another file",
                None => "was deleted or moved",
            };
            return Err(lost(path, what));
        }
        Ok(())
    }

    /// Checks that no other program has written the database file since the last commit of this
    /// process.
    ///
    /// # Errors
    /// [`PlanError::Lost`].
    pub(super) fn check_unwritten(&self) -> Result<(), PlanError> {
        match self.files.first() {
            Some((path, _)) if written(path) != self.written => {
                Err(lost(path, "was written by another program"))
            }
            _ => Ok(()),
        }
    }

    /// The error for a lock file that was taken away, so that a second writer can come.
    pub(super) fn unlocked(&self) -> PlanError {
        let path = self.files.first().map(|(path, _)| path.as_path());
        lost(
            path.unwrap_or(Path::new("the database")),
            "lost its lock file (its name with -lock)",
        )
    }

    /// The error for contents that another program has changed.
    pub(super) fn changed(&self) -> PlanError {
        let path = self.files.first().map(|(path, _)| path.as_path());
        let path = path.unwrap_or(Path::new("the database"));
        lost(path, "was changed by another program")
    }
}

fn lost(path: &Path, what: &'static str) -> PlanError {
    PlanError::Lost {
        path: path.display().to_string(),
        what,
    }
}

fn identity(path: &Path) -> Option<Identity> {
    let found = fs::metadata(path).ok()?;
    Some((found.dev(), found.ino()))
}

fn written(path: &Path) -> Option<(u64, i64, i64)> {
    let found = fs::metadata(path).ok()?;
    Some((found.len(), found.mtime(), found.mtime_nsec()))
}
