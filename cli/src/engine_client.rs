//! A running engine, as those see it who look on: its robot, its programs, its notes.

use std::time::Duration;

use ipc::{Arm, Client, Verb, whole_text};
use planner::robot::Robot;
use serde_json::Value;

use crate::client::accepted;
use crate::exit::Exit;
use crate::failure::Failure;

/// How long the engine may take to answer.
const PATIENCE: Duration = Duration::from_secs(3);

/// A running engine.
pub(crate) struct EngineClient {
    client: Client,
}

impl EngineClient {
    /// Opens the engine of an arm.
    ///
    /// # Errors
    /// [`Exit::NoPeer`] when shared memory cannot be used.
    pub(crate) fn open(arm: &Arm, name: &str) -> Result<Self, Failure> {
        let client = Client::open(arm, name)?;
        Ok(Self { client })
    }

    /// Asks and gives the body of the answer.
    ///
    /// # Errors
    /// [`Exit::NoPeer`] without an engine, [`Exit::Refused`] with its words when it refuses.
    pub(crate) fn ask(&self, verb: Verb) -> Result<Value, Failure> {
        Ok(accepted(self.client.ask(verb, PATIENCE)?)?.body)
    }

    /// A long text of the engine: `urdf`, `robot` or `program`.
    ///
    /// # Errors
    /// As [`Self::ask`].
    pub(crate) fn text(&self, of: &str) -> Result<String, Failure> {
        whole_text(of, |verb| self.ask(verb))
    }

    /// The robot that the engine moves, by its own files.
    ///
    /// # Errors
    /// As [`Self::ask`], and an engine whose robot cannot be read here.
    pub(crate) fn robot(&self) -> Result<Robot, Failure> {
        let body = self.ask(Verb::Status)?;
        let name = body["status"]["robot"].as_str().unwrap_or("robot");
        let (urdf, toml) = (self.text("urdf")?, self.text("robot")?);
        planner::robot::parse(name, &urdf, &toml)
            .map_err(|error| Failure::new(Exit::Unreadable, error))
    }
}
