//! The operator at the terminal: signals, lines, progress, and the file of samples.

use std::io::{self, IsTerminal};
use std::path::Path;

use engine::run_loop::Operator;
use engine::session::{Blame, Note, RunSample, Session};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output_file::OutputFile;
use crate::printer::Printer;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::signals::SignalThread;

/// What a console prints of what happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Voice {
    /// A line for each command that is done, and for what goes wrong.
    Lines,
    /// One JSON object for everything.
    Json,
    /// Messages of the program only.
    Messages,
}

/// The samples of a run: how many joints at which rate, and where they are written.
pub(crate) struct SampleOptions<'a> {
    /// Joints of the arm.
    pub(crate) joints: usize,
    /// Servo rate.
    pub(crate) rate_hz: f64,
    /// The file; none keeps only the sums.
    pub(crate) file: Option<&'a Path>,
}

/// The operator of a run.
pub(crate) struct Console {
    signals: SignalThread,
    printer: Printer,
    recording: Recording<OutputFile>,
    progress: Progress,
    voice: Voice,
    done: usize,
}

impl Console {
    /// An operator whose signals act on `session` from now on.
    ///
    /// # Errors
    /// The file of samples cannot be written.
    pub(crate) fn new(
        printer: &Printer,
        signals: SignalThread,
        session: &Session,
        samples: &SampleOptions<'_>,
        voice: Voice,
    ) -> Result<Self, Failure> {
        let sink = samples.file.map(OutputFile::create).transpose()?;
        let recording = Recording::new(samples.joints, samples.rate_hz, sink)?;
        let terminal = io::stderr().is_terminal() && voice != Voice::Json;
        signals.steer(session);
        Ok(Self {
            signals,
            printer: printer.clone(),
            recording,
            progress: Progress::new(printer, terminal),
            voice,
            done: 0,
        })
    }

    /// How many commands were done.
    pub(crate) fn done(&self) -> usize {
        self.done
    }

    /// What was published and measured.
    pub(crate) fn recording(&self) -> &Recording<OutputFile> {
        &self.recording
    }

    /// Nothing moves any more: ends the file of samples.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.signals.release();
        self.recording.finish()
    }

    /// One line for what happened.
    fn tell(&self, note: &Note) {
        let printer = &self.printer;
        match note {
            Note::Done {
                line, name, ticks, ..
            } => {
                let seconds = *ticks as f64 * self.recording.period();
                printer.line(&format!(
                    "done     line {line:4}  {name:30} {seconds:9.3} s"
                ));
            }
            Note::Message { text } => printer.line(&format!("message  {text}")),
            Note::Guarded { line, message, .. } => {
                printer.line(&format!("guard    line {line:4}  {message}"));
            }
            Note::Refused {
                line, name, error, ..
            } => printer.note(&format!(
                "canter: error: line {line}: {name}: {}",
                error.message
            )),
            Note::NotArrived { .. }
            | Note::EndMissed { .. }
            | Note::NotSettled { .. }
            | Note::SpeedAsked { .. } => {
                printer.note(&format!("canter: {note}"));
            }
            Note::Faulted { reason, .. } => printer.note(&format!("canter: error: {reason}")),
            Note::Ended { reason } if *reason > 0 => {
                printer.note(&format!("canter: the program ended with reason {reason}"));
            }
            _ => {}
        }
    }
}

impl Operator for Console {
    fn observe(&mut self, samples: &[RunSample], session: &Session) -> io::Result<()> {
        self.recording.take(samples)?;
        self.progress.show(&session.status());
        Ok(())
    }

    fn hear(&mut self, note: &Note) {
        self.done += usize::from(matches!(note, Note::Done { .. }));
        match (self.voice, note) {
            (Voice::Lines, note) => self.tell(note),
            (Voice::Json, note) => tell_json(&self.printer, note),
            (Voice::Messages, Note::Message { text }) => self.printer.note(text),
            (Voice::Messages, _) => {}
        }
    }

    fn has_stopped(&self, session: &Session) -> bool {
        self.signals.has_stopped(session)
    }
}

/// What happened, as one JSON object on a line.
pub(crate) fn tell_json(printer: &Printer, note: &Note) {
    // All keys of a note are texts, so it can be written.
    if let Ok(text) = serde_json::to_string(note) {
        printer.line(&text);
    }
}

/// How a process ends after a fault.
pub(crate) fn exit_of(blame: Blame) -> Exit {
    match blame {
        Blame::Guard => Exit::Aborted,
        Blame::Driver => Exit::DriverFault,
    }
}
