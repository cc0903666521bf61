//! The commands that show and command the arms.

mod all;
mod completions;
mod keyboard;
mod man;
mod notes;
mod one;
mod router;
mod send;
mod top;

pub(crate) use all::All;
pub(crate) use completions::Completions;
pub(crate) use man::Man;
pub(crate) use notes::Notes;
pub(crate) use one::{One, Override};
pub(crate) use router::Router;
pub(crate) use send::Send;
pub(crate) use top::Top;

use std::io::Write;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use zenoh::Session;

use crate::failure::Failure;
use crate::link::ask;

/// How long an arm may take to answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// A line of JSON for who reads the output.
fn print(line: &Value) -> Result<(), Failure> {
    writeln!(std::io::stdout().lock(), "{line}")
        .map_err(|cause| Failure::Unreadable(format!("standard output: {cause}")))
}

/// The body of a positive answer; the refusal otherwise.
fn accepted(answer: Value) -> Result<Value, Failure> {
    if answer["accepted"] == true {
        return Ok(answer["body"].clone());
    }
    let why = answer["message"].as_str().unwrap_or("refused");
    Err(Failure::Refused(why.to_owned()))
}

/// Asks one arm.
fn ask_one(
    session: &Session,
    (arm, word): (&str, &str),
    text: &Value,
) -> Result<Option<Value>, Failure> {
    let answers = ask(session, (arm, word), text, PATIENCE)?;
    Ok(answers.into_iter().next().map(|(_, answer)| answer))
}

/// An arm that has answered: how it is, and until when it would do what is asked now.
struct Contact {
    /// What it said: status, session, last_note.
    body: Value,
    /// Its clock then (ns since 1970).
    clock_ns: u64,
    asked: Instant,
}

impl Contact {
    /// Asks an arm how it is.
    fn make(session: &Session, arm: &str) -> Result<Self, Failure> {
        let asked = Instant::now();
        let answer = ask_one(session, (arm, "status"), &json!({}))?;
        let Some(answer) = answer else {
            return Err(Failure::NoPeer(format!(
                "{arm} does not answer: no such arm, its cell is dark, or no right to ask"
            )));
        };
        let body = accepted(answer)?;
        let clock_ns = body["clock_ns"].as_u64().unwrap_or(0);
        Ok(Self {
            body,
            clock_ns,
            asked,
        })
    }

    /// Until when (on the clock of the arm) something holds that is asked now and waited for.
    fn until_ns(&self) -> u64 {
        let hold = self.asked.elapsed() + PATIENCE;
        let hold = u64::try_from(hold.as_nanos()).unwrap_or(u64::MAX);
        self.clock_ns.saturating_add(hold)
    }
}

/// Nothing came back of something that was asked.
fn unknown(arm: &str, word: &str) -> Failure {
    Failure::NoPeer(format!(
        "{arm} gave no answer to {word}: no right, or the network or its cell is gone. What became of \
         it is not known; canter-fleet list shows how the arm is"
    ))
}
