use std::io::{self, Write};

use clap::Args;
use engine::session::Note;
use servo::Control;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::host_options::{HostOptions, RefusalOption};
use crate::output;
use crate::robot::RobotOption;

/// Run the engine of an arm until Ctrl-C; programs come from `canter send`
///
/// Prints a line for everything that happens. Ctrl-C stops on the path and ends; a second Ctrl-C
/// does not wait for the arm to rest.
#[derive(Args, Debug)]
pub(crate) struct Engine {
    #[command(flatten)]
    robot: RobotOption,
    #[command(flatten)]
    host: HostOptions,
    #[command(flatten)]
    refusal: RefusalOption,
    /// Print one JSON object for everything that happens, one a line
    #[arg(long)]
    json: bool,
}

impl Engine {
    /// Serves until a signal or a client ends it.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP])?;
        let length = crcl::LengthUnit::default();
        let mut host =
            self.host
                .start(&robot, self.robot.place(), length, self.refusal.policy())?;
        output::note(&format!(
            "canter: engine of {} at {}, driver {}",
            robot.name, host.arm, host.session.driver
        ));
        let mut stopping = false;
        while !host.is_shut_down() {
            for _ in signals.pending() {
                if stopping || host.session.status().idle {
                    return Ok(Exit::Done);
                }
                stopping = true;
                output::note("canter: stopping on the path; once more to end at once");
                host.session.control(Control::Stop { fast: false });
            }
            let note = host.turn()?;
            // Nobody reads the recording here; it must not grow.
            drop(host.session.samples());
            let Some(note) = note else { continue };
            self.tell(&note)?;
            match note {
                Note::Stopped if stopping => return Ok(Exit::Stopped),
                Note::Closed => return Ok(Exit::Internal),
                _ => {}
            }
        }
        Ok(Exit::Done)
    }

    fn tell(&self, note: &Note) -> io::Result<()> {
        let mut out = io::stdout().lock();
        if self.json {
            serde_json::to_writer(&mut out, note)?;
            writeln!(out)
        } else {
            writeln!(out, "{}", line(note))
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
