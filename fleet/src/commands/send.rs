use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::notes::Follower;
use super::{Contact, accepted, ask_one};
use crate::answers::clock_ns;
use crate::failure::Failure;
use crate::link::{LinkOption, open, until_signal};

/// Largest file of a program (bytes).
const LARGEST: u64 = 1 << 20;

/// Send a program to an arm and wait for its end
///
/// Prints what happens, one line of JSON each. Each program has an id that the engine takes once: if the
/// network is gone before the answer comes, the same command with `--id` and `--session`, as the
/// message says, finds out whether it was taken, and gives it if not. Nothing is sent twice by itself.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Send {
    /// Name of the arm
    #[arg(value_name = "CELL/ARM")]
    arm: String,
    /// The program: .canon (text), .json or .xml
    #[arg(value_name = "PROGRAM")]
    program: PathBuf,
    /// The id of an earlier attempt
    #[arg(long, value_name = "ID", requires = "session")]
    id: Option<String>,
    /// The session of the engine at the earlier attempt
    #[arg(long, value_name = "SESSION", requires = "id")]
    session: Option<String>,
    /// Only hand it over
    #[arg(long)]
    no_wait: bool,
    #[command(flatten)]
    link: LinkOption,
}

impl Send {
    /// Sends, then follows.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let text = read(&self.program)?;
        let ends = until_signal()?;
        let session = open(&self.link)?;
        let contact = Contact::make(&session, &self.arm)?;
        let mut follower = Follower::new(&session, &self.arm)?;
        follower.seen = contact.body["last_note"].as_u64().unwrap_or(0);
        let id = self.id.clone().unwrap_or_else(fresh_id);
        let run = self.session.clone().unwrap_or_else(|| follower.run.clone());
        let program = json!({
            "id": id,
            "session": run,
            "until_ns": contact.until_ns(),
            "format": form(&self.program),
            "name": self.program.display().to_string(),
            "program": text,
        });
        let Some(answer) = ask_one(&session, (&self.arm, "submit"), &program)? else {
            return Err(Failure::NoPeer(format!(
                "{} gave no answer to the program: no right, or the network or its cell is gone. \
                 What became of it is not known; the same command with --id {id} --session {run} \
                 finds out, and gives it only if it was not taken",
                self.arm
            )));
        };
        let body = accepted(answer)?;
        say(&body, &id);
        match body["last"].as_u64() {
            Some(last) if !self.no_wait => {
                if body["again"] == true {
                    // Its notes may have been before this attempt.
                    follower.seen = 0;
                }
                follower.until(last, &ends)
            }
            _ => Ok(()),
        }
    }
}

/// Says what was taken.
fn say(body: &Value, id: &str) {
    let commands = body["commands"].as_u64().unwrap_or(0);
    let again = if body["again"] == true {
        ", at an earlier attempt"
    } else {
        ""
    };
    // Nobody may listen.
    let _ = writeln!(
        std::io::stderr().lock(),
        "canter-fleet: {commands} commands accepted as {id}{again}"
    );
}

/// An id that no other program has.
fn fresh_id() -> String {
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let host: String = host
        .chars()
        .filter(|c| c.is_ascii_alphanumeric() || *c == '-')
        .take(40)
        .collect();
    format!("{host}-{:x}-{:x}", std::process::id(), clock_ns())
}

/// The form of a program, by its name.
fn form(path: &Path) -> &'static str {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("json") => "json",
        Some("xml") => "xml",
        _ => "text",
    }
}

/// Reads a program.
fn read(path: &Path) -> Result<String, Failure> {
    let shown = path.display();
    let unreadable = |cause: String| Failure::Unreadable(format!("cannot read {shown}: {cause}"));
    let found = fs::metadata(path).map_err(|cause| unreadable(cause.to_string()))?;
    if !found.is_file() || found.len() > LARGEST {
        let wanted = format!("expected a regular file of at most {LARGEST} bytes");
        return Err(unreadable(wanted));
    }
    fs::read_to_string(path).map_err(|cause| unreadable(cause.to_string()))
}
