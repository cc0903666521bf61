use clap::Args;
use engine::session::Note;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::host_options::{HostOptions, RefusalOption};
use crate::printer::Printer;
use crate::robot::RobotOption;
use crate::signals::SignalThread;

/// Run the engine of an arm until Ctrl-C; programs come from `canter send`
///
/// Prints a line for each event; the arm does not wait for a reader. Ctrl-C stops on the path and
/// ends; a second Ctrl-C brakes as fast as the joints can.
#[derive(Args, Debug)]
pub(crate) struct Engine {
    #[command(flatten)]
    robot: RobotOption,
    #[command(flatten)]
    host: HostOptions,
    #[command(flatten)]
    refusal: RefusalOption,
    /// Print one JSON object per event, one per line
    #[arg(long)]
    json: bool,
}

impl Engine {
    /// Serves until a signal or a client ends it.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        if self.json {
            printer.expect_json();
        }
        let signals = SignalThread::start(printer, "once more to brake hard")?;
        let length = crcl::LengthUnit::default();
        let mut host =
            self.host
                .start(&robot, self.robot.place(), length, self.refusal.policy())?;
        signals.steer(&host.session);
        printer.note(&format!(
            "canter: engine of {} at {}, driver {}",
            robot.name, host.arm, host.session.driver
        ));
        let exit = loop {
            if signals.has_stopped(&host.session) {
                let idle = host.session.status().idle;
                break if idle { Exit::Done } else { Exit::Stopped };
            }
            if signals.count() > 1 {
                break Exit::Stopped;
            }
            if host.is_shut_down() {
                break Exit::Done;
            }
            let note = host.turn()?;
            // The recording is not used here; it must not grow.
            drop(host.session.samples());
            let Some(note) = note else { continue };
            self.tell(printer, &note);
            if matches!(note, Note::Closed) {
                break Exit::Internal;
            }
        };
        drop(host);
        signals.release();
        Ok(exit)
    }

    fn tell(&self, printer: &Printer, note: &Note) {
        if !self.json {
            return printer.line(&line(note));
        }
        // All keys of a note are texts, so it can be written.
        if let Ok(text) = serde_json::to_string(note) {
            printer.line(&text);
        }
    }
}

/// What happened, on one line.
pub(crate) fn line(note: &Note) -> String {
    match note {
        Note::Started {
            line,
            name,
            planned_s,
            ..
        } => {
            format!("started  line {line:4}  {name:30} {planned_s:9.3} s planned")
        }
        Note::Done { line, name, .. } => format!("done     line {line:4}  {name}"),
        Note::Refused {
            line,
            name,
            error,
            dropped,
            ..
        } => {
            format!(
                "refused  line {line:4}  {name}: {}; {dropped} dropped",
                error.message
            )
        }
        Note::Message { text } => format!("message  {text}"),
        Note::Ended { reason } => format!("ended    reason {reason}"),
        Note::Stopped => "stopped".to_owned(),
        Note::Aborted { dropped } => format!("aborted  {dropped} dropped"),
        Note::Faulted {
            reason, dropped, ..
        } => format!("fault    {reason}; {dropped} dropped"),
        Note::Recovered => "recovered".to_owned(),
        Note::Closed => "closed".to_owned(),
        _ => String::new(),
    }
}
