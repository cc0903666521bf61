//! Why a canonical command cannot be executed.

use serde::Serialize;
use thiserror::Error;

/// The six classes of error that a robot controller distinguishes.
///
/// # Source
/// The classes of NIST's KittingViewer (2013), its counts of errors by kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ErrorClass {
    /// A number is outside the range that its command allows.
    Range,
    /// The text or the data of a command cannot be understood.
    Parse,
    /// The command is not allowed at this point of the program.
    Sequence,
    /// The gripper cannot be used now.
    GripperUse,
    /// The tool changer cannot be used now.
    ToolChange,
    /// The motion cannot be made.
    Motion,
}

impl std::fmt::Display for ErrorClass {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Range => "range",
            Self::Parse => "parse",
            Self::Sequence => "sequence",
            Self::GripperUse => "gripper use",
            Self::ToolChange => "tool change",
            Self::Motion => "motion",
        })
    }
}

/// One command that has no effect because it breaks a rule of the language,
/// of the tools or of the arm.
#[derive(Clone, Debug, Error, PartialEq, Serialize)]
#[error("{class} error: {message}")]
pub struct CommandError {
    /// Kind of error, for counting and for policy.
    pub class: ErrorClass,
    /// What was expected and what came.
    pub message: String,
    /// What would fix it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub help: Option<String>,
}

impl CommandError {
    /// A motion that did not end as its command says.
    pub fn motion(message: impl Into<String>) -> Self {
        Self::new(ErrorClass::Motion, message)
    }

    pub(crate) fn new(class: ErrorClass, message: impl Into<String>) -> Self {
        Self {
            class,
            message: message.into(),
            help: None,
        }
    }

    pub(crate) fn range(message: impl Into<String>) -> Self {
        Self::new(ErrorClass::Range, message)
    }

    pub(crate) fn sequence(message: impl Into<String>) -> Self {
        Self::new(ErrorClass::Sequence, message)
    }

    pub(crate) fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// A value that the language itself refuses is a range error.
impl From<crcl::ValueError> for CommandError {
    fn from(error: crcl::ValueError) -> Self {
        Self::range(error.to_string()).with_help(error.help())
    }
}
