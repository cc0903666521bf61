use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;

use serde_json::{Value, json};
use zenoh::Session;

use super::{Contact, accepted, ask_one, print};
use crate::failure::Failure;
use crate::link::{LinkOption, open, until_signal};

/// How often an arm is asked what has happened.
const POLL: Duration = Duration::from_millis(200);

/// Print what happens to an arm, one line of JSON each
///
/// Nothing is lost while the network is gone: the notes are numbered, and asked for by number. An
/// engine keeps its last 512.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Notes {
    /// Name of the arm
    #[arg(value_name = "CELL/ARM")]
    arm: String,
    /// Only those after this number [default: those that come]
    #[arg(long, value_name = "NUMBER")]
    since: Option<u64>,
    /// End when nothing more is there
    #[arg(long)]
    now: bool,
    #[command(flatten)]
    link: LinkOption,
}

impl Notes {
    /// Prints until a signal comes.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let ends = until_signal()?;
        let session = open(&self.link)?;
        let mut follower = Follower::new(&session, &self.arm)?;
        if let Some(since) = self.since {
            follower.seen = since;
        }
        while !ends.load(Ordering::Acquire) {
            let notes = follower.next()?;
            if self.now && notes.is_empty() {
                break;
            }
            for note in &notes {
                print(note)?;
            }
            if notes.is_empty() {
                sleep(POLL);
            }
        }
        Ok(())
    }
}

/// Asks for the notes of one run of an engine.
pub(super) struct Follower<'a> {
    session: &'a Session,
    arm: &'a str,
    /// The run of the engine.
    pub(super) run: String,
    /// Number of the last note that is known.
    pub(super) seen: u64,
}

impl<'a> Follower<'a> {
    /// From now on.
    pub(super) fn new(session: &'a Session, arm: &'a str) -> Result<Self, Failure> {
        let contact = Contact::make(session, arm)?;
        Ok(Self {
            session,
            arm,
            run: contact.body["session"]
                .as_str()
                .unwrap_or_default()
                .to_owned(),
            seen: contact.body["last_note"].as_u64().unwrap_or(0),
        })
    }

    /// What has happened since; nothing where the network is gone for a while.
    ///
    /// # Errors
    /// The engine was started again.
    pub(super) fn next(&mut self) -> Result<Vec<Value>, Failure> {
        let since = json!({"since": self.seen});
        let Some(answer) = ask_one(self.session, (self.arm, "notes"), &since)? else {
            return Ok(Vec::new());
        };
        let Ok(body) = accepted(answer) else {
            return Ok(Vec::new());
        };
        if body["session"].as_str() != Some(&self.run) {
            return Err(Failure::NoPeer(format!(
                "the engine of {} was started again",
                self.arm
            )));
        }
        let notes = body["notes"].as_array().cloned().unwrap_or_default();
        if let Some(last) = notes.last() {
            self.seen = last["number"].as_u64().unwrap_or(self.seen);
        }
        Ok(notes)
    }

    /// Prints notes until a command is over.
    ///
    /// # Errors
    /// The program ended otherwise than done, or the signal came.
    pub(super) fn until(&mut self, last: u64, ends: &AtomicBool) -> Result<(), Failure> {
        while !ends.load(Ordering::Acquire) {
            let notes = self.next()?;
            for entry in &notes {
                print(&entry["note"])?;
                if let Some(end) = over(&entry["note"], last) {
                    return end;
                }
            }
            if notes.is_empty() {
                sleep(POLL);
            }
        }
        Err(Failure::Stopped(
            "no longer waited for; the program goes on".to_owned(),
        ))
    }
}

/// How the program ended, if nothing of it can follow.
fn over(note: &Value, last: u64) -> Option<Result<(), Failure>> {
    let is_last = note["id"].as_u64() == Some(last);
    let why = |of: &Value| of.as_str().unwrap_or("no reason").to_owned();
    match note["event"].as_str()? {
        "done" if is_last => Some(Ok(())),
        "refused" if is_last || note["dropped"].as_u64() > Some(0) => {
            Some(Err(Failure::Refused(why(&note["error"]["message"]))))
        }
        "aborted" => Some(Err(Failure::Stopped("the program was stopped".to_owned()))),
        "faulted" if note["blame"] == "guard" => Some(Err(Failure::Aborted(why(&note["reason"])))),
        "faulted" => Some(Err(Failure::DriverFault(why(&note["reason"])))),
        "closed" => Some(Err(Failure::NoPeer("the engine has ended".to_owned()))),
        _ => None,
    }
}
