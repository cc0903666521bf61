use std::io;

use clap::Args;
use engine::run_loop::{Operator, RunEnd, RunLoop};
use engine::session::{Note, RunSample, Session};

use crate::console::tell_json;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::host_options::{HostOptions, RefusalOption, ShownWorld};
use crate::printer::Printer;
use crate::recorder_options;
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
    shown: ShownWorld,
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
        self.host.show(&mut host, self.shown.world.as_deref())?;
        signals.steer(&host.session);
        printer.note(&format!(
            "canter: engine of {} at {}, driver {}",
            robot.name, host.arm, host.session.driver
        ));
        let desk = EngineDesk {
            signals,
            printer: printer.clone(),
            json: self.json,
        };
        let mut running = RunLoop::new(host, desk);
        let exit = match running.serve()? {
            RunEnd::Stopped if running.session().status().idle => Exit::Done,
            RunEnd::Stopped => Exit::Stopped,
            RunEnd::ShutDown => Exit::Done,
            _ => Exit::Internal,
        };
        let finished = running.finish()?;
        finished.operator.signals.release();
        if let Some(summary) = finished.recorded? {
            recorder_options::report(printer, &summary);
        }
        Ok(exit)
    }
}

/// The operator of an engine that runs until it is ended.
struct EngineDesk {
    signals: SignalThread,
    printer: Printer,
    json: bool,
}

impl Operator for EngineDesk {
    fn observe(&mut self, _samples: &[RunSample], _session: &Session) -> io::Result<()> {
        Ok(())
    }

    fn hear(&mut self, note: &Note) {
        if self.json {
            tell_json(&self.printer, note);
        } else {
            self.printer.line(&line(note));
        }
    }

    fn has_stopped(&self, session: &Session) -> bool {
        self.signals.has_stopped(session) || self.signals.count() > 1
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
