//! Why a robot cannot be used.

use kinematics::UrdfError;
use thiserror::Error;

/// Why a robot cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RobotError {
    /// No shipped robot has that name, and it is not a folder either.
    #[error("no robot \"{name}\": expected a folder with robot.toml, or one of {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The shipped names.
        known: String,
    },
    /// A file cannot be read.
    #[error("{file}: cannot read: {message}")]
    Read {
        /// The file.
        file: String,
        /// What the system said.
        message: String,
    },
    /// A file or folder cannot be written.
    #[error("{file}: cannot write: {message}")]
    Write {
        /// The file.
        file: String,
        /// What the system said.
        message: String,
    },
    /// `robot.toml` is not TOML, or has a key too many, too few or of a wrong kind.
    #[error("{file}:{line}:{column}: {message}")]
    Toml {
        /// The file.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// Column, counted from 1.
        column: usize,
        /// What was expected and what came.
        message: String,
    },
    /// A value of `robot.toml` does not fit the robot.
    #[error("{file}:{line}:{column}: {key}: expected {expected}, found {found}")]
    Value {
        /// The file.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// Column, counted from 1.
        column: usize,
        /// The key.
        key: String,
        /// What it should be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// The URDF cannot be used.
    #[error("{file}:{source}")]
    Urdf {
        /// The file.
        file: String,
        /// What is wrong with it.
        source: UrdfError,
    },
    /// The robot has more joints than the engine drives.
    #[error("{file}: the chain has {found} movable joints, at most {most} are driven")]
    TooManyJoints {
        /// The file.
        file: String,
        /// Joints in the chain.
        found: usize,
        /// The most that are driven.
        most: usize,
    },
}
