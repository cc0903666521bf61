//! What may be asked over the network: a list. Everything else is refused.

use ipc::{ControlAsk, Verb};
use serde::Deserialize;

/// The longest question (bytes).
const LONGEST: usize = 4 << 20;

/// What may be asked of an arm over the network.
#[derive(Clone, Debug, PartialEq)]
pub enum Allowed {
    /// Say how it is.
    Status,
    /// Something for the engine's main thread.
    Engine(Verb),
    /// Something about the current motion.
    Control(ControlAsk),
}

/// Why a question does not pass.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// Not in the list.
    #[error(
        "{0:?} does not go over the network; what does: {list}. Setpoints, jog and recover are for \
         who stands at the arm", list = WORDS.join(", ")
    )]
    NotAllowed(String),
    /// For one arm only.
    #[error("{0:?} goes to one arm, not to all")]
    OneArm(String),
    /// It came late.
    #[error("too late by {late_ms} ms: it was meant for an earlier moment, and was not done")]
    TooLate {
        /// How late.
        late_ms: u64,
    },
    /// It cannot be read.
    #[error("{word:?}: expected {expected}, {cause}")]
    Unreadable {
        /// What is asked.
        word: String,
        /// What belongs to it.
        expected: &'static str,
        /// What is wrong.
        cause: String,
    },
}

/// Everything that passes.
const WORDS: [&str; 7] = [
    "status", "notes", "submit", "pause", "resume", "stop", "override",
];

/// What belongs to a program.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Submission {
    id: String,
    session: String,
    until_ns: u64,
    format: String,
    name: String,
    program: String,
}

/// What belongs to a question about notes.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Since {
    since: u64,
}

/// What belongs to a speed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Share {
    share: f64,
    until_ns: u64,
}

/// What belongs to what may make the arm move.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Until {
    until_ns: u64,
}

impl Allowed {
    /// Reads a question: the last word of its name, its text, the time of this cell (ns since 1970).
    /// `one` says whether it goes to one arm.
    ///
    /// What can make an arm move carries the time until which it holds, on the clock of the cell; a
    /// network that delivers late moves nothing.
    ///
    /// # Errors
    /// [`Refusal`]: it is not in the list, or cannot be read, or is late.
    ///
    /// ```
    /// use canter_fleet::Allowed;
    /// assert!(Allowed::read("stop", b"", (false, 0)).is_ok());
    /// assert!(Allowed::read("jog", b"{}", (true, 0)).is_err());
    /// ```
    pub fn read(word: &str, text: &[u8], (one, now_ns): (bool, u64)) -> Result<Self, Refusal> {
        if !WORDS.contains(&word) {
            let shown = word.chars().take(40).collect();
            return Err(Refusal::NotAllowed(shown));
        }
        let read = Text { word, text };
        if !one && !["status", "pause", "stop"].contains(&word) {
            return Err(Refusal::OneArm(word.to_owned()));
        }
        Ok(match word {
            "status" => Self::Status,
            "notes" => {
                let Since { since } = read.as_json("{since: number}")?;
                Self::Engine(Verb::Notes { since })
            }
            "submit" => {
                let all: Submission =
                    read.as_json("{id, session, until_ns, format, name, program}")?;
                in_time(all.until_ns, now_ns)?;
                Self::Engine(Verb::SubmitOnce {
                    id: all.id,
                    session: all.session,
                    format: all.format,
                    name: all.name,
                    program: all.program,
                })
            }
            "override" => {
                let Share { share, until_ns } = read.as_json("{share: 0 to 1, until_ns}")?;
                in_time(until_ns, now_ns)?;
                Self::Control(ControlAsk::Override(share))
            }
            "resume" => {
                let Until { until_ns } = read.as_json("{until_ns}")?;
                in_time(until_ns, now_ns)?;
                Self::Control(ControlAsk::Resume)
            }
            "pause" => Self::Control(ControlAsk::Pause),
            "stop" => Self::Control(ControlAsk::Stop { fast: true }),
            _ => return Err(Refusal::NotAllowed(word.to_owned())),
        })
    }
}

/// Whether now is not after the time that something holds until.
fn in_time(until_ns: u64, now_ns: u64) -> Result<(), Refusal> {
    match now_ns.checked_sub(until_ns) {
        Some(late) if late > 0 => Err(Refusal::TooLate {
            late_ms: late.div_ceil(1_000_000),
        }),
        _ => Ok(()),
    }
}

/// The text of a question.
struct Text<'a> {
    word: &'a str,
    text: &'a [u8],
}

impl Text<'_> {
    fn as_json<T: for<'a> Deserialize<'a>>(&self, expected: &'static str) -> Result<T, Refusal> {
        let wrong = |cause: String| Refusal::Unreadable {
            word: self.word.to_owned(),
            expected,
            cause,
        };
        if self.text.len() > LONGEST {
            return Err(wrong(format!("got {} bytes", self.text.len())));
        }
        // A list would be read by the places of the fields.
        if self.text.trim_ascii_start().first() != Some(&b'{') {
            return Err(wrong("got something else".to_owned()));
        }
        serde_json::from_slice(self.text).map_err(|cause| wrong(cause.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUBMIT: &str = r#"{"id": "a", "session": "s", "until_ns": 10, "format": "text",
        "name": "p", "program": "x"}"#;

    #[test]
    fn what_is_listed_passes() {
        let read = |word, text: &str| Allowed::read(word, text.as_bytes(), (true, 10));
        assert_eq!(read("status", ""), Ok(Allowed::Status));
        assert_eq!(
            read("notes", r#"{"since": 3}"#),
            Ok(Allowed::Engine(Verb::Notes { since: 3 }))
        );
        assert!(matches!(
            read("submit", SUBMIT),
            Ok(Allowed::Engine(Verb::SubmitOnce { .. }))
        ));
        assert_eq!(
            read("override", r#"{"share": 0.5, "until_ns": 10}"#),
            Ok(Allowed::Control(ControlAsk::Override(0.5)))
        );
        assert_eq!(
            read("resume", r#"{"until_ns": 11}"#),
            Ok(Allowed::Control(ControlAsk::Resume))
        );
        assert_eq!(read("pause", ""), Ok(Allowed::Control(ControlAsk::Pause)));
        let stop = ControlAsk::Stop { fast: true };
        assert_eq!(read("stop", ""), Ok(Allowed::Control(stop)));
    }

    #[test]
    fn nothing_else_passes() {
        for word in [
            "jog",
            "recover",
            "abort",
            "follow",
            "replace",
            "shutdown",
            "next",
            "single_step",
            "setpoint",
            "state",
            "text",
            "submit_once",
            "*",
            "**",
            "",
            "Stop",
        ] {
            let refused = Allowed::read(word, SUBMIT.as_bytes(), (true, 0));
            assert!(matches!(refused, Err(Refusal::NotAllowed(_))), "{word}");
        }
    }

    #[test]
    fn what_moves_goes_to_one_arm_and_in_time() {
        for (word, text) in [
            ("submit", SUBMIT),
            ("resume", r#"{"until_ns": 10}"#),
            ("override", r#"{"share": 1, "until_ns": 10}"#),
        ] {
            let all = Allowed::read(word, text.as_bytes(), (false, 0));
            assert_eq!(all, Err(Refusal::OneArm(word.to_owned())));
            let late = Allowed::read(word, text.as_bytes(), (true, 11));
            assert_eq!(late, Err(Refusal::TooLate { late_ms: 1 }), "{word}");
            for wrong in ["", "{}", "[1]", "nonsense", r#"{"until_ns": 20, "jog": 1}"#] {
                let refused = Allowed::read(word, wrong.as_bytes(), (true, 0));
                assert!(
                    matches!(refused, Err(Refusal::Unreadable { .. })),
                    "{wrong}"
                );
            }
        }
        for word in ["stop", "pause", "status"] {
            assert!(Allowed::read(word, b"", (false, u64::MAX)).is_ok());
        }
        let long = vec![b' '; LONGEST + 1];
        assert!(Allowed::read("submit", &long, (true, 0)).is_err());
    }
}
