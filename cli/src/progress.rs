use std::time::Duration;

use engine::session::Status;
use indicatif::{ProgressBar, ProgressStyle};

/// One line at the bottom of a terminal that says what the arm is doing.
pub(crate) struct Progress {
    line: Option<ProgressBar>,
}

impl Progress {
    /// A line that is shown only on a terminal.
    pub(crate) fn new(terminal: bool) -> Self {
        let line = terminal.then(|| {
            let line = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}") {
                line.set_style(style);
            }
            line.enable_steady_tick(Duration::from_millis(100));
            line
        });
        Self { line }
    }

    /// Says where the session is.
    pub(crate) fn show(&self, status: &Status) {
        let Some(line) = &self.line else { return };
        let [x, y, z] = status.position_m.map(|meters| meters * 1e3);
        let doing = match (status.held, status.command) {
            (true, _) => "held",
            (false, Some(name)) => name,
            (false, None) => "waiting",
        };
        line.set_message(format!(
            "{doing}  at ({x:.1}, {y:.1}, {z:.1}) mm  {:.0} % speed  {} commands wait",
            status.path_rate * 100.0,
            status.queued
        ));
    }

    /// Makes place for other output.
    pub(crate) fn clear(&self) {
        if let Some(line) = &self.line {
            line.suspend(|| {});
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(line) = &self.line {
            line.finish_and_clear();
        }
    }
}
