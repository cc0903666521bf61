//! Has commands executed and waits for them, while clients and an operator are served.

use std::io;
use std::time::{Duration, Instant};

use ipc::IpcError;
use plan::run::MotionFailure;
use thiserror::Error;

use crate::arm_motion::Mover;
use crate::host::{GivenProgram, Host};
use crate::queue::Given;
use crate::session::{Blame, Note, RunSample, Session, Status};

/// Time limit for a new session with the driver after a fault.
const RECOVERY: Duration = Duration::from_secs(5);

/// Who watches a run: keeps its recording, is told what happens, and may end it.
pub trait Operator {
    /// Looks at the session once in every turn; `samples` are those since the last turn.
    ///
    /// # Errors
    /// The samples cannot be written.
    fn observe(&mut self, samples: &[RunSample], session: &Session) -> io::Result<()>;

    /// Something happened.
    fn hear(&mut self, note: &Note);

    /// Whether the operator wanted the end, and the arm rests because of it.
    fn has_stopped(&self, session: &Session) -> bool;
}

/// Why a run is over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RunEnd {
    /// The last command is done.
    Done,
    /// A command was refused, and no command comes after it.
    Refused {
        /// Number of the command.
        id: u32,
        /// Why.
        reason: String,
    },
    /// The operator stopped the arm, or somebody aborted the program.
    Stopped,
    /// A client ended the engine.
    ShutDown,
    /// A fault is latched.
    Faulted {
        /// Who found it.
        blame: Blame,
        /// What was wrong.
        reason: String,
    },
    /// The session has ended by itself.
    Closed,
}

/// Why a run cannot be watched any longer.
#[derive(Debug, Error)]
pub enum RunLoopError {
    /// Shared memory failed.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The operator's file failed.
    #[error("the samples cannot be written: {0}")]
    Samples(#[source] io::Error),
}

/// What is left of a run.
#[derive(Debug)]
pub struct Finished<O> {
    /// The operator, who has seen the last sample.
    pub operator: O,
    /// Where the session was.
    pub status: Status,
    /// What was recorded, if it was, or why its file cannot be written.
    pub recorded: Result<Option<recorder::Summary>, recorder::RecorderError>,
}

/// What one turn brought.
enum Turn {
    Quiet,
    Note(Note),
    Over(RunEnd),
}

/// A session with its clients and its operator.
///
/// When it is dropped the arm stops on the path, and the driver that belongs to it ends.
#[derive(Debug)]
pub struct RunLoop<D, O> {
    host: Host<D>,
    operator: O,
    blame: Option<Blame>,
}

impl<D, O: Operator> RunLoop<D, O> {
    /// Watches the session of `host` for `operator`.
    pub fn new(host: Host<D>, operator: O) -> Self {
        Self {
            host,
            operator,
            blame: None,
        }
    }

    /// The session.
    pub fn session(&self) -> &Session {
        &self.host.session
    }

    /// Whose fault is latched, if one is.
    pub fn blame(&self) -> Option<Blame> {
        self.blame
    }

    /// Waits until the commands of these numbers are done, or cannot be done any more.
    ///
    /// # Errors
    /// [`RunLoopError`].
    pub fn wait_for(&mut self, ids: &[u32]) -> Result<RunEnd, RunLoopError> {
        let Some(last) = ids.last().copied() else {
            return Ok(RunEnd::Done);
        };
        loop {
            let note = match self.turn()? {
                Turn::Quiet => continue,
                Turn::Over(end) => return Ok(end),
                Turn::Note(note) => note,
            };
            match note {
                Note::Done { id, .. } if id == last => return Ok(RunEnd::Done),
                Note::Refused {
                    id, error, dropped, ..
                } if dropped > 0 || id == last => {
                    let reason = error.to_string();
                    return Ok(RunEnd::Refused { id, reason });
                }
                Note::Faulted { blame, reason, .. } => {
                    return Ok(RunEnd::Faulted { blame, reason });
                }
                Note::Aborted { .. } => return Ok(RunEnd::Stopped),
                _ => {}
            }
        }
    }

    /// Serves clients until the operator or a client ends the session.
    ///
    /// # Errors
    /// [`RunLoopError`].
    pub fn serve(&mut self) -> Result<RunEnd, RunLoopError> {
        loop {
            if let Turn::Over(end) = self.turn()? {
                return Ok(end);
            }
        }
    }

    /// Serves clients and operator once, and gives the next thing that happened.
    fn turn(&mut self) -> Result<Turn, RunLoopError> {
        if self.operator.has_stopped(&self.host.session) {
            return Ok(Turn::Over(RunEnd::Stopped));
        }
        let note = self.host.turn()?;
        let samples = self.host.samples();
        self.operator
            .observe(&samples, &self.host.session)
            .map_err(RunLoopError::Samples)?;
        if self.host.is_shut_down() {
            return Ok(Turn::Over(RunEnd::ShutDown));
        }
        let Some(note) = note else {
            return Ok(Turn::Quiet);
        };
        self.operator.hear(&note);
        match &note {
            Note::Faulted { blame, .. } => self.blame = Some(*blame),
            Note::Recovered => self.blame = None,
            Note::Closed => return Ok(Turn::Over(RunEnd::Closed)),
            _ => {}
        }
        Ok(Turn::Note(note))
    }

    /// Clears a fault; whether that was possible.
    fn clear_fault(&mut self) -> bool {
        if self.host.session.recover().is_err() {
            self.blame = None;
            return true;
        }
        let deadline = Instant::now() + RECOVERY;
        while Instant::now() < deadline {
            match self.turn() {
                Ok(Turn::Note(Note::Recovered)) => return true,
                Ok(Turn::Over(_)) | Err(_) => return false,
                Ok(_) => {}
            }
        }
        false
    }

    /// Tells clients and recordings which program was given; see [`Host::tell_program`].
    pub fn tell_program(&mut self, program: GivenProgram, certificate: Option<String>) {
        self.host.tell_program(program, certificate);
    }

    /// Ends session and driver.
    ///
    /// # Errors
    /// [`RunLoopError::Samples`].
    pub fn finish(mut self) -> Result<Finished<O>, RunLoopError> {
        let status = self.host.session.status();
        // The sample of a period is complete when the next state arrives: the last ones are still
        // missing.
        let recorded = self.host.close();
        let samples = self.host.samples();
        self.operator
            .observe(&samples, &self.host.session)
            .map_err(RunLoopError::Samples)?;
        while let Some(note) = self.host.session.note(Duration::ZERO) {
            match note {
                Note::NotSettled { .. } => self.operator.hear(&note),
                Note::Closed => break,
                _ => {}
            }
        }
        drop(self.host);
        Ok(Finished {
            operator: self.operator,
            status,
            recorded,
        })
    }
}

impl<D, O: Operator> Mover for RunLoop<D, O> {
    fn execute(&mut self, commands: Vec<Given>) -> Result<(), MotionFailure> {
        if self.operator.has_stopped(&self.host.session) {
            return Err(MotionFailure::stopped());
        }
        let ids = match self.host.session.give(commands) {
            Ok(ids) => ids,
            Err(error) => {
                // A fault may have come between two executions: hear whose it is.
                while let Ok(Turn::Note(_)) = self.turn() {}
                return Err(MotionFailure::new(0, error.to_string()));
            }
        };
        let end = self.wait_for(&ids);
        match end.map_err(|error| MotionFailure::new(0, error.to_string()))? {
            RunEnd::Done => Ok(()),
            RunEnd::Refused { id, reason } => {
                let position = ids.iter().position(|known| *known == id);
                Err(MotionFailure::new(position.unwrap_or(0), reason))
            }
            RunEnd::Faulted { reason, .. } => Err(MotionFailure::new(0, reason)),
            RunEnd::Stopped | RunEnd::ShutDown => Err(MotionFailure::stopped()),
            RunEnd::Closed => Err(MotionFailure::new(0, "the engine has ended")),
        }
    }

    fn setpoint(&self) -> Vec<f64> {
        self.host.session.status().setpoint
    }

    fn recover(&mut self) -> bool {
        self.clear_fault()
    }
}
