//! Why a command ends without what was asked.

use std::io;
use std::process::ExitCode;

/// Why a command ends; the codes are those of `canter`.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// The cell says no, or a program was refused.
    #[error("{0}")]
    Refused(String),
    /// A wrong argument.
    #[error("{0}")]
    Usage(String),
    /// A file that cannot be read or written.
    #[error("{0}")]
    Unreadable(String),
    /// No router, no cell, no engine, or no right.
    #[error("{0}")]
    NoPeer(String),
    /// The program was stopped.
    #[error("{0}")]
    Stopped(String),
    /// A limit or guard aborted the motion.
    #[error("{0}")]
    Aborted(String),
    /// The driver reported a fault or was lost.
    #[error("{0}")]
    DriverFault(String),
}

impl Failure {
    /// The exit code.
    pub(crate) fn code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Refused(_) => 1,
            Self::Usage(_) => 2,
            Self::Unreadable(_) => 3,
            Self::NoPeer(_) => 4,
            Self::Stopped(_) => 5,
            Self::Aborted(_) => 6,
            Self::DriverFault(_) => 7,
        })
    }

    /// What writing to standard output came to; a reader that has closed it (`| head -1`) is no failure.
    pub(crate) fn of_output(written: io::Result<()>) -> Result<(), Self> {
        match written {
            Err(cause) if cause.kind() != io::ErrorKind::BrokenPipe => {
                Err(Self::Unreadable(format!("standard output: {cause}")))
            }
            _ => Ok(()),
        }
    }

    /// The link says no.
    pub(crate) fn link(cause: impl std::fmt::Display) -> Self {
        Self::NoPeer(words(cause))
    }
}

/// An error of zenoh without the place in its source.
pub(crate) fn words(cause: impl std::fmt::Display) -> String {
    let text = cause.to_string();
    let end = text.find(" at /").unwrap_or(text.len());
    text[..end].trim_end().to_owned()
}

impl From<ipc::IpcError> for Failure {
    fn from(error: ipc::IpcError) -> Self {
        Self::NoPeer(error.to_string())
    }
}
