//! Requests of an operator to a running engine, and the answers.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::RequestId;

/// The longest answer (bytes): the engine has memory for answers of this length from the start,
/// and for no others.
pub const LONGEST_ANSWER: usize = 16 << 10;

/// What an operator asks of a running engine. What acts on the current motion (stop, pause, resume,
/// override, abort, recover) is not among it: that is a [`crate::ControlAsk`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "verb", rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Verb {
    /// Execute a program.
    Submit {
        /// `text`, `json` or `xml`.
        format: String,
        /// The program's name, for messages.
        name: String,
        /// The program.
        program: String,
    },
    /// Execute a program that has a number of its sender's. A sender that got no answer sends the same
    /// again: the engine takes a number once, and answers as the first time.
    SubmitOnce {
        /// The number: 1 to 100 ASCII letters, digits and signs, different for each program.
        id: String,
        /// The session of the engine that it is for, as [`Verb::Status`] tells it.
        session: String,
        /// `text`, `json` or `xml`.
        format: String,
        /// The program's name, for messages.
        name: String,
        /// The program.
        program: String,
    },
    /// Execute a move in the place of the one that moves now, in the same state of motion and without
    /// a stop; refused where that is not possible, and the old move goes on.
    Replace {
        /// `text`, `json` or `xml`.
        format: String,
        /// The program's name, for messages.
        name: String,
        /// The program: one move, with settings before and behind it.
        program: String,
    },
    /// Jog; the arm stops when no further request comes in time.
    Jog {
        /// `joint`, `tool`, `workstation`, `base` or `goal`.
        space: String,
        /// Speeds as fractions of the largest, -1..=1: one per joint, or x, y, z, rx, ry, rz in the
        /// tool frame, in the workstation or in the base; one for all joints towards a goal; all 0 stops.
        speeds: Vec<f64>,
        /// The arm stops when no further request comes for this long (ms).
        timeout_ms: u64,
        /// How far at most: m of the tool, or rad or m of the joint that moves most; the jog then
        /// ends by itself. Without it as far as the arm can go.
        #[serde(default)]
        distance: Option<f64>,
        /// Where a jog in space `goal` ends: one position per joint (rad, m).
        #[serde(default)]
        goal: Vec<f64>,
    },
    /// Follow a joint trajectory with the times of its points. It goes into the queue like a
    /// command; a note tells when it begins, or why it is refused as a whole.
    Follow {
        /// Names of the joints, in the order of the numbers in each point: every joint of the arm
        /// once.
        joints: Vec<String>,
        /// The points in the order of time.
        points: Vec<FollowPoint>,
        /// Whether only the way is kept, and the engine makes the time law.
        #[serde(default)]
        retime: bool,
    },
    /// Execute commands one by one, or all again.
    SingleStep {
        /// Whether each command waits for [`Verb::Next`].
        on: bool,
    },
    /// Let the next command begin that waits for it.
    Next,
    /// Report.
    Status,
    /// What has happened.
    Notes {
        /// Number of the last note that the client has; only later ones are returned.
        since: u64,
    },
    /// A text of the engine, in parts: the robot's files, or the last program.
    Text {
        /// `urdf`, `robot` (robot.toml), `folder` (where the robot's files are) or `program`.
        of: String,
        /// Where the part begins (bytes): 0, then the `next` of the answer before.
        from: usize,
    },
    /// Stop on the path and end the engine.
    Shutdown,
}

impl Verb {
    /// Whether it has an effect on arm or engine. Only the client that commands the arm may ask
    /// this; and it is withdrawn when the client gives up waiting.
    pub fn commands(&self) -> bool {
        match self {
            Self::Submit { .. }
            | Self::SubmitOnce { .. }
            | Self::Replace { .. }
            | Self::Jog { .. }
            | Self::Follow { .. }
            | Self::SingleStep { .. }
            | Self::Next
            | Self::Shutdown => true,
            Self::Status | Self::Notes { .. } | Self::Text { .. } => false,
        }
    }

    /// The program that it puts into the queue.
    #[must_use]
    pub fn program(&self) -> Option<SubmittedProgram<'_>> {
        match self {
            Self::Submit {
                format,
                name,
                program,
            }
            | Self::SubmitOnce {
                format,
                name,
                program,
                ..
            } => Some(SubmittedProgram {
                format,
                name,
                text: program,
            }),
            _ => None,
        }
    }
}

/// A program of a request, for the queue of commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SubmittedProgram<'a> {
    /// `text`, `json` or `xml`.
    pub format: &'a str,
    /// Its name, for messages.
    pub name: &'a str,
    /// The program.
    pub text: &'a str,
}

/// A long text of an engine: asks for its parts ([`Verb::Text`]) and puts them together. `ask` gives the
/// body of an answer.
///
/// # Errors
/// Those of `ask`.
///
/// # Example
/// ```
/// let parts = ["<robot ", "name=\"a\"/>"];
/// let mut asked = parts.iter();
/// let text = ipc::whole_text("urdf", |_verb| {
///     Ok::<_, ()>(serde_json::json!({ "text": asked.next(), "length": 17 }))
/// });
/// assert_eq!(text, Ok("<robot name=\"a\"/>".to_owned()));
/// ```
pub fn whole_text<E>(of: &str, mut ask: impl FnMut(Verb) -> Result<Value, E>) -> Result<String, E> {
    let mut text = String::new();
    loop {
        let of = of.to_owned();
        let from = text.len();
        let body = ask(Verb::Text { of, from })?;
        let part = body["text"].as_str().unwrap_or_default();
        text.push_str(part);
        if part.is_empty() || body["length"].as_u64() <= Some(text.len() as u64) {
            return Ok(text);
        }
    }
}

/// A point of [`Verb::Follow`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FollowPoint {
    /// When (s after the start of the trajectory).
    pub time_s: f64,
    /// Joint positions (rad, m).
    pub positions: Vec<f64>,
    /// Joint velocities (rad/s, m/s); empty: not given. For all points or for none.
    #[serde(default)]
    pub velocities: Vec<f64>,
    /// Joint accelerations (rad/s², m/s²); empty: not given. For all points or for none.
    #[serde(default)]
    pub accelerations: Vec<f64>,
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
