//! Why a recording cannot be written or read.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a recording cannot be written or read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecorderError {
    /// The file cannot be written.
    #[error("cannot write {}: {cause}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system or the MCAP library said.
        cause: String,
    },
    /// The file cannot be read.
    #[error("cannot read {}: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system or the MCAP library said.
        cause: String,
    },
    /// The file is no recording of Canter.
    #[error("{}: expected a recording of canter, found {found}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What is there or missing.
        found: String,
    },
    /// There is already a file of this name.
    #[error("{} exists already; give another name or remove it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The operating system gave no thread.
    #[error("cannot start the recorder's thread: {cause}")]
    Thread {
        /// What the operating system said.
        cause: String,
    },
}

/// A file that cannot be written.
pub(crate) fn unwritable(path: &Path, cause: impl ToString) -> RecorderError {
    RecorderError::Write {
        path: path.to_owned(),
        cause: cause.to_string(),
    }
}

/// A file that cannot be read.
pub(crate) fn unreadable(path: &Path, cause: impl ToString) -> RecorderError {
    RecorderError::Read {
        path: path.to_owned(),
        cause: cause.to_string(),
    }
}

/// A file that must not be there yet.
pub(crate) fn created(path: &Path, cause: &io::Error) -> RecorderError {
    if cause.kind() == io::ErrorKind::AlreadyExists {
        let path = path.to_owned();
        return RecorderError::Exists { path };
    }
    unwritable(path, cause)
}
