use std::time::{Duration, Instant};

use engine::session::Status;

use crate::printer::Printer;

/// How often the line changes.
const REFRESH: Duration = Duration::from_millis(100);

/// Starts the line again: to its start, no wrapping, clear.
const BEGIN: &str = "\r\x1b[?7l\x1b[2K";

/// Ends it: wrapping again.
const END: &str = "\x1b[?7h";

/// One line at the bottom of a terminal that shows what the arm is doing. It does not wait for the
/// terminal.
pub(crate) struct Progress {
    printer: Option<Printer>,
    shown: Option<Instant>,
}

impl Progress {
    /// A line that is shown only on a terminal.
    pub(crate) fn new(printer: &Printer, terminal: bool) -> Self {
        if terminal {
            printer.clear_before_lines();
        }
        Self {
            printer: terminal.then(|| printer.clone()),
            shown: None,
        }
    }

    /// Says where the session is.
    pub(crate) fn show(&mut self, status: &Status) {
        let Some(printer) = &self.printer else { return };
        if self.shown.is_some_and(|at| at.elapsed() < REFRESH) {
            return;
        }
        self.shown = Some(Instant::now());
        let [x, y, z] = status.position_m.map(|meters| meters * 1e3);
        let doing = match (status.held, status.command) {
            (true, _) => "held",
            (false, Some(name)) => name,
            (false, None) => "waiting",
        };
        printer.show(&format!(
            "{BEGIN}{doing}  at ({x:.1}, {y:.1}, {z:.1}) mm  {:.0} % speed  {} commands wait{END}",
            status.time_scaling * 100.0,
            status.queued
        ));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(printer) = &self.printer {
            printer.show(&format!("{BEGIN}{END}"));
        }
    }
}
