use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::{Cell as Field, Row as TableRow, Table, TableState};
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait};

use super::keyboard::{Key, Keyboard};
use crate::cells::{Cells, Row};
use crate::failure::Failure;
use crate::keys::{self, Kind};
use crate::link::{LinkOption, open, until_signal};

/// How often the picture is drawn.
const FRAME: Duration = Duration::from_millis(200);

/// How long reports are counted for their rate.
const COUNT: Duration = Duration::from_secs(2);

/// Show all arms live in the terminal; q ends it
///
/// Arrow keys and page keys scroll. It only reads.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Top {
    #[command(flatten)]
    link: LinkOption,
}

/// What the threads of zenoh write and the picture shows.
type Known = Arc<Mutex<Cells>>;

impl Top {
    /// Shows until q or a signal.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        if !std::io::stdout().is_terminal() {
            return Err(Failure::Usage(
                "top needs a terminal; canter-fleet list --all prints JSON".to_owned(),
            ));
        }
        let ends = until_signal()?;
        let session = open(&self.link)?;
        let known = Known::default();
        listen(&session, &known)?;
        let keyboard = Keyboard::open()?;
        let mut terminal = ratatui::try_init()
            .map_err(|cause| Failure::Usage(format!("the terminal cannot be used: {cause}")))?;
        let shown = show(&mut terminal, (&known, &keyboard), &ends);
        ratatui::restore();
        shown.map_err(|cause| Failure::Unreadable(format!("the terminal: {cause}")))
    }
}

/// Writes everything that comes into what is known.
fn listen(session: &Session, known: &Known) -> Result<(), Failure> {
    let into = |known: Known| {
        move |sample: Sample| {
            let text = sample.payload().to_bytes();
            let text = (sample.kind() == SampleKind::Put).then_some(&*text);
            let mut cells = known.lock().unwrap_or_else(PoisonError::into_inner);
            cells.take(sample.key_expr().as_str(), text, Instant::now());
        }
    };
    for kind in [Kind::Status, Kind::Note] {
        session
            .declare_subscriber(keys::of("*/*", kind))
            .callback(into(Arc::clone(known)))
            .background()
            .wait()
            .map_err(Failure::link)?;
    }
    session
        .liveliness()
        .declare_subscriber(keys::of("*/*", Kind::Alive))
        .history(true)
        .callback(into(Arc::clone(known)))
        .background()
        .wait()
        .map_err(Failure::link)
}

fn show(
    terminal: &mut ratatui::DefaultTerminal,
    (known, keyboard): (&Known, &Keyboard),
    ends: &AtomicBool,
) -> std::io::Result<()> {
    let mut chosen = TableState::default().with_selected(0);
    let mut counted = Instant::now();
    let mut rate = 0.0;
    while !ends.load(Ordering::Acquire) {
        let cells = {
            let mut cells = known.lock().unwrap_or_else(PoisonError::into_inner);
            if counted.elapsed() >= COUNT {
                rate = cells.rate(counted.elapsed());
                counted = Instant::now();
            }
            cells.clone()
        };
        terminal.draw(|frame| draw(frame, (&cells, rate), &mut chosen))?;
        match keyboard.next(FRAME) {
            Some(Key::End) => break,
            Some(Key::Rows(rows)) if rows < 0 => chosen.scroll_up_by(rows.unsigned_abs()),
            Some(Key::Rows(rows)) => chosen.scroll_down_by(rows.unsigned_abs()),
            None => {}
        }
    }
    Ok(())
}

/// Draws a line of numbers and a table with a row for each arm.
fn draw(frame: &mut Frame<'_>, (cells, rate): (&Cells, f64), chosen: &mut TableState) {
    let [above, below] =
        Layout::vertical([Constraint::Length(1), Constraint::Min(1)]).areas(frame.area());
    let head = format!(
        "{} arms: {}; {rate:.0} reports/s; q ends",
        cells.rows.len(),
        cells.summary()
    );
    frame.render_widget(Line::from(head), above);
    let now = Instant::now();
    let rows = cells.rows.iter().map(|(name, row)| line(name, row, now));
    let titles = [
        "arm", "state", "robot", "command", "queued", "speed %", "age s", "last",
    ];
    let widths = [
        Constraint::Length(24),
        Constraint::Length(8),
        Constraint::Length(14),
        Constraint::Length(20),
        Constraint::Length(6),
        Constraint::Length(7),
        Constraint::Length(6),
        Constraint::Min(10),
    ];
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let table = Table::new(rows, widths)
        .header(TableRow::new(titles).style(bold))
        .row_highlight_style(Style::new().add_modifier(Modifier::REVERSED));
    frame.render_stateful_widget(table, below, chosen);
}

fn line<'a>(name: &'a str, row: &'a Row, now: Instant) -> TableRow<'a> {
    let state = row.state();
    let style = match state {
        "fault" => Style::new().fg(Color::Red),
        "dark" => Style::new().fg(Color::DarkGray),
        "held" => Style::new().fg(Color::Yellow),
        "moves" => Style::new().fg(Color::Green),
        _ => Style::new(),
    };
    let mut fields = vec![Field::from(name), Field::from(state).style(style)];
    fields.extend(row.columns(now).map(Field::from));
    TableRow::new(fields)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    fn picture(cells: &Cells, selected: usize) -> String {
        let mut terminal = Terminal::new(TestBackend::new(110, 6)).unwrap();
        let mut chosen = TableState::default().with_selected(selected);
        terminal
            .draw(|frame| draw(frame, (cells, 20.0), &mut chosen))
            .unwrap();
        terminal.backend().to_string()
    }

    #[test]
    fn every_arm_has_a_row() {
        let mut cells = Cells::default();
        let now = Instant::now();
        let report = br#"{"status": {"state": "ready", "idle": true, "robot": "ur5e", "queued": 2,
            "time_scaling": 1.0}}"#;
        for number in 0..9 {
            let arm = format!("hall-{number}/arm");
            cells.take(&keys::of(&arm, Kind::Alive), Some(b""), now);
            cells.take(&keys::of(&arm, Kind::Status), Some(report), now);
        }
        cells.take("canter/hall-1/arm/alive", None, now);
        let shown = picture(&cells, 0);
        assert!(
            shown.contains("9 arms: 1 dark, 8 idle; 20 reports/s"),
            "{shown}"
        );
        for word in ["hall-0/arm", "hall-3/arm", "ur5e", "100"] {
            assert!(shown.contains(word), "{shown}");
        }
        assert!(!shown.contains("hall-8/arm"), "{shown}");
        assert!(picture(&cells, 8).contains("hall-8/arm"), "it scrolls");
    }
}
