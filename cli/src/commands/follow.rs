use std::path::PathBuf;

use clap::Args;
use ipc::{FollowPoint, Verb};
use serde::Deserialize;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::{input, output};

use super::send::wait;

/// Have a running engine follow a joint trajectory with the times of its points
///
/// The file is JSON: `joints` are the names, `points` have `time_s`, `positions` and, for all points
/// or for none, `velocities` and `accelerations` (s, rad, m). The trajectory begins where the arm
/// stands, ends at rest, and is refused as a whole if it breaks a limit. Prints one JSON object per
/// event, one per line.
#[derive(Args, Debug)]
pub(crate) struct Follow {
    /// The trajectory
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    arm: ArmOption,
    /// Keep only the way, and let the engine choose the fastest times
    #[arg(long)]
    retime: bool,
}

/// A trajectory in a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    joints: Vec<String>,
    points: Vec<FollowPoint>,
}

impl Follow {
    /// Sends, then waits for the end.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let text = input::text(&self.file)?;
        let read = serde_json::from_str(&text).map_err(anyhow::Error::from);
        let File { joints, points } = input::unreadable(&self.file.display().to_string(), read)?;
        let seen = self.arm.ask(Verb::Status)?.body["last_note"].as_u64();
        let answer = self.arm.ask(Verb::Follow {
            joints,
            points,
            retime: self.retime,
        })?;
        output::note("canter: the trajectory is accepted for checking");
        match answer.body["last"].as_u64() {
            Some(last) => wait(&self.arm, seen.unwrap_or(0), last),
            None => Ok(Exit::Done),
        }
    }
}
