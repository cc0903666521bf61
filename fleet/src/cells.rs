//! What is known of all cells.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::keys::{self, Kind};

/// An arm as far as it has been heard.
#[derive(Clone, Debug, Default)]
pub(crate) struct Row {
    /// Whether its engine answers.
    pub(crate) alive: bool,
    /// Its last report.
    pub(crate) report: Value,
    /// When the last report came.
    pub(crate) heard: Option<Instant>,
    /// What happened last.
    pub(crate) note: Value,
}

impl Row {
    fn status(&self) -> &Value {
        &self.report["status"]
    }

    /// `dark`, `fault`, `held`, `idle`, `moves`, or `?` before the first report.
    pub(crate) fn state(&self) -> &str {
        let status = self.status();
        match () {
            () if !self.alive => "dark",
            () if !status.is_object() => "?",
            () if status["fault"].is_string() => "fault",
            () if status["held"] == true => "held",
            () if status["idle"] == true => "idle",
            () => "moves",
        }
    }

    /// Robot, command, commands that wait, speed (%), age of the report (s), and fault or last note.
    pub(crate) fn columns(&self, now: Instant) -> [String; 6] {
        let status = self.status();
        let text = |of: &str| status[of].as_str().unwrap_or("-").to_owned();
        let speed = status["time_scaling"].as_f64();
        let speed = speed.map_or("-".to_owned(), |share| format!("{:.0}", 100.0 * share));
        let queued = status["queued"].as_u64();
        let age = self.heard.map(|at| now.saturating_duration_since(at));
        [
            text("robot"),
            text("command"),
            queued.map_or("-".to_owned(), |count| count.to_string()),
            speed,
            age.map_or("-".to_owned(), |age| format!("{:.1}", age.as_secs_f64())),
            self.words(),
        ]
    }

    /// The fault, or what happened last.
    fn words(&self) -> String {
        if let Some(fault) = self.status()["fault"].as_str() {
            return one_line(fault);
        }
        let note = &self.note["note"];
        let text = |of: &str| note[of].as_str().unwrap_or_default();
        let why = note["error"]["message"].as_str().unwrap_or(text("reason"));
        let words = [text("event"), text("name"), text("text"), why];
        let words: Vec<_> = words.into_iter().filter(|word| !word.is_empty()).collect();
        one_line(&words.join(" "))
    }
}

/// The same without control characters, which could change a terminal.
fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .take(200)
        .collect()
}

/// What is known of all arms, by name.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cells {
    /// The arms.
    pub(crate) rows: BTreeMap<String, Row>,
    /// Reports that came since the last [`Self::rate`].
    fresh: u64,
}

impl Cells {
    /// Takes in what came under a name; `text` is none where something is gone.
    pub(crate) fn take(&mut self, name: &str, text: Option<&[u8]>, now: Instant) {
        let Some((arm, kind)) = keys::read(name) else {
            return;
        };
        let read = text.and_then(|text| serde_json::from_slice::<Value>(text).ok());
        let row = self.rows.entry(one_line(arm)).or_default();
        match (kind, read) {
            (Kind::Alive, _) => row.alive = text.is_some(),
            (Kind::Status, Some(report)) => {
                row.report = report;
                row.heard = Some(now);
                self.fresh += 1;
            }
            (Kind::Note, Some(note)) => row.note = note,
            (_, None) => {}
        }
    }

    /// Reports per second in this time.
    pub(crate) fn rate(&mut self, over: Duration) -> f64 {
        std::mem::take(&mut self.fresh) as f64 / over.as_secs_f64().max(1e-9)
    }

    /// How many are in each state, as words.
    pub(crate) fn summary(&self) -> String {
        let mut counts = BTreeMap::new();
        for row in self.rows.values() {
            *counts.entry(row.state()).or_insert(0_u32) += 1;
        }
        let words: Vec<_> = counts
            .iter()
            .map(|(state, count)| format!("{count} {state}"))
            .collect();
        words.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arm_is_what_was_heard_of_it() {
        let mut cells = Cells::default();
        let now = Instant::now();
        cells.take("canter/a/left/alive", Some(b""), now);
        assert_eq!(cells.rows["a/left"].state(), "?");
        let report = br#"{"status": {"state": "ready", "idle": false, "robot": "ur5e",
            "command": "MoveTo", "queued": 3, "time_scaling": 0.5}}"#;
        cells.take("canter/a/left/status", Some(report), now);
        let row = &cells.rows["a/left"];
        assert_eq!(row.state(), "moves");
        let later = now + Duration::from_millis(1200);
        assert_eq!(
            row.columns(later)[..5],
            ["ur5e", "MoveTo", "3", "50", "1.2"]
        );
        let note = br#"{"number": 1, "note": {"event": "message", "text": "a\u001b[2Jb"}}"#;
        cells.take("canter/a/left/note", Some(note), now);
        assert_eq!(cells.rows["a/left"].columns(now)[5], "message a [2Jb");
        let fault = br#"{"status": {"state": "ready", "fault": "joint 2 too fast"}}"#;
        cells.take("canter/a/left/status", Some(fault), now);
        assert_eq!(cells.rows["a/left"].state(), "fault");
        assert_eq!(cells.rows["a/left"].columns(now)[5], "joint 2 too fast");
        cells.take("canter/a/left/alive", None, now);
        assert_eq!(cells.summary(), "1 dark");
        cells.take("canter/a/left/status", Some(b"\xff{"), now);
        cells.take("something/else", Some(b"{}"), now);
        assert_eq!(cells.rows.len(), 1);
        assert_eq!(cells.rate(Duration::from_secs(2)), 1.0);
        assert_eq!(cells.rate(Duration::from_secs(2)), 0.0);
    }
}
