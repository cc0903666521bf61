//! Requests of an operator to a running engine, and the answers.

use serde::{Deserialize, Serialize};

use crate::RequestId;

/// The longest answer (bytes): the engine has memory for answers of this length from the start,
/// and for no others.
pub const LONGEST_ANSWER: usize = 16 << 10;

/// What an operator asks of a running engine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "verb", rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Verb {
    /// Execute a program.
    Submit {
        /// `text` or `json`.
        format: String,
        /// The program's name, for messages.
        name: String,
        /// The program.
        program: String,
    },
    /// Stop on the path and stay there until `Resume`.
    Pause,
    /// Go on along the path.
    Resume,
    /// Share of the planned speed.
    Override {
        /// 0..=1.
        share: f64,
    },
    /// Stop on the path.
    Stop {
        /// As fast as the joints can, instead of gently.
        fast: bool,
    },
    /// Stop on the path and drop the queue.
    Abort,
    /// Clear a latched fault and open a new session with the driver.
    Recover,
    /// Jog; the arm stops when no further request comes in time.
    Jog {
        /// `joint` or `tool`.
        space: String,
        /// Speeds as fractions of the largest, -1..=1: one per joint, or x, y, z, rx, ry, rz in the
        /// tool frame; all 0 stops.
        speeds: Vec<f64>,
        /// The arm stops when no further request comes for this long (ms).
        timeout_ms: u64,
    },
    /// Report.
    Status,
    /// What has happened.
    Notes {
        /// Number of the last note that the client has; only later ones are returned.
        since: u64,
    },
    /// Stop on the path and end the engine.
    Shutdown,
}

impl Verb {
    /// Whether the request is withdrawn when the client stops waiting. Stop, pause and abort are
    /// executed all the same.
    pub fn can_be_withdrawn(&self) -> bool {
        self.commands()
    }

    /// Whether only the client that commands the arm may ask this. Any client may stop, pause and
    /// ask for the status.
    pub fn commands(&self) -> bool {
        matches!(
            self,
            Self::Submit { .. }
                | Self::Resume
                | Self::Override { .. }
                | Self::Recover
                | Self::Jog { .. }
                | Self::Shutdown
        )
    }
}

/// Who asks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// A name a person understands.
    pub name: String,
    /// The process number.
    pub process: u32,
}

/// A request with its sender.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// Its number; the answer carries it.
    pub id: RequestId,
    /// Who asks.
    pub client: Identity,
    /// What for.
    pub ask: Verb,
}

/// The engine's answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Whether the engine does it.
    pub accepted: bool,
    /// One sentence for the user; empty if there is nothing to say.
    pub message: String,
    /// Details for a program.
    pub body: serde_json::Value,
}

impl Answer {
    /// Yes, with details.
    pub fn accept(body: serde_json::Value) -> Self {
        Self {
            accepted: true,
            message: String::new(),
            body,
        }
    }

    /// The bytes for the sender of request `id`; at most [`LONGEST_ANSWER`].
    pub(crate) fn encode(&self, id: RequestId) -> Result<Vec<u8>, serde_json::Error> {
        let encode = |answer: &Self| serde_json::to_vec(&Reply { id, answer });
        let text = encode(self)?;
        if text.len() <= LONGEST_ANSWER {
            return Ok(text);
        }
        // A character is at most six bytes of JSON. What was decided stays true.
        let kept: String = self.message.chars().take(LONGEST_ANSWER / 8).collect();
        encode(&Self {
            accepted: self.accepted,
            message: format!("{kept} (the answer is cut: it has {} bytes)", text.len()),
            body: serde_json::Value::Null,
        })
    }

    /// No, and why.
    pub fn refuse(message: impl Into<String>) -> Self {
        Self {
            accepted: false,
            message: message.into(),
            body: serde_json::Value::Null,
        }
    }
}

/// An answer on its way.
#[derive(Serialize)]
struct Reply<'a> {
    id: RequestId,
    answer: &'a Answer,
}

/// An answer that has come.
#[derive(Deserialize)]
pub(crate) struct Received {
    pub(crate) id: RequestId,
    pub(crate) answer: Answer,
}
