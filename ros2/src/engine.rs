//! The thread that asks the engine, and what it hears from it.
//!
//! An answer of the engine may take long; the thread that serves ROS waits for none.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::thread::sleep;
use std::time::{Duration, Instant};

use ipc::{Arm, Client, FollowPoint, IpcError, Verb, whole_text};
use serde_json::Value;

/// How long an engine may take to answer.
const PATIENCE: Duration = Duration::from_secs(2);

/// How often it is asked what has happened.
const LOOK: Duration = Duration::from_millis(10);

/// How long an engine may take to know that it rests, after the arm does.
const SETTLE: Duration = Duration::from_millis(300);

/// How often its numbers of notes are compared: an engine that was started again counts from 1.
const COMPARE: Duration = Duration::from_secs(1);

/// What the engine is to do.
#[derive(Debug)]
pub(crate) enum Task {
    /// Follow a trajectory.
    Follow {
        /// Names of the joints.
        joints: Vec<String>,
        /// The points.
        points: Vec<FollowPoint>,
        /// Whether the time law is the engine's.
        retime: bool,
    },
    /// Execute a program.
    Program {
        /// `text`, `json` or `xml`.
        format: &'static str,
        /// Its name.
        name: String,
        /// The program.
        text: String,
    },
}

/// A task with its number.
#[derive(Debug)]
pub(crate) struct Order {
    /// Number of the task.
    pub(crate) serial: u64,
    /// The task.
    pub(crate) task: Task,
}

/// What the engine says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Heard {
    /// It has queued a task as commands of these numbers.
    Taken {
        /// Number of the task.
        serial: u64,
        /// Numbers of its first and last command.
        commands: (u64, u64),
    },
    /// It does not take a task.
    Refused {
        /// Number of the task.
        serial: u64,
        /// Why.
        why: String,
    },
    /// A note.
    Note(Value),
    /// It does not answer.
    Lost(String),
}

/// Asks an engine; stays in the thread that opened it.
pub(crate) struct Engine {
    client: Client,
    /// Number of the last note that was heard.
    seen: u64,
}

impl Engine {
    /// Opens the channel of an arm's engine, which must answer.
    ///
    /// # Errors
    /// Shared memory, or no engine.
    pub(crate) fn open(arm: &Arm) -> Result<Self, EngineError> {
        let client = Client::open(arm, "canter-ros2")?;
        let mut engine = Self { client, seen: 0 };
        engine.seen = engine.ask(Verb::Status)?["last_note"].as_u64().unwrap_or(0);
        Ok(engine)
    }

    fn ask(&self, verb: Verb) -> Result<Value, EngineError> {
        let answer = self.client.ask(verb, PATIENCE)?;
        if answer.accepted {
            return Ok(answer.body);
        }
        Err(EngineError::Refused(answer.message))
    }

    /// Names of the joints, root first.
    ///
    /// # Errors
    /// The engine does not answer.
    pub(crate) fn joints(&self) -> Result<Vec<String>, EngineError> {
        let body = self.ask(Verb::Status)?;
        let names = body["status"]["joint_names"]
            .as_array()
            .into_iter()
            .flatten();
        Ok(names
            .filter_map(|name| name.as_str().map(str::to_owned))
            .collect())
    }

    /// The robot's URDF.
    ///
    /// # Errors
    /// The engine does not answer.
    pub(crate) fn urdf(&self) -> Result<String, EngineError> {
        whole_text("urdf", |verb| self.ask(verb))
    }

    /// Serves orders until nobody can give one any more.
    pub(crate) fn run(mut self, orders: &Receiver<Order>, tell: &Sender<Heard>) {
        let mut compared = Instant::now();
        loop {
            match orders.recv_timeout(LOOK) {
                Ok(order) => {
                    // The bridge ends where nobody listens.
                    let _ = tell.send(self.obey(order));
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            let heard = self.listen();
            let lost = heard.as_ref().err().map(ToString::to_string);
            for note in heard.unwrap_or_default() {
                let _ = tell.send(Heard::Note(note));
            }
            if let Some(why) = lost {
                let _ = tell.send(Heard::Lost(why));
            }
            if compared.elapsed() > COMPARE {
                compared = Instant::now();
                self.compare();
            }
        }
    }

    fn obey(&self, Order { serial, task }: Order) -> Heard {
        let why = match self.give(task) {
            Ok(commands) => return Heard::Taken { serial, commands },
            Err(error) => error.to_string(),
        };
        Heard::Refused { serial, why }
    }

    /// Gives a task to an engine that rests; gives the numbers of its commands.
    fn give(&self, task: Task) -> Result<(u64, u64), EngineError> {
        let end = Instant::now() + SETTLE;
        let mut body = self.ask(Verb::Status)?;
        while body["status"]["idle"] != true && Instant::now() < end {
            sleep(LOOK);
            body = self.ask(Verb::Status)?;
        }
        let status = &body["status"];
        if let Some(fault) = status["fault"].as_str() {
            return Err(EngineError::Fault(fault.to_owned()));
        }
        if status["held"] == true {
            return Err(EngineError::Held);
        }
        if status["idle"] != true {
            return Err(EngineError::Busy);
        }
        let body = self.ask(match task {
            Task::Follow {
                joints,
                points,
                retime,
            } => Verb::Follow {
                joints,
                points,
                retime,
            },
            Task::Program { format, name, text } => Verb::Submit {
                format: format.to_owned(),
                name,
                program: text,
            },
        })?;
        let number = |of: &str| body[of].as_u64().unwrap_or(0);
        Ok((number("first"), number("last")))
    }

    /// What has happened since the last call.
    fn listen(&mut self) -> Result<Vec<Value>, EngineError> {
        let body = self.ask(Verb::Notes { since: self.seen })?;
        let mut notes = Vec::new();
        for entry in body["notes"].as_array().into_iter().flatten() {
            self.seen = entry["number"].as_u64().unwrap_or(self.seen);
            notes.push(entry["note"].clone());
        }
        Ok(notes)
    }

    /// Begins at 0 again with an engine that does.
    fn compare(&mut self) {
        let last = self
            .ask(Verb::Status)
            .ok()
            .and_then(|body| body["last_note"].as_u64());
        if last.is_some_and(|last| last < self.seen) {
            self.seen = 0;
        }
    }
}

/// Why the engine does not do something.
#[derive(Debug, thiserror::Error)]
pub(crate) enum EngineError {
    /// Shared memory, or no answer.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// It says no.
    #[error("{0}")]
    Refused(String),
    /// A fault is latched.
    #[error("a fault is latched ({0}); canter recover clears it")]
    Fault(String),
    /// A pause or stop holds the arm.
    #[error("the arm is held; canter resume releases it")]
    Held,
    /// Something is being executed.
    #[error("the arm is executing something else")]
    Busy,
}
