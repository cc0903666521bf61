//! Publishes how an arm is and what happens to it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use ipc::{Arm, Client, IpcError, StatusReader, Verb};
use serde_json::{Value, json};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

use crate::answers::clock_ns;
use crate::failure::Failure;
use crate::keys::{self, Kind};

/// How often it is looked whether the engine has reported; it reports ten times a second.
const LOOK: Duration = Duration::from_millis(20);

/// How often the engine is asked what has happened.
const LISTEN: Duration = Duration::from_millis(100);

/// How long an engine may take to answer.
const PATIENCE: Duration = Duration::from_secs(1);

/// Publishes reports and notes of an arm.
pub(crate) struct Reporter {
    arm: String,
    session: Session,
    client: Client,
    reports: StatusReader,
    status: Publisher<'static>,
    note: Publisher<'static>,
    /// Present while the engine answers.
    alive: Option<LivelinessToken>,
    /// The run of the engine, as it tells it.
    run: String,
    /// Number of the last note that was published.
    seen: u64,
}

impl Reporter {
    /// For an arm; its engine need not run yet.
    ///
    /// # Errors
    /// Shared memory, or the session is closed.
    pub(crate) fn open(session: &Session, arm: &Arm) -> Result<Self, Failure> {
        let name = arm.to_string();
        let publisher = |kind| {
            session
                .declare_publisher(keys::of(&name, kind))
                // A slow network must not hold up the next report.
                .congestion_control(CongestionControl::Drop)
                .wait()
                .map_err(Failure::link)
        };
        Ok(Self {
            session: session.clone(),
            client: Client::open(arm, "canter-fleet")?,
            reports: StatusReader::open(arm)?,
            status: publisher(Kind::Status)?,
            note: publisher(Kind::Note)?,
            alive: None,
            run: String::new(),
            seen: 0,
            arm: name,
        })
    }

    /// Publishes until the flag is set.
    pub(crate) fn run(mut self, ends: &Arc<AtomicBool>) {
        let mut listened = None::<Instant>;
        while !ends.load(Ordering::Acquire) {
            if listened.is_none_or(|at| at.elapsed() >= LISTEN) {
                listened = Some(Instant::now());
                match self.listen() {
                    Ok(()) => self.show(true),
                    Err(_) => self.show(false),
                }
            }
            self.report();
            sleep(LOOK);
        }
    }

    /// Publishes the engine's latest report, if there is a new one.
    fn report(&self) {
        let mut latest = None;
        while let Ok(Some(report)) = self.reports.read() {
            latest = Some(report);
        }
        if let Some(report) = latest.filter(|_| self.alive.is_some()) {
            let text = json!({
                "session": self.run,
                "last_note": self.seen,
                "clock_ns": clock_ns(),
                "status": report,
            });
            self.put(&self.status, &text);
        }
    }

    /// Publishes what has happened.
    fn listen(&mut self) -> Result<(), IpcError> {
        let body = self.ask(self.seen)?;
        let run = body["session"].as_str().unwrap_or_default();
        if run != self.run {
            // An engine that starts counts from 1; what was before we came is there to be asked for.
            let first = self.run.is_empty();
            self.run = run.to_owned();
            self.seen = 0;
            if first {
                let last = self.client.ask(Verb::Status, PATIENCE)?.body["last_note"].as_u64();
                self.seen = last.unwrap_or(0);
            }
            return Ok(());
        }
        for entry in body["notes"].as_array().into_iter().flatten() {
            self.seen = entry["number"].as_u64().unwrap_or(self.seen);
            let text = json!({
                "session": self.run,
                "number": self.seen,
                "note": entry["note"],
            });
            self.put(&self.note, &text);
        }
        Ok(())
    }

    fn ask(&self, since: u64) -> Result<Value, IpcError> {
        Ok(self.client.ask(Verb::Notes { since }, PATIENCE)?.body)
    }

    fn put(&self, publisher: &Publisher<'static>, text: &Value) {
        // Without a router nobody reads it; the notes can be asked for later.
        let _ = publisher.put(text.to_string()).wait();
    }

    /// Shows or takes back the sign that the engine answers.
    fn show(&mut self, answers: bool) {
        if answers == self.alive.is_some() {
            return;
        }
        self.alive = if answers {
            let liveliness = self.session.liveliness();
            let token = liveliness.declare_token(keys::of(&self.arm, Kind::Alive));
            token.wait().ok()
        } else {
            None
        };
    }
}
