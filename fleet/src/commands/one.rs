//! Questions to one arm that can make it move.

use serde_json::json;

use super::{Contact, accepted, ask_one, print, unknown};
use crate::failure::Failure;
use crate::link::{LinkOption, open};

/// One arm.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct One {
    /// Name of the arm
    #[arg(value_name = "CELL/ARM")]
    arm: String,
    #[command(flatten)]
    link: LinkOption,
}

impl One {
    /// Lets the arm go on.
    pub(crate) fn resume(&self) -> Result<(), Failure> {
        self.ask("resume", None)
    }

    fn ask(&self, word: &str, share: Option<f64>) -> Result<(), Failure> {
        let session = open(&self.link)?;
        let contact = Contact::make(&session, &self.arm)?;
        let mut text = json!({"until_ns": contact.until_ns()});
        if let Some(share) = share {
            text["share"] = json!(share);
        }
        let answer = ask_one(&session, (&self.arm, word), &text)?;
        let answer = answer.ok_or_else(|| unknown(&self.arm, word))?;
        print(&accepted(answer)?)
    }
}

/// Set the speed of an arm, as a share of the planned one: 0 to 1
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Override {
    #[command(flatten)]
    one: One,
    /// The share
    #[arg(value_name = "SHARE")]
    share: f64,
}

impl Override {
    /// Asks the arm.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        self.one.ask("override", Some(self.share))
    }
}
