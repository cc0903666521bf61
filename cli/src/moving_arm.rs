//! The running engine for executing plans: a few commands at a time; the operator may stop it.

use std::io::{self, IsTerminal};
use std::path::Path;
use std::time::{Duration, Instant};

use engine::arm_motion::Mover;
use engine::queue::Given;
use engine::session::{Blame, Note};
use plan::run::MotionFailure;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::host_options::Host;
use crate::output_file::OutputFile;
use crate::printer::Printer;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::signals::SignalThread;

/// Time limit for a new session with the driver after a fault.
const RECOVERY: Duration = Duration::from_secs(5);

/// An engine with its driver, its clients and the signals of the operator.
pub(crate) struct MovingArm {
    host: Host,
    signals: SignalThread,
    printer: Printer,
    recording: Recording<OutputFile>,
    progress: Progress,
    blame: Option<Exit>,
}

impl MovingArm {
    /// Takes over a running engine of `joints` joints at `rate_hz`; with `samples`, what is
    /// published and measured goes into that file.
    ///
    /// # Errors
    /// The file cannot be written, or signals cannot be received.
    pub(crate) fn new(
        mut host: Host,
        (joints, rate_hz): (usize, f64),
        samples: Option<&Path>,
        printer: &Printer,
    ) -> Result<Self, Failure> {
        let signals = SignalThread::start(printer, "once more to brake hard")?;
        host.own("canter plan-run");
        let sink = samples.map(OutputFile::create).transpose()?;
        signals.steer(&host.session);
        Ok(Self {
            host,
            signals,
            printer: printer.clone(),
            recording: Recording::new(joints, rate_hz, sink)?,
            progress: Progress::new(printer, io::stderr().is_terminal()),
            blame: None,
        })
    }

    /// The exit code after a fault of the arm, if there was one.
    pub(crate) fn blame(&self) -> Option<Exit> {
        self.blame
    }

    /// Has commands executed and waits for the last.
    ///
    /// # Errors
    /// [`MotionFailure`], with `stopped` if the operator stopped the motion.
    fn execute_all(&mut self, commands: Vec<Given>) -> Result<(), MotionFailure> {
        if self.signals.count() > 0 {
            return Err(MotionFailure::stopped());
        }
        let given = self.host.session.give(commands);
        let ids = given.map_err(|error| {
            self.read_blame();
            MotionFailure::new(0, error.to_string())
        })?;
        let Some(last) = ids.last().copied() else {
            return Ok(());
        };
        let position = |id: u32| ids.iter().position(|known| *known == id).unwrap_or(0);
        loop {
            let Some(note) = self.turn()? else { continue };
            match note {
                Note::Done { id, .. } if id == last => return Ok(()),
                Note::Refused { id, error, .. } => {
                    return Err(MotionFailure::new(position(id), error.to_string()));
                }
                Note::Faulted { blame, reason, .. } => {
                    self.blame = Some(exit_of(blame));
                    return Err(MotionFailure::new(0, reason));
                }
                Note::Aborted { .. } => return Err(MotionFailure::stopped()),
                Note::Closed => return Err(MotionFailure::new(0, "the engine has ended")),
                Note::Message { text } => {
                    self.printer.note(&text);
                }
                _ => {}
            }
        }
    }

    /// Reads a fault that came between two executions.
    fn read_blame(&mut self) {
        while let Ok(Some(note)) = self.turn() {
            if let Note::Faulted { blame, .. } = note {
                self.blame = Some(exit_of(blame));
            }
        }
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
                Ok(Some(Note::Recovered)) => {
                    self.blame = None;
                    return true;
                }
                Ok(Some(Note::Closed)) | Err(_) => return false,
                Ok(_) => {}
            }
        }
        false
    }

    /// Serves clients and signals, keeps the recording, returns the next note.
    fn turn(&mut self) -> Result<Option<Note>, MotionFailure> {
        let lost = |error: String| MotionFailure::new(0, error);
        let note = self.host.turn().map_err(|error| lost(error.to_string()))?;
        self.recording
            .take(&self.host.session.samples())
            .map_err(|error| lost(format!("the samples cannot be written: {error}")))?;
        self.progress.show(&self.host.session.status());
        if self.host.is_shut_down() || self.signals.has_stopped(&self.host.session) {
            return Err(MotionFailure::stopped());
        }
        Ok(note)
    }

    /// Ends engine and driver, and the file of samples; returns the largest distance (m) of the arm
    /// from its path.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn finish(mut self) -> io::Result<f64> {
        // The sample of a period is complete when the next state arrives: the last ones are still
        // missing.
        self.host.session.close();
        self.recording.take(&self.host.session.samples())?;
        let worst = self.recording.worst();
        drop(self.host);
        self.signals.release();
        self.recording.finish()?;
        Ok(worst)
    }
}

/// How a process ends after a fault.
fn exit_of(blame: Blame) -> Exit {
    match blame {
        Blame::Guard => Exit::Aborted,
        Blame::Driver => Exit::DriverFault,
    }
}

impl Mover for MovingArm {
    fn execute(&mut self, commands: Vec<Given>) -> Result<(), MotionFailure> {
        self.execute_all(commands)
    }

    fn setpoint(&self) -> Vec<f64> {
        self.host.session.status().setpoint
    }

    fn recover(&mut self) -> bool {
        self.clear_fault()
    }
}
