//! Why a view cannot be served.

use ipc::IpcError;
use planner::robot::RobotError;
use recorder::RecorderError;
use thiserror::Error;

/// Why a view cannot be served.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ViewError {
    /// The port cannot be used.
    #[error("cannot listen on 127.0.0.1:{port}: {cause}; --port 0 takes a free one")]
    Port {
        /// The port asked for.
        port: u16,
        /// What the operating system said.
        cause: String,
    },
    /// The operating system gave no random numbers for the token.
    #[error("cannot make a token: {cause}")]
    Token {
        /// What the operating system said.
        cause: String,
    },
    /// The operating system gave no thread.
    #[error("cannot start a thread of the view: {cause}")]
    Thread {
        /// What the operating system said.
        cause: String,
    },
    /// The engine, or shared memory.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The engine said no.
    #[error("the engine refuses: {0}")]
    Refused(String),
    /// The robot's files.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The recording.
    #[error(transparent)]
    Recording(#[from] RecorderError),
}
